"""Which pairs of objects are near enough to be looked at, and since when?

Near means near in the plane or, for cars that drive towards each other, near along their road. Cars that are *near in
time* may be further apart: a time gap of 3 s is 15 m in a town and 100 m on a motorway, so a radius in metres alone is
too small for the one or costs too much in the other. These are pairs that are in line, less than two lanes apart
sideways, and that the faster one's speed would bring together within some seconds.

A pair enters the near set at one radius and leaves it at a larger one, so that two cars at the rim do not come and go
with the noise. Cost per frame follows the number of near pairs, not the square of the number of objects.
"""

import math
from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise

import numpy as np
from scipy.spatial import KDTree

from qsr.measuring.footprints import (
    ACROSS,
    ALONG,
    COS,
    HALF_LENGTH,
    ROAD,
    SIN,
    SPEED,
    TRAVEL,
    BoolArray,
    FloatArray,
    LongArray,
    X,
    Y,
    shares_road,
)
from qsr.measuring.road_relations import is_on_one_road
from qsr.measuring.routes import Routes
from qsr.settings import RelationSettings

# Up to here comparing all pairs is quicker than building a tree.
_ALL_PAIRS_LIMIT = 60


def pairs_within(
    centre_m: FloatArray, half_length_m: FloatArray, radius_m: float, starts: LongArray | None = None
) -> tuple[LongArray, FloatArray]:
    """List the pairs whose centres are nearer than the radius plus both half lengths.

    Parameters
    ----------
    centre_m : (n, 2). half_length_m : (n,). radius_m : of the gap between the ends, roughly.
    starts : where the objects of each frame begin, and n: pairs are of one frame. None for one frame.

    Returns
    -------
    (2, pairs) indices, the lower in the first row, in lexicographic order; and (pairs,) distances less both half
    lengths.

    Examples
    --------
    >>> centre_m = np.array([[0.0, 0.0], [30.0, 0.0], [90.0, 0.0], [95.0, 0.0]])
    >>> pairs_within(centre_m, np.full(4, 2.0), 40.0, np.array([0, 3, 4]))
    (array([[0],
           [1]]), array([26.]))
    """
    bounds = [0, len(centre_m)] if starts is None else starts.tolist()
    reach_m = radius_m + 2.0 * float(half_length_m.max(initial=0.0))
    frames = [_pairs_of_one(centre_m[start:stop], reach_m) + start for start, stop in pairwise(bounds)]
    first, second = frames[0] if len(frames) == 1 else np.concatenate(frames, axis=1)
    x, y = centre_m.T
    distance_m = np.hypot(x.take(first) - x.take(second), y.take(first) - y.take(second))
    distance_m = distance_m - half_length_m.take(first) - half_length_m.take(second)
    near = (distance_m <= radius_m).nonzero()[0]
    return np.array((first.take(near), second.take(near)), dtype=np.int64), distance_m.take(near)


def _pairs_of_one(centre_m: FloatArray, reach_m: float) -> LongArray:
    """List pairs of one frame, (2, pairs): all within reach, and more where that is quicker."""
    count = len(centre_m)
    if count <= _ALL_PAIRS_LIMIT:
        return _all_pairs(count)
    tree = KDTree(centre_m, leafsize=16, compact_nodes=False, balanced_tree=False)
    found = tree.query_pairs(reach_m, output_type="ndarray")
    return found[np.argsort(found[:, 0] * count + found[:, 1])].T


@lru_cache(maxsize=_ALL_PAIRS_LIMIT + 1)
def _all_pairs(count: int) -> LongArray:
    index = np.arange(count)
    return np.array((index[:, None] < index).nonzero(), dtype=np.int64)


