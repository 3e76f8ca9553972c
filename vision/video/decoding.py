"""What does the file hold? Header checks and the decoding loop, on PyAV (FFmpeg).

Runs on the reader thread of `frames.VideoSource`. Damage is told apart from a clean end here: a container that
announces more than it delivers, a packet cut short and a picture the decoder had to invent all count as broken.
"""

from collections import deque
from collections.abc import Generator, Iterator
from contextlib import closing, suppress
from dataclasses import dataclass, replace
from datetime import datetime
from pathlib import Path

import av
import numpy as np
from av.container import InputContainer
from av.video.frame import VideoFrame
from av.video.stream import VideoStream

from vision.errors import VideoBroken, VideoError
from vision.objects import ByteArray
from vision.video.frame import Frame
from vision.video.recording import ConnectionBytes, connections, is_recording

# FFmpeg plays text files and single pictures as videos; nobody means that.
NOT_VIDEO_FORMATS = frozenset({"tty", "image2", "png_pipe", "jpeg_pipe", "bmp_pipe", "gif_pipe", "webp_pipe"})
CONTAINERS = "mov,mp4,m4a,3gp,3g2,mj2,matroska,webm,avi,mpegts,mpeg,asf,flv,mxf,ogg"
"""In which a video holds its own pictures; playlists and session descriptions lead to other files and hosts."""
PLANAR_420 = frozenset({"yuv420p", "yuvj420p"})
# AVI counts frames that it leaves empty; only a file cut short also ends before its announced duration.
MISSING_TAIL_FRAMES = 1.5
CLOCKLESS_YEAR = 1970
STEP_BACK_US = 1_000_000
"""How much earlier is looked for a key picture where there was none; twice as much each time."""
ANALYSED_US = 1_000_000
"""What of a recording is read before its first frame is given; FFmpeg takes five seconds if left to itself."""


@dataclass(frozen=True, slots=True)
class VideoHeader:
    """What the container says of its first video stream; see `frames.VideoSource`.

    `start_us` is the time stamp that counts as media time 0; recorders cut running streams, so it may be anything.
    """

    path: str
    stream_index: int
    start_us: int
    width_px: int
    height_px: int
    rate_hz: float
    frame_count: int | None
    duration_us: int | None
    codec: str
    created_utc: datetime | None


def read_header(path: Path | str) -> VideoHeader:
    """Read what a video file announces about itself.

    Parameters
    ----------
    path : the file.

    Returns
    -------
    Size, rate, counts of the first video stream.

    Raises
    ------
    VideoError
        If the file is missing, empty, not a video, or without a video stream.
    """
    with _open(path) as container:
        return _header(path, container)


def unfit(path: str) -> str:
    """Say why a file that somebody sent is no video that holds its own pictures; empty if it is one."""
    try:
        av.open(path, options={"format_whitelist": CONTAINERS}).close()
        read_header(path)
    except av.FFmpegError as error:
        return f"no container of a video ({error.strerror})"
    except VideoError as error:
        return str(error)
    return ""


def read_recording_header(folder: Path) -> VideoHeader:
    """Read what the first connection of a recording tells, waiting for it while the recording grows.

    Raises
    ------
    VideoError
        If there is no video in it.
    """
    for part, stream in connections(folder):
        with suppress(av.FFmpegError), _open_stream(stream) as container:
            header = _header(folder, container)
            return replace(header, start_us=0, frame_count=None, duration_us=None, created_utc=part.utc)
    raise VideoError(f"recording {str(folder)!r}: expected a video stream, got none that can be read")


