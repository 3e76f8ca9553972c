"""Does a source that sends for an hour take more memory than one that sends for a quarter of it?"""

import os
import subprocess
import threading
from fractions import Fraction
from pathlib import Path

import av
import psutil
import pytest

from service.store.log import open_log
from tests.service.runs.live.test_watching import WATCH

CLIP_S, RATE_HZ = 12, 5
HOUR_S = 3600
GROWTH_KB = 30_000
"""Three quarters of an hour of this scene are some 9 MB of log and of recording, which none of it may lie in memory."""


@pytest.fixture(scope="module")
def clip(scene: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Some seconds of the demo's scene at a low rate, without frames that wait for later ones."""
    file = tmp_path_factory.mktemp("clip") / "clip.mp4"
    with av.open(str(scene / "video.mp4")) as source, av.open(str(file), "w") as target:
        stream = target.add_stream("libx264", rate=RATE_HZ, options={"preset": "veryfast", "bf": "0"})
        stream.width, stream.height, stream.pix_fmt = 1280, 720, "yuv420p"
        for picture in source.decode(source.streams.video[0]):
            index = round(float(picture.time or 0) * 25)
            if index < CLIP_S * 25 and index % (25 // RATE_HZ) == 0:
                picture.pts, picture.time_base = index // (25 // RATE_HZ), Fraction(1, RATE_HZ)
                target.mux(stream.encode(picture))
        target.mux(stream.encode(None))
    return file


@pytest.mark.slow
def test_an_hour_takes_no_more_memory_than_a_quarter_of_it(clip: Path, scene: Path, tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe.ts")
    writer = threading.Thread(target=send_over_and_over, args=(clip, tmp_path / "pipe.ts"))
    names = ["--log", tmp_path / "live.db", "--recordings", tmp_path / "recordings", "--site", scene / "site.toml"]
    command = [*WATCH, str(tmp_path / "pipe.ts"), *map(str, names), "--workers", "0"]
    sizes_kb: list[tuple[int, int]] = []
    with subprocess.Popen(command, stderr=subprocess.DEVNULL, stdout=subprocess.DEVNULL) as program:
        writer.start()
        while program.poll() is None:
            seen_us = covered_us(tmp_path / "live.db")
            sizes_kb.append((seen_us, resident_kb(program.pid)))
            try:
                program.wait(2)
            except subprocess.TimeoutExpired:
                continue
    writer.join()
    assert program.returncode == 0
    early = [size for seen_us, size in sizes_kb if 600_000_000 <= seen_us <= 900_000_000]
    late = [size for seen_us, size in sizes_kb if seen_us >= 3_300_000_000]
    assert len(early) > 0 < len(late)
    assert max(late) <= max(early) + GROWTH_KB
    with open_log(str(tmp_path / "live.db")) as log:
        assert log.run().status == "finished"
        assert log.last_us(log.run().id) >= (HOUR_S - 1) * 1_000_000


def send_over_and_over(clip: Path, pipe: Path) -> None:
    """Send a clip for an hour of media time, as fast as it is taken, in one stream whose time goes on."""
    with av.open(str(pipe), "w", format="mpegts") as target, av.open(str(clip)) as source:
        video = source.streams.video[0]
        stream = target.add_stream_from_template(video)
        packets = [(one.dts, bytes(one), one.is_keyframe) for one in source.demux(video) if one.dts is not None]
        assert video.time_base is not None
        step = round(Fraction(1, RATE_HZ) / video.time_base)
        for number in range(HOUR_S * RATE_HZ):
            _, data, is_key = packets[number % len(packets)]
            packet = av.Packet(data)
            packet.stream, packet.time_base, packet.is_keyframe = stream, video.time_base, is_key
            packet.pts = packet.dts = number * step
            target.mux(packet)


def covered_us(log: Path) -> int:
    """Tell how far the run has come."""
    if not log.exists():
        return 0
    with open_log(str(log)) as opened:
        runs = opened.runs()
        return opened.last_us(runs[0].id) if runs else 0


def resident_kb(pid: int) -> int:
    return round(psutil.Process(pid).memory_info().rss / 1000)
