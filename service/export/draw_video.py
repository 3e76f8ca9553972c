"""Where do drawn frames go? A log's overlay on its video, or on a piece of it, as a new video or as one picture."""

from collections.abc import Iterable, Iterator
from contextlib import closing
from fractions import Fraction
from itertools import dropwhile, takewhile
from pathlib import Path

import av
import cv2
import numpy as np

from gis.cameras.camera import GroundCamera
from service.errors import ExportError, InputError, LogError, NotInLogError
from service.export.drawing import EVENT_LINGER_US, TRAIL_US, Overlay, OverlayReader, draw_overlay
from service.export.events import SHORTEST_SHOWN_US
from service.export.tracks import END, Views
from service.questions.events.notes import covered
from service.questions.events.queries import EventFilter, decode_event, find_event, iterate_events
from service.records.runs import CameraRecord, RunRecord
from service.records.seen import Drawing
from service.records.times import TimePoint, format_media
from service.store.log import EventLog
from vision.objects import ByteArray
from vision.video.frames import Frame, VideoSource, open_video

USUAL = Drawing()
Window = tuple[int, int | None]
"""From when, and to when, excluded; None is to the end."""
MICROSECOND = Fraction(1, 1_000_000)
_SOUGHT_IN = {"crf": "20", "preset": "veryfast", "g": "25", "bf": "0"}
"""A key picture in every second, and none that rests on a later one: players seek to the frame."""


def picture_at(log: EventLog, run: RunRecord, video: Path, t_us: int, drawing: Drawing = USUAL) -> ByteArray:
    """Give the frame that is shown at a time, with its overlay.

    Returns
    -------
    (h, w, 3) blue, green, red.

    Raises
    ------
    NotInLogError
        If no frame is shown at the time.
    LogError, InputError, VisionError
        If the log holds no camera for the video, or a file cannot be used.
    """
    source = open_video(video)
    frame = source.frame_at(t_us)
    if frame is None:
        expected = f"expected a time in its video, of which it covers {covered(log, run)}"
        raise NotInLogError(f"run {run.id!r}: {expected}, got {format_media(t_us)}")
    window_us = frame.t_us, frame.t_us + 1
    [(_, picture)] = _drawn(log, run, source, [frame], window_us, drawing=drawing)
    return picture


def event_window(log: EventLog, event_id: str, pad_us: int) -> tuple[RunRecord, tuple[int, int]]:
    """Say in which run an event is, and from when to when to look at it; what is shorter than a second takes one.

    Parameters
    ----------
    pad_us : so much before and behind it too.

    Raises
    ------
    NotInLogError
        If the log has no such event.
    ExportError
        If its run had no video.
    """
    text = find_event(log, event_id)
    if text is None:
        raise NotInLogError(f"event: expected the id of an event in this log, got {event_id!r}")
    event = decode_event(text)
    run = log.run(event.run)
    if run.input_kind != "video":
        raise ExportError(f"event {event_id!r}: expected one of a run on a video, got one on {run.input!r}")
    return run, (max(0, event.start_us - pad_us), max(event.end_us, event.start_us + SHORTEST_SHOWN_US) + pad_us)


