"""Is what a camera sends in the log once, whatever happens to the camera, the line and the program?"""

import io
import os
import signal
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import closing, contextmanager, suppress
from pathlib import Path

import av
import numpy as np
import pytest

from service.cli.app import run as run_cli
from service.export.tracks import Views
from service.runs.live.recording_writer import RecordingWriter, left_behind
from service.runs.processing import RunRequest, process
from service.store.log import open_log
from tests.service.logs import kept_rows, read_all
from vision.video.recording import INDEX, parts_so_far

WATCH = [sys.executable, "-c", "from service.cli.app import main; main()", "watch"]
# The same with a wall clock that is set as soon as there is a first file.
SET_CLOCK = """
import sys, time
from pathlib import Path
from service.cli.app import main
folder, jump_ns, clock = Path(sys.argv.pop(1)), 1_000_000_000 * int(sys.argv.pop(1)), time.time_ns
time.time_ns = lambda: clock() + (jump_ns if any(folder.glob("*/000000.ts")) else 0)
main()
"""
SENT_S = 6  # one overtake is over by then
PIECE = 188 * 20  # packets of MPEG-TS


def sent_at(clock_s: int, scene: Path, folder: Path) -> bytes:
    """The same by a camera whose clock says so at the first picture."""
    file = folder / "sent.ts"
    with av.open(str(scene / "video.mp4")) as source, av.open(str(file), "w", format="mpegts") as target:
        stream = target.add_stream_from_template(source.streams.video[0])
        for packet in source.demux(source.streams.video[0]):
            if packet.dts is not None and packet.pts is not None and packet.dts * packet.time_base < SENT_S:
                packet.stream = stream
                packet.dts += round(clock_s / packet.time_base)
                packet.pts += round(clock_s / packet.time_base)
                target.mux(packet)
    return file.read_bytes()


@contextmanager
def camera(*visits: bytes) -> Iterator[str]:
    """Send one after the other to whoever calls, and cut the line after each; stay silent in the last one."""

    def serve(called: Callable[[], socket.socket]) -> None:
        for number, data in enumerate(visits, start=1):
            line = called()
            for at in range(0, len(data), PIECE):
                line.sendall(data[at : at + PIECE])
            if number < len(visits):
                line.close()

    with answering(serve) as url:
        yield url


@contextmanager
def answering(serve: Callable[[Callable[[], socket.socket]], None]) -> Iterator[str]:
    """Answer calls at an address, until it is left; `serve` is given what waits for the next one."""
    server = socket.create_server(("127.0.0.1", 0))
    held: list[socket.socket] = []

    def called() -> socket.socket:
        held.append(server.accept()[0])
        return held[-1]

    def answer() -> None:
        with suppress(OSError):
            serve(called)

    thread = threading.Thread(target=answer)
    thread.start()
    yield f"tcp://127.0.0.1:{server.getsockname()[1]}"
    server.shutdown(socket.SHUT_RDWR)
    server.close()
    for line in held:
        line.close()
    thread.join()


@contextmanager
def watching(
    url: str, scene: Path, folder: Path, watch: Sequence[str] = WATCH, workers: str = "0"
) -> Iterator["subprocess.Popen[bytes]"]:
    names = ["--log", folder / "live.db", "--recordings", folder / "recordings", "--site", scene / "site.toml"]
    command = [*watch, url, *map(str, names), "--workers", workers]
    program = subprocess.Popen(command, stderr=subprocess.PIPE, stdout=subprocess.DEVNULL)
    with program:
        try:
            yield program
        finally:
            program.kill()


def until(is_so: Callable[[], bool], program: "subprocess.Popen[bytes]") -> None:
    while not is_so():
        assert program.poll() is None, program.stderr and program.stderr.read().decode()
        time.sleep(0.02)


def recordings(folder: Path) -> list[Path]:
    return sorted(path.parent for path in (folder / "recordings").glob(f"*/{INDEX}"))


