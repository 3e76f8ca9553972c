"""`dyknow evaluate --what detection,tracks`: figures of seeing and following on the command line."""

import json
from pathlib import Path

import pytest

from service.cli.app import run
from tests.service.questions.scoring.test_scene_scores import FRAMES, write_csv, write_run, write_scene
from tests.service.questions.scoring.test_truth_rows import STEP_US

BORDER_EVENT = json.dumps(
    {"type": "overtake", "roles": {"overtaker": "a", "overtaken": "b"}, "start_us": 0, "end_us": 1, "countable": False}
)


@pytest.fixture
def scene(tmp_path: Path) -> Path:
    folder = write_scene(tmp_path)
    (folder / "truth_events.jsonl").write_text(BORDER_EVENT, encoding="utf-8")
    return folder


@pytest.fixture
def tracks(tmp_path: Path) -> Path:
    rows = [f"{k * STEP_US},t1,{30 + k},18,0,10,4,2,1" for k in range(FRAMES)]
    return write_csv(tmp_path / "tracks.csv", *rows)


def test_parts_of_a_log_come_as_one_table_each(scene: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["evaluate", write_run(scene), "--truth", str(scene), "--what", "events,tracks,detection"]) == 0
    detection, tracks, events = capsys.readouterr().out.split("\n\n")
    assert " ".join(detection.splitlines()[1].split()) == "precision 0.474 0.273 to 0.683 9 of 19"
    assert [line.split("  ")[0] for line in tracks.splitlines()] == ["tracks", "vision objects", "cars"]
    assert events.startswith("overtake: 0 in the truth")


def test_json_has_a_field_for_each_part(scene: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["evaluate", write_run(scene), str(scene), "--what", "detection,tracks,events", "--json"]) == 0
    record = json.loads(capsys.readouterr().out)
    assert list(record) == ["detection", "tracks", "events"]
    assert (record["detection"]["of"], record["detection"]["right"]) == ("vision objects", FRAMES - 1)
    assert record["tracks"]["vision objects"]["id_switches"] == 1
    assert record["events"]["in_truth"] == 0


def test_file_of_tracks_is_scored_without_a_log(scene: Path, tracks: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["evaluate", "--tracks", str(tracks), "--truth", str(scene), "--json"]) == 0
    record = json.loads(capsys.readouterr().out)
    assert (record["detection"]["precision"], record["detection"]["recall"]) == (1.0, 1.0)
    assert record["tracks"]["tracks"]["hota"] == pytest.approx(1.0)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--truth", "scene"], "expected either a log or --tracks, got neither"),
        (["log.db", "--truth", "scene", "--tracks", "t.csv"], "expected either a log or --tracks, got both"),
        (["log.db"], "expected one folder with the truth, got none"),
        (["log.db", "scene", "--truth", "other"], "expected one folder with the truth, got scene and other"),
        (["log.db", "scene", "--what", "speed"], "expected some of detection,tracks,events, got 'speed'"),
        (["--tracks", "t.csv", "--truth", "scene", "--what", "events"], "some of detection,tracks, got 'events'"),
        (["log.db", "scene", "--what", "tracks", "--min-f1", "0.5"], "expected events among --what, got tracks"),
    ],
)
def test_wrong_command_line_is_refused(arguments: list[str], message: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["evaluate", *arguments]) == 2
    assert message in " ".join(capsys.readouterr().err.split())


def test_missing_file_of_tracks_is_refused(scene: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["evaluate", "--tracks", str(scene / "none.csv"), "--truth", str(scene)]) == 3
    assert "none.csv: expected a readable trajectory file" in capsys.readouterr().err
