"""Stopping early: Ctrl-C, once or impatiently twice, and readers that close the pipe."""

import os
import re
import signal
import sqlite3
import subprocess
import sys
import threading
from pathlib import Path

import pytest

from service.cli.app import run
from service.runs.machine import Interrupts
from service.runs.processing import Progress, RunRequest, _Meter, process
from service.store.log import open_log
from service.store.writer import RunWriter
from tests.service.logs import SECOND_US, overtake, read_all, write_log
from tests.service.runs.graph.test_stream_processes import write_race
from tests.service.tracks import write_tracks

PROGRAM = [sys.executable, "-c", "from service.cli.app import main; main()"]


KILL_MIDWAY = """
import os, signal, sys
from pathlib import Path
from service.runs.processing import RunRequest, process
def stop(progress):
    if progress.frames == int(sys.argv[3]):
        os.kill(os.getpid(), signal.SIGKILL)
process(RunRequest(Path(sys.argv[1]), None, sys.argv[2], again=True), on_progress=stop)
"""

SIGNAL_MIDWAY = """
import os, signal, sys
from service.cli.app import run
from service.runs.processing import _Meter
number = signal.Signals[sys.argv[1]]
signal.signal(number, signal.default_int_handler if sys.argv[1] == "SIGINT" else signal.SIG_DFL)  # nohup ignores some
count = _Meter.count
def stop(meter, t_us):
    count(meter, t_us)
    if t_us == 4_900_000:
        os.kill(os.getpid(), number)
_Meter.count = stop
sys.exit(run(sys.argv[2:]))
"""


def rows(log: Path) -> list[str]:
    with sqlite3.connect(log) as connection:
        lines = list(connection.iterdump())
    connection.close()
    return lines


def press_ctrl_c_twice(progress: Progress) -> None:
    if progress.frames == 5:
        os.kill(os.getpid(), signal.SIGINT)
        os.kill(os.getpid(), signal.SIGINT)


def test_two_quick_interrupts_leave_the_run_interrupted(tmp_path: Path) -> None:
    log = str(tmp_path / "a.db")
    summary = process(
        RunRequest(write_tracks(tmp_path / "t.csv", frames=20), None, log), on_progress=press_ctrl_c_twice
    )
    assert (summary.status, summary.progress.frames) == ("interrupted", 5)
    with open_log(log) as opened:
        assert opened.run().status == "interrupted"


