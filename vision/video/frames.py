"""Which picture was taken when? Frames of a video file with the decoder's own time stamps.

The planes are handed on as the decoder stores them (one full-size luma plane, two half-size chroma planes): turning
whole frames into BGR would cost more than sampling the road does. Decoding runs ahead of the consumer on its own
thread; a bounded hand-over keeps it from running away.
"""

from __future__ import annotations

import math
import threading
from collections import deque
from collections.abc import Callable, Generator, Iterator
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from vision.objects import ByteArray
from vision.video.frame import Frame
from vision.video.pace import Pace
from vision.video.recording import is_recording

if TYPE_CHECKING:
    from vision.video.decoding import VideoHeader

__all__ = ["ByteArray", "Frame", "VideoSource", "open_video"]

FRAMES_AHEAD = 8
LEFT_OUT_KEPT = 10_000  # of frames that nobody asks for


class VideoSource:
    """The frames of one video file; every iteration reads it from the start.

    Attributes
    ----------
    path : the file, as given.
    width_px, height_px : size of a frame.
    rate_hz : average frame rate by the container; for information only, times come from time stamps.
    frame_count : number of frames by the container, None where it does not say.
    duration_us : length by the container, None where it does not say.
    first_pts_us : the time stamp in the file that counts as time 0; a player shows a frame at `t_us` plus this.
    codec : in FFmpeg's words.
    created_utc : when it was recorded by the container, None where it does not say.
    skipped_frames : frames of the latest iteration left out because they had no time stamp, did not come later than
        the one before, or came damaged before the first good one.
    damaged_frames, first_damage_us : how many of these came damaged, and the time of the first (None if it has none).
    left_out : (index, t_us) of the frames that were decoded and not looked at, until they are taken; the last ones.
    """

    def __init__(self, header: VideoHeader) -> None:
        self.path = header.path
        self.width_px = header.width_px
        self.height_px = header.height_px
        self.rate_hz = header.rate_hz
        self.frame_count = header.frame_count
        self.duration_us = header.duration_us
        self.first_pts_us = header.start_us
        self.codec = header.codec
        self.created_utc = header.created_utc
        self.skipped_frames = self.damaged_frames = 0
        self.first_damage_us: int | None = None
        self.left_out = deque[tuple[int, int]](maxlen=LEFT_OUT_KEPT)
        self._header = header

    @property
    def damage(self) -> str:
        """Say in words what the latest iteration could not decode; empty if nothing."""
        if self.damaged_frames == 0:
            return ""
        first = "without a time stamp" if self.first_damage_us is None else f"at {self.first_damage_us / 1e6:.2f} s"
        frames = "1 frame" if self.damaged_frames == 1 else f"{self.damaged_frames} frames"
        return f"{frames} could not be decoded, the first {first}"

    def __iter__(self) -> Iterator[Frame]:
        """Decode the file once, in order; as `frames` without preparation."""
        return self.frames()

    def frames(
        self, prepare: Callable[[Frame], Frame] | None = None, *, rate_hz: float = math.inf, from_us: int = 0
    ) -> Generator[Frame]:
        """Decode the file once, in order.

        Parameters
        ----------
        prepare : what the decoder's thread does to every frame before it hands it over; work that needs no earlier
            frame runs beside the consumer's there.
        rate_hz : so many frames a second are enough, see `vision.video.pace`; the others are only decoded.
        from_us : begins with the frame that is shown then, see `decoding.decode_from`; what is left out is not counted.

        Yields
        ------
        Frames with strictly increasing `t_us`.

        Raises
        ------
        VideoBroken
            After the last good frame, where the rest of the file cannot be read.
        """
        hand_over = _HandOver(FRAMES_AHEAD)
        read = partial(self._read, hand_over, prepare, Pace(rate_hz, self.rate_hz), from_us)
        reader = threading.Thread(target=read, name="video-decoder", daemon=True)
        reader.start()
        try:
            while (item := hand_over.take()) is not None:
                if isinstance(item, BaseException):
                    raise item
                yield item
        finally:
            # A consumer that stops early closes this generator: the decoder must not wait for room for ever.
            hand_over.close()
            reader.join()

    def frame_at(self, t_us: int) -> Frame | None:
        """Decode the frame that is shown at a time, from the key picture before it on; see `decoding.frame_at`."""
        from vision.video.decoding import frame_at

        return frame_at(self._header, t_us)

    def take_left_out(self, before_us: float = math.inf) -> list[tuple[int, int]]:
        """Take (index, t_us) of the frames before a time that were not looked at, once each, in order."""
        taken = []
        while self.left_out and self.left_out[0][1] < before_us:
            taken.append(self.left_out.popleft())
        return taken

    def _read(self, hand_over: _HandOver, prepare: Callable[[Frame], Frame] | None, pace: Pace, from_us: int) -> None:
        from vision.video.decoding import Skipped, decode, decode_from, decode_recording

        self.skipped_frames = self.damaged_frames = 0
        self.first_damage_us = None
        self.left_out.clear()
        try:
            whole = decode_recording if is_recording(Path(self.path)) else decode
            for picture in decode_from(self._header, from_us) if from_us > 0 else whole(self._header):
                if isinstance(picture, Skipped):
                    self.skipped_frames += 1
                    if picture.is_damaged:
                        self.first_damage_us = self.first_damage_us if self.damaged_frames else picture.t_us
                        self.damaged_frames += 1
                elif not pace.takes(picture.t_us):
                    self.left_out.append((picture.index, picture.t_us))
                elif not hand_over.put(prepare(picture) if prepare else picture):
                    return
        except BaseException as error:  # (handed to the consumer's thread and raised there)
            hand_over.put(error)
        else:
            hand_over.put(None)


def open_video(path: Path | str) -> VideoSource:
    """Open a video file, or the recording of a live source, and read its header.

    Parameters
    ----------
    path : a file that FFmpeg can read; its first video stream is used. Or the folder of a recording, which may grow
        while it is read: frames come as they are sent then.

    Returns
    -------
    A source of frames; iterate over it.

    Raises
    ------
    VideoError
        If the file is missing, empty, not a video, or without a video stream.
    """
    from vision.video.decoding import read_header, read_recording_header

    folder = Path(path)
    return VideoSource(read_recording_header(folder) if is_recording(folder) else read_header(path))


class _HandOver:
    """Bounded queue between the decoder thread and one consumer that may leave at any moment.

    `queue.Queue` has no way to wake a producer that waits for room once nobody takes any more.
    """

    def __init__(self, capacity: int) -> None:
        self._items: deque[Frame | BaseException | None] = deque()
        self._capacity = capacity
        self._changed = threading.Condition()
        self._is_closed = False

    def put(self, item: Frame | BaseException | None) -> bool:
        """Wait for room and add an item; False, at once, when the consumer has left."""
        with self._changed:
            self._changed.wait_for(lambda: self._is_closed or len(self._items) < self._capacity)
            if self._is_closed:
                return False
            self._items.append(item)
            self._changed.notify_all()
            return True

    def take(self) -> Frame | BaseException | None:
        """Wait for an item and remove it."""
        with self._changed:
            self._changed.wait_for(lambda: len(self._items) > 0)
            item = self._items.popleft()
            self._changed.notify_all()
            return item

    def close(self) -> None:
        """Drop what waits and refuse what comes."""
        with self._changed:
            self._is_closed = True
            self._items.clear()
            self._changed.notify_all()