def recorded_bytes(folder: Path) -> int:
    return sum(file.stat().st_size for one in recordings(folder) for file in one.glob("*.ts"))


def connection_count(folder: Path) -> int:
    found = recordings(folder)
    return len({part.connection for part in parts_so_far(found[-1])}) if found else 0


def events(log: Path | str) -> list[tuple[str, int, int, Sequence[tuple[str, str]]]]:
    return [(one.type, one.start_us, one.end_us, sorted(one.roles.items())) for one in read_all(str(log))]


def reprocessed(folder: Path, scene: Path) -> Path:
    """Process the recordings into a log of their own."""
    log = folder / "again.db"
    for recording in recordings(folder):
        assert process(RunRequest(recording, scene / "site.toml", str(log))).status == "finished"
    return log


@pytest.mark.long
def test_a_camera_that_is_cut_is_called_again_and_what_came_can_be_processed_again(
    sent: bytes, scene: Path, tmp_path: Path
) -> None:
    half = len(sent) // (2 * PIECE) * PIECE
    with camera(sent[:half], sent) as url, watching(url, scene, tmp_path) as program:
        until(lambda: connection_count(tmp_path) == 2 and recorded_bytes(tmp_path) > 1.3 * len(sent), program)
        program.send_signal(signal.SIGINT)
        _, told = program.communicate()
    assert program.returncode == 0, told
    assert b"called again" in told
    assert b"Traceback" not in told
    assert b"the camera's view was lost from" in told
    assert b"no picture came for" in told
    (recording,) = recordings(tmp_path)
    first, second = parts_so_far(recording)
    assert (first.why, first.start_us) == ("", 0)
    assert second.why == "it ended"
    assert second.start_us > 0
    live, again = tmp_path / "live.db", reprocessed(tmp_path, scene)
    assert events(live)
    assert kept_rows(live) == kept_rows(again)
    with open_log(str(live)) as log:
        (run,) = log.runs()
        lost, back = log.views(run.id)
        last_us = log.covered_us(run.id)[1]
    assert lost.pixel_from_ground == ()
    assert (back.t_us, back.pixel_from_ground) == (second.start_us, run.camera.pixel_from_ground)
    view = Views(run.camera, iter((lost, back)))
    times_us = (0, lost.t_us - 1, lost.t_us, back.t_us - 1, back.t_us, last_us)
    assert [view.at(t_us) is None for t_us in times_us] == [False, False, True, True, False, False]


@pytest.mark.slow
def test_what_a_killed_program_left_is_processed_beside_the_camera(sent: bytes, scene: Path, tmp_path: Path) -> None:
    with camera(sent) as url, watching(url, scene, tmp_path) as program:
        until(lambda: recorded_bytes(tmp_path) > 0.9 * len(sent), program)
        program.kill()
    (left,) = left_behind(tmp_path / "recordings")
    with camera(sent) as url, watching(url, scene, tmp_path) as program:
        until(lambda: recorded_bytes(tmp_path) > 1.8 * len(sent), program)
        until(lambda: left not in left_behind(tmp_path / "recordings"), program)
        program.send_signal(signal.SIGTERM)
        program.communicate()
    assert program.returncode == 0
    assert left_behind(tmp_path / "recordings") == []
    assert len(recordings(tmp_path)) == 2
    with open_log(str(tmp_path / "live.db")) as log:
        assert [one.status for one in log.runs()] == ["finished", "finished"]
    assert sorted(events(tmp_path / "live.db")) == sorted(events(reprocessed(tmp_path, scene))) != []


