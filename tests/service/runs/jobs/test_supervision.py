"""Does a server keep a worker as long as it lives, and no longer, whatever is killed?"""

import os
import random
import re
import signal
import socket
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

import psutil
import pytest

from service.cli.app import run as run_cli
from service.runs.jobs.worker import work
from service.runs.processing import RunRequest, process
from service.store.databases.sqlite_file import SqliteFile
from service.store.registers.jobs import Jobs
from tests.service.conftest import NewLog
from tests.service.logs import kept_rows, write_log
from tests.service.runs.jobs.test_jobs import add, check_same, is_free, opened, until

SERVE = [sys.executable, "-c", "from service.cli.app import main; main()", "serve", "--port", "0"]


@contextmanager
def serving(url: str, *options: str) -> Iterator["subprocess.Popen[str]"]:
    with subprocess.Popen([*SERVE, url, *options], stderr=subprocess.PIPE, text=True) as server:
        yield server
        server.kill()


def next_worker(server: "subprocess.Popen[str]") -> int:
    """Read what a server says until a worker begins, and give the number of its process."""
    assert server.stderr is not None
    for line in server.stderr:
        if begun := re.fullmatch(r"worker (\d+) begins\n", line):
            return int(begun[1])
    raise AssertionError("the server ended")


def called(server: "subprocess.Popen[str]") -> socket.socket:
    """Read what a server says until it has an address, and call it."""
    assert server.stderr is not None
    for line in server.stderr:
        if address := re.search(r"http://([0-9.]+):(\d+)/", line):
            return socket.create_connection((address[1], int(address[2])))
    raise AssertionError("the server ended")


def is_begun(jobs: Jobs) -> bool:
    """Tell whether a job was begun that is not finished, or none is left."""
    left = [one.attempts for one in jobs.listed() if one.state != "finished"]
    return not left or any(left)


def is_gone(process_id: int) -> bool:
    """Tell whether a process has ended, whoever is to take note of it."""
    stat = Path(f"/proc/{process_id}/stat")
    return not stat.exists() or stat.read_text().rpartition(")")[2].split()[0] == "Z"


@pytest.mark.long
def test_a_worker_that_is_killed_is_replaced_and_goes_with_its_server(tmp_path: Path) -> None:
    with serving(write_log(tmp_path / "a.db", [])) as server:
        first = next_worker(server)
        os.kill(first, signal.SIGKILL)
        second = next_worker(server)
        assert second != first
        server.kill()
        until(lambda: is_gone(second))


@pytest.mark.slow
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


@pytest.mark.slow
def test_fifty_kills_of_server_worker_or_both_lose_nothing_and_double_nothing(new_log: NewLog, tracks: Path) -> None:
    url, whole, rng = new_log(), new_log(), random.Random(1)
    with opened(url) as jobs:
        names = list[str]()
        server: subprocess.Popen[bytes] | None = None
        for number in range(50):
            names.append(add(jobs, tracks, min_confidence=number // 2 / 50))  # one job for two kills
            if server is None:  # the worker of the one before may still be ending
                server = subprocess.Popen([*SERVE, url], stderr=subprocess.DEVNULL, start_new_session=True)
            if rng.random() < 0.7:  # else it may be killed before a job is begun
                until(lambda: is_begun(jobs))
            with suppress(subprocess.TimeoutExpired):
                server.wait(rng.uniform(0.0, 2.0))  # a job takes half of it
            assert server.poll() is None
            victim = rng.choice(("server", "worker", "both"))
            if victim == "worker":
                with suppress(psutil.NoSuchProcess, IndexError):
                    rng.choice(psutil.Process(server.pid).children()).kill()
            else:
                server.kill() if victim == "server" else os.killpg(server.pid, signal.SIGKILL)
                server.wait()
                server = None
            for name in set(names):
                jobs.change(name, ("waiting", "running"), attempts=0)
        if server is not None:
            server.kill()
            server.wait()
        for name in names:
            until(lambda name=name: is_free(url, name))
        assert "finished" in [jobs.find(name).state for name in names]
        work(url, stays=False, tell=lambda _: None)
        assert [jobs.find(name).state for name in names] == ["finished"] * len(names)
    for number in range(25):
        process(RunRequest(tracks, tracks.parent / "site.toml", whole, min_confidence=number / 50))
    check_same(url, whole)


@pytest.mark.slow
def test_half_an_upload_goes_when_its_server_was_killed_and_no_other_one_lives(tmp_path: Path) -> None:
    folder, log, other = tmp_path / "uploads", tmp_path / "a.db", tmp_path / "b.db"
    folder.mkdir()
    options = ("--workers", "0", "--uploads", str(folder))
    head = b"PUT /api/v1/sources/a.mp4/video HTTP/1.1\r\nHost: localhost\r\nContent-Length: 9\r\n\r\nhalf"
    with serving(write_log(log, []), *options) as server, called(server) as line:
        line.sendall(head)
        until(lambda: bool(os.listdir(folder)))
        with serving(write_log(other, []), *options) as second, called(second) as asking:
            asking.sendall(b"GET /api/v1/health HTTP/1.1\r\nHost: localhost\r\n\r\n")
            assert asking.recv(1000)
            assert len(os.listdir(folder)) == 1
        server.kill()
        server.wait()  # before the line is cut, as a server that lives clears up then
    assert len(os.listdir(folder)) == 1
    with serving(str(log), *options) as server, called(server):
        until(lambda: not os.listdir(folder))


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
