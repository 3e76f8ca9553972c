"""The video file: readable, seekable, and none left after a failure."""

from pathlib import Path

import av
import numpy as np
import pytest

from data_gen.drawing.video import VideoWriter
from data_gen.errors import DataGenError


def picture(number: int) -> np.ndarray[tuple[int, ...], np.dtype[np.uint8]]:
    return np.full((96, 64), 40 + number, dtype=np.uint8)


def test_frames_come_back_with_exact_times_and_a_key_frame_each_second(tmp_path: Path) -> None:
    path = tmp_path / "video.mp4"
    with VideoWriter(path, (64, 64), 25) as video:
        for number in range(60):
            video.write(picture(number))
    with av.open(str(path)) as container:
        stream = container.streams.video[0]
        assert (stream.codec_context.name, stream.frames) == ("h264", 60)
        frames = [(frame.pts * stream.time_base, frame.key_frame) for frame in container.decode(stream)]
    assert [int(time_s * 1_000_000) for time_s, _ in frames] == list(range(0, 2_400_000, 40_000))
    assert [time_s for time_s, is_key in frames if is_key] == [0, 1, 2]


def test_the_index_lies_before_the_pictures_so_that_browsers_start_at_once(tmp_path: Path) -> None:
    path = tmp_path / "video.mp4"
    with VideoWriter(path, (64, 64), 25) as video:
        video.write(picture(0))
    data = path.read_bytes()
    assert data.index(b"moov") < data.index(b"mdat")


def test_no_file_is_left_when_drawing_fails(tmp_path: Path) -> None:
    path = tmp_path / "video.mp4"

    def draw_then_fail() -> None:
        with VideoWriter(path, (64, 64), 25) as video:
            video.write(picture(0))
            raise RuntimeError("out of paint")

    with pytest.raises(RuntimeError, match="out of paint"):
        draw_then_fail()
    assert not path.exists()


def test_an_encoder_failure_reaches_the_caller(tmp_path: Path) -> None:
    def write_into_a_missing_folder() -> None:
        with VideoWriter(tmp_path / "missing" / "video.mp4", (64, 64), 25) as video:
            for number in range(20):
                video.write(picture(number))

    with pytest.raises(DataGenError, match=r"expected to write H\.264"):
        write_into_a_missing_folder()


def test_an_odd_size_is_refused(tmp_path: Path) -> None:
    with pytest.raises(DataGenError, match=r"expected even width and height, got \(65, 64\)"):
        VideoWriter(tmp_path / "video.mp4", (65, 64), 25)
