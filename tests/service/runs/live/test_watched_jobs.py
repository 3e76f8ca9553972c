"""Is a live source that was queued watched until somebody cancels it, whatever goes wrong with it or its worker?"""

import os
import re
import signal
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

import pytest

from service.cli.app import run as run_cli
from service.runs.jobs.worker import work
from service.runs.live.live_source import LiveSource
from service.runs.live.recording_writer import left_behind
from service.runs.processing import RunRequest, process
from service.runs.requests import LiveRequest, read_request
from service.store.entries import Job
from service.store.log import open_log
from tests.service.runs.jobs.test_jobs import opened
from tests.service.runs.jobs.test_supervision import next_worker, serving
from tests.service.runs.live.test_watching import (
    answering,
    events,
    recorded_bytes,
    recordings,
    reprocessed,
    until,
)

WORK_LIVE = [sys.executable, "-c", "from service.cli.app import main; main()", "worker", "--live", "1"]


@contextmanager
def patient_camera(data: bytes) -> Iterator[str]:
    """Send the same to each that calls, and stay silent then."""

    def serve(called: Callable[[], socket.socket]) -> None:
        while True:
            line = called()
            with suppress(OSError):  # who called may be killed
                line.sendall(data)

    with answering(serve) as url:
        yield url


def queue(source: str, log: str, folder: Path, *options: str) -> int:
    return run_cli(["watch", source, "--log", log, "--recordings", str(folder / "recordings"), "--queue", *options])


def only_job(log: str) -> Job:
    with opened(log) as jobs:
        (job,) = jobs.listed()
    return job


@pytest.mark.slow
def test_a_camera_outlives_its_worker_and_its_server_and_ends_when_it_is_cancelled(
    sent: bytes, scene: Path, tmp_path: Path
) -> None:
    log = str(tmp_path / "live.db")
    with patient_camera(sent) as url:
        assert queue(url, log, tmp_path, "--site", str(scene / "site.toml")) == 0
        with subprocess.Popen([*WORK_LIVE, log], stderr=subprocess.PIPE, text=True) as program:
            worker = next_worker(program)
            until(lambda: recorded_bytes(tmp_path) > 0.9 * len(sent), program)
            os.kill(worker, signal.SIGKILL)
            assert next_worker(program) != worker
            until(lambda: recorded_bytes(tmp_path) > 1.8 * len(sent), program)
            program.kill()  # of which its worker takes note
        assert only_job(log).state in {"running", "waiting"}
        with serving(log, "--live", "1") as server:
            until(lambda: recorded_bytes(tmp_path) > 2.7 * len(sent), server)
            until(lambda: len(left_behind(tmp_path / "recordings")) == 0, server)
            assert run_cli(["jobs", "cancel", log, only_job(log).id]) == 0
            until(lambda: only_job(log).state == "cancelled", server)
    assert len(recordings(tmp_path)) == 3
    with open_log(log) as opened_log:
        assert [one.status for one in opened_log.runs()] == ["finished"] * 3
    assert sorted(events(log)) == sorted(events(reprocessed(tmp_path, scene))) != []


@pytest.mark.long
def test_what_does_not_answer_waits_and_is_watched_once_it_does(sent: bytes, scene: Path, tmp_path: Path) -> None:
    pipe, log, told = tmp_path / "pipe.ts", str(tmp_path / "live.db"), list[str]()
    os.mkfifo(pipe)
    wrong, folder = tmp_path / "wrong", tmp_path / "site"
    wrong.mkdir()
    (wrong / "site.toml").write_text("no table")
    folder.symlink_to(wrong)
    assert queue(str(pipe), log, tmp_path, "--site", str(folder / "site.toml"), "--workers", "0") == 0
    assert only_job(log).input == str(pipe)

    def mend() -> None:
        (tmp_path / "right").symlink_to(scene)
        (tmp_path / "right").rename(folder)
        pipe.write_bytes(sent)

    def tell(line: str) -> None:
        told.append(line)
        if " waits again: " in line:
            assert (only_job(log).state, only_job(log).message) != ("failed", "")
            threading.Timer(2.5, mend).start()  # it is tried more often than a run may be begun, and told once

    work(log, "live", stays=False, tell=tell)
    job = only_job(log)
    assert (job.state, job.kind) == ("finished", "live")
    assert re.fullmatch(r"\d+ s of input, \d+ frames, \d+ cars, \d+ events", job.message)
    assert job.attempts > 1
    name = f"job {job.id}"
    assert [line.split(": ")[0] for line in told] == [name, f"{name} waits again", name, f"{name} is finished"]
    (tmp_path / "file.ts").write_bytes(sent)
    again = str(tmp_path / "file.db")
    assert process(RunRequest(tmp_path / "file.ts", scene / "site.toml", again)).status == "finished"
    assert events(log) == events(again) != []


