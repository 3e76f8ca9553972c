"""Stopping early: Ctrl-C, once or impatiently twice, and readers that close the pipe."""

import os
import signal
import subprocess
import sys
import threading
from pathlib import Path

import pytest

from service.runs.interrupts import Interrupts
from service.runs.processing import Progress, RunRequest, process
from service.store.log import open_log
from tests.service.logs import SECOND_US, overtake, write_log
from tests.service.tracks import write_tracks

PROGRAM = [sys.executable, "-c", "from service.cli.app import main; main()"]


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
    from service.runs.recording import Recorder

    finish = Recorder.finish

    def interrupted_finish(*arguments: object) -> None:
        os.kill(os.getpid(), signal.SIGINT)
        finish(*arguments)  # type: ignore[arg-type]  # passed on as they came

    monkeypatch.setattr(Recorder, "finish", interrupted_finish)
    log = str(tmp_path / "a.db")
    process(RunRequest(write_tracks(tmp_path / "t.csv", frames=3), None, log))
    with open_log(log) as opened:
        assert opened.run().status == "finished"


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
