"""What does the camera's sensor add to the picture? Light that drifts, blur by vibration, noise: on the luma plane.

Noise is cut from a stock of noise pictures at random places, which costs less than drawing it anew.
"""

import math

import cv2
import numpy as np
from numpy.typing import NDArray

from data_gen.simulation.states import ByteArray, FloatArray

NOISE_SIGMA = 1.8
"""Standard deviation of a good sensor in daylight, in steps of luma."""

_STOCK = 6
_MARGIN_PX = 64
_SIGMAS_IN_RANGE = 5


class Sensor:
    """Turns a clean luma plane into one as recorded.

    Parameters
    ----------
    size_px : width and height of the image.
    noise_sigma : standard deviation of the noise, in steps of luma.
    rng : source of the noise; consumed further by each frame.
    """

    def __init__(self, size_px: tuple[int, int], *, noise_sigma: float, rng: np.random.Generator) -> None:
        self._size_px = size_px
        self._zero = min(127, max(16, math.ceil(_SIGMAS_IN_RANGE * noise_sigma)))
        self._stock = _noise_stock(size_px, noise_sigma, self._zero, rng)
        self._rng = rng

    def expose(self, luma: ByteArray, *, gain: float, blur_px: FloatArray | None = None) -> None:
        """Record one frame.

        Parameters
        ----------
        luma : (h, w), changed in place.
        gain : brightness of the scene, about 1.
        blur_px : (2,), how far the image moves right and down during the exposure; none without.
        """
        width_px, height_px = self._size_px
        if blur_px is not None and np.abs(blur_px).max() > 0.05:
            columns, rows = (_smear(float(length_px)) for length_px in blur_px)
            cv2.sepFilter2D(luma, -1, columns, rows, dst=luma)
        cv2.LUT(luma, _light_table(gain, self._zero), dst=luma)
        stock, left, top = self._rng.integers((_STOCK, _MARGIN_PX, _MARGIN_PX))
        cv2.add(luma, self._stock[stock][top : top + height_px, left : left + width_px], dst=luma)


def _smear(length_px: float) -> NDArray[np.float32]:
    """Give three weights with the variance of a smear of some length, at most 2 px: a**2 / 12 each way."""
    side = min(length_px**2 / 12, 1 / 3) / 2
    return np.array([side, 1 - 2 * side, side], dtype=np.float32)


def _light_table(gain: float, noise_zero: int) -> ByteArray:
    """Map luma to luma under a gain, less the zero of the noise stock that is added next."""
    lit = 16 + (np.arange(256) - 16) * gain - noise_zero
    return np.clip(np.round(lit), 0, 255).astype(np.uint8)


def _noise_stock(size_px: tuple[int, int], sigma: float, zero: int, rng: np.random.Generator) -> tuple[ByteArray, ...]:
    shape = (size_px[1] + _MARGIN_PX, size_px[0] + _MARGIN_PX)
    stock = (zero + sigma * rng.standard_normal(shape, dtype=np.float32) for _ in range(_STOCK))
    return tuple(np.clip(np.round(noise), 0, 2 * zero).astype(np.uint8) for noise in stock)
