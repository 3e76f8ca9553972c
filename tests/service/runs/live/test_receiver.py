"""Does media time go on where a line was cut, whatever came of the line before?"""

from collections.abc import Sequence
from pathlib import Path
from threading import Event
from typing import cast

import av
import numpy as np
import pytest

from service.errors import InputError
from service.runs.live.live_source import LiveSource
from service.runs.live.receiver import Connection, Receiver
from service.runs.live.recording_writer import recordings
from vision.video.recording import Part, parts_so_far

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


def silent(clip: Path) -> Connection:
    """A connection that brings nothing."""
    container, stream = connected(clip)
    assert sum(packet.size > 0 for packet in container.demux(stream)) == 20
    return container, stream


class Camera:
    """A source that is cut after each connection, and then gives the next one; where none is left it says so."""

    shown, ends = "camera", False

    def __init__(self, connections: Sequence[Connection]) -> None:
        self.waiting = list(connections)
        self.ended = Event()

    def open(self) -> Connection:
        if not self.waiting:
            self.ended.set()
            raise InputError("camera: expected live video, got none")
        return self.waiting.pop(0)


def recorded(folder: Path, first: Connection, *others: Connection) -> list[Part]:
    """Record all connections."""
    source = cast("LiveSource", Camera(others))
    receiver = Receiver(source, first, folder, longest_us=9 * HOUR_US, most_bytes=10**9, tell=lambda _: None)
    begun = list[Path]()
    receiver.record(begun.append)
    (recording,) = recordings(folder)
    assert begun == [recording]
    return parts_so_far(recording)


def test_time_goes_on_between_connections(clip: Path, tmp_path: Path) -> None:
    first, second = recorded(tmp_path, connected(clip), connected(clip))
    assert first.start_us == 0
    assert second.start_us >= 19 * 40_000 + 500_000  # what was seen, and the pause


def test_a_line_that_brings_nothing_sets_no_time_back(clip: Path, tmp_path: Path) -> None:
    _, second = recorded(tmp_path, connected(clip), silent(clip), connected(clip))
    assert second.start_us >= 19 * 40_000 + 1_000_000


def test_media_time_begins_with_the_first_picture(clip: Path, tmp_path: Path) -> None:
    (part,) = recorded(tmp_path, silent(clip), connected(clip))
    assert part.start_us == 0
