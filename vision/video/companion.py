"""Which frame of a second video belongs to a frame of the first? The one nearest in time, if it is near enough."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from vision.video.frames import Frame

# Before two frames have been seen, their distance is a guess.
USUAL_STEP_US = 40_000


class Companion:
    """A second video, read along with the first one.

    Parameters
    ----------
    frames : in order of time, on the time line of the first video.
    """

    def __init__(self, frames: Iterable[Frame]) -> None:
        self._frames: Iterator[Frame] = iter(frames)
        self._before: Frame | None = None
        self._after: Frame | None = None
        self._step_us = USUAL_STEP_US
        self._is_at_end = False

    def at(self, t_us: int) -> Frame | None:
        """Find the frame of a moment.

        Parameters
        ----------
        t_us : later than at the call before.

        Returns
        -------
        The nearest frame not farther away than half the distance between two frames; None if there is none.
        """
        while not self._is_at_end and (self._after is None or self._after.t_us < t_us):
            self._advance()
        near = [one for one in (self._before, self._after) if one is not None]
        best = min(near, key=lambda frame: abs(frame.t_us - t_us), default=None)
        return best if best is not None and 2 * abs(best.t_us - t_us) <= self._step_us else None

    def _advance(self) -> None:
        frame = next(self._frames, None)
        if frame is None:
            self._is_at_end = True
            return
        if self._after is not None:
            # A hole in the second video must not stretch what counts as near.
            step_us = frame.t_us - self._after.t_us
            self._step_us = step_us if self._before is None else min(step_us, self._step_us * 5 // 4)
        self._before, self._after = self._after, frame
