"""Messages of monitors in chronicles: processing, recognising again and checking go by one rule."""

import json
from pathlib import Path

import pytest

from service.cli.app import run
from service.questions.recognition.stored_recognition import recognise_stored
from service.runs.processing import RunRequest, process
from tests.service.runs.graph.test_stream_processes import LIMIT, run_race, write_race, written

LATE = "message limit_violated[?car]\nchronicle late[?car](t1) { event(limit_violated[?car], t1) }\n"
SHAPES = {
    "event": ("chronicle late[?a, ?b](t1) { event(limit_violated[?a, ?b], t1) }", "C0301", "got 2"),
    "noevent": (
        """chronicle late[?a, ?b](t1, t2) {
            event(close[?a, ?b]:(false, true), t1) event(close[?a, ?b]:(true, false), t2) t2 - t1 in [0s, 9s]
            noevent(limit_violated[?a, ?b], (t1, t2))
        }""",
        "C0301",
        "got 2",
    ),
    "values": (
        "attribute limit_violated[?a] chronicle late[?a](t1) { event(limit_violated[?a]:(false, true), t1) }",
        "C0302",
        "got one with values",
    ),
}


@pytest.mark.long
@pytest.mark.parametrize("shape", SHAPES)
def test_a_shape_that_no_monitor_gives_is_refused_everywhere_with_its_place(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], shape: str
) -> None:
    text, code, came = SHAPES[shape]
    if "attribute" not in text:
        text = "message limit_violated[?a, ?b]\n" + text
    log = run_race(tmp_path, LIMIT)
    chronicle, monitors = str(written(tmp_path, "b.chronicle", text)), str(tmp_path / "a.monitors")
    race, new = str(tmp_path / "race.csv"), str(tmp_path / "new.db")
    capsys.readouterr()
    for command in (
        ["process", race, "--log", new, "--chronicles", chronicle, "--monitors", monitors],
        ["recognise", log, "--chronicles", chronicle],
        ["check", chronicle, "--monitors", monitors],
    ):
        assert run(command) == 3
        shown = "".join(capsys.readouterr())
        assert f"error[{code}]: expected" in shown
        assert came in shown
        assert f"{chronicle}:" in shown
    assert not Path(new).exists()


@pytest.mark.long
def test_what_a_monitor_gives_is_known_everywhere(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    monitors = written(tmp_path, "a.monitors", LIMIT)
    chronicle = written(tmp_path, "b.chronicle", LATE)
    url = str(tmp_path / "log.db")
    request = RunRequest(write_race(tmp_path / "race.csv"), None, url, (chronicle,), monitor_files=(monitors,))
    assert process(request).warnings == ()
    assert recognise_stored(url, [chronicle]).warnings == ()
    assert run(["check", str(chronicle), "--monitors", str(monitors), "--format", "json"]) == 0
    assert json.loads(capsys.readouterr().out) == []


@pytest.mark.long
def test_a_monitor_that_no_file_defines_is_warned_of_everywhere(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    monitors = written(tmp_path, "a.monitors", LIMIT)
    chronicle = written(tmp_path, "b.chronicle", LATE.replace("limit_v", "limits_v"))
    url = str(tmp_path / "log.db")
    request = RunRequest(write_race(tmp_path / "race.csv"), None, url, (chronicle,), monitor_files=(monitors,))
    for [warning] in (process(request).warnings, recognise_stored(url, [chronicle]).warnings):
        assert "got 'limits_violated', which chronicle 'late' looks at and nothing gives" in warning
        assert "did you mean 'limit_violated'?" in warning
    assert run(["check", str(chronicle), "--monitors", str(monitors)]) == 0
    shown = capsys.readouterr().out
    assert "C0901" in shown
    assert "did you mean 'limit_violated'?" in shown


@pytest.mark.long
def test_the_library_asks_for_no_monitor(tmp_path: Path) -> None:
    request = RunRequest(write_race(tmp_path / "race.csv"), None, str(tmp_path / "log.db"))
    [warning] = process(request).warnings
    assert "race.csv: expected roads for " in warning


def test_monitors_are_about_traffic(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    monitors, chronicle = written(tmp_path, "a.monitors", LIMIT), written(tmp_path, "b.chronicle", LATE)
    command = ["check", str(chronicle), "--monitors", str(monitors)]
    assert run([*command, "--stream", "own"]) == 2
    assert "expected traffic to go with --monitors, got own" in capsys.readouterr().err
    assert run([*command, "--stream", "traffic"]) == 0


def test_check_refuses_monitors_with_errors(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    monitors = written(tmp_path, "a.monitors", LIMIT.replace("15 m/s", "15 m"))
    assert run(["check", str(written(tmp_path, "b.chronicle", LATE)), "--monitors", str(monitors)]) == 3
    assert "error[F0402]: expected a speed, as 'speed[?car]' is, got a length" in capsys.readouterr().err
