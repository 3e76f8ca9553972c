"""What do the first seconds of a video tell before it is processed? If the camera moves, and pictures for a scale."""

from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace

import cv2
import numpy as np

from vision.errors import VideoBroken
from vision.objects import ByteArray
from vision.registration.registration import Registration
from vision.registration.settings import RegistrationSettings
from vision.registration.watch import MovementWatch
from vision.settings import VisionSettings
from vision.video.frame import Frame
from vision.video.frames import VideoSource

STEP_US = 500_000


@dataclass(frozen=True, slots=True)
class FirstLook:
    """What was seen.

    Attributes
    ----------
    moves_from_us : when it was noticed that the camera moves; None if it stands.
    pictures : luma, one every half second, each as seen from where the first one was taken.
    """

    moves_from_us: int | None
    pictures: list[ByteArray]


def first_look(video: VideoSource, settings: VisionSettings, *, span_us: int, least_px: float) -> FirstLook:
    """Look at the first seconds of a video that can be read again.

    Parameters
    ----------
    span_us : that long.
    least_px : a smaller shift of the picture is none.
    """
    size_px = video.width_px, video.height_px
    watch = MovementWatch(size_px, settings.registration, least_px=least_px)
    moves_from_us: int | None = None
    kept, first_us, due_us = [], None, 0
    # Where the video breaks the run itself will say so.
    for frame in _unbroken(video):
        first_us = frame.t_us if first_us is None else first_us
        since_us = frame.t_us - first_us
        if since_us > span_us:
            break
        if watch.look(frame) and moves_from_us is None:
            moves_from_us = frame.t_us
        if since_us >= due_us:
            kept.append(replace(frame, luma=frame.luma.copy()))
            due_us = since_us + STEP_US
    if moves_from_us is None:
        return FirstLook(None, [frame.luma for frame in kept])
    return FirstLook(moves_from_us, _straightened(kept, size_px, settings.registration))


def _unbroken(video: VideoSource) -> Iterator[Frame]:
    with suppress(VideoBroken):
        yield from video


def _straightened(frames: Sequence[Frame], size_px: tuple[int, int], settings: RegistrationSettings) -> list[ByteArray]:
    """Draw pictures as seen from where the first one was taken, as far as all of them show the same."""
    motion = Registration(np.eye(3), size_px, settings)
    seen = whole = np.full((size_px[1], size_px[0]), 255, np.uint8)
    straight: list[ByteArray] = []
    for frame in frames:
        matrix = motion.locate(frame, ())
        if matrix is not None:
            back = np.linalg.inv(matrix)
            straight.append(np.asarray(cv2.warpPerspective(frame.luma, back, size_px), np.uint8))
            shown = cv2.warpPerspective(whole, back, size_px, flags=cv2.INTER_NEAREST)
            seen = np.asarray(cv2.min(seen, shown), np.uint8)
    is_seen = cv2.erode(seen, np.ones((3, 3), np.uint8), borderType=cv2.BORDER_CONSTANT, borderValue=(0,)) > 0
    return [np.where(is_seen, luma, straight[0]) for luma in straight]
