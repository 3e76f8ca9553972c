"""Where do vehicles seen from low above meet the ground, and in which lane? Parts blobs of several by their feet.

In the image a vehicle covers the lanes behind it, so its cells say nothing; but the lowest cell of every column of a
blob is where something meets the ground, or nearly. Where another vehicle's cells follow below it, that one stands
nearer and hides the foot: what looks lowest there is the other one's roof line, and far from the ground. A vehicle's
feet lie in one lane, without a gap. Where the feet of a blob lie in two lanes, or far apart in one, and something as
high as a car stands on both, there are two vehicles.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from vision.detection.blobs import Cells
from vision.detection.parting.lanes import LaneField, LaneStrip
from vision.objects import BoolArray, FloatArray, IntArray, Table
from vision.road.boxes import axis
from vision.road.cover import Rectangle
from vision.road.grid import Grid
from vision.road.view import GroundView
from vision.settings import VisionSettings
from vision.video.frames import ByteArray


@dataclass(frozen=True, slots=True, eq=False)
class Feet(Table):
    """The lowest cells of the columns of groups.

    Attributes
    ----------
    group : (f,) ascending.
    column : (f,) of the grid, ascending in each group.
    points : (f, 2) on the image.
    height_px : (f,) from the highest to the lowest cell, both included.
    is_hidden : (f,) True where another group follows below.
    """

    group: IntArray
    column: IntArray
    points: FloatArray
    height_px: FloatArray
    is_hidden: BoolArray


def find_feet(cells: Cells, grid: Grid, below_cells: int) -> Feet:
    """Find the lowest cell of every column of every group.

    Parameters
    ----------
    cells : n groups, on an image grid.
    grid : of the cells.
    below_cells : how many below a column's lowest one are looked at.

    Returns
    -------
    One foot a column and group.

    Examples
    --------
    Two groups in one column of cells, the second right below the first, and one cell of road between them:

    >>> grid = Grid.between(np.zeros(2), np.array([3.0, 6.0]), side=1.0, is_north_up=False)
    >>> points = np.array([[1.5, 0.5], [1.5, 1.5], [2.5, 0.5], [1.5, 3.5], [1.5, 4.5]])
    >>> groups = (np.array([0, 0, 0, 1, 1]), np.array([0, 3]))
    >>> cells = Cells(points, groups[0], np.ones(5, np.uint8), np.zeros(5, bool), groups[1], np.arange(2))
    >>> feet = find_feet(cells, grid, 3)
    >>> feet.column.tolist(), feet.height_px.tolist(), feet.is_hidden.tolist()
    ([1, 2, 1], [2.0, 1.0, 2.0], [True, False, False])
    """
    rows, columns = grid.shape
    place, row = np.rint(grid.to_cells(cells.points)).astype(np.intp).T
    key = cells.group * columns + place
    lowest, highest = np.full(cells.count * columns, -1, np.intp), np.full(cells.count * columns, rows, np.intp)
    np.maximum.at(lowest, key, row)
    np.minimum.at(highest, key, row)
    key = np.flatnonzero(lowest >= 0)
    group, column = np.divmod(key, columns)
    low, high = lowest[key], highest[key]
    owner = np.full((rows + below_cells, columns), -1, np.intp)
    owner[row, place] = cells.group
    below = np.stack([owner[low + step, column] for step in range(1, below_cells + 1)])
    is_hidden = ((below >= 0) & (below != group)).any(axis=0)
    points = grid.to_plane(np.column_stack([column, low]).astype(np.float64))
    return Feet(group, column, points, (low - high + 1) * np.float64(grid.side), is_hidden)


@dataclass(frozen=True, slots=True, eq=False)
class _LaneFeet:
    """The feet of one or more groups, and the lanes that they stand in.

    Attributes
    ----------
    feet : of the groups.
    lane : (f,) number, 0 for none and for feet that are hidden. heading_rad : (f,) of the lane.
    """

    feet: Feet
    lane: IntArray
    heading_rad: FloatArray

    def of(self, group: int) -> _LaneFeet:
        """Select the feet of one group."""
        rows = slice(*np.searchsorted(self.feet.group, [group, group + 1]))
        return _LaneFeet(self.feet.select(rows), self.lane[rows], self.heading_rad[rows])


class ImageLanes(LaneField):
    """The lanes as they lie in the image.

    Parameters
    ----------
    grid : of the image.
    lanes : on the ground, may be none.
    view : of the camera.
    settings : the usual car, and what is seen of vehicles and their feet.
    """

    def __init__(self, grid: Grid, lanes: Sequence[LaneStrip], view: GroundView, settings: VisionSettings) -> None:
        super().__init__(grid, (), settings.detection)
        self._view = view
        self._usual_width_m = settings.usual_width_m
        # Two vehicles are no narrower than this where the road is seen most coarsely.
        self._least_px = 2 * self._settings.apart_width_m / settings.car_width_m * self._settings.least_car_px
        ground_m, is_below = view.to_ground(grid.centres(Rectangle(0, grid.shape[0], 0, grid.shape[1])))
        self._lay(lanes, lambda *piece: is_below & _is_beside(ground_m, *piece))

    def parts(
        self, cells: Cells, light: Callable[[FloatArray], ByteArray], is_whole: BoolArray | None = None
    ) -> IntArray:
        """Part groups that stand on several feet.

        Parameters
        ----------
        cells : n groups.
        light : not used: a shadow is told by its want of height.
        is_whole : (n,) groups known to be one vehicle; None for none. These are parted at steps of their outline only,
            unless lanes run with the view: there, vehicles that came into view one behind the other were never seen
            apart.

        Returns
        -------
        (p,) which vehicle of its group a cell belongs to, from 1 on; 0 in groups that are not parted.
        """
        del light
        result = np.zeros(len(cells.group), np.intp)
        if cells.count == 0:
            return result
        standing = self._standing(cells)
        # Most groups are specks, too narrow for two feet even where the road is seen most coarsely.
        widths_px = np.bincount(standing.feet.group, minlength=cells.count) * self._grid.side
        for group in np.flatnonzero(widths_px >= self._least_px).tolist():
            mine = standing.of(group)
            is_known = is_whole is not None and is_whole[group] and not self._is_lengthwise(mine)
            vehicle = self._vehicles(mine, [] if is_known else self._in_lanes(mine))
            if vehicle.max() > 1:
                rows = slice(cells.starts[group], cells.starts[group] + cells.sizes[group])
                column = np.rint(self._grid.to_cells(cells.points[rows])[:, 0]).astype(np.intp)
                dealt = vehicle[np.searchsorted(mine.feet.column, column)]
                result[rows] = self._with_hidden_sides(mine.feet, vehicle, cells.points[rows], dealt)
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
        standing = self._standing(cells)
        for group in range(cells.count):
            mine = standing.of(group)
            lane = int(np.bincount(mine.lane).argmax())
            is_in = mine.lane == lane
            is_known[group] = lane > 0 and is_in.mean() >= self._settings.lane_share
            ahead = np.exp(1j * mine.heading_rad[is_in]).sum()
            heading_rad[group] = np.angle(ahead)
        return heading_rad, is_known

    def walkers(self, cells: Cells, course_rad: FloatArray, is_moving: BoolArray) -> BoolArray:
        """Find what is as narrow as a person and does not move along the lane that it is in.

        Parameters
        ----------
        cells : n groups.
        course_rad : (n,) direction of motion. is_moving : (n,) where that is known.

        Returns
        -------
        (n,).
        """
        if cells.count == 0:
            return np.zeros(0, np.bool_)
        left, right = (edge.reduceat(cells.points[:, 0], cells.starts) for edge in (np.minimum, np.maximum))
        lowest = np.maximum.reduceat(cells.points[:, 1], cells.starts)
        foot_m = self._view.to_ground(np.column_stack([(left + right) / 2, lowest]))[0]
        width_m = (right - left + self._grid.side) * self._view.sight(foot_m).across_m
        lane_rad, is_known = self.headings(cells)
        is_along = is_known & is_moving & (np.cos(course_rad - lane_rad) >= self._settings.walker_cos)
        return np.asarray((width_m < self._settings.walker_width_m) & ~is_along)

    def _standing(self, cells: Cells) -> _LaneFeet:
        """Find the feet of groups and look up their lanes."""
        feet = find_feet(cells, self._grid, self._settings.below_cells)
        lane, heading_rad = self.lanes_at(feet.points)
        return _LaneFeet(feet, np.where(feet.is_hidden, 0, lane), heading_rad)

    def _vehicles(self, standing: _LaneFeet, pieces: list[IntArray]) -> IntArray:
        """Number the vehicles of one group that stand on its feet, from 1 on; all 1 if there is only one.

        `pieces` are the vehicles told by their lanes, each by the rows of its feet.
        """
        column = standing.feet.column
        if self._is_between_lanes(standing.feet, pieces):
            pieces = self._between_steps(standing.feet)
        if len(pieces) < 2:
            return np.ones(len(column), np.intp)
        # Columns on no foot of their own go with the nearest one that has.
        known = np.concatenate(pieces)
        names = np.repeat(np.arange(1, len(pieces) + 1), [len(one) for one in pieces])
        nearest = np.argmin(np.abs(column[:, None] - column[known][None]), axis=1)
        return np.asarray(names[nearest], np.intp)

    def _is_between_lanes(self, feet: Feet, pieces: list[IntArray]) -> bool:
        """Tell whether pieces of a group, each in a lane, are level and no wider than one vehicle; so are none."""
        if len(pieces) < 2:
            return True
        ground_m = self._view.to_ground(np.array([np.median(feet.points[one], axis=0) for one in pieces]))[0]
        sight = self._view.sight(ground_m)
        depth_m = ground_m @ sight.away.mean(axis=0)
        width_m = self._grid.side * (np.array([len(one) for one in pieces]) @ sight.across_m)
        return bool(np.ptp(depth_m) < self._settings.level_m and width_m < self._settings.two_vehicles_m)

    def _between_steps(self, feet: Feet) -> list[IntArray]:
        """List the vehicles of one group by its lower outline, where that makes a high step to another."""
        ground_m, is_ground = self._view.to_ground(feet.points)
        seen = np.flatnonzero(~feet.is_hidden & is_ground)
        row, scale = feet.points[seen, 1], self._view.sight(ground_m[seen]).across_m
        width_m, height_m = self._grid.side * scale, feet.height_px[seen] * scale
        is_step = np.abs(np.diff(row)) * scale[1:] > self._settings.step_m
        found: list[IntArray] = []
        for piece in np.split(np.arange(len(seen)), np.flatnonzero(is_step) + 1):
            if (
                width_m[piece].sum() < self._settings.step_width_m
                or np.median(height_m[piece]) < self._settings.feet_height_m
            ):
                continue
            step_m = [abs(row[piece[0]] - row[one[-1]]) * scale[piece[0]] for one in found]
            # Where the outline comes back to a level where it was, all in between is one vehicle with a gap in it.
            level = next((k for k, one_m in enumerate(step_m) if one_m <= self._settings.step_m), len(found))
            found[level:] = [np.concatenate([*found[level : level + 1], piece])]
        return [seen[one] for one in found]

    def _is_lengthwise(self, standing: _LaneFeet) -> bool:
        """Tell whether the lanes run with the line of sight: then a vehicle's feet lie side by side in one of them."""
        on_lane = standing.lane > 0
        if not on_lane.any():
            return False
        away = self._view.sight(self._view.to_ground(standing.feet.points[on_lane])[0]).away
        along = axis(standing.heading_rad[on_lane].astype(np.float64))
        return bool(np.median(np.abs(np.einsum("ni,ni->n", away, along))) >= self._settings.lengthwise_cos)

    def _with_hidden_sides(self, feet: Feet, vehicle: IntArray, points: FloatArray, dealt: IntArray) -> IntArray:
        """Give vehicles what is seen of them above the nearer ones that hide a side of them: (p,) numbers."""
        result = dealt.copy()
        lowest = np.zeros(int(vehicle.max()) + 1)
        np.maximum.at(lowest, vehicle, feet.points[:, 1])
        for one in range(1, len(lowest)):
            left, right = feet.points[vehicle == one, 0].min(), feet.points[vehicle == one, 0].max()
            foot = np.array([[(left + right) / 2, lowest[one]]])
            scale = float(self._view.sight(self._view.to_ground(foot)[0]).across_m[0])
            is_near = np.abs(points[:, 0] - (left + right) / 2) < self._usual_width_m / scale - (right - left) / 2
            is_above = points[:, 1] < np.minimum(lowest[one], lowest[dealt] - self._settings.roof_m / scale)
            result[is_near & is_above & (dealt != one)] = one
        return result

    def _in_lanes(self, standing: _LaneFeet) -> list[IntArray]:
        """List the vehicles of one group by lanes, each by the rows of its feet."""
        lanes = np.unique(standing.lane[standing.lane > 0])
        return [one for lane in lanes for one in self._in_lane(standing, lane)]

    def _in_lane(self, standing: _LaneFeet, lane: int) -> list[IntArray]:
        """List the vehicles of one group that stand in one lane, each by the rows of its feet."""
        mine = np.flatnonzero(standing.lane == lane)
        ground_m = self._view.to_ground(standing.feet.points[mine])[0]
        sight = self._view.sight(ground_m)
        along_m = ground_m @ axis(standing.heading_rad[mine[:1]].astype(np.float64))[0]
        order = np.argsort(along_m)
        least_m = max(
            self._settings.gap_m, self._settings.gap_cells * self._grid.side * float(np.median(sight.along_m))
        )
        pieces = np.split(order, np.flatnonzero(np.diff(along_m[order]) > least_m) + 1)
        width_m = self._grid.side * sight.across_m
        height_m = standing.feet.height_px[mine] * sight.across_m
        least_width_m = self._settings.feet_width_m if len(pieces) == 1 else self._settings.apart_width_m
        return [
            mine[one]
            for one in pieces
            if width_m[one].sum() >= least_width_m and np.median(height_m[one]) >= self._settings.feet_height_m
        ]


def _is_beside(points_m: FloatArray, start: FloatArray, end: FloatArray, half_m: float) -> BoolArray:
    """Tell which points lie beside a stretch of line, no farther from it than `half_m`."""
    length_m = float(np.hypot(*(end - start)))
    ahead = (end - start) / length_m
    x, y = points_m[..., 0] - start[0], points_m[..., 1] - start[1]
    along, across = x * ahead[0] + y * ahead[1], y * ahead[0] - x * ahead[1]
    return np.asarray((along >= 0) & (along <= length_m) & (np.abs(across) < half_m))
