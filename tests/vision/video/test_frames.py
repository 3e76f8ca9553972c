"""Frames of a file: time stamps, planes, and files that break."""

import threading
from dataclasses import replace
from fractions import Fraction
from pathlib import Path

import av
import numpy as np
import pytest

from tests.vision.support import ByteArray, flip_first_picture, write_video
from vision.errors import VideoBroken, VideoError
from vision.video.frames import Frame, open_video


def pictures(count: int, *, height: int = 64, width: int = 96) -> list[ByteArray]:
    rng = np.random.default_rng(7)
    noise = rng.integers(60, 120, (count, height, width), dtype=np.uint8)
    for i in range(count):
        noise[i, 10:20, i : i + 12] = 230
    return list(noise)


def write_jpegs(path: Path, images: list[ByteArray], *, times: list[int]) -> None:
    """Write pictures that need no others, at times in frames of 40 ms."""
    with av.open(str(path), "w") as container:
        stream = container.add_stream("mjpeg", rate=25)
        stream.height, stream.width = images[0].shape
        stream.pix_fmt = "yuvj420p"
        for image, time in zip(images, times, strict=True):
            frame = av.VideoFrame.from_ndarray(image, format="gray").reformat(format="yuvj420p")
            frame.pts, frame.time_base = time, Fraction(1, 25)
            container.mux(stream.encode(frame))
        container.mux(stream.encode(None))


def split_at_data(path: Path) -> tuple[bytes, int]:
    """The file's bytes and where its picture data starts."""
    content = path.read_bytes()
    start = content.index(b"mdat")
    assert content.index(b"moov") < start
    return content, start


def read_until_broken(path: Path) -> tuple[list[Frame], VideoBroken]:
    frames: list[Frame] = []
    with pytest.raises(VideoBroken) as caught:
        frames.extend(open_video(path))  # list.extend keeps what came before the error
    return frames, caught.value


def test_frames_carry_the_time_stamps_of_the_file_and_not_a_count(tmp_path: Path) -> None:
    times = [0, 1, 2, 5, 6, 11]  # frames were dropped while recording
    write_video(tmp_path / "v.mp4", pictures(6), times=times)
    assert [frame.t_us for frame in open_video(tmp_path / "v.mp4")] == [40_000 * t for t in times]


def test_media_time_starts_with_the_first_frame_whatever_its_time_stamp(tmp_path: Path) -> None:
    write_jpegs(tmp_path / "v.mkv", pictures(4), times=[250, 251, 252, 255])  # cut out of a running stream
    assert [frame.t_us for frame in open_video(tmp_path / "v.mkv")] == [0, 40_000, 80_000, 200_000]


def test_frames_that_a_container_leaves_empty_are_no_damage(tmp_path: Path) -> None:
    write_jpegs(tmp_path / "v.avi", pictures(4), times=[0, 1, 5, 6])  # AVI announces 7 frames
    source = open_video(tmp_path / "v.avi")
    assert source.frame_count == 7
    assert [frame.t_us for frame in source] == [0, 40_000, 200_000, 240_000]


def test_planes_are_the_pictures(tmp_path: Path) -> None:
    source = pictures(3)
    write_video(tmp_path / "v.mp4", source)
    frames = list(open_video(tmp_path / "v.mp4"))
    assert [frame.index for frame in frames] == [0, 1, 2]
    assert frames[0].luma.shape == (64, 96)
    assert frames[0].chroma_u.shape == frames[0].chroma_v.shape == (32, 48)
    assert np.all(np.abs(frames[2].chroma_u.astype(int) - 128) <= 2)
    bright = frames[2].luma[12:18, 4:12].mean() - frames[2].luma[30:60, 30:80].mean()
    assert bright > 80
    assert not frames[0].luma.flags.writeable


def test_source_describes_the_video_and_can_be_read_again(tmp_path: Path) -> None:
    write_video(tmp_path / "v.mp4", pictures(10))
    source = open_video(tmp_path / "v.mp4")
    assert (source.width_px, source.height_px, source.frame_count, source.duration_us) == (96, 64, 10, 400_000)
    assert source.rate_hz == pytest.approx(25.0)
    assert [f.t_us for f in source] == [f.t_us for f in source]


