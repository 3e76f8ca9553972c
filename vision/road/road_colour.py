"""Which colour does the bare road have? The most frequent one, or that of the plain road around each place."""

import cv2
import numpy as np
from numpy.typing import NDArray

from vision.road.rectify import RoadCells, Window
from vision.road.settings import RoadSettings

FloatArray = NDArray[np.float32]


class RoadColour:
    """Tells the usual colour of a road.

    Parameters
    ----------
    cells : the raster.
    settings : of this room.
    car_cells : width of a car, about.

    Attributes
    ----------
    cells, car_cells : as given.
    road : (packed_size,) the cells that were road at first.
    """

    def __init__(self, cells: RoadCells, settings: RoadSettings, *, car_cells: float) -> None:
        self.cells = cells
        self.car_cells = car_cells
        self.road = cells.pack(cells.road)
        self._reach = round(settings.plain_around_widths * car_cells / 2)
        self._plain_levels = settings.plain_levels
        self._least_plain = settings.least_plain_widths2 * car_cells**2

    def around(self, planes: FloatArray) -> FloatArray:
        """Find the usual colour around every cell.

        Parameters
        ----------
        planes : (3, packed_size) of a background.

        Returns
        -------
        (3, packed_size); the most frequent colour of all where there is no plain road around.
        """
        cells = self.around_in(planes, self.cells.whole, self.usual(planes))
        return np.concatenate([cells[:, *strip.area.slices].reshape(3, -1) for strip in self.cells.strips], axis=1)

    def around_in(self, planes: FloatArray, window: Window, usual: FloatArray) -> FloatArray:
        """Find the usual colour around the cells of a window; nothing else is computed.

        Parameters
        ----------
        planes : (3, packed_size) of a background.
        window : of the raster.
        usual : (3,) the most frequent colour of all.

        Returns
        -------
        (3, rows, columns) as `around`.
        """
        reach = self._reach
        rows, columns = (_widened(one, reach, size) for one, size in zip(window, self.cells.grid.shape, strict=True))
        near, inner = (rows[0], columns[0]), (rows[1], columns[1])
        colours = self.cells.window(planes, near)
        is_plain = np.abs(colours - usual[:, None, None]).max(axis=0) <= self._plain_levels
        weight = (self.cells.window(self.road, near) & is_plain).astype(np.float32)
        count, *totals = (
            cv2.boxFilter(levels, -1, (2 * reach + 1, 2 * reach + 1), normalize=False)[inner]
            for levels in (weight, *(np.rint(colours).astype(np.uint8) * weight))
        )
        is_enough = count >= self._least_plain
        mean = np.stack(totals) / np.maximum(count, 1)
        return np.where(is_enough, mean, usual[:, None, None]).astype(np.float32)

    def usual(self, planes: FloatArray) -> FloatArray:
        """Find the most frequent level of the road in every plane, (3,)."""
        cells = np.flatnonzero(self.road)
        return np.array([np.bincount(plane.take(cells).astype(np.intp)).argmax() for plane in planes], np.float32)


def _widened(one: slice, reach: int, size: int) -> tuple[slice, slice]:
    """Widen a range of cells as far as there are any; returns that, and where the range lies in it."""
    start = max(one.start - reach, 0)
    return slice(start, min(one.stop + reach, size)), slice(one.start - start, one.stop - start)
