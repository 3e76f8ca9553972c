"""Which part of the image did something touch? Rectangles on even pixels, as the chroma planes need them."""

from dataclasses import dataclass

import numpy as np

from data_gen.simulation.states import FloatArray


@dataclass(frozen=True, slots=True)
class Rectangle:
    """A part of the image; all edges are even."""

    left: int
    top: int
    right: int
    bottom: int

    @property
    def window(self) -> tuple[slice, slice]:
        """Rows and columns."""
        return slice(self.top, self.bottom), slice(self.left, self.right)

    @property
    def size_px(self) -> tuple[int, int]:
        """Width and height."""
        return self.right - self.left, self.bottom - self.top


def rectangle_around(points_px: FloatArray, size_px: tuple[int, int], *, margin_px: float = 0.0) -> Rectangle | None:
    """Give the part of the image around points.

    Parameters
    ----------
    points_px : (n, 2).
    size_px : width and height of the image, both even.
    margin_px : added on all sides.

    Returns
    -------
    The smallest rectangle on even pixels that holds the points' pixels; None if it lies outside the image.

    Examples
    --------
    >>> rectangle_around(np.array([[3.2, 5.0], [8.9, 6.0]]), (64, 64))
    Rectangle(left=2, top=4, right=10, bottom=8)
    """
    low, high = points_px.min(axis=0) - margin_px, points_px.max(axis=0) + margin_px
    if not (np.isfinite(low).all() and np.isfinite(high).all()):
        return None
    left, top = (max(0, int(np.floor(edge)) & ~1) for edge in low)
    right, bottom = (min(size, (int(np.floor(edge)) + 2 + 1) & ~1) for size, edge in zip(size_px, high, strict=True))
    return Rectangle(left, top, right, bottom) if left < right and top < bottom else None