def _header(path: Path | str, container: InputContainer) -> VideoHeader:
    if not _has_moving_pictures(container):
        raise VideoError(f"video {str(path)!r}: expected a video stream, got {_describe_streams(container)}")
    stream = _first_video(container)
    assert stream is not None
    if stream.codec_context is None or stream.width <= 0 or stream.height <= 0:
        raise VideoError(
            f"video {str(path)!r}: expected frames of a known size, got {stream.width!r} x {stream.height!r} px"
        )
    return VideoHeader(
        path=str(path),
        stream_index=stream.index,
        start_us=_stream_us(stream, stream.start_time) or 0,
        width_px=stream.width,
        height_px=stream.height,
        rate_hz=float(stream.average_rate or stream.guessed_rate or 0.0),
        frame_count=stream.frames or None,
        duration_us=_duration_us(container, stream),
        codec=stream.codec_context.name,
        created_utc=_created_utc(container),
    )


@dataclass(frozen=True, slots=True)
class Skipped:
    """A picture left out: without a time stamp, not later than the one before, or damaged before the first good one."""

    t_us: int | None
    is_damaged: bool


def decode(header: VideoHeader, *, from_us: int = 0) -> Generator[Frame | Skipped]:
    """Decode a video file once.

    Parameters
    ----------
    header : of the file, from `read_header`.
    from_us : begins with a key picture that should lie before, where the container can be sought in; `index` counts
        from there.

    Yields
    ------
    Frames with strictly increasing time stamps, and the pictures left out.

    Raises
    ------
    VideoBroken
        Where the file cannot be read on, after the last good frame.
    """
    index, last_us = 0, None
    with _open(header.path) as container:
        is_sought = _seek(container, header, from_us)
        pictures = _pictures(container, header)
        while True:
            try:
                picture = next(pictures)
            except StopIteration:
                return
            except (av.FFmpegError, _Damage) as error:
                reason = str(error) if isinstance(error, _Damage) else f"decoder error {error.strerror!r}"
                raise VideoBroken(path=header.path, t_us=last_us or 0, frame_index=index, reason=reason) from error
            # What is shown before a key picture rests on others that were passed over.
            if is_sought and (picture.is_corrupt or not picture.key_frame):
                continue
            is_sought = False
            t_us = _time_us(picture, header)
            # Damage before the first good picture mends itself, as in a stream cut between key frames.
            is_damaged = picture.is_corrupt and index == 0
            if t_us is None or is_damaged or (last_us is not None and t_us <= last_us):
                yield Skipped(t_us, is_damaged)
                continue
            yield _frame(picture, index=index, t_us=t_us)
            index, last_us = index + 1, t_us


def decode_from(header: VideoHeader, t_us: int) -> Generator[Frame]:
    """Decode from the frame that is shown at a time on, from the key picture before it where it can be sought.

    Yields
    ------
    The last frame not later than the time, and those behind it, as a pass from the start gives them, but for their
    index; from the first frame on for a time before it, and nothing after the last one.

    Raises
    ------
    VideoBroken
        If the file cannot be read up to there, or on.
    """
    for pictures, is_whole in _passes(header, t_us):
        frames = (one for one in pictures if isinstance(one, Frame))
        with closing(pictures):
            try:
                reached, is_certain = _reach(frames, t_us)
            except VideoBroken:
                if is_whole:
                    raise
                continue  # of what comes before there is nothing to go by
            if is_certain or is_whole:
                yield from reached
                yield from frames
                return


def frame_at(header: VideoHeader, t_us: int) -> Frame | None:
    """Decode the frame that is shown at a time: the first of `decode_from`.

    Returns
    -------
    None before the first frame, and after the last one.
    """
    with closing(decode_from(header, t_us)) as frames:
        shown = next(frames, None)
    return shown if shown is not None and shown.t_us <= t_us else None


def _passes(header: VideoHeader, t_us: int) -> Iterator[tuple[Generator[Frame | Skipped], bool]]:
    """Give passes that begin before a time, each earlier than the one before; the last one, which says so, is whole."""
    if is_recording(Path(header.path)):
        yield decode_recording(header), True
        return
    from_us, back_us = t_us, STEP_BACK_US
    while from_us > 0:
        yield decode(header, from_us=from_us), False
        from_us, back_us = from_us - back_us, 2 * back_us
    yield decode(header), True