def facing_within(
    road: FloatArray, along_m: FloatArray, *, travel: FloatArray, half_length_m: FloatArray, reach_m: float
) -> tuple[LongArray, FloatArray]:
    """List the pairs on one road that travel in opposite directions, no matter whether they have met.

    Parameters
    ----------
    road : (n,) index, negative for none. along_m : (n,) on the road. half_length_m : (n,).
    travel : (n,) cosine between heading and road; 0 for a car that takes no part.
    reach_m : of the gap between the bodies along the road.

    Returns
    -------
    As from `pairs_within`, the distance being that along the road.

    Examples
    --------
    >>> facing_within(np.zeros(3), np.array([0.0, 70.0, 80.0]), travel=np.array([1.0, -1.0, 1.0]),
    ...               half_length_m=np.full(3, 2.0), reach_m=100.0)
    (array([[0, 1],
           [1, 2]]), array([66.,  6.]))
    """
    on_road = road >= 0
    forth = (on_road & (travel > 0)).nonzero()[0]
    back = (on_road & (travel < 0)).nonzero()[0]
    if not len(forth) or not len(back):
        return np.zeros((2, 0), dtype=np.int64), np.zeros(0)
    # One line holds all roads, so far apart that no pair reaches from one to the next. It only finds the pairs: numbers
    # on it are too large to be measured with.
    longest_m = float(half_length_m.max())
    span_m = 2.0 * (float(np.abs(along_m).max()) + reach_m + 2.0 * longest_m)
    at_m = road * span_m + along_m
    back = back.take(at_m.take(back).argsort())
    forth_m, back_m = at_m.take(forth), at_m.take(back)
    reach = reach_m + half_length_m.take(forth) + longest_m
    start = back_m.searchsorted(forth_m - reach)
    count = back_m.searchsorted(forth_m + reach, side="right") - start
    one = forth.repeat(count)
    other = back.take(np.arange(len(one)) + (start - count.cumsum() + count).repeat(count))
    distance_m = np.abs(along_m.take(one) - along_m.take(other)) - half_length_m.take(one) - half_length_m.take(other)
    pairs = np.array((np.minimum(one, other), np.maximum(one, other)), dtype=np.int64)
    order = (pairs[0] * len(road) + pairs[1]).argsort()
    order = order[distance_m.take(order) <= reach_m]
    return pairs.take(order, axis=1), distance_m.take(order)


def near_in_time(
    table: FloatArray, settings: RelationSettings, starts: LongArray | None = None
) -> tuple[LongArray, FloatArray, BoolArray]:
    """List the pairs that may stay, and say which of them may come in.

    Parameters
    ----------
    table : (13, n) as made by `qsr.measuring.footprints.object_table`.
    settings : thresholds.
    starts : of the frames, as in `pairs_within`.

    Returns
    -------
    (2, pairs) columns of the table, the lower in the first row, in lexicographic order; (pairs,) distances as from
    `pairs_within`; (pairs,) True for those within the smaller limits.
    """
    speed_mps = table[SPEED]
    radius_m = max(settings.leave_radius_m, settings.leave_reach_s * float(speed_mps.max(initial=0.0)))
    pairs, distance_m = pairs_within(table[X : Y + 1].T, table[HALF_LENGTH], radius_m, starts)
    may_enter = distance_m <= settings.enter_radius_m
    stays = distance_m <= settings.leave_radius_m
    # Most pairs are too far apart or near anyway: only the others are asked whether they are in line.
    faster_mps = speed_mps.take(pairs).max(axis=0)
    asked = (~may_enter & (distance_m <= settings.leave_reach_s * faster_mps)).nonzero()[0]
    if len(asked):
        sideways_m = _sideways_m(table.take(pairs.take(asked, axis=1), axis=1), settings)
        stays[asked] |= sideways_m <= settings.leave_line_m
        is_soon = distance_m.take(asked) <= settings.enter_reach_s * faster_mps.take(asked)
        may_enter[asked] = is_soon & (sideways_m <= settings.enter_line_m)
    kept = stays.nonzero()[0]
    return pairs.take(kept, axis=1), distance_m.take(kept), may_enter.take(kept)


def _sideways_m(ends: FloatArray, settings: RelationSettings) -> FloatArray:
    """Measure how far apart the centres are across the road, or across the mean heading; inf if there is none."""
    a, b = ends[:, 0], ends[:, 1]
    apart_x, apart_y = a[X] - b[X], a[Y] - b[Y]
    mean_cos, mean_sin = a[COS] + b[COS], a[SIN] + b[SIN]
    alike = a[COS] * b[COS] + a[SIN] * b[SIN] > math.cos(settings.heading_limit_rad)
    size = np.where(alike, np.hypot(mean_cos, mean_sin), 1.0)
    across_heading = np.where(alike, np.abs(apart_y * mean_cos - apart_x * mean_sin) / size, np.inf)
    on_one_road = is_on_one_road(ends, np.hypot(apart_x, apart_y), settings)
    sideways_m: FloatArray = np.where(on_one_road, np.abs(a[ACROSS] - b[ACROSS]), across_heading)
    return sideways_m