@pytest.mark.parametrize("is_rows", [False, True], ids=["video", "rows"])
@pytest.mark.parametrize("has_writer", [False, True], ids=["no writer", "silent writer"])
def test_a_pipe_that_nothing_comes_through_can_be_cancelled(tmp_path: Path, has_writer: bool, is_rows: bool) -> None:
    pipe, log, told = tmp_path / "pipe.ts", str(tmp_path / "live.db"), list[str]()
    os.mkfifo(pipe)
    assert queue(str(pipe), log, tmp_path, *(["--rows"] if is_rows else [])) == 0

    def cancel() -> None:
        while only_job(log).message != "begun":  # as is said for the first time while it is opened
            time.sleep(0.02)
        assert run_cli(["jobs", "cancel", log, only_job(log).id]) == 0

    writer = os.open(pipe, os.O_RDWR) if has_writer else None
    canceller = threading.Thread(target=cancel)
    canceller.start()
    work(log, "live", stays=False, tell=told.append)
    canceller.join()
    if writer is not None:
        os.close(writer)
    assert (only_job(log).state, only_job(log).attempts) == ("cancelled", 1)
    assert [line.partition(": ")[0].split()[-1] for line in told] == [only_job(log).id, "cancelled"]


@pytest.mark.long
def test_a_pipe_that_falls_silent_can_be_cancelled(sent: bytes, scene: Path, tmp_path: Path) -> None:
    pipe, log = tmp_path / "pipe.ts", str(tmp_path / "live.db")
    os.mkfifo(pipe)
    assert queue(str(pipe), log, tmp_path, "--site", str(scene / "site.toml"), "--workers", "0") == 0

    def send() -> None:
        with pipe.open("wb", buffering=0) as writer:
            writer.write(sent)
            while recorded_bytes(tmp_path) < 0.9 * len(sent):
                time.sleep(0.02)
            assert run_cli(["jobs", "cancel", log, only_job(log).id]) == 0
            while only_job(log).state == "running":
                time.sleep(0.02)

    sender = threading.Thread(target=send)
    sender.start()
    work(log, "live", stays=False, tell=lambda _: None)
    sender.join()
    assert only_job(log).state == "cancelled"
    with open_log(log) as opened_log:
        assert [one.status for one in opened_log.runs()] == ["finished"]


@pytest.mark.parametrize("scheme", ["rtsp", "http"])
def test_an_address_that_never_answers_can_be_cancelled_before_it_gives_up(tmp_path: Path, scheme: str) -> None:
    log, called = str(tmp_path / "live.db"), list[socket.socket]()
    with socket.create_server(("127.0.0.1", 0)) as server:
        assert queue(f"{scheme}://127.0.0.1:{server.getsockname()[1]}/1", log, tmp_path) == 0

        def cancel() -> None:
            called.append(server.accept()[0])
            assert called[0].recv(4096)
            assert run_cli(["jobs", "cancel", log, only_job(log).id]) == 0

        canceller = threading.Thread(target=cancel)
        canceller.start()
        work(log, "live", stays=False, tell=lambda _: None)
        canceller.join()
        assert only_job(log).state == "cancelled"
        called[0].setblocking(False)
        with pytest.raises(BlockingIOError):  # the line is still open: nobody waited for it
            called[0].recv(4096)
        called[0].close()


def test_a_cancellation_is_kept_where_the_source_gives_up_then(tmp_path: Path) -> None:
    log = str(tmp_path / "live.db")
    os.mkfifo(tmp_path / "pipe.ts")
    assert queue(str(tmp_path / "pipe.ts"), log, tmp_path) == 0
    with opened(log) as jobs:
        taken = jobs.take("live")
        assert taken is not None
        jobs.cancel(taken.job.id)
        taken.end("waiting", "it does not answer")
        assert jobs.take("live") is None
    assert (only_job(log).state, only_job(log).message) == ("cancelled", "")


