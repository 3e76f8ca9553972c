"""What is one picture of a video? Its place, its time, and its planes as the decoder stores them."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

ByteArray = NDArray[np.uint8]


@dataclass(frozen=True, slots=True)
class Frame:
    """One picture: its place in the video, its time, its planes (4:2:0, 8 bits, read only).

    Attributes
    ----------
    index : 0, 1, 2... over the frames handed out.
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