def facing_pairs(
    table: FloatArray, settings: RelationSettings, routes: Routes | None, starts: LongArray
) -> tuple[LongArray, FloatArray]:
    """List the pairs that drive in opposite directions on one road or towards each other, near enough to be looked at.

    Parameters
    ----------
    table, settings : as in `near_in_time`.
    routes : the ways between the columns of the table; None where the map says nothing of them.
    starts : of the frames, as in `pairs_within`.

    Returns
    -------
    As from `facing_within`; along the route between them if they are not on one road.
    """
    travel, half_length_m, reach_m, road = table[TRAVEL], table[HALF_LENGTH], settings.oncoming_leave_m, table[ROAD]
    if len(starts) > 2:  # each frame has roads of its own
        roads_before = (np.arange(len(starts) - 1) * (road.max(initial=0.0) + 1.0)).repeat(np.diff(starts))
        road = np.where(road < 0, road, road + roads_before)
    travel = np.where(np.abs(travel) > math.sqrt(settings.road_alignment), travel, 0.0)
    pairs, distance_m = facing_within(road, table[ALONG], travel=travel, half_length_m=half_length_m, reach_m=reach_m)
    if routes is None:
        return pairs, distance_m
    known = np.flatnonzero(routes.places.lane[:, 0] >= 0)
    begins = known.searchsorted(starts)
    near, _ = pairs_within(table[X : Y + 1].take(known, axis=1).T, half_length_m.take(known), reach_m, begins)
    others = known.take(near)
    route_m = np.abs(routes.facing_m(others)) - half_length_m.take(others).sum(axis=0)
    kept = np.flatnonzero((route_m <= reach_m) & ~shares_road(road.take(others)))
    pairs = np.concatenate((pairs, others.take(kept, axis=1)), axis=1)
    order = (pairs[0] * len(travel) + pairs[1]).argsort()
    return pairs.take(order, axis=1), np.append(distance_m, route_m.take(kept)).take(order)


@dataclass(frozen=True, slots=True)
class NearPairs:
    """Hold the near pairs of one frame and how they follow from those of the frame before.

    Attributes
    ----------
    rows : (pairs,) which of those that were given.
    came_from : (pairs,) column of each pair in the frame before, -1 for a new one; None when nothing changed.
    ended : columns of the frame before whose pairs are gone.
    """

    rows: LongArray
    came_from: LongArray | None
    ended: LongArray


def pair_keys(serials: LongArray, pairs: LongArray) -> LongArray:
    """Give a number to each pair of objects, which nobody else has for as long as there are the two.

    Parameters
    ----------
    serials : (n,) of objects, below 2**31, rising within a frame.
    pairs : (2, pairs) of these, the lower in the first row.
    """
    keys: LongArray = (serials.take(pairs[0]) << 31) | serials.take(pairs[1])
    return keys


class NearSet:
    """Follow the set of near pairs from frame to frame.

    Objects are told apart by serial numbers that rise in order of first appearance and are never used twice, so that an
    object that takes the place of another makes new pairs.
    """

    def __init__(self) -> None:
        self._keys: LongArray = np.zeros(0, dtype=np.int64)

    def columns(self, serials: LongArray) -> LongArray:
        """Give the pairs of the last frame as (2, pairs) columns of this one, without those of which one is gone."""
        ends = np.array((self._keys >> 31, self._keys & (2**31 - 1)))
        if not len(serials):
            return ends[:, :0]
        columns = np.minimum(serials.searchsorted(ends), len(serials) - 1)
        return columns[:, (serials.take(columns) == ends).all(axis=0)]

    def update(self, keys: LongArray, may_enter: BoolArray) -> NearPairs:
        """Take the pairs of one frame that are near enough to stay.

        Parameters
        ----------
        keys : (pairs,) as from `pair_keys`, rising.
        may_enter : (pairs,) which of them are near enough to come in if they were not there in the last frame.
        """
        old = self._keys
        if len(old):
            column = old.searchsorted(keys)
            column[column == len(old)] = 0
            known = old.take(column) == keys
        else:
            column = np.zeros(len(keys), dtype=np.int64)
            known = column > 0
        rows = (known | may_enter).nonzero()[0]
        if len(rows) < len(keys):
            keys, column, known = keys.take(rows), column.take(rows), known.take(rows)
        if len(keys) == len(old) and known.all():
            return NearPairs(rows, None, np.zeros(0, dtype=np.int64))
        self._keys = keys
        gone = np.ones(len(old), dtype=np.bool_)
        gone[column[known]] = False
        return NearPairs(rows, np.where(known, column, -1), gone.nonzero()[0])