def test_a_pipe_is_found_from_any_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    os.mkfifo("pipe.ts")
    assert queue("pipe.ts", str(tmp_path / "live.db"), tmp_path) == 0
    assert only_job(str(tmp_path / "live.db")).input == str(tmp_path / "pipe.ts")


def test_other_workers_leave_live_sources_alone(tmp_path: Path) -> None:
    log = str(tmp_path / "live.db")
    os.mkfifo(tmp_path / "pipe.ts")
    assert queue(str(tmp_path / "pipe.ts"), log, tmp_path) == 0
    work(log, stays=False, tell=lambda _: None)
    assert (only_job(log).state, only_job(log).attempts) == ("waiting", 0)


def test_a_camera_over_http_is_kept_as_long_as_one_by_command(tmp_path: Path) -> None:
    log = str(tmp_path / "live.db")
    assert queue("rtsp://camera.example/1", log, tmp_path) == 0
    request = read_request(only_job(log).request, log)
    assert isinstance(request, LiveRequest)
    assert request == LiveRequest(request.input, request.run, request.recordings)


def test_the_same_source_is_queued_once_and_listed_as_it_was_named(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    log = str(tmp_path / "live.db")
    for folder in ("one", "two"):  # from wherever it is asked for
        (tmp_path / folder).mkdir()
        monkeypatch.chdir(tmp_path / folder)
        assert queue("rtsp://$CAMERA@camera.example/1", log, tmp_path) == 0
        assert f"job {only_job(log).id} is waiting: rtsp://$CAMERA@camera.example/1" in capsys.readouterr().out
    assert run_cli(["jobs", "list", log]) == 0
    assert "rtsp://$CAMERA@camera.example/1" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("source", "said"),
    [
        ("rtsp://me:secret@camera.example/1", "rtsp://camera.example/1: expected who asks from the environment"),
        ("-", "-: expected a source that a worker reaches"),
    ],
)
def test_what_a_log_should_not_keep_is_not_queued(
    source: str, said: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert queue(source, str(tmp_path / "live.db"), tmp_path) == 3
    told = capsys.readouterr().err
    assert said in told
    assert "secret" not in told
    assert not list(tmp_path.iterdir())


def test_who_asks_stands_in_the_environment(monkeypatch: pytest.MonkeyPatch, sent: bytes) -> None:
    asked = list[bytes]()
    with socket.create_server(("127.0.0.1", 0)) as server:
        port = server.getsockname()[1]

        def answer() -> None:
            for said in (
                b"HTTP/1.0 401 Unauthorized\r\nWWW-Authenticate: Basic realm=x\r\n\r\n",
                b"HTTP/1.0 200 OK\r\nContent-Type: video/mp2t\r\n\r\n" + sent,
            ):
                with server.accept()[0] as line:
                    asked.append(line.recv(4096))
                    line.sendall(said)

        thread = threading.Thread(target=answer)
        thread.start()
        monkeypatch.setenv("CAMERA", "me:secret")
        source = LiveSource(f"http://$CAMERA@127.0.0.1:{port}/1")
        assert source.shown == f"http://127.0.0.1:{port}/1"
        container, _ = source.open()
        container.close()
        thread.join()
    assert b"Authorization: Basic bWU6c2VjcmV0" in asked[1]


def test_a_variable_that_is_not_set_is_told(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    names = ["--log", str(tmp_path / "live.db"), "--recordings", str(tmp_path / "recordings")]
    assert run_cli(["watch", "rtsp://$NOBODY_SAID@camera.example/1", *names]) == 3
    assert "expected a variable of the environment, got $NOBODY_SAID, which is not set" in capsys.readouterr().err


def test_live_sources_go_with_neither_once_nor_a_cluster(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for option in (["--once"], ["--cluster", "auto"]):
        assert run_cli(["worker", str(tmp_path / "a.db"), "--live", "2", *option]) == 2
        assert "--once" in capsys.readouterr().err


def test_a_log_that_is_missing_is_not_made(tmp_path: Path) -> None:
    assert run_cli(["worker", str(tmp_path / "a.db"), "--live", "1"]) == 3
    assert not list(tmp_path.iterdir())
