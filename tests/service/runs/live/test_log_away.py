"""Is a camera recorded while the server of its log is away, and is all of it in the log once that is back?"""

import signal
import socket
import subprocess
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import closing, contextmanager, suppress
from pathlib import Path

import pytest
from sqlalchemy.engine import make_url

from service.cli.app import run as run_cli
from service.runs.live.recording_writer import left_behind
from service.store.log import open_log
from tests.service.conftest import NewLog
from tests.service.runs.live.test_watched_jobs import WORK_LIVE, only_job
from tests.service.runs.live.test_watching import (
    PIECE,
    WATCH,
    answering,
    events,
    recorded_bytes,
    recordings,
    reprocessed,
    until,
)

AWAY = "; what comes is recorded"


class Gate:
    """A way to a server that can be shut: it carries bytes between TCP and the server's socket.

    Parameters
    ----------
    url : of a log on the server.

    Attributes
    ----------
    url : of the same, by this way.
    """

    def __init__(self, url: str) -> None:
        place = make_url(url)
        self._server = f"{place.query['host']}/.s.PGSQL.5432"
        self._port = 0
        self.open()
        self.url = place.set(host="127.0.0.1", port=self._port, query={}).render_as_string(hide_password=False)

    def open(self) -> None:
        """Let callers in."""
        self._ends = list[socket.socket]()
        self._listener = socket.create_server(("127.0.0.1", self._port))
        self._port = self._listener.getsockname()[1]
        threading.Thread(target=self._accept, args=(self._listener,), daemon=True).start()

    def close(self) -> None:
        """Cut all lines, and refuse callers."""
        self._listener.shutdown(socket.SHUT_RDWR)
        self._listener.close()
        for end in self._ends:
            with suppress(OSError):
                end.shutdown(socket.SHUT_RDWR)

    def _accept(self, listener: socket.socket) -> None:
        with suppress(OSError):
            while True:
                caller = listener.accept()[0]
                server = socket.socket(socket.AF_UNIX)
                server.connect(self._server)
                self._ends += [caller, server]
                for ends in ((caller, server), (server, caller)):
                    threading.Thread(target=_carry, args=ends, daemon=True).start()


def _carry(source: socket.socket, target: socket.socket) -> None:
    with source, suppress(OSError):  # the thread of the other way closes the other end
        while data := source.recv(1 << 16):
            target.sendall(data)
    with suppress(OSError):
        target.shutdown(socket.SHUT_RDWR)


@contextmanager
def running(command: Sequence[str]) -> Iterator[tuple["subprocess.Popen[bytes]", list[str]]]:
    """Run a program, and read what it tells as it does."""
    told = list[str]()

    def read() -> None:
        assert program.stderr is not None
        for line in program.stderr:
            told.append(line.decode())  # at once

    with subprocess.Popen(command, stderr=subprocess.PIPE, stdout=subprocess.DEVNULL) as program:
        reader = threading.Thread(target=read)
        reader.start()
        try:
            yield program, told
        finally:
            program.kill()
            reader.join()


@pytest.mark.slow
@pytest.mark.parametrize("is_job", [False, True], ids=["by hand", "as a job"])
def test_a_camera_is_recorded_while_its_log_is_away(
    postgres: NewLog, sent: bytes, scene: Path, tmp_path: Path, is_job: bool
) -> None:
    half, is_away, is_told = len(sent) // (2 * PIECE) * PIECE, threading.Event(), threading.Event()
    log = postgres()

    def serve(called: Callable[[], socket.socket]) -> None:
        line = called()
        line.sendall(sent[:half])
        is_away.wait()
        line.sendall(sent[half:])
        is_told.wait()
        line.sendall(sent)
        while True:
            called().sendall(sent)

    names = ["--recordings", str(tmp_path / "recordings"), "--site", str(scene / "site.toml")]
    with answering(serve) as url, closing(Gate(log)) as gate:
        command = [*WATCH, url, "--log", gate.url, *names]
        if is_job:
            assert run_cli(["watch", url, "--log", log, *names, "--queue"]) == 0
            command = [*WORK_LIVE, gate.url]
        with running(command) as (program, told):
            until(lambda: recorded_bytes(tmp_path) > 0.4 * len(sent), program)
            gate.close()
            is_away.set()
            until(lambda: any(AWAY in line for line in told), program)
            is_told.set()
            until(lambda: recorded_bytes(tmp_path) > 1.9 * len(sent), program)
            gate.open()
            until(lambda: len(recordings(tmp_path)) == 2 and recorded_bytes(tmp_path) > 2.8 * len(sent), program)
            until(lambda: not left_behind(tmp_path / "recordings"), program)
            if is_job:
                assert run_cli(["jobs", "cancel", log, only_job(log).id]) == 0
                until(lambda: only_job(log).state == "cancelled", program)
            program.send_signal(signal.SIGINT)
            program.wait()
    assert program.returncode == (130 if is_job else 0), told
    assert "Traceback" not in "".join(told)
    assert len(recordings(tmp_path)) == 2
    with open_log(log) as opened:
        assert [one.status for one in opened.runs()] == ["finished", "finished"]
    assert sorted(events(log)) == sorted(events(reprocessed(tmp_path, scene))) != []
