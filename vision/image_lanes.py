"""Which lane does a vehicle seen from low above the road stand in? Parts blobs of several vehicles by their feet.

In the image a vehicle covers the lanes behind it, so its cells say nothing; but the lowest cell of every column of a
blob is where something meets the ground, or nearly. A vehicle's feet lie in one lane, without a gap. Where the feet of
a blob lie in two lanes, or far apart in one, and something as high as a car stands on both, there are two vehicles.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vision.blobs import Cells
from vision.cover import Rectangle
from vision.frames import ByteArray
from vision.grid import Grid
from vision.lanes import LANE_SHARE, LaneField, LaneStrip
from vision.view import GroundView

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.intp]
BoolArray = NDArray[np.bool_]

# Of a vehicle half hidden by another one this much is seen at least; shadows on the next lane are flatter than this.
LEAST_WIDTH_M, LEAST_HEIGHT_M = 1.1, 0.9
# Feet in one lane with nothing between them for this far belong to two vehicles; the view is too coarse for less.
LEAST_GAP_M, GAP_CELLS = 6.0, 6.0


@dataclass(frozen=True, slots=True, eq=False)
class _Feet:
    """The lowest cells of the columns of one or more groups.

    Attributes
    ----------
    group : (f,) ascending.
    column : (f,) of the grid, ascending in each group.
    points : (f, 2) on the image. height : (f,) from the highest to the lowest cell, in pixels.
    lane : (f,) number, 0 for none. heading_rad : (f,) of the lane.
    """

    group: IntArray
    column: IntArray
    points: FloatArray
    height: FloatArray
    lane: IntArray
    heading_rad: FloatArray

    def of(self, group: int) -> _Feet:
        """Select the feet of one group."""
        rows = slice(*np.searchsorted(self.group, [group, group + 1]))
        return _Feet(
            self.group[rows],
            self.column[rows],
            self.points[rows],
            self.height[rows],
            self.lane[rows],
            self.heading_rad[rows],
        )


class ImageLanes(LaneField):
    """The lanes as they lie in the image.

    Parameters
    ----------
    grid : of the image.
    lanes : on the ground, may be none.
    view : of the camera.
    """

    def __init__(self, grid: Grid, lanes: Sequence[LaneStrip], view: GroundView) -> None:
        super().__init__(grid, ())
        self._view = view
        ground_m, is_below = view.to_ground(grid.centres(Rectangle(0, grid.shape[0], 0, grid.shape[1])))
        taken = np.zeros(grid.shape, np.uint8)
        for number, lane in enumerate(lanes, start=1):
            inside = np.zeros(grid.shape, np.bool_)
            for start, end in zip(lane.centre_line_m[:-1], lane.centre_line_m[1:], strict=True):
                part = is_below & _is_beside(ground_m, start, end, lane.width_m / 2)
                self._heading_rad[part] = np.arctan2(*(end - start)[::-1])
                inside |= part
            self._lane[inside] = number
            taken += inside
        self._lane[taken > 1] = 0

    def parts(
        self, cells: Cells, light: Callable[[FloatArray], ByteArray], is_whole: BoolArray | None = None
    ) -> IntArray:
        """Part groups that stand on several feet.

        Parameters
        ----------
        cells : n groups.
        light : not used: a shadow is told by its want of height.
        is_whole : (n,) groups that are not to be parted; None for none.

        Returns
        -------
        (p,) which vehicle of its group a cell belongs to, from 1 on; 0 in groups that are not parted.
        """
        del light
        result = np.zeros(len(cells.group), np.intp)
        if cells.count == 0:
            return result
        feet = self._feet(cells)
        for group in range(cells.count) if is_whole is None else np.flatnonzero(~is_whole).tolist():
            mine = feet.of(group)
            vehicle = self._vehicles(mine)
            if vehicle.max() > 1:
                rows = slice(cells.starts[group], cells.starts[group] + cells.sizes[group])
                column = self._columns(cells.points[rows])
                result[rows] = vehicle[np.searchsorted(mine.column, column)]
        return result

    def headings(self, cells: Cells) -> tuple[FloatArray, BoolArray]:
        """Find the direction of the lanes that groups stand in.

        Parameters
        ----------
        cells : n groups.

        Returns
        -------
        (n,) direction, and (n,) whether enough of the group stands in one lane.
        """
        heading_rad, is_known = np.zeros(cells.count), np.zeros(cells.count, np.bool_)
        if cells.count == 0:
            return heading_rad, is_known
        feet = self._feet(cells)
        for group in range(cells.count):
            mine = feet.of(group)
            lane = int(np.bincount(mine.lane).argmax())
            is_in = mine.lane == lane
            is_known[group] = lane > 0 and is_in.mean() >= LANE_SHARE
            ahead = np.exp(1j * mine.heading_rad[is_in]).sum()
            heading_rad[group] = np.angle(ahead)
        return heading_rad, is_known

    def _columns(self, points: FloatArray) -> IntArray:
        return np.rint(self._grid.to_cells(points)[:, 0]).astype(np.intp)

    def _feet(self, cells: Cells) -> _Feet:
        """Find the lowest cell of every column of every group."""
        column = self._columns(cells.points)
        order = np.lexsort((cells.points[:, 1], column, cells.group))
        column, group, points = column[order], cells.group[order], cells.points[order]
        is_new = np.ones(len(order), np.bool_)
        is_new[1:] = (column[1:] != column[:-1]) | (group[1:] != group[:-1])
        highest = np.flatnonzero(is_new)
        lowest = np.append(highest[1:], len(order)) - 1
        lane, heading_rad = self.lanes_at(points[lowest])
        height = points[lowest, 1] - points[highest, 1] + self._grid.side
        return _Feet(group[lowest], column[lowest], points[lowest], height, lane, heading_rad)

    def _vehicles(self, feet: _Feet) -> IntArray:
        """Number the vehicles of one group that stand on its feet, from 1 on; all 1 if there is only one."""
        ground_m = self._view.to_ground(feet.points)[0]
        sight = self._view.sight(ground_m)
        middles: list[IntArray] = []
        for number in np.unique(feet.lane[feet.lane > 0]).tolist():
            mine = np.flatnonzero(feet.lane == number)
            cos, sin = np.cos(feet.heading_rad[mine[0]]), np.sin(feet.heading_rad[mine[0]])
            along_m = ground_m[mine, 0] * cos + ground_m[mine, 1] * sin
            order = np.argsort(along_m)
            least_m = max(LEAST_GAP_M, GAP_CELLS * self._grid.side * float(np.median(sight.along_m[mine])))
            for one in np.split(mine[order], np.flatnonzero(np.diff(along_m[order]) > least_m) + 1):
                width_m = self._grid.side * sight.across_m[one].sum()
                height_m = np.median(feet.height[one] * sight.across_m[one])
                if width_m >= LEAST_WIDTH_M and height_m >= LEAST_HEIGHT_M:
                    middles.append(one)
        if len(middles) < 2:
            return np.ones(len(feet.column), np.intp)
        # Columns on no foot of their own go with the nearest one that has.
        known = np.concatenate(middles)
        names = np.repeat(np.arange(1, len(middles) + 1), [len(one) for one in middles])
        nearest = np.argmin(np.abs(feet.column[:, None] - feet.column[known][None]), axis=1)
        return np.asarray(names[nearest], np.intp)


def _is_beside(points_m: FloatArray, start: FloatArray, end: FloatArray, half_m: float) -> BoolArray:
    """Tell which points lie beside a stretch of line, no farther from it than `half_m`."""
    length_m = float(np.hypot(*(end - start)))
    ahead = (end - start) / length_m
    x, y = points_m[..., 0] - start[0], points_m[..., 1] - start[1]
    along, across = x * ahead[0] + y * ahead[1], y * ahead[0] - x * ahead[1]
    return np.asarray((along >= 0) & (along <= length_m) & (np.abs(across) < half_m))