@pytest.mark.long
def test_a_pipe_that_is_over_is_the_end(sent: bytes, scene: Path, tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe.ts")
    writer = threading.Thread(target=lambda: (tmp_path / "pipe.ts").write_bytes(sent))
    writer.start()
    with watching(str(tmp_path / "pipe.ts"), scene, tmp_path, workers="auto") as program:
        program.communicate()
    writer.join()
    assert program.returncode == 0
    (tmp_path / "file.ts").write_bytes(sent)
    log = tmp_path / "file.db"
    assert process(RunRequest(tmp_path / "file.ts", scene / "site.toml", str(log))).status == "finished"
    assert events(tmp_path / "live.db") == events(log) != []


@pytest.mark.slow
@pytest.mark.parametrize("jump_s", [3600, -3600])
def test_a_wall_clock_that_is_set_tears_no_media_time(sent: bytes, scene: Path, tmp_path: Path, jump_s: int) -> None:
    half, began_s = len(sent) // (2 * PIECE) * PIECE, time.monotonic()
    watch = [sys.executable, "-c", SET_CLOCK, str(tmp_path / "recordings"), str(jump_s), "watch"]
    with camera(sent[:half], sent) as url, watching(url, scene, tmp_path, watch) as program:
        until(lambda: connection_count(tmp_path) == 2 and recorded_bytes(tmp_path) > 1.3 * len(sent), program)
        program.send_signal(signal.SIGINT)
        _, told = program.communicate()
    assert program.returncode == 0, told
    took_us = round((time.monotonic() - began_s) * 1e6)
    (recording,) = recordings(tmp_path)
    first, second = parts_so_far(recording)
    assert 0 < second.utc_us - first.utc_us - 1_000_000 * jump_s < took_us  # as the clock said
    assert 0 < second.start_us < took_us + 1_000_000 * SENT_S
    live, again = tmp_path / "live.db", reprocessed(tmp_path, scene)
    assert events(live)
    assert kept_rows(live) == kept_rows(again)
    with open_log(str(live)) as log:
        (run,) = log.runs()
        times_us = [t_us for _, t_us in log.frames(run.id)]
        lost, back = log.views(run.id)
    assert run.start_utc_us == first.utc_us
    assert times_us == sorted(set(times_us))
    assert lost.t_us < back.t_us == second.start_us


@pytest.mark.slow
@pytest.mark.parametrize("clocks_s", [(0, 0), (7200, 3600), (7200, 10800)])
def test_time_stamps_that_jump_begin_a_connection(scene: Path, tmp_path: Path, clocks_s: tuple[int, int]) -> None:
    os.mkfifo(tmp_path / "pipe.ts")
    jumped = b"".join(sent_at(clock_s, scene, tmp_path) for clock_s in clocks_s)
    writer = threading.Thread(target=lambda: (tmp_path / "pipe.ts").write_bytes(jumped))
    writer.start()
    with watching(str(tmp_path / "pipe.ts"), scene, tmp_path) as program:
        program.communicate()
    writer.join()
    assert program.returncode == 0
    first, second = parts_so_far(recordings(tmp_path)[0])
    assert second.why == "its time stamps jumped"
    assert first.start_us == 0
    assert (SENT_S - 1) * 1_000_000 < second.start_us < SENT_S * 1_000_000  # no picture came late
    with open_log(str(tmp_path / "live.db")) as log:
        assert log.covered_us(log.run().id)[1] < 2 * SENT_S * 1_000_000
    assert events(tmp_path / "live.db") == events(reprocessed(tmp_path, scene)) != []


@pytest.mark.slow
def test_pictures_of_another_size_begin_a_recording(sent: bytes, scene: Path, tmp_path: Path) -> None:
    small = tmp_path / "small.ts"
    noise = np.random.default_rng(1)
    with av.open(str(small), "w", format="mpegts") as target:
        stream = target.add_stream("libx264", rate=25)
        stream.width, stream.height, stream.pix_fmt = 320, 240, "yuv420p"
        for _ in range(100):
            picture = noise.integers(90, 110, (240, 320, 3), dtype=np.uint8)
            target.mux(stream.encode(av.VideoFrame.from_ndarray(picture, format="rgb24")))
        target.mux(stream.encode(None))
    with camera(sent, small.read_bytes()) as url, watching(url, scene, tmp_path) as program:
        until(lambda: len(recordings(tmp_path)) == 2, program)
        program.send_signal(signal.SIGINT)
        _, told = program.communicate()
    # The first run is over the recording before; that the site's roads are not in view now is told of the second.
    assert program.returncode == 3
    assert b"within the view" in told
    with open_log(str(tmp_path / "live.db")) as log:
        (run,) = log.runs()
    assert (run.file.width_px, run.status) == (1280, "finished")


@pytest.mark.parametrize(
    ("source", "said"),
    [
        ("tcp://127.0.0.1:9", "expected live video, got Connection refused"),
        ("rtsp://me:secret@127.0.0.1:9/1", "rtsp://127.0.0.1:9/1: expected live video"),
        ("nowhere", "expected an address, a device, a pipe or -, got no such file"),
        ("/dev/null", "expected live video"),
    ],
)
def test_what_does_not_answer_is_told_in_a_line(
    source: str, said: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = str(tmp_path / "recordings")
    assert run_cli(["watch", source, "--log", str(tmp_path / "live.db"), "--recordings", folder]) == 3
    told = capsys.readouterr().err
    assert said in told
    assert "secret" not in told
    assert told.count("\n") == 1
    assert not list(tmp_path.iterdir())


@pytest.mark.long
@pytest.mark.parametrize(("data", "came"), [(b"", "got nothing"), (b"no video", "got Invalid data found")])
def test_a_pipe_without_video_is_told_in_a_line(data: bytes, came: str, tmp_path: Path) -> None:
    watch = [*WATCH, "-", "--log", str(tmp_path / "live.db"), "--recordings", str(tmp_path / "recordings")]
    done = subprocess.run(watch, input=data, capture_output=True, check=False)
    assert done.returncode == 3
    assert done.stderr.decode().startswith(f"error: -: expected live video, {came}")
    assert not list(tmp_path.iterdir())


def test_a_site_that_is_missing_is_told_before_anything_is_written(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    names = ["--log", str(tmp_path / "live.db"), "--recordings", str(tmp_path / "recordings")]
    with camera(b"") as url:
        assert run_cli(["watch", url, *names, "--site", str(tmp_path / "none.toml")]) == 3
        socket.create_connection(("127.0.0.1", int(url.rpartition(":")[2]))).close()  # it waits for a caller
    assert "none.toml: expected a readable site file" in capsys.readouterr().err
    assert not list(tmp_path.iterdir())


def test_a_log_that_cannot_be_made_is_told_before_anything_is_recorded(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    names = ["--log", str(tmp_path / "nowhere" / "live.db"), "--recordings", str(tmp_path / "recordings")]
    with camera(b"") as url:
        assert run_cli(["watch", url, *names]) == 3
        socket.create_connection(("127.0.0.1", int(url.rpartition(":")[2]))).close()  # it waits for a caller
    assert f"expected an existing folder '{tmp_path}/nowhere'" in capsys.readouterr().err
    assert not list(tmp_path.iterdir())


def test_a_file_is_for_another_command(scene: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    names = ["--log", str(tmp_path / "live.db"), "--recordings", str(tmp_path / "recordings")]
    assert run_cli(["watch", str(scene / "video.mp4"), *names]) == 3
    assert "dyknow process reads it" in capsys.readouterr().err


def test_a_recording_that_misses_a_file_is_told(
    sent: bytes, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    broken = tmp_path / "broken"
    with closing(RecordingWriter(broken)) as writer, av.open(io.BytesIO(sent), format="mpegts") as came:
        writer.connect(came.streams.video[0], 0, "")
        for packet in came.demux(came.streams.video[0]):
            if packet.pts is not None:
                writer.write(packet)
    next(broken.glob("*.ts")).unlink()
    assert run_cli(["process", str(broken), "--log", str(tmp_path / "b.db")]) == 3
    assert "expected the file '000000.ts', got 'No such file or directory'" in capsys.readouterr().err
    (broken / INDEX).write_text("nonsense\n")
    assert run_cli(["process", str(broken), "--log", str(tmp_path / "b.db")]) == 3
    assert f"expected a file in each line of {INDEX}" in capsys.readouterr().err
