"""Where are the cells of a raster? A regular grid on a plane: the ground in metres, or the image in pixels."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import cv2
import numpy as np

from vision.errors import VisionError
from vision.objects import BoolArray, ByteArray, FloatArray
from vision.road.cover import Rectangle

MAX_CELLS = 16_000_000
# Fractional bits of OpenCV's polygon corners.
POLYGON_BITS = 4


@dataclass(frozen=True, slots=True)
class Grid:
    """Square cells; integer (column, row) coordinates are cell centres.

    Attributes
    ----------
    first : (2,) position of the centre of cell (0, 0) on the plane.
    side : of a cell, in the plane's unit.
    shape : (rows, columns).
    is_north_up : True if rows run against the plane's second axis (ground), False if along it (image).
    """

    first: FloatArray
    side: float
    shape: tuple[int, int]
    is_north_up: bool
    _step: FloatArray = field(init=False, repr=False)  # from cell to cell along both axes

    def __post_init__(self) -> None:
        """Work out the step."""
        object.__setattr__(self, "_step", np.array([self.side, -self.side if self.is_north_up else self.side]))

    @classmethod
    def between(cls, low: FloatArray, high: FloatArray, *, side: float, is_north_up: bool) -> Grid:
        """Cover a rectangle of the plane.

        Parameters
        ----------
        low, high : (2,) corners of the rectangle.
        side : of a cell.
        is_north_up : see `Grid`.

        Returns
        -------
        The grid; it may reach past `high` (or, north up, past the low end of the second axis) by a part of a cell.

        Raises
        ------
        VisionError
            If that takes too many cells.
        """
        columns, rows = (max(1, int(cells)) for cells in np.ceil((high - low) / side - 1e-9))
        if rows * columns > MAX_CELLS:
            raise VisionError(f"road raster: expected at most {MAX_CELLS} cells, got {rows} x {columns}")
        first = np.array([low[0] + side / 2, high[1] - side / 2 if is_north_up else low[1] + side / 2])
        return cls(first, side, (rows, columns), is_north_up)

    def to_plane(self, cells: FloatArray) -> FloatArray:
        """Convert cells to positions on the plane.

        Parameters
        ----------
        cells : (..., 2) column, row.

        Returns
        -------
        (..., 2).

        Examples
        --------
        >>> grid = Grid.between(np.array([0.0, 0.0]), np.array([4.0, 2.0]), side=0.5, is_north_up=True)
        >>> grid.to_plane(np.array([0.0, 0.0])).tolist()
        [0.25, 1.75]
        """
        return np.asarray(self.first + cells * self._step)

    def to_cells(self, points: FloatArray) -> FloatArray:
        """Convert positions on the plane to cells.

        Parameters
        ----------
        points : (..., 2).

        Returns
        -------
        (..., 2) column, row, not rounded.
        """
        return np.asarray((points - self.first) / self._step)

    def look_up(self, values: BoolArray, points: FloatArray) -> BoolArray:
        """Read a raster at positions on the plane.

        Parameters
        ----------
        values : (rows, columns).
        points : (n, 2).

        Returns
        -------
        (n,) the nearest cell's value, False outside the grid.
        """
        rows, columns = self.shape
        column, row = np.rint(self.to_cells(points)).T
        is_inside = (column >= 0) & (column < columns) & (row >= 0) & (row < rows)
        place = np.where(is_inside, row * columns + column, 0).astype(np.intp)
        return np.asarray(is_inside & values.take(place))

    def centres(self, area: Rectangle) -> FloatArray:
        """List the centres of the cells of a rectangle.

        Parameters
        ----------
        area : rows and columns.

        Returns
        -------
        (rows, columns, 2) positions on the plane.
        """
        columns, rows = np.arange(area.left, area.right), np.arange(area.top, area.bottom)
        return self.to_plane(np.stack(np.meshgrid(columns, rows), axis=-1).astype(np.float64))

    def paint(self, polygons: Sequence[FloatArray] | FloatArray) -> ByteArray:
        """Mark the cells inside polygons.

        Parameters
        ----------
        polygons : corners of each, (k, 2), on the plane.

        Returns
        -------
        (rows, columns) 1 inside, 0 outside.
        """
        cells = np.zeros(self.shape, np.uint8)
        # Far corners would overflow OpenCV's fixed point; what lies that far outside cannot be seen to be cut.
        limit = float(2 ** (28 - POLYGON_BITS))
        for polygon in polygons:
            corners = np.clip(self.to_cells(polygon), -limit, limit) * 2**POLYGON_BITS
            cv2.fillPoly(cells, [np.rint(corners).astype(np.int32)], (1,), shift=POLYGON_BITS)
        return cells
