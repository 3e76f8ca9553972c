"""Does a server keep a worker as long as it lives, and no longer, whatever is killed?"""

import os
import re
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from service.cli.app import run as run_cli
from service.runs.processing import RunRequest, process
from service.store.databases.sqlite_file import SqliteFile
from tests.service.logs import kept_rows, write_log
from tests.service.test_jobs import add, is_free, opened, until

SERVE = [sys.executable, "-c", "from service.cli.app import main; main()", "serve", "--port", "0"]


@contextmanager
def serving(url: str) -> Iterator["subprocess.Popen[str]"]:
    with subprocess.Popen([*SERVE, url], stderr=subprocess.PIPE, text=True) as server:
        yield server
        server.kill()


def next_worker(server: "subprocess.Popen[str]") -> int:
    """Read what a server says until a worker begins, and give the number of its process."""
    assert server.stderr is not None
    for line in server.stderr:
        if begun := re.fullmatch(r"worker (\d+) begins\n", line):
            return int(begun[1])
    raise AssertionError("the server ended")


def is_gone(process_id: int) -> bool:
    """Tell whether a process has ended, whoever is to take note of it."""
    stat = Path(f"/proc/{process_id}/stat")
    return not stat.exists() or stat.read_text().rpartition(")")[2].split()[0] == "Z"


def test_kills_of_a_server_and_of_its_worker_lose_nothing_and_double_nothing(tmp_path: Path, tracks: Path) -> None:
    url, whole = str(tmp_path / "a.db"), str(tmp_path / "whole.db")
    with opened(url) as jobs:
        name = add(jobs, tracks)
        with serving(url) as server:
            worker = next_worker(server)
            until(lambda: " s of input" in jobs.find(name).message)
            server.kill()
            until(lambda: is_gone(worker) and is_free(url, name))
        assert (jobs.find(name).state, jobs.find(name).attempts) == ("waiting", 0)
        jobs.change(name, ("waiting",), message="")
        with serving(url) as server:
            worker = next_worker(server)
            until(lambda: " s of input" in jobs.find(name).message)
            os.kill(worker, signal.SIGKILL)
            assert next_worker(server) != worker
            until(lambda: jobs.find(name).state == "finished")
            server.send_signal(signal.SIGINT)
            assert server.wait() == 130
    process(RunRequest(tracks, tracks.parent / "site.toml", whole))
    again, once = kept_rows(url), kept_rows(whole)
    assert [row[1:] for row in again.pop("events")] == [row[1:] for row in once.pop("events")]
    assert again == once


@pytest.mark.parametrize("options", [[], ["--workers", "0"]])
@pytest.mark.parametrize("can_write", [True, False])
def test_a_worker_begins_where_the_log_can_be_written_unless_told_otherwise(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    *,
    options: list[str],
    can_write: bool,
) -> None:
    log = write_log(tmp_path / "a.db", [])
    monkeypatch.setattr("uvicorn.Server.run", lambda *_, **__: None)
    monkeypatch.setattr(SqliteFile, "can_write", lambda _: can_write)
    assert run_cli(["serve", log, "--port", "0", *options]) == 0
    begun = re.findall(r"worker \d+ begins", capsys.readouterr().err)
    assert len(begun) == (can_write and not options)
