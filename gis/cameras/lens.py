"""How does a lens bend the picture? One number, which moves points along the rays from the picture's middle.

The division model of Fitzgibbon (2001, Simultaneous linear estimation of multiple view geometry and lens distortion,
equation 2): a pixel at the distance r from the middle is where a pinhole camera sees at r / (1 + radial r^2). We count
r in half diagonals of the picture. Both directions are closed forms, and what lies outside of the picture stays
outside, where the polynomial of Brown folds it back into it.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from gis.errors import GisError
from gis.polyline import FloatArray

# Beyond this the border of the picture is where no lens with one number puts it.
MAX_RADIAL = 0.8


@dataclass(frozen=True, slots=True)
class Lens:
    """A lens with radial distortion about the middle of its picture.

    Attributes
    ----------
    size_px : width and height of the picture.
    radial : strength, within [-0.8, 0.8]; below 0 straight lines bulge outwards, as with wide lenses.

    Raises
    ------
    GisError
        If the strength or the size is out of range.

    Examples
    --------
    >>> lens = Lens((641, 481), -0.2)
    >>> lens.straighten([[320.0, 240.0], [640.0, 480.0]]).round(1).tolist()
    [[320.0, 240.0], [719.7, 539.7]]
    >>> lens.bend(lens.straighten([[640.0, 480.0]])).round(9).tolist()
    [[640.0, 480.0]]
    """

    size_px: tuple[int, int]
    radial: float

    def __post_init__(self) -> None:
        if min(self.size_px) < 2:
            raise GisError(f"lens: expected a picture of at least 2 x 2 px, got {self.size_px!r}")
        if not abs(self.radial) <= MAX_RADIAL:
            raise GisError(f"lens: expected a radial of -{MAX_RADIAL} to {MAX_RADIAL}, got {self.radial!r}")

    def straighten(self, points_px: ArrayLike) -> FloatArray:
        """Move pixels to where a camera with a straight picture has them.

        Parameters
        ----------
        points_px : (..., 2).

        Returns
        -------
        (..., 2); nan for what is farther out than any light falls.
        """
        offset, middle = self._offset(points_px)
        divisor = 1 + self.radial * (offset**2).sum(axis=-1, keepdims=True)
        return np.asarray(middle + self._unit_px * offset / np.where(divisor > 0, divisor, np.nan))

    def bend(self, points_px: ArrayLike) -> FloatArray:
        """Move the pixels of a straight picture to where this lens shows them: the inverse of `straighten`."""
        offset, middle = self._offset(points_px)
        # Below 0 is the root where a lens with radial > 0 shows nothing: such points stay outside of the picture.
        with np.errstate(invalid="ignore"):
            root = np.sqrt(np.maximum(1 - 4 * self.radial * (offset**2).sum(axis=-1, keepdims=True), 0.0))
            return np.asarray(middle + self._unit_px * offset * 2 / (1 + root))

    def derivative(self, points_px: ArrayLike) -> FloatArray:
        """Differentiate `bend` at points (..., 2) of the straight picture: (..., 2, 2)."""
        offset, _ = self._offset(points_px)
        square = (offset**2).sum(axis=-1)[..., None, None]
        root = np.sqrt(np.maximum(1 - 4 * self.radial * square, 1e-12))
        outer = offset[..., :, None] * offset[..., None, :]
        return np.asarray(2 / (1 + root) * np.eye(2) + 8 * self.radial / (root * (1 + root) ** 2) * outer)

    @property
    def _unit_px(self) -> float:
        return float(np.hypot(*self.size_px)) / 2

    def _offset(self, points_px: ArrayLike) -> tuple[FloatArray, FloatArray]:
        middle = (np.array(self.size_px) - 1) / 2
        return (np.asarray(points_px, np.float64) - middle) / self._unit_px, middle