def _reach(frames: Iterator[Frame], t_us: int) -> tuple[list[Frame], bool]:
    """Go on to a time.

    Returns
    -------
    The frame that is shown then, and the one behind it if that was needed to know; nothing if all end before. And
    whether it comes behind another one, or behind the end: the first frame of a pass may have the time of one before
    it, and then a whole pass leaves it out.
    """
    seen = deque[Frame](maxlen=3)
    for frame in frames:
        seen.append(frame)
        if frame.t_us >= t_us:
            reached = [*seen][-1 if frame.t_us == t_us else -2 :]
            return reached, len(seen) > len(reached)
    return [], len(seen) > 0


def decode_recording(header: VideoHeader) -> Generator[Frame | Skipped]:
    """Decode a recording once; what is damaged is left out, since a live source goes on after it.

    Parameters
    ----------
    header : from `read_recording_header`.

    Yields
    ------
    Frames with strictly increasing times, across all connections, and the pictures left out.

    Raises
    ------
    VideoBroken
        Where pictures of another size begin.
    """
    index, last_us = 0, -1
    for part, stream in connections(Path(header.path)):
        first_us: int | None = None
        for picture in _undamaged(stream):
            t_us = None if picture is None else _time_us(picture, header)
            if picture is None or t_us is None:
                yield Skipped(None, picture is None)
                continue
            first_us = t_us if first_us is None else first_us
            t_us += part.start_us - first_us
            size_px = picture.width, picture.height
            if size_px != (header.width_px, header.height_px):
                reason = f"pictures of {size_px[0]} x {size_px[1]} px"
                raise VideoBroken(path=header.path, t_us=max(last_us, 0), frame_index=index, reason=reason)
            if t_us <= last_us:
                yield Skipped(t_us, is_damaged=False)
                continue
            yield _frame(picture, index=index, t_us=t_us)
            index, last_us = index + 1, t_us


def _undamaged(bytes_: ConnectionBytes) -> Iterator[VideoFrame | None]:
    """Decode the pictures of a connection; None for each that could not be."""
    try:
        container = _open_stream(bytes_)
    except av.FFmpegError:  # cut before anything was told
        return
    with container:
        stream = _first_video(container)
        if stream is None:
            return
        stream.thread_type = "AUTO"
        packets = container.demux(stream)
        while True:
            try:
                pictures = next(packets).decode()
            except StopIteration:
                return
            except av.FFmpegError:
                yield None
                continue
            for picture in pictures:
                assert isinstance(picture, VideoFrame)
                yield None if picture.is_corrupt else picture


def _open_stream(bytes_: ConnectionBytes) -> InputContainer:
    return av.open(bytes_, "r", format="mpegts", options={"analyzeduration": str(ANALYSED_US)})


class _Damage(Exception):  # noqa: N818  (internal signal, turned into VideoBroken)
    """The stream goes on, but not as the container promised."""


def _open(path: Path | str) -> InputContainer:
    file = Path(path)
    if not file.is_file():
        what = "a folder" if file.is_dir() else "no such file"
        raise VideoError(f"video {str(path)!r}: expected a video file, got {what}")
    if file.stat().st_size == 0:
        raise VideoError(f"video {str(path)!r}: expected a video file, got an empty file (0 bytes)")
    try:
        return av.open(str(file))
    except (av.FFmpegError, OSError) as error:
        raise VideoError(
            f"video {str(path)!r}: expected a video file, got unreadable content ({error.strerror})"
        ) from error


def _has_moving_pictures(container: InputContainer) -> bool:
    return _first_video(container) is not None and not NOT_VIDEO_FORMATS & set(container.format.name.split(","))


def _first_video(container: InputContainer) -> VideoStream | None:
    # A cover picture in a sound file is a video stream too.
    streams = (s for s in container.streams.video if not s.disposition & av.stream.Disposition.attached_pic)
    return next(streams, None)


