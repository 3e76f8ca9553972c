"""Is the picture of a time, found by seeking, the one that a pass from the start gives?"""

import random
from fractions import Fraction
from itertools import pairwise
from pathlib import Path

import av
import numpy as np
import pytest

from tests.vision.support import ByteArray, write_video
from vision.errors import VideoBroken
from vision.video.frames import Frame, open_video

COUNT = 70
CLIPS = {
    "one key picture, B frames.mp4": ("libx264", {"g": "500", "bf": "3", "b-pyramid": "normal"}),
    "open groups.mp4": ("libx264", {"g": "12", "bf": "3", "x264-params": "open-gop=1:scenecut=0"}),
    "open groups.ts": ("libx264", {"g": "12", "bf": "3", "x264-params": "open-gop=1:scenecut=0"}),
    "refreshed by columns.mp4": ("libx264", {"g": "25", "x264-params": "intra-refresh=1"}),
    "h264.avi": ("libx264", {"g": "20", "bf": "0"}),
    "hevc.mkv": ("libx265", {"x265-params": "keyint=16:bframes=3:open-gop=1:log-level=none"}),
    "vp9.webm": ("libvpx-vp9", {"g": "24", "deadline": "realtime", "cpu-used": "8"}),
    "mpeg4.mp4": ("mpeg4", {"g": "15", "bf": "2"}),
    "mpeg2.mpg": ("mpeg2video", {"g": "15", "bf": "2"}),
    "mpeg2.ts": ("mpeg2video", {"g": "15", "bf": "2"}),
    "each by itself.avi": ("mjpeg", {}),
}


def pictures() -> list[ByteArray]:
    """Noise with something that moves, so that no two pictures are equal and motion is predicted."""
    rng = np.random.default_rng(3)
    ground = rng.integers(60, 200, (96, 128), dtype=np.uint8)
    found = []
    for number in range(COUNT):
        picture = np.roll(ground, number, axis=1)
        picture[20:40, number : number + 20] = 20 + 3 * number
        found.append(picture)
    return found


def write(path: Path, codec: str, options: dict[str, str], times: list[int]) -> None:
    """Write a clip whose frames have times in steps of 40 ms."""
    with av.open(str(path), "w") as container:
        stream = container.add_stream(codec, rate=25, options=options)
        stream.height, stream.width = 96, 128
        stream.pix_fmt = "yuvj420p" if codec == "mjpeg" else "yuv420p"
        stream.codec_context.thread_count = 1
        for picture, time in zip(pictures(), times, strict=True):
            frame = av.VideoFrame.from_ndarray(picture, format="gray").reformat(format=stream.pix_fmt)
            frame.pts, frame.time_base = time, Fraction(1, 25)
            container.mux(stream.encode(frame))
        container.mux(stream.encode(None))


def check(path: Path, seed: int = 1) -> int:
    """Compare with a pass from the start at some frames, and between two; return how many frames there are."""
    source = open_video(path)
    frames = list(source)
    # A player goes on showing a frame until the next one.
    middles = [(one.t_us + other.t_us) // 2 for one, other in pairwise(frames)]
    times = [(one.t_us, one) for one in frames] + list(zip(middles, frames, strict=False))
    for t_us, expected in [*times[:2], times[len(frames) - 1], *random.Random(seed).sample(times, 30)]:
        found = source.frame_at(t_us)
        assert found is not None, t_us
        assert found.t_us == expected.t_us, t_us
        assert is_same(found, expected), t_us
    for t_us, expected in random.Random(seed).sample(times, 3):
        rest = frames[[one.t_us for one in frames].index(expected.t_us) :]
        behind = list(source.frames(from_us=t_us))
        assert [one.t_us for one in behind] == [one.t_us for one in rest], t_us
        assert all(map(is_same, behind, rest)), t_us
    assert list(source.frames(from_us=frames[-1].t_us + 1)) == []
    assert source.frame_at(-1) is None
    assert source.frame_at(frames[-1].t_us + 1) is None
    return len(frames)


def is_same(one: Frame, other: Frame) -> bool:
    return all(np.array_equal(getattr(one, name), getattr(other, name)) for name in ("luma", "chroma_u", "chroma_v"))


@pytest.mark.long
@pytest.mark.parametrize("name", CLIPS)
def test_the_picture_of_a_time_is_that_of_a_whole_pass(tmp_path: Path, name: str) -> None:
    codec, options = CLIPS[name]
    write(tmp_path / name, codec, options, list(range(COUNT)))
    assert check(tmp_path / name) >= COUNT - 2


@pytest.mark.long
@pytest.mark.parametrize("name", ["v.mp4", "v.mkv", "v.ts"])
def test_steps_may_differ_and_time_may_begin_anywhere(tmp_path: Path, name: str) -> None:
    rng = random.Random(5)
    times = [2_000]
    while len(times) < COUNT:
        times.append(times[-1] + rng.choice([1, 1, 1, 2, 7, 40]))
    write(tmp_path / name, "libx264", {"g": "30", "bf": "2"}, times)
    assert check(tmp_path / name) == COUNT


def test_frames_that_a_whole_pass_leaves_out_are_left_out(tmp_path: Path) -> None:
    path = tmp_path / "v.mkv"  # its clock ticks in milliseconds: at 2 kHz every second frame falls on the one before
    write_video(path, pictures(), rate_hz=2000, options={})
    assert check(path) < COUNT


def test_what_lies_behind_damage_is_refused_as_in_a_whole_pass(tmp_path: Path) -> None:
    path = tmp_path / "v.mp4"
    write_video(path, pictures())
    frames = list(open_video(path))
    content = path.read_bytes()
    path.write_bytes(content[: content.index(b"mdat") + (len(content) - content.index(b"mdat")) // 2])
    source = open_video(path)
    found = source.frame_at(frames[25].t_us)
    assert found is not None
    assert is_same(found, frames[25])
    with pytest.raises(VideoBroken):
        source.frame_at(frames[-1].t_us)
