"""`dyknow evaluate`: scores of a log on the command line, also where there is nothing to score."""

import json
from pathlib import Path

import pytest

from service.cli.app import run
from tests.service.runs.graph.test_stream_processes import run_race

CAR = "t_us,id,x_m,y_m\n0,a,0,0\n"
FAR = json.dumps(
    {"type": "overtake", "roles": {"overtaker": "a", "overtaken": "b"}, "start_us": 0, "end_us": 1, "countable": True}
)


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> str:
    return run_race(tmp_path_factory.mktemp("race"), "")


def truth(folder: Path, *lines: str) -> str:
    where = folder / "truth"
    where.mkdir()
    (where / "truth.csv").write_text(CAR)
    (where / "truth_events.jsonl").write_text("\n".join(lines))
    return str(where)


@pytest.mark.long
def test_a_scene_without_events_that_were_not_recognised_either(
    tmp_path: Path, log: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(["evaluate", log, truth(tmp_path), "--min-f1", "1"]) == 0
    assert capsys.readouterr().out.splitlines() == [
        "overtake: 0 in the truth, 0 right, 0 wrong, 0 missed, 0 at the border",
        "precision -",
        "recall    -",
    ]


def test_false_events_of_a_scene_without_any(tmp_path: Path, log: str, capsys: pytest.CaptureFixture[str]) -> None:
    where = truth(tmp_path)
    assert run(["evaluate", log, where, "--type", "pass", "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert (found["in_truth"], found["wrong"], found["precision"], found["f1"]) == (0, 1, 0.0, 0.0)
    assert (found["recall"], found["recall_interval"], found["mean_start_error_s"]) == (None, None, None)
    assert run(["evaluate", log, where, "--type", "pass", "--min-f1", "0.5"]) == 5
    assert "pass: expected F1 >= 0.5, got 0.000" in capsys.readouterr().err


def test_an_event_that_was_missed(tmp_path: Path, log: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["evaluate", log, truth(tmp_path, FAR), "--min-f1", "0.5"]) == 5
    shown = capsys.readouterr()
    assert shown.out.splitlines()[:2] == ["overtake: 0 right, 0 wrong, 1 missed, 0 at the border", "precision -"]
    assert "expected F1 >= 0.5, got 0.000" in shown.err


def test_a_type_that_nobody_knows_is_refused(tmp_path: Path, log: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["evaluate", log, truth(tmp_path), "--type", "overtke"]) == 3
    shown = capsys.readouterr().err
    assert "event type: expected one that the run's chronicles or the truth have (aborted_overtake, " in shown
    assert "got 'overtke'; did you mean 'overtake'?" in shown


NEAR = "chronicle near[?a, ?b](t1) { event(close[?a, ?b]:(true, false), t1) }"


@pytest.mark.long
def test_a_type_that_the_truth_does_not_tell_of_is_not_judged(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    log, where = run_race(tmp_path, "", NEAR), truth(tmp_path, FAR)
    assert run(["evaluate", log, where, "--type", "near"]) == 0
    assert capsys.readouterr().out == "near: 0 recognised; the truth does not tell of this type\n"
    assert run(["evaluate", log, where, "--type", "near", "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert (found["has_truth"], found["unjudged"], found["wrong"], found["f1"]) == (False, 0, 0, None)


def test_a_threshold_for_what_cannot_be_judged_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    log = run_race(tmp_path, "", NEAR)
    assert run(["evaluate", log, truth(tmp_path), "--type", "near", "--min-f1", "0.5"]) == 3
    assert "--min-f1: expected a type that the truth tells of, got 'near'" in capsys.readouterr().err
