"""What is said beside an answer: runs that did not come to their end, and names that no log holds."""

from pathlib import Path

import pytest

from service.api.app import create_app
from service.cli.app import run as run_command
from service.records.runs import RunStatus
from service.store.log import open_log
from tests.service.http import Client
from tests.service.logs import SECOND_US, run, write_log, write_small_log
from tests.service.tracks import write_tracks

NEAR = """chronicle near[?a, ?b](t1, t2) {
  event(close[?a, ?b]:(false, true), t1)
  event(close[?a, ?b]:(true, false), t2)
  t2 - t1 in [0s, 1s]
  t2 - t1 in [0s, 2s]
}
"""


@pytest.mark.parametrize(
    ("status", "said"),
    [
        ("running", "is being written still, or was killed; it covers 00:00.000 to 00:12.000"),
        ("broken", "broke off; it covers 00:00.000 to 00:12.000; at 13 s"),
        ("interrupted", "was interrupted; it covers 00:00.000 to 00:12.000; at 13 s"),
    ],
)
def test_events_of_a_run_without_an_end_say_so(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], status: RunStatus, said: str
) -> None:
    url = str(tmp_path / "a.db")
    with open_log(url, "w") as log:
        writer = log.begin_run(run())
        writer.append_frames([0, 12 * SECOND_US])
        if status == "running":
            writer.flush()
        else:
            writer.finish(status, "at 13 s")
    assert run_command(["events", url]) == 0
    assert capsys.readouterr().err == f"note: run 'r1' of demo.mp4 {said}\n"


def test_a_run_that_nobody_asked_for_is_not_spoken_of(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    url = write_small_log(tmp_path / "a.db")
    with open_log(url, "w") as log:
        log.begin_run(run("r2", source="other.mp4")).finish("broken", "at 1 s")
    assert run_command(["events", url, "--run", "r1"]) == 0
    assert run_command(["events", url, "--source", "demo.mp4"]) == 0
    assert "note" not in capsys.readouterr().err


@pytest.mark.parametrize(
    ("question", "note"),
    [
        (("type", "overtaek"), "type: expected one that the log holds, got 'overtaek'; did you mean 'overtake'?"),
        (("actor", "car77"), "actor: expected one that the log holds, got 'car77'; did you mean 'car7'?"),
        (("road", "raod1"), "road: expected one that the log holds, got 'raod1'; did you mean 'road1'?"),
        (("source", "demo.mp5"), "source: expected one that the log holds, got 'demo.mp5'; did you mean 'demo.mp4'?"),
        (("role.overtakr", "car7"), "role: expected one that the log holds, got 'overtakr'; did you mean 'overtaker'?"),
    ],
    ids=["type", "actor", "road", "source", "role"],
)
def test_an_unknown_name_gets_the_nearest_one_that_the_log_holds(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], question: tuple[str, str], note: str
) -> None:
    url = write_small_log(tmp_path / "a.db")
    name, value = question
    option = ["--role", f"{name[5:]}={value}"] if name.startswith("role.") else [f"--{name}", value]
    assert run_command(["events", url, *option, "--fail-empty"]) == 4
    assert f"note: {note}" in capsys.readouterr().err
    with Client(create_app(url, shipped=())) as client:
        answer = client.get("/api/v1/events", params={name: value}).json()
    assert answer["items"] == []
    assert note in answer["notes"][0]


def test_a_known_name_of_which_nothing_happened_is_no_slip(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    url = write_log(tmp_path / "a.db", [])
    assert run_command(["events", url, "--type", "overtake"]) == 0
    assert "note" not in capsys.readouterr().err


def test_an_answer_with_events_has_no_notes_over_http(tmp_path: Path) -> None:
    with Client(create_app(write_small_log(tmp_path / "a.db"), shipped=())) as client:
        assert "notes" not in client.get("/api/v1/events").json()


def test_process_without_roads_says_which_chronicles_find_nothing(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert (
        run_command(["process", str(write_tracks(tmp_path / "t.csv", frames=3)), "--log", str(tmp_path / "a.db")]) == 0
    )
    said = capsys.readouterr().err
    assert "warning: t.csv: expected roads for " in said
    assert "'overtake'" in said
    assert "'follow'" not in said


def test_process_shows_the_warnings_that_check_shows(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    doubtful = tmp_path / "near.chronicle"
    doubtful.write_text(NEAR)
    assert run_command(["check", str(doubtful)]) == 0
    warning = capsys.readouterr().out.strip()
    assert warning.startswith("warning[")
    tracks = write_tracks(tmp_path / "t.csv", frames=3)
    assert run_command(["process", str(tracks), "--log", str(tmp_path / "a.db"), "--chronicles", str(doubtful)]) == 0
    assert warning in capsys.readouterr().err
