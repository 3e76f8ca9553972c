"""Which vehicles, each a body with a height, make up a blob that is seen slantwise? On the map, upright things lean.

A body covers its footprint, and its roof covers the same farther away from the camera by its height: together the hull
of both. A tall vehicle so reaches over the lane behind it, and what fills two lanes may be one; cars of a queue touch,
since each leans over the gap behind it. So the blob is read lane by lane, the nearest one first: the rows of a lane are
cut into bodies of lengths that cars, vans and trucks have, where there are gaps if possible, and what lies in their
hulls is gone before the next lane is read.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from vision.detection.parting.lane_bodies import nearest_body, turned
from vision.detection.settings import DetectionSettings
from vision.objects import BoolArray, FloatArray, IntArray
from vision.road.kinds import KINDS, TRUCK, Kind


@dataclass(frozen=True, slots=True)
class Solid:
    """A body on the ground, in axes along and across its lane, metres; `lean_m` is how far its roof is shifted."""

    along_m: tuple[float, float]
    across_m: tuple[float, float]
    lean_m: tuple[float, float]

    def distance_m(self, along: FloatArray, across: FloatArray) -> FloatArray:
        """Measure how far places lie outside of the hull of footprint and roof, (p,) 0 inside; about, at corners."""
        nearest = np.full(len(along), np.inf)
        for share in np.linspace(0.0, 1.0, 5):
            beyond = [
                np.maximum(np.maximum(low + share * lean - place, place - high - share * lean), 0.0)
                for place, (low, high), lean in zip(
                    (along, across), (self.along_m, self.across_m), self.lean_m, strict=True
                )
            ]
            nearest = np.minimum(nearest, np.hypot(*beyond))
        return nearest


def cut_rows(
    width_m: FloatArray, seen_m: FloatArray, lean: tuple[float, float], *, side: float, settings: DetectionSettings
) -> list[tuple[int, int, Kind]]:
    """Cut the rows of a lane into bodies, at the least cost.

    A body costs what its length and width are beside those of its kind. So do rows in it that are narrower than those
    before and behind, or hold shadow only; solid rows that belong to no body; and a cut between two bodies, less where
    what is seen is narrow, for vehicles have round corners, and nothing where the gap is longer than a window.

    Parameters
    ----------
    width_m : (r,) how wide what is in each row of the lane is; rows narrower than a body are not solid.
    seen_m : (r,) the same with shadow.
    lean : how far along and across the lane a metre of height shifts what is seen; metres.
    side : of a row, metres.
    settings : sizes and costs.

    Returns
    -------
    First row of each body, the one after its last, and its kind.
    """
    rows, is_solid = len(width_m), width_m >= settings.body_width_m
    waist = _waist(seen_m, round(settings.waist_reach_m / side))
    waste = side * (settings.waist_cost * waist**2 + settings.shade_cost * ~is_solid)
    # What lies before each row, as sums. All costs are beside those of rows of nobody.
    solid, wide_m, wasted = (
        np.concatenate([[0.0], np.cumsum(each, dtype=np.float64)])
        for each in (is_solid, width_m * is_solid, waste - settings.nobody_cost * side * is_solid)
    )
    room_m = max(float(seen_m.max(initial=0.0)) - side, TRUCK.width_m)
    most = round((settings.longest_m + TRUCK.height_m * abs(lean[0])) / side)
    table = _Table(rows)
    for end in range(1, rows + 1):
        first = np.arange(max(0, end - most), end)
        wide = (wide_m[end] - wide_m[first]) / np.maximum(solid[end] - solid[first], 1.0)
        prices = _prices(np.asarray((end - first) * side, np.float64), wide - side, lean, room_m, settings)
        table.add(end, first, prices, wasted[end] - wasted[first])
        table.allow(end, waist, round(settings.window_m / side), settings.cut_cost)
    return table.bodies()


class _Table:
    """The cheapest cut of all rows before each row.

    `ended` is the cost where a body ends before the row, `begin` what may come before a body that begins there; `last`
    and `before` are where the latest body of the one and the other ends, 0 for none.
    """

    def __init__(self, rows: int) -> None:
        self._ended, self._begin = np.full(rows + 1, np.inf), np.zeros(rows + 1)
        self._starts, self._kinds, self._last, self._before = np.zeros((4, rows + 1), np.intp)
        self._ended[0] = 0.0

    def add(self, end: int, first: IntArray, prices: FloatArray, waste: FloatArray) -> None:
        """Let a body end before a row that begins at one of `first`, at (kinds, n) prices and (n,) costs of rows."""
        total = prices.min(axis=0) + waste + self._begin[first]
        chosen = int(total.argmin())
        self._ended[end], self._starts[end], self._kinds[end] = total[chosen], first[chosen], prices[:, chosen].argmin()
        last = self._last[end - 1]
        self._last[end] = end if self._ended[end] < self._ended[last] else last

    def allow(self, end: int, waist: FloatArray, window: int, cut_cost: float) -> None:
        """Let a body begin at a row: free behind a gap as long as a window; nearer to another body, it is a cut."""
        self._before[end] = self._last[max(0, end - window)]
        self._begin[end] = self._ended[self._before[end]]
        for gap in range(min(window, end)):
            cut = cut_cost * (1 - gap / window) * (1 - waist[end - gap - 1 : end + 1].max()) ** 2
            if self._ended[end - gap] + cut < self._begin[end]:
                self._before[end], self._begin[end] = end - gap, self._ended[end - gap] + cut

    def bodies(self) -> list[tuple[int, int, Kind]]:
        """Read the bodies off, from the last row back."""
        found: list[tuple[int, int, Kind]] = []
        end = int(self._last[-1])
        while end > 0:
            found.append((int(self._starts[end]), end, KINDS[self._kinds[end]]))
            end = int(self._before[self._starts[end]])
        return found[::-1]


def _waist(seen_m: FloatArray, reach: int) -> FloatArray:
    """Say how much narrower each row is than the widest on either side of it, within reach: (r,) 0 to 1."""
    before, behind = (
        np.max(sliding_window_view(np.pad(side_m, (reach, 0)), reach + 1), axis=1) for side_m in (seen_m, seen_m[::-1])
    )
    least_m = np.minimum(before, behind[::-1])
    return np.asarray(1.0 - seen_m / np.maximum(least_m, 1e-6))


def _prices(
    length_m: FloatArray, width_m: FloatArray, lean: tuple[float, float], room_m: float, settings: DetectionSettings
) -> FloatArray:
    """Say what bodies of such length and width cost as each kind, (kinds, n); in a lane, `room_m` is seen at most."""
    prices = []
    for kind in KINDS:
        beside = (length_m - kind.height_m * abs(lean[0]) - kind.length_m) / kind.differs_m
        beside_m = width_m - min(kind.width_m + kind.height_m * abs(lean[1]), room_m)
        # Where bodies lean far across the lane, what is in it is not how wide they are.
        says = abs(lean[1]) < settings.upright_lean
        prices.append(beside**2 + says * (beside_m / settings.width_differs_m) ** 2)
    return np.stack(prices)


def part_solids(
    points_m: FloatArray,
    lane: IntArray,
    heading_rad: FloatArray,
    is_shade: BoolArray,
    lean: FloatArray,
    *,
    side: float,
    settings: DetectionSettings,
) -> IntArray:
    """Part a blob into bodies, lane by lane.

    Parameters
    ----------
    points_m : (p, 2) cells of the blob.
    lane, heading_rad : (p,) number of the lane that each is in, 0 for none, and its direction.
    is_shade : (p,) cells that are shadow.
    lean : (2,) how far a metre of height shifts what is seen; metres.
    side : of a cell, in metres.
    settings : what is a body.

    Returns
    -------
    (p,) number of the body that each cell goes to, from 1, or `NOBODY`; all 0 if there are not two.
    """
    is_left = ~is_shade & (lane > 0)
    distances: list[FloatArray] = []
    depth_m = points_m @ lean
    numbers = np.unique(lane[is_left]).tolist()
    for number in sorted(numbers, key=lambda one: float(np.median(depth_m[lane == one]))):
        mine = lane == number
        strip = _Strip.along(float(heading_rad[mine][0]), points_m, lean, side)
        for solid in _solids(strip, mine, is_left & mine, settings):
            distances.append(solid.distance_m(*strip.places))
            is_left &= distances[-1] > 0
    return nearest_body(distances, is_shade, settings)


@dataclass(frozen=True, slots=True)
class _Strip:
    """Cells and the lean of a metre in axes along and across a lane; `side` of a cell."""

    places: tuple[FloatArray, FloatArray]
    lean: tuple[float, float]
    side: float

    @classmethod
    def along(cls, heading_rad: float, points_m: FloatArray, lean: FloatArray, side: float) -> _Strip:
        """Turn points, (p, 2), and the lean, (2,)."""
        ahead, left = turned(lean[None], heading_rad)
        return cls(turned(points_m, heading_rad), (float(ahead[0]), float(left[0])), side)


def _solids(strip: _Strip, is_in: BoolArray, is_left: BoolArray, settings: DetectionSettings) -> list[Solid]:
    """Find the bodies that stand in one lane, by its cells and by those that are left of them: no shadow, and seen."""
    side, lean, (along, across) = strip.side, strip.lean, strip.places
    if is_left.sum() * side**2 < settings.part_area_m2:
        return []
    first = along[is_in].min()
    row = np.rint((along - first) / side).astype(np.intp)
    width_m, seen_m = (
        np.asarray(side * np.bincount(row[cells], minlength=int(row[is_in].max()) + 1), np.float64)
        for cells in (is_left, is_in)
    )
    found = []
    for start, end, kind in cut_rows(width_m, seen_m, lean, side=side, settings=settings):
        mine = is_left & (row >= start) & (row < end)
        if mine.sum() * side**2 < settings.part_area_m2:
            continue
        low, high = first + (start - 0.5) * side, first + (end - 0.5) * side
        shift = (kind.height_m * lean[0], kind.height_m * lean[1])
        ends = (low - min(shift[0], 0.0), high - max(shift[0], 0.0))
        # It leans away from the side where it stands, and is no wider than usual: the rest are specks and shadow.
        right, left = np.percentile(across[mine], [10, 90])
        sides = (right, right + kind.width_m) if shift[1] > 0 else (left - kind.width_m, left)
        found.append(Solid((min(ends), max(ends)), sides, shift))
    return found
