"""One run is written by one process at a time, and a killed one does not stand in the way."""

import subprocess
import sys
from pathlib import Path

import pytest

from service.cli import app
from service.errors import RunBusyError
from service.store.databases.sqlite_file import RunLock
from service.store.log import open_log
from tests.service.conftest import NewLog
from tests.service.logs import overtake, read_all, run, write_log

WRITE_FOR_EVER = """
import signal, sys
from service.store.log import open_log
from tests.service.conftest import NewLog
from tests.service.logs import run
log = open_log(sys.argv[1], "w")
log.begin_run(run())
print("begun", flush=True)
signal.pause()
"""


def test_a_run_that_is_being_written_is_refused_for_the_second(new_log: NewLog) -> None:
    url = new_log()
    with open_log(url, "w") as first, open_log(url, "w") as second:
        writer = first.begin_run(run())
        with pytest.raises(RunBusyError, match=r"log_.*'.*expected run 'r1' to be free, got one .* is writing now"):
            second.begin_run(run())
        second.begin_run(run("r2")).finish("finished")
        writer.append_events([overtake()])
        writer.finish("finished")
        second.begin_run(run()).finish("finished")


@pytest.mark.long
def test_a_run_left_by_a_killed_process_is_repeated_at_once(new_log: NewLog) -> None:
    url = new_log()
    with subprocess.Popen([sys.executable, "-c", WRITE_FOR_EVER, url], stdout=subprocess.PIPE) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == b"begun\n"
        with open_log(url, "w") as log, pytest.raises(RunBusyError):
            log.begin_run(run())
        process.kill()
    write_log(url, [overtake()])
    assert [event.id for event in read_all(url)] == ["r1-1"]


def test_a_lock_whose_file_was_removed_is_taken_anew(tmp_path: Path) -> None:
    log = tmp_path / "a.db"
    first = RunLock(log, "r1")
    (tmp_path / "a.db-r1.writing").unlink()
    second = RunLock(log, "r1")
    assert (tmp_path / "a.db-r1.writing").exists()
    second.release()
    first.release()


def test_a_busy_run_has_an_exit_code_of_its_own() -> None:
    assert app.report(RunBusyError("log 'a.db': expected run 'r1' to be free, got ...")) == 6