def test_an_interrupt_while_the_run_is_closed_does_not_stop_that(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    finish = RunWriter.finish

    def interrupted_finish(*arguments: object) -> None:
        os.kill(os.getpid(), signal.SIGINT)
        finish(*arguments)  # type: ignore[arg-type]  # passed on as they came

    monkeypatch.setattr(RunWriter, "finish", interrupted_finish)
    log = str(tmp_path / "a.db")
    process(RunRequest(write_tracks(tmp_path / "t.csv", frames=3), None, log))
    with open_log(log) as opened:
        assert opened.run().status == "finished"


@pytest.mark.long
def test_a_repeat_that_is_killed_leaves_the_run_as_it_was(tmp_path: Path) -> None:
    race, log = write_race(tmp_path / "race.csv"), tmp_path / "a.db"
    process(RunRequest(race, None, str(log)))
    before = rows(log)
    assert [event.type for event in read_all(str(log))].count("pass") == 1
    killed = subprocess.run([sys.executable, "-c", KILL_MIDWAY, race, log, "110"], check=False)
    assert killed.returncode == -signal.SIGKILL
    assert rows(log) == before
    process(RunRequest(race, None, str(log), again=True))
    assert [event.type for event in read_all(str(log))].count("pass") == 1
    assert [one.name for one in tmp_path.iterdir() if one.name.startswith("a.db")] == ["a.db"]


@pytest.mark.slow
def test_a_run_that_was_killed_stays_readable_until_its_repeat_is_finished(tmp_path: Path) -> None:
    race, log = write_race(tmp_path / "race.csv"), tmp_path / "a.db"
    for frames in ("115", "110"):
        subprocess.run([sys.executable, "-c", KILL_MIDWAY, race, log, frames], check=False)
        with open_log(str(log)) as opened:
            assert opened.run().status == "running"
            assert opened.last_us(opened.run().id) == 9_900_000  # what ten seconds of media time flushed
    assert not process(RunRequest(race, None, str(log))).was_finished
    with open_log(str(log)) as opened:
        assert opened.run().status == "finished"


@pytest.mark.long
def test_a_finished_run_is_not_processed_again_unless_asked(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    arguments = ["process", str(write_race(tmp_path / "race.csv")), "--log", str(tmp_path / "a.db")]
    assert run(arguments) == 0
    before = rows(tmp_path / "a.db")
    capsys.readouterr()
    assert run(arguments) == 0
    assert re.fullmatch(
        r"run [0-9a-f]{16} is finished in .*a\.db, so nothing was done; --again processes it once more\n",
        capsys.readouterr().out,
    )
    assert rows(tmp_path / "a.db") == before
    assert run([*arguments, "--json"]) == 0
    assert '"was_finished":true' in capsys.readouterr().out
    assert run([*arguments, "--again"]) == 0
    assert "120 frames" in capsys.readouterr().out


@pytest.mark.parametrize(("name", "code"), [("SIGINT", 130), ("SIGTERM", 143), ("SIGHUP", 129)])
def test_each_signal_ends_a_run_with_its_code(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str, code: int
) -> None:
    def stop(meter: _Meter, t_us: int) -> None:
        os.kill(os.getpid(), signal.Signals[name])

    def unheard(*_: object) -> None:
        raise AssertionError(f"expected the run to take {name}")

    monkeypatch.setattr(_Meter, "count", stop)
    tracks, log = write_tracks(tmp_path / "t.csv", frames=20), tmp_path / "a.db"
    before = signal.signal(signal.Signals[name], unheard)  # else it might end the tests, or be ignored by them
    try:
        assert run(["process", str(tracks), "--log", str(log)]) == code
    finally:
        signal.signal(signal.Signals[name], before)
    with open_log(str(log)) as opened:
        record = opened.run()
    assert record.status == "interrupted"
    assert record.reason.endswith("got an interrupt" if name == "SIGINT" else f"got {name}")


@pytest.mark.long
@pytest.mark.parametrize(
    ("name", "code"),
    [
        ("SIGTERM", 143),
        pytest.param("SIGINT", 130, marks=pytest.mark.slow),
        pytest.param("SIGHUP", 129, marks=pytest.mark.slow),
    ],
)
def test_a_signal_ends_a_program_in_the_ordinary_way(tmp_path: Path, name: str, code: int) -> None:
    race, log = write_race(tmp_path / "race.csv"), tmp_path / "a.db"
    ended = subprocess.run([sys.executable, "-c", SIGNAL_MIDWAY, name, "process", race, "--log", log], check=False)
    assert ended.returncode == code
    with open_log(str(log)) as opened:
        record = opened.run()
        assert (record.status, opened.last_us(record.id)) == ("interrupted", 4_900_000)
        assert record.reason.endswith("got an interrupt" if name == "SIGINT" else f"got {name}")
    assert sorted(one.name for one in tmp_path.iterdir()) == ["a.db", "race.csv"]


@pytest.mark.long
def test_a_demo_that_is_stopped_scores_nothing(
    scene: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def stop(meter: _Meter, t_us: int) -> None:
        os.kill(os.getpid(), signal.SIGTERM)

    (tmp_path / "scene").symlink_to(scene)
    monkeypatch.setattr("data_gen.outputs.scene.generate", lambda *_, **__: None)
    monkeypatch.setattr(_Meter, "count", stop)
    assert run(["demo", "--out", str(tmp_path)]) == 143
    told = capsys.readouterr()
    assert "got SIGTERM; the events up to there are kept" in told.err
    assert "3. " not in told.out


@pytest.mark.long
def test_a_stopped_repeat_says_that_the_run_stays(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    arguments = ["process", str(write_race(tmp_path / "race.csv")), "--log", str(tmp_path / "a.db")]
    assert run(arguments) == 0
    before = rows(tmp_path / "a.db")

    def stop(meter: _Meter, t_us: int) -> None:
        os.kill(os.getpid(), signal.SIGTERM)

    monkeypatch.setattr(_Meter, "count", stop)
    assert run([*arguments, "--again"]) == 143
    assert "got SIGTERM; the run in the log came further and stays" in capsys.readouterr().err
    assert rows(tmp_path / "a.db") == before


def test_a_signal_that_is_ignored_stays_ignored() -> None:
    before = signal.signal(signal.SIGHUP, signal.SIG_IGN)  # what nohup does
    try:
        with Interrupts() as interrupts:
            os.kill(os.getpid(), signal.SIGHUP)
            assert interrupts.came is None
    finally:
        signal.signal(signal.SIGHUP, before)


def test_the_handler_before_is_put_back() -> None:
    before = signal.getsignal(signal.SIGINT)
    with Interrupts():
        assert signal.getsignal(signal.SIGINT) is not before
    assert signal.getsignal(signal.SIGINT) is before


def test_off_the_main_thread_nothing_is_changed() -> None:
    seen: list[object] = []

    def enter() -> None:
        with Interrupts():
            seen.append(signal.getsignal(signal.SIGINT))

    thread = threading.Thread(target=enter)
    thread.start()
    thread.join()
    assert seen == [signal.getsignal(signal.SIGINT)]


@pytest.mark.long
def test_a_reader_that_has_enough_is_no_failure(tmp_path: Path) -> None:
    url = write_log(tmp_path / "a.db", [overtake(second * SECOND_US) for second in range(2000)])
    for output in ("jsonl", "table"):
        command = [*PROGRAM, "events", url, "--format", output, "--limit", "2000"]
        with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as running:
            assert running.stdout is not None
            assert running.stderr is not None
            running.stdout.readline()
            running.stdout.close()
            assert running.stderr.read() == ""
        assert running.returncode == 0