def write_video(
    log: EventLog, run: RunRecord, video: Path, out: Path, window_us: Window, *, drawing: Drawing = USUAL
) -> None:
    """Write the frames of a window `[from, to)` with their overlay as H.264, with their own time stamps.

    Raises
    ------
    LogError, VisionError, InputError
        If the log holds no camera for the video, no frame lies in the window, or a file cannot be used.
    """
    source = open_video(video)
    with closing(source.frames(from_us=window_us[0])) as frames:
        drawn = _drawn(log, run, source, frames, window_us, drawing=drawing)
        first = next(drawn, None)
        if first is None:
            raise InputError(f"{video}: expected frames from {window_us[0]} us on, got none")
        try:
            container = av.open(str(out), "w", options={"movflags": "faststart"})
        except OSError as error:
            raise InputError(f"{out}: expected a path that can be written, got {error.strerror}") from error
        with container:
            stream = container.add_stream("libx264", rate=Fraction(25), options=_SOUGHT_IN)
            # An odd side cannot be halved for chroma: the last row or column is left out.
            stream.height, stream.width = (side_px // 2 * 2 for side_px in first[1].shape[:2])
            stream.pix_fmt, stream.codec_context.time_base = "yuv420p", MICROSECOND
            for t_us, picture in (first, *drawn):
                cut = np.ascontiguousarray(picture[: stream.height, : stream.width])
                frame = av.VideoFrame.from_ndarray(cut, format="bgr24")
                frame.pts, frame.time_base = t_us - first[0], MICROSECOND
                container.mux(stream.encode(frame))
            container.mux(stream.encode(None))


def _drawn(
    log: EventLog, run: RunRecord, source: VideoSource, frames: Iterable[Frame], window_us: Window, *, drawing: Drawing
) -> Iterator[tuple[int, ByteArray]]:
    """Draw those of some frames, in order, that lie in a window: their times and pictures."""
    (from_us, to_us), width_px = window_us, drawing.width_px
    begun = dropwhile(lambda one: one.t_us < from_us, frames)
    inside = takewhile(lambda one: to_us is None or one.t_us < to_us, begun)
    if drawing.overlay == "none":
        yield from ((one.t_us, _narrowed(one.to_bgr(), width_px)) for one in inside)
        return
    looked = _overlays(log, run, _camera(run, source), inside, from_us=from_us, to_us=to_us)
    for frame, seen, view in looked:
        picture = _narrowed(frame.to_bgr(), width_px)
        scale = picture.shape[1] / source.width_px
        yield frame.t_us, draw_overlay(picture, seen, view, scale=scale, is_named=drawing.overlay == "symbols")


def _narrowed(picture: ByteArray, width_px: int | None) -> ByteArray:
    """Make a picture that is wider smaller."""
    scale = 1.0 if width_px is None else width_px / picture.shape[1]
    if scale >= 1.0:
        return picture
    size_px = max(1, round(picture.shape[1] * scale)), max(1, round(picture.shape[0] * scale))
    return np.asarray(cv2.resize(picture, size_px, interpolation=cv2.INTER_AREA), np.uint8)


def _overlays(
    log: EventLog, run: RunRecord, camera: CameraRecord, frames: Iterable[Frame], *, from_us: int, to_us: int | None
) -> Iterator[tuple[Frame, Overlay, GroundCamera | None]]:
    """Give frames of [from_us, to_us) with what is drawn on each, and how the camera looked; None if unknown."""
    end = None if to_us is None else TimePoint(to_us, "media")
    near = EventFilter(runs=(run.id,), from_=TimePoint(from_us - EVENT_LINGER_US, "media"), to=end)
    events = [decode_event(text) for text in iterate_events(log, near)]
    reader = OverlayReader(log.states(run.id, from_us=from_us - TRAIL_US, to_us=to_us), events)
    views = Views(camera, log.views(run.id))
    # Where the run looked long before, cars have no rows that are drawn either.
    looked = log.frames(run.id, from_us=from_us - TRAIL_US, to_us=to_us)
    (_, looked_us), (_, next_us) = next(looked, END), next(looked, END)
    for frame in frames:
        while next_us <= frame.t_us:
            looked_us, (_, next_us) = next_us, next(looked, END)
        yield frame, reader.at(frame.t_us, looked_us=looked_us), views.at(frame.t_us)


def _camera(run: RunRecord, video: VideoSource) -> CameraRecord:
    """Give the camera of a run, if a video is that of the run."""
    camera = run.camera
    if camera is None:
        raise LogError(f"run {run.id!r}: expected one on a video, got one on {run.input!r}")
    expected, came = f"{camera.width_px} x {camera.height_px}", f"{video.width_px} x {video.height_px}"
    if expected != came:
        raise InputError(f"{video.path}: expected the video of the run, {expected} pixels, got {came}")
    return camera
