"""What is one picture of a video, and which one of a second video goes with it? Its place, its time, its planes."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import cv2
import numpy as np

from vision.objects import ByteArray


@dataclass(frozen=True, slots=True)
class Frame:
    """One picture: its place in the video, its time, its planes (4:2:0, 8 bits, read only).

    Attributes
    ----------
    index : 0, 1, 2... over the frames of the video, those included that are not looked at.
    t_us : the decoder's time stamp.
    luma : (h, w).
    chroma_u, chroma_v : (ceil(h / 2), ceil(w / 2)); 128 is colourless.
    """

    index: int
    t_us: int
    luma: ByteArray
    chroma_u: ByteArray
    chroma_v: ByteArray

    def to_bgr(self) -> ByteArray:
        """Convert the whole picture to colours, for drawing.

        Returns
        -------
        (h, w, 3), blue, green, red.

        Examples
        --------
        >>> grey = np.full((2, 4), 128, np.uint8)
        >>> half = np.full((1, 2), 128, np.uint8)
        >>> Frame(index=0, t_us=0, luma=grey, chroma_u=half, chroma_v=half).to_bgr()[0, 0].tolist()
        [130, 130, 130]
        """
        height, width = self.luma.shape
        even_luma = np.pad(self.luma, ((0, height % 2), (0, width % 2)), mode="edge")
        planes = [even_luma.ravel(), self.chroma_u.ravel(), self.chroma_v.ravel()]
        stacked = np.concatenate(planes).reshape(even_luma.shape[0] * 3 // 2, even_luma.shape[1])
        return np.asarray(cv2.cvtColor(stacked, cv2.COLOR_YUV2BGR_I420), np.uint8)[:height, :width]


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
        self._step_us = 0
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
        # Two frames tell how far they are apart.
        while not self._is_at_end and (self._before is None or self._after is None or self._after.t_us < t_us):
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
