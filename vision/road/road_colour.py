"""Which colour does the bare road have? The most frequent one, or that of the plain road around each place."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from vision.road.rectify import RoadCells

FloatArray = NDArray[np.float32]
BoolArray = NDArray[np.bool_]

# Colours this near to the most frequent one are plain road; around a place, that is their mean within so many widths of
# a car, if they fill this part of a squared width.
PLAIN_LEVELS = 14.0
AROUND_WIDTHS = 7.0
LEAST_PLAIN_WIDTHS2 = 0.5


class RoadColour:
    """Tells the usual colour of a road.

    Parameters
    ----------
    cells : the raster.
    car_cells : width of a car, about.
    """

    def __init__(self, cells: RoadCells, *, car_cells: float) -> None:
        self._cells = cells
        self._car_cells = car_cells
        self._road = cells.pack(cells.road.astype(np.uint8)) > 0

    def around(self, planes: FloatArray) -> FloatArray:
        """Find the usual colour around every cell.

        Parameters
        ----------
        planes : (3, packed_size) of a background.

        Returns
        -------
        (3, packed_size); the most frequent colour of all where there is no plain road around.
        """
        usual = usual_colour(planes, self._road)[:, None]
        result = np.repeat(usual, planes.shape[1], axis=1)
        is_plain = self._road & (np.abs(planes - usual).max(axis=0) <= PLAIN_LEVELS)
        weight = self._cells.unpack(is_plain.astype(np.uint8)).astype(np.float32)
        side = 2 * round(AROUND_WIDTHS * self._car_cells / 2) + 1
        count = self._packed(cv2.boxFilter(weight, -1, (side, side), normalize=False))
        is_enough = count >= LEAST_PLAIN_WIDTHS2 * self._car_cells**2
        for plane, target in zip(planes, result, strict=True):
            level = self._cells.unpack(np.rint(plane).astype(np.uint8)) * weight
            total = self._packed(cv2.boxFilter(level, -1, (side, side), normalize=False))
            target[is_enough] = total[is_enough] / count[is_enough]
        return result

    def _packed(self, values: cv2.typing.MatLike) -> FloatArray:
        return np.concatenate([values[strip.area.slices].ravel() for strip in self._cells.strips])


def usual_colour(planes: FloatArray, road: BoolArray) -> FloatArray:
    """Find the most frequent level of the road in every plane.

    Parameters
    ----------
    planes : (3, n). road : (n,) which cells are road.

    Returns
    -------
    (3,).

    Examples
    --------
    >>> usual_colour(np.array([[100.0, 100.0, 30.0, 7.0]], np.float32), np.array([True, True, True, False])).tolist()
    [100.0]
    """
    return np.array([np.bincount(plane[road].astype(np.intp)).argmax() for plane in planes], np.float32)
