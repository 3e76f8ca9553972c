"""Which lane is a cell in, and which way do people drive there? Parts merged blobs that no track can tell apart.

Two cars that stand side by side, with the shadow of one in the gap, are one blob; if they were there before anything
was tracked, no prediction divides it. But each fills its lane, and no vehicle fills two. Lanes also give the direction
of what has never moved. Where lanes overlap, and where there are none (inside junctions), nothing is known.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from vision.detection.blobs import Cells
from vision.detection.parting.lane_bodies import is_shadow, part_bodies, turned
from vision.detection.parting.solids import part_solids
from vision.detection.settings import DetectionSettings
from vision.objects import BoolArray, FloatArray, IntArray
from vision.road.grid import Grid
from vision.video.frames import ByteArray


@dataclass(frozen=True, slots=True, eq=False)
class LaneStrip:
    """One lane.

    Attributes
    ----------
    centre_line_m : (k, 2) in driving direction. width_m : full width.
    """

    centre_line_m: FloatArray
    width_m: float


def lane_headings(points_m: FloatArray, lanes: Sequence[LaneStrip]) -> FloatArray:
    """Tell which way people drive where points lie.

    Parameters
    ----------
    points_m : (n, 2).
    lanes : may be none.

    Returns
    -------
    (n,) heading of the lane; nan beside all lanes, and where they overlap.

    Examples
    --------
    >>> east = LaneStrip(np.array([[0.0, 0.0], [100.0, 0.0]]), 3.5)
    >>> north = LaneStrip(np.array([[90.0, -50.0], [90.0, 50.0]]), 3.5)
    >>> lane_headings(np.array([[10.0, 1.0], [10.0, 3.0], [90.0, 0.0]]), [east, north]).tolist()
    [0.0, nan, nan]
    """
    heading_rad, lanes_there = np.full(len(points_m), np.nan), np.zeros(len(points_m), np.intp)
    for lane in lanes:
        start, step = lane.centre_line_m[:-1], np.diff(lane.centre_line_m, axis=0)
        offset = points_m[:, None] - start
        part = np.clip((offset * step).sum(axis=2) / (step**2).sum(axis=1), 0.0, 1.0)
        away_m = np.hypot(*np.moveaxis(offset - part[..., None] * step, 2, 0))
        piece = np.argmin(away_m, axis=1)
        is_inside = away_m.min(axis=1) <= lane.width_m / 2
        heading_rad[is_inside] = np.arctan2(step[piece, 1], step[piece, 0])[is_inside]
        lanes_there += is_inside
    return np.where(lanes_there == 1, heading_rad, np.nan)


Lean = Callable[[FloatArray], FloatArray]
"""Tells for (n, 2) ground points how far a metre of height shifts what is seen: (n, 2) metres."""


def upright(points_m: FloatArray) -> FloatArray:
    """Say that nothing leans: the view of a camera straight above, (n, 2)."""
    return np.zeros_like(points_m)


class LaneField:
    """The lanes on a raster of ground.

    Parameters
    ----------
    grid : of ground.
    lanes : may be none.
    settings : what a vehicle fills of a lane.
    lean : how far vehicles lean where, seen slantwise.
    """

    def __init__(
        self, grid: Grid, lanes: Sequence[LaneStrip], settings: DetectionSettings, lean: Lean = upright
    ) -> None:
        self._grid, self._settings, self._lean = grid, settings, lean
        self._lane = np.zeros(grid.shape, np.int32)
        self._heading_rad = np.zeros(grid.shape, np.float32)
        self._numbers = len(lanes) + 1  # of lanes, with 0 for none
        # Half a cell less on either side, so that lanes side by side share no cell.
        self._lay(lanes, lambda start, end, half_m: grid.paint([_quad(start, end, half_m - grid.side / 2)]) > 0)

    def _lay(self, lanes: Sequence[LaneStrip], covers: Callable[[FloatArray, FloatArray, float], BoolArray]) -> None:
        """Lay lanes on the raster; `covers` tells for start, end and half-width of a piece where it lies."""
        taken = np.zeros(self._grid.shape, np.uint8)
        for number, lane in enumerate(lanes, start=1):
            inside = np.zeros(self._grid.shape, np.bool_)
            for start, end in pairwise(lane.centre_line_m):
                part = covers(start, end, lane.width_m / 2)
                self._heading_rad[part] = np.arctan2(*(end - start)[::-1])
                inside |= part
            self._lane[inside] = number
            taken += inside
        self._lane[taken > 1] = 0

    def lanes_at(self, points_m: FloatArray) -> tuple[IntArray, FloatArray]:
        """Look up points.

        Parameters
        ----------
        points_m : (n, 2) inside the grid.

        Returns
        -------
        (n,) number of the lane, 0 for none, and (n,) its direction.
        """
        column, row = np.rint(self._grid.to_cells(points_m)).astype(np.intp).T
        place = row * self._grid.shape[1] + column
        return self._lane.take(place).astype(np.intp), self._heading_rad.take(place).astype(np.float64)

    def parts(
        self, cells: Cells, light: Callable[[FloatArray], ByteArray], is_whole: BoolArray | None = None
    ) -> IntArray:
        """Part groups that fill several lanes.

        Parameters
        ----------
        cells : n groups.
        light : tells how many per cent of the road's light are left at (n, 2) points, 0 where it is no shadow; asked
            only where there may be something to part.
        is_whole : (n,) groups that are not to be parted; None for none.

        Returns
        -------
        (p,) number of the vehicle in its group that the cell belongs to, -1 for none; 0 in groups that are not parted.
        """
        result = np.zeros(len(cells.group), np.intp)
        if cells.count == 0:
            return result
        lane, heading_rad = self.lanes_at(cells.points)
        least = self._settings.part_area_m2 / self._grid.side**2
        counts = np.bincount(cells.group * self._numbers + lane, minlength=cells.count * self._numbers)
        is_large = counts.reshape(cells.count, self._numbers)[:, 1:] >= least
        # Leaning bodies touch even in one lane.
        is_open = is_large.sum(axis=1) > (self._lean is upright)
        for group in np.flatnonzero(is_open if is_whole is None else is_open & ~is_whole):
            rows = slice(cells.starts[group], cells.starts[group] + cells.sizes[group])
            result[rows] = self._parted(cells.points[rows], lane[rows], heading_rad[rows], light, cells.points)
        return result

    def _parted(
        self,
        points_m: FloatArray,
        lane: IntArray,
        heading_rad: FloatArray,
        light: Callable[[FloatArray], ByteArray],
        all_points_m: FloatArray,
    ) -> IntArray:
        """Number the vehicles in one group; all 0 if it is one. `all_points_m` are those of all groups."""
        (lean,) = self._lean(points_m.mean(axis=0)[None])
        if lean.any():
            is_shade = is_shadow(light(points_m), light(all_points_m), self._settings)
            return part_solids(
                points_m, lane, heading_rad, is_shade, lean, side=self._grid.side, settings=self._settings
            )
        numbers, is_long = self._filled(points_m, lane, heading_rad)
        if is_long:
            is_shade = is_shadow(light(points_m), light(all_points_m), self._settings)
            return part_bodies(points_m, lane, heading_rad, is_shade, side=self._grid.side, settings=self._settings)
        if len(numbers) > 1:
            left = light(points_m)
            numbers = [one for one in numbers if not _is_even(left[lane == one], self._settings)]
        return _dealt(points_m, lane, numbers) if len(numbers) > 1 else np.zeros(len(lane), np.intp)

    def _filled(self, points_m: FloatArray, lane: IntArray, heading_rad: FloatArray) -> tuple[list[int], bool]:
        """List the lanes in which a group is as large as a vehicle, and tell whether it is longer than a car in one.

        None if it is not wide enough for two.
        """
        side = self._grid.side
        least = self._settings.part_area_m2 / side**2
        numbers, is_long = [], False
        for number in np.unique(lane[lane > 0]).tolist():
            mine = lane == number
            along, across = turned(points_m, heading_rad[mine][0])
            if np.ptp(across) + side < self._settings.two_vehicles_m:
                return [], False
            is_long |= bool(np.ptp(along[mine]) + side > self._settings.long_vehicle_m)
            if np.ptp(across[mine]) + side >= self._settings.part_width_m and mine.sum() >= least:
                numbers.append(number)
        return numbers, is_long

    def headings(self, cells: Cells) -> tuple[FloatArray, BoolArray]:
        """Find the direction of the lanes that groups are in.

        Parameters
        ----------
        cells : n groups.

        Returns
        -------
        (n,) direction, and (n,) whether enough of the group is in lanes.
        """
        lane, heading_rad = self.lanes_at(cells.points)
        is_in = lane > 0
        # Lanes side by side in opposite directions have one axis: doubled angles add up, and the largest lane decides.
        sums = [
            np.add.reduceat(np.where(is_in, part, 0.0), cells.starts) if cells.count else np.zeros(0)
            for part in (np.cos(2 * heading_rad), np.sin(2 * heading_rad), np.ones(len(lane)))
        ]
        axis_rad = np.arctan2(sums[1], sums[0]) / 2
        ahead = np.where(is_in, np.cos(heading_rad - axis_rad[cells.group]), 0.0)
        forward = np.add.reduceat(ahead, cells.starts) if cells.count else np.zeros(0)
        return np.where(forward < 0, axis_rad + np.pi, axis_rad), sums[2] >= self._settings.lane_share * cells.sizes

    def walkers(self, cells: Cells, course_rad: FloatArray, is_moving: BoolArray) -> BoolArray:
        """Find people on foot, (n,); none from above, where they are too small to be seen at all (`image_lanes.py`)."""
        del course_rad, is_moving
        return np.zeros(cells.count, np.bool_)


def borders_of(lanes: Sequence[LaneStrip], grid: Grid, settings: DetectionSettings) -> BoolArray:
    """Mark where lanes end sideways: there are the lines, and the kerbs between carriageways.

    Parameters
    ----------
    lanes : may be none.
    grid : of ground.
    settings : where lines and kerbs lie.

    Returns
    -------
    (rows, columns).

    Examples
    --------
    >>> grid = Grid(np.array([0.0, 0.0]), 0.5, (1, 12), is_north_up=True)
    >>> north = LaneStrip(np.array([[3.0, -9.0], [3.0, 9.0]]), 3.0)
    >>> borders_of([north], grid, DetectionSettings()).astype(int).tolist()
    [[0, 0, 1, 1, 0, 0, 0, 0, 0, 1, 1, 0]]
    """
    # Lines are blurred by half a cell, and what is painted covers all cells that it touches.
    pieces = [(*ends, lane.width_m / 2) for lane in lanes for ends in pairwise(lane.centre_line_m)]
    outer, inner = (
        grid.paint([_quad(start, end, half_m + reach_m) for start, end, half_m in pieces]) > 0
        for reach_m in (settings.border_outside_m, -settings.border_inside_m - grid.side)
    )
    return np.asarray(outer & ~inner)


def _quad(start: FloatArray, end: FloatArray, half_m: float) -> FloatArray:
    """Outline a straight piece of a lane."""
    heading_rad = float(np.arctan2(*(end - start)[::-1]))
    left = half_m * np.array([-np.sin(heading_rad), np.cos(heading_rad)])
    return np.array([start + left, start - left, end - left, end + left])


def _is_even(light: ByteArray, settings: DetectionSettings) -> bool:
    """Tell whether cells are evenly dark road."""
    dark = light[light > 0].astype(np.int16)
    if len(dark) == 0:
        return False
    is_even = np.abs(dark - np.median(dark)) <= settings.even_percent
    return bool(is_even.sum() >= settings.shadow_share * len(light))


def _dealt(points_m: FloatArray, lane: IntArray, numbers: list[int]) -> IntArray:
    """Give the cells outside the given lanes to the nearest of the vehicles in them."""
    middles = np.array([points_m[lane == number].mean(axis=0) for number in numbers])
    nearest = np.argmin(np.linalg.norm(points_m[:, None] - middles[None], axis=-1), axis=1)
    return np.where(np.isin(lane, numbers), lane, np.array(numbers, np.intp)[nearest])
