"""Does media time go on where a line was cut, whatever came of the line before?"""

from dataclasses import replace
from pathlib import Path
from typing import cast

import av
import numpy as np
import pytest

from service.live.live_source import LiveSource
from service.live.receiver import Connection, Receiver
from vision.video.recording import INDEX, parts_so_far

HOUR_US = 3_600_000_000


@pytest.fixture
def clip(tmp_path: Path) -> Path:
    file = tmp_path / "clip.ts"
    with av.open(str(file), "w", format="mpegts") as target:
        stream = target.add_stream("libx264", rate=25)
        stream.width, stream.height, stream.pix_fmt = 64, 48, "yuv420p"
        for k in range(20):
            picture = np.full((48, 64, 3), 100 + k, np.uint8)
            target.mux(stream.encode(av.VideoFrame.from_ndarray(picture, format="rgb24")))
        target.mux(stream.encode(None))
    return file


def connected(clip: Path) -> Connection:
    container = av.open(str(clip))
    return container, container.streams.video[0]


class Camera:
    """A source that answers whenever it is called, and is always cut."""

    shown, ends = "camera", False

    def __init__(self, clip: Path) -> None:
        self._clip = clip

    def open(self) -> Connection:
        return connected(self._clip)


def record(first: Connection, clip: Path, folder: Path, *, connections: int) -> None:
    """Record until so many connections have brought something."""
    told: list[str] = []
    source = cast("LiveSource", Camera(clip))
    receiver = Receiver(source, folder, longest_us=9 * HOUR_US, most_bytes=10**9, tell=told.append)
    begun: list[Path] = []

    def begin(recording: Path) -> None:
        begun.append(recording)
        if len(begun) == connections:
            receiver.ended.set()

    receiver.record(first, begin)


def test_time_goes_on_between_connections(clip: Path, tmp_path: Path) -> None:
    record(connected(clip), clip, tmp_path / "r", connections=2)
    (recording,) = (tmp_path / "r").iterdir()
    first, second = parts_so_far(recording)
    assert first.start_us == 0
    assert second.start_us >= 19 * 40_000 + 500_000  # what was seen, and the pause


def test_a_line_that_brings_nothing_sets_no_time_back(clip: Path, tmp_path: Path) -> None:
    record(connected(clip), clip, tmp_path / "r", connections=1)
    (recording,) = (tmp_path / "r").iterdir()
    (part,) = parts_so_far(recording)
    began = replace(part, utc_us=part.utc_us - HOUR_US)
    (recording / INDEX).write_text(began.as_line() + "\n")
    silent = connected(clip)
    assert sum(packet.size > 0 for packet in silent[0].demux(silent[1])) == 20
    record(silent, clip, tmp_path / "r", connections=1)
    assert parts_so_far(recording)[-1].start_us > HOUR_US


@pytest.mark.parametrize("index", ["", "nonsense\n"])
def test_a_recording_that_cannot_be_read_is_not_gone_on_with(clip: Path, tmp_path: Path, index: str) -> None:
    (tmp_path / "r" / "2020").mkdir(parents=True)
    (tmp_path / "r" / "2020" / INDEX).write_text(index)
    record(connected(clip), clip, tmp_path / "r", connections=1)
    assert len(list((tmp_path / "r").iterdir())) == 2
    assert (tmp_path / "r" / "2020" / INDEX).read_text() == index
