"""Where do drawn frames go? A log's overlay on its video, as a new video or as one picture."""

from collections.abc import Iterator
from fractions import Fraction
from pathlib import Path

import av
import cv2
import numpy as np

from service.errors import InputError, LogError
from service.export.drawing import TRAIL_US, OverlayReader, draw_overlay
from service.export.tracks import Views
from service.questions.queries import EventFilter, decode_event, iterate_events
from service.records import CameraRecord
from service.store.databases.location import log_files
from service.store.log import open_log
from vision.objects import ByteArray
from vision.video.frames import Frame, open_video

MICROSECOND = Fraction(1, 1_000_000)
END = (0, 1 << 62)  # of the frames that a run looked at


def draw_picture(video: Path, log_url: str, out: Path, *, at_us: int, run: str | None = None) -> None:
    """Write the first frame at or after a time, with its overlay, as a picture.

    Raises
    ------
    LogError, InputError, VisionError
        If the log holds no camera for the video, the video ends before the time, or a file cannot be used.
    """
    _check_target(out, video, *log_files(log_url))
    for _, picture in _drawn_frames(video, log_url, from_us=at_us, to_us=None, run=run):
        if not cv2.imwrite(str(out), picture):
            raise InputError(f"{out}: expected a path that can be written, got a refusal")
        return
    raise InputError(f"{video}: expected a frame at or after {at_us} us, got the end of the video")


def draw_video(
    video: Path, log_url: str, out: Path, *, from_us: int = 0, to_us: int | None = None, run: str | None = None
) -> None:
    """Write the frames of `[from_us, to_us)` with their overlay as H.264, with their own time stamps.

    Raises
    ------
    LogError, VisionError, InputError
        If the log holds no camera for the video, no frame lies in the interval, or a file cannot be used.
    """
    _check_target(out, video, *log_files(log_url))
    drawn = _drawn_frames(video, log_url, from_us=from_us, to_us=to_us, run=run)
    first = next(drawn, None)
    if first is None:
        raise InputError(f"{video}: expected frames from {from_us} us on, got none")
    height_px, width_px = first[1].shape[:2]
    try:
        container = av.open(str(out), "w", options={"movflags": "faststart"})
    except OSError as error:
        raise InputError(f"{out}: expected a path that can be written, got {error.strerror}") from error
    with container:
        stream = container.add_stream("libx264", rate=Fraction(25), options={"crf": "20", "preset": "veryfast"})
        # An odd side cannot be halved for chroma: the last row or column is left out.
        stream.width, stream.height, stream.pix_fmt = width_px // 2 * 2, height_px // 2 * 2, "yuv420p"
        stream.codec_context.time_base = MICROSECOND
        for t_us, picture in (first, *drawn):
            cut = np.ascontiguousarray(picture[: stream.height, : stream.width])
            frame = av.VideoFrame.from_ndarray(cut, format="bgr24")
            frame.pts, frame.time_base = t_us - first[0], MICROSECOND
            container.mux(stream.encode(frame))
        container.mux(stream.encode(None))


def _check_target(out: Path, *used: Path) -> None:
    """Refuse to write where nothing can be written, or over what is being read."""
    if any(out.exists() and one.exists() and out.samefile(one) for one in used):
        raise InputError(f"{out}: expected a new file, got one that is being read")
    if not out.parent.is_dir() or out.is_dir():
        raise InputError(f"{out}: expected a file in an existing folder, got another path")


def _drawn_frames(
    video: Path, log_url: str, *, from_us: int, to_us: int | None, run: str | None
) -> Iterator[tuple[int, ByteArray]]:
    with open_log(log_url) as log:
        record = log.run(run)
        if record.camera is None:
            raise LogError(f"log {log_url!r}: expected a run on a video, got one on {record.input!r}")
        events = [decode_event(text) for text in iterate_events(log, EventFilter(runs=(record.id,)))]
        reader = OverlayReader(log.states(record.id, from_us=from_us - TRAIL_US, to_us=to_us), events)
        views = Views(record.camera, log.views(record.id))
        lens, frames = record.camera.lens, log.frames(record.id)
        (_, looked_us), (_, next_us) = next(frames, END), next(frames, END)
        for frame in _frames(video, record.camera):
            while next_us <= frame.t_us:
                looked_us, (_, next_us) = next_us, next(frames, END)
            if to_us is not None and frame.t_us >= to_us:
                return
            if frame.t_us >= from_us:
                numbers = views.at(frame.t_us)
                view = None if numbers is None else np.array(numbers).reshape(3, 3)
                yield frame.t_us, draw_overlay(frame.to_bgr(), reader.at(frame.t_us, looked_us=looked_us), view, lens)


def _frames(video: Path, camera: CameraRecord) -> Iterator[Frame]:
    source = open_video(video)
    if (source.width_px, source.height_px) != (camera.width_px, camera.height_px):
        expected, came = f"{camera.width_px} x {camera.height_px}", f"{source.width_px} x {source.height_px}"
        raise InputError(f"{video}: expected the video of the run, {expected} pixels, got {came}")
    yield from source