def _describe_streams(container: InputContainer) -> str:
    kinds = ", ".join(stream.type for stream in container.streams) or "no stream at all"
    return f"format {container.format.name!r} with {kinds}"


def _duration_us(container: InputContainer, stream: VideoStream) -> int | None:
    length_us = _stream_us(stream, stream.duration)
    return container.duration if length_us is None else length_us  # FFmpeg's unit for containers is the microsecond


def _created_utc(container: InputContainer) -> datetime | None:
    """Read when the recording was made; a camera without a clock says 1904 or 1970."""
    try:
        created = datetime.fromisoformat(container.metadata.get("creation_time", ""))
    except ValueError:
        return None
    return created if created.tzinfo is not None and created.year > CLOCKLESS_YEAR else None


def _stream_us(stream: VideoStream, ticks: int | None) -> int | None:
    return None if ticks is None or stream.time_base is None else round(ticks * stream.time_base * 1_000_000)


def _seek(container: InputContainer, header: VideoHeader, t_us: int) -> bool:
    """Go to a key picture before a time, or near it; False where the file is read from its start."""
    stream = container.streams[header.stream_index]
    if t_us <= 0 or stream.time_base is None:
        return False
    try:
        container.seek(int((t_us + header.start_us) / (1_000_000 * stream.time_base)), stream=stream)
    except av.FFmpegError:
        return False
    return True


def _pictures(container: InputContainer, header: VideoHeader) -> Iterator[VideoFrame]:
    """Decode pictures in display order; raise `_Damage` where the file stops being what its header says."""
    stream = container.streams[header.stream_index]
    assert isinstance(stream, VideoStream)
    stream.thread_type = "AUTO"
    packets, last_us, damage, is_started = 0, 0, None, False
    for packet in container.demux(stream):
        if packet.is_corrupt:
            damage = "a packet cut short"
            break
        packets += packet.size > 0
        last_us = max(last_us, (_stream_us(stream, packet.pts) or 0) - header.start_us)
        for picture in packet.decode():
            assert isinstance(picture, VideoFrame)
            if picture.is_corrupt and is_started:
                raise _Damage("a damaged picture")
            is_started |= not picture.is_corrupt
            yield picture
    if damage is not None:
        for picture in stream.decode(None):
            picture.time_base = stream.time_base  # PyAV sets it only on pictures that come out of a packet
            yield picture
    elif header.frame_count is not None and packets < header.frame_count and not _reaches_end(last_us, header):
        damage = f"the end of the file after {packets} of {header.frame_count} announced frames"
    if damage is not None:
        raise _Damage(damage)


def _reaches_end(last_us: int, header: VideoHeader) -> bool:
    if header.duration_us is None or header.rate_hz <= 0 or last_us <= 0:
        return False
    return last_us >= header.duration_us - MISSING_TAIL_FRAMES * 1_000_000 / header.rate_hz


def _time_us(picture: VideoFrame, header: VideoHeader) -> int | None:
    if picture.pts is None or picture.time_base is None:
        return None
    return round(picture.pts * picture.time_base * 1_000_000) - header.start_us


def _frame(picture: VideoFrame, *, index: int, t_us: int) -> Frame:
    if picture.format.name not in PLANAR_420:
        picture = picture.reformat(format="yuv420p")
    luma, chroma_u, chroma_v = (_plane(picture, i) for i in range(3))
    return Frame(index=index, t_us=t_us, luma=luma, chroma_u=chroma_u, chroma_v=chroma_v)


def _plane(picture: VideoFrame, index: int) -> ByteArray:
    """View one plane without copying; the array keeps the decoder's buffer alive."""
    plane = picture.planes[index]
    rows: ByteArray = np.frombuffer(memoryview(plane), np.uint8)
    view = rows[: plane.height * plane.line_size].reshape(plane.height, plane.line_size)[:, : plane.width]
    view.flags.writeable = False
    return view