@pytest.mark.parametrize("size", [(64, 96), (63, 95)], ids=["even", "odd"])
def test_other_pixel_formats_are_brought_to_half_size_chroma(tmp_path: Path, size: tuple[int, int]) -> None:
    path = tmp_path / "v.mkv"
    with av.open(str(path), "w") as container:
        stream = container.add_stream("ffv1", rate=25)
        stream.height, stream.width, stream.pix_fmt = *size, "bgr0"
        red = np.zeros((*size, 3), np.uint8)
        red[..., 0] = 255
        container.mux(stream.encode(av.VideoFrame.from_ndarray(red, format="rgb24").reformat(format="bgr0")))
        container.mux(stream.encode(None))
    frame = next(iter(open_video(path)))
    assert frame.luma.shape == size
    assert frame.chroma_v.shape == ((size[0] + 1) // 2, (size[1] + 1) // 2)
    assert frame.to_bgr().shape == (*size, 3)
    blue, green, red_level = frame.to_bgr()[size[0] // 2, size[1] // 2].tolist()
    assert red_level > 240
    assert max(blue, green) < 15


def test_frames_that_do_not_come_later_are_skipped_and_counted(tmp_path: Path) -> None:
    path = tmp_path / "v.mkv"  # its clock ticks in milliseconds: at 2 kHz every second frame falls on the one before
    write_video(path, pictures(8), rate_hz=2000, options={})
    source = open_video(path)
    times = [frame.t_us for frame in source]
    assert times == sorted(set(times))
    assert source.skipped_frames == 8 - len(times) > 0


def test_frames_are_prepared_in_order_by_the_decoders_thread(tmp_path: Path) -> None:
    path = tmp_path / "video.mp4"
    write_video(path, pictures(20))
    threads, source = [], open_video(path)

    def prepare(frame: Frame) -> Frame:
        threads.append(threading.current_thread().name)
        return replace(frame, t_us=frame.t_us + 1)

    assert [frame.t_us for frame in source.frames(prepare)] == [frame.t_us + 1 for frame in open_video(path)]
    assert threads == ["video-decoder"] * 20


def test_error_in_preparing_comes_after_the_frames_before_it(tmp_path: Path) -> None:
    path = tmp_path / "video.mp4"
    write_video(path, pictures(20))
    source = open_video(path)
    frames: list[Frame] = []

    def prepare(frame: Frame) -> Frame:
        if frame.index == 12:
            raise VideoError("frame 12: expected another size")
        return frame

    with pytest.raises(VideoError, match="frame 12"):
        frames.extend(source.frames(prepare))  # list.extend keeps what came before the error
    assert [frame.index for frame in frames] == list(range(12))


def test_consumer_that_stops_early_leaves_no_thread_behind(tmp_path: Path) -> None:
    write_video(tmp_path / "v.mp4", pictures(60))
    before = threading.active_count()
    for frame in open_video(tmp_path / "v.mp4"):
        if frame.index == 3:
            break
    assert threading.active_count() == before


@pytest.mark.parametrize(
    ("name", "content", "got"),
    [
        ("missing.mp4", None, "no such file"),
        ("empty.mp4", b"", "empty file"),
        ("words.mp4", b"these are words\n" * 100, "unreadable content"),
        ("words.txt", b"these are words\n" * 100, "tty"),
    ],
)
def test_what_is_no_video_is_refused(tmp_path: Path, name: str, content: bytes | None, got: str) -> None:
    if content is not None:
        (tmp_path / name).write_bytes(content)
    with pytest.raises(VideoError, match=rf"{name}.*expected a video.*got .*{got}"):
        open_video(tmp_path / name)


def test_folder_is_refused(tmp_path: Path) -> None:
    with pytest.raises(VideoError, match="expected a video file, got a folder"):
        open_video(tmp_path)


def test_sound_without_pictures_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "sound.wav"
    with av.open(str(path), "w") as container:
        stream = container.add_stream("pcm_s16le", rate=8000)
        sound = av.AudioFrame.from_ndarray(np.zeros((1, 800), np.int16), format="s16", layout="mono")
        sound.sample_rate = 8000
        container.mux(stream.encode(sound))
        container.mux(stream.encode(None))
    with pytest.raises(VideoError, match=r"expected a video stream, got .*audio"):
        open_video(path)


def test_file_without_its_header_is_refused(tmp_path: Path) -> None:
    write_video(tmp_path / "v.mp4", pictures(20))
    content, start = split_at_data(tmp_path / "v.mp4")
    (tmp_path / "cut.mp4").write_bytes(content[: start // 2])
    with pytest.raises(VideoError, match="unreadable content"):
        open_video(tmp_path / "cut.mp4")


def test_truncated_file_gives_every_whole_frame_then_says_where_it_breaks(tmp_path: Path) -> None:
    write_video(tmp_path / "v.mp4", pictures(40))
    content, start = split_at_data(tmp_path / "v.mp4")
    (tmp_path / "cut.mp4").write_bytes(content[: start + (len(content) - start) // 2])
    whole = [frame.luma.copy() for frame in open_video(tmp_path / "v.mp4")]
    frames, error = read_until_broken(tmp_path / "cut.mp4")
    assert 15 <= len(frames) <= 25
    assert all(np.array_equal(frame.luma, good) for frame, good in zip(frames, whole, strict=False))
    assert (error.frame_index, error.t_us) == (len(frames), frames[-1].t_us)
    assert "cut.mp4" in str(error)


def test_truncation_between_packets_is_noticed(tmp_path: Path) -> None:
    write_video(tmp_path / "v.mp4", pictures(40))
    with av.open(str(tmp_path / "v.mp4")) as container:
        packets = [packet for packet in container.demux(video=0) if packet.size]
        assert packets[12].pos is not None
        end = packets[12].pos
    (tmp_path / "cut.mp4").write_bytes((tmp_path / "v.mp4").read_bytes()[:end])
    frames, error = read_until_broken(tmp_path / "cut.mp4")
    assert len(frames) == error.frame_index == 12


@pytest.mark.parametrize("damage", ["zeros", "noise"])
def test_damage_in_the_middle_ends_the_video_there(tmp_path: Path, damage: str) -> None:
    write_video(tmp_path / "v.mp4", pictures(40))
    content, start = split_at_data(tmp_path / "v.mp4")
    middle, length = start + (len(content) - start) // 2, 6000
    rng = np.random.default_rng(3)
    patch = bytes(length) if damage == "zeros" else rng.integers(0, 256, length, dtype=np.uint8).tobytes()
    (tmp_path / "bad.mp4").write_bytes(content[:middle] + patch + content[middle + length :])
    whole = [frame.luma.copy() for frame in open_video(tmp_path / "v.mp4")]
    frames, error = read_until_broken(tmp_path / "bad.mp4")
    assert 10 <= len(frames) < 25
    # Damage that happens to be a valid picture is noticed one frame late.
    assert all(np.array_equal(frame.luma, good) for frame, good in zip(frames[:-1], whole, strict=False))
    assert error.frame_index == len(frames)


def test_frames_that_could_not_be_decoded_are_counted(tmp_path: Path) -> None:
    write_video(tmp_path / "v.mp4", pictures(30))
    flip_first_picture(tmp_path / "v.mp4")
    source = open_video(tmp_path / "v.mp4")
    assert len(list(source)) == 29
    assert (source.skipped_frames, source.damaged_frames, source.first_damage_us) == (1, 1, 0)
    assert source.damage == "1 frame could not be decoded, the first at 0.00 s"


def test_a_sound_video_has_no_damage(tmp_path: Path) -> None:
    write_video(tmp_path / "v.mp4", pictures(10))
    source = open_video(tmp_path / "v.mp4")
    assert len(list(source)) == 10
    assert (source.damaged_frames, source.first_damage_us, source.damage) == (0, None, "")
