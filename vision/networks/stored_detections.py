"""What did somebody else's detector find? Detections from a file, joined to the times of a video or standing alone.

Two forms are read. MOT text: ``frame,left,top...`` without a header, frames counted from 1. CSV with a header: boxes in
pixels, upright or oriented, or on the ground in metres. docs/detectors.md lists the columns. Names of tracks in a file
are not looked at: detections are what is read.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from vision.networks.box_detector import GroundBoxes, ImageBoxes, Instant
from vision.networks.settings import NetworkSettings
from vision.objects import Int64Array


@dataclass(frozen=True, slots=True)
class StoredInstant:
    """A moment of a file that stands alone."""

    index: int
    t_us: int


class StoredDetections:
    """Detections of a whole file, by frame or by time.

    Parameters
    ----------
    keys : (n,) ascending: number of the frame from 0, or time in microseconds.
    boxes : n, in the same order.
    is_by_frame : what the keys are.
    settings : how a gap is told, and a usual step between moments.
    """

    def __init__(
        self,
        keys: Int64Array,
        boxes: ImageBoxes | GroundBoxes,
        *,
        is_by_frame: bool,
        settings: NetworkSettings | None = None,
    ) -> None:
        settings = settings or NetworkSettings()
        self._boxes = boxes
        self.is_by_frame = is_by_frame
        self._keys, starts = np.unique(keys, return_index=True)
        self._bounds = np.append(starts, len(keys))
        steps = np.diff(self._keys)
        self._step_us = int(np.median(steps)) if len(steps) else settings.usual_step_us
        self._told_gap_us = settings.told_gap_us
        self._used = -1
        self._before_us: int | None = None

    def __len__(self) -> int:
        return len(self._boxes)

    @property
    def last_key(self) -> int:
        """The last frame or time; -1 if there is none."""
        return int(self._keys[-1]) if len(self._keys) else -1

    @property
    def is_on_ground(self) -> bool:
        """Whether the boxes are in metres."""
        return isinstance(self._boxes, GroundBoxes)

    def count_after(self, frame_count: int) -> int:
        """Count the detections, by frame, that lie past the end of a video of so many frames."""
        place = int(np.searchsorted(self._keys, frame_count))
        return len(self._boxes) - int(self._bounds[place])

    def detect(self, instant: Instant) -> ImageBoxes | GroundBoxes:
        """Look up what was found at an instant.

        Parameters
        ----------
        instant : later than at the call before.

        Returns
        -------
        The boxes of its frame; by time, those of the nearest time not farther away than half a step of file and video.
        """
        place = self._place(instant)
        if place is None:
            return self._rows(0, 0)
        self._used = place
        return self._rows(int(self._bounds[place]), int(self._bounds[place + 1]))

    def instants(self, rate_hz: float | None) -> Iterator[StoredInstant]:
        """List the moments of a file that stands alone.

        Parameters
        ----------
        rate_hz : frames in a second, for a file by frame; not looked at otherwise.

        Returns
        -------
        All frames up to the last one; by time, the times of the file and, in its gaps, some without detections.
        """
        if self.is_by_frame:
            assert rate_hz is not None, "a file by frame is opened with a rate"
            for index in range(self.last_key + 1):
                yield StoredInstant(index, round(index * 1e6 / rate_hz))
            return
        for index, t_us in enumerate(self._times_with_gaps()):
            yield StoredInstant(index, t_us)

    def _times_with_gaps(self) -> Iterator[int]:
        before_us: int | None = None
        for t_us in self._keys.tolist():
            if before_us is not None:
                end_us = min(t_us - self._step_us // 2, before_us + self._told_gap_us)
                yield from range(before_us + self._step_us, end_us, self._step_us)
            yield t_us
            before_us = t_us

    def _place(self, instant: Instant) -> int | None:
        key = instant.index if self.is_by_frame else instant.t_us
        after = int(np.searchsorted(self._keys, key))
        if self.is_by_frame:
            return after if after < len(self._keys) and self._keys[after] == key else None
        before_us, self._before_us = self._before_us, instant.t_us
        step_us = self._step_us if before_us is None else min(self._step_us, instant.t_us - before_us)
        around = [place for place in (after - 1, after) if self._used < place < len(self._keys)]
        near = [place for place in around if 2 * abs(int(self._keys[place]) - key) <= step_us]
        return min(near, key=lambda place: abs(int(self._keys[place]) - key), default=None)

    def _rows(self, start: int, end: int) -> ImageBoxes | GroundBoxes:
        return self._boxes.select(np.arange(start, end))
