"""Which pairs of objects are near enough to be looked at, and since when?

Near means near in the plane or, for cars that drive towards each other, near along their road.

A pair enters the near set at one radius and leaves it at a larger one, so that two cars at the rim do not come and go
with the noise. Cost per frame follows the number of near pairs, not the square of the number of objects.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import KDTree

FloatArray = NDArray[np.float64]
PairArray = NDArray[np.int64]
BoolArray = NDArray[np.bool_]

# Up to here comparing all pairs is quicker than building a tree.
_ALL_PAIRS_LIMIT = 60


def pairs_within(centre_m: FloatArray, half_length_m: FloatArray, radius_m: float) -> tuple[PairArray, FloatArray]:
    """List the pairs whose centres are nearer than the radius plus both half lengths.

    Parameters
    ----------
    centre_m : (n, 2). half_length_m : (n,). radius_m : of the gap between the ends, roughly.

    Returns
    -------
    (pairs, 2) indices, the lower first, in lexicographic order; and (pairs,) distances less both half lengths.

    Examples
    --------
    >>> centre_m = np.array([[0.0, 0.0], [30.0, 0.0], [90.0, 0.0]])
    >>> pairs_within(centre_m, np.full(3, 2.0), 40.0)
    (array([[0, 1]]), array([26.]))
    """
    count = len(centre_m)
    if count <= _ALL_PAIRS_LIMIT:
        first, second = np.triu_indices(count, 1)
    else:
        reach_m = radius_m + 2.0 * float(half_length_m.max())
        found = KDTree(centre_m, leafsize=16, compact_nodes=False, balanced_tree=False).query_pairs(
            reach_m, output_type="ndarray"
        )
        order = np.argsort(found[:, 0] * count + found[:, 1])
        first, second = found[order, 0], found[order, 1]
    apart_m = centre_m[first] - centre_m[second]
    distance_m = np.hypot(apart_m[:, 0], apart_m[:, 1]) - half_length_m[first] - half_length_m[second]
    near = np.flatnonzero(distance_m <= radius_m)
    return np.stack([first[near], second[near]], axis=1).astype(np.int64, copy=False), distance_m[near]


def facing_within(
    road: FloatArray, along_m: FloatArray, *, travel: FloatArray, half_length_m: FloatArray, reach_m: float
) -> tuple[PairArray, FloatArray]:
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
    forth = np.flatnonzero((road >= 0) & (travel > 0))
    back = np.flatnonzero((road >= 0) & (travel < 0))
    if not len(forth) or not len(back):
        return np.zeros((0, 2), dtype=np.int64), np.zeros(0)
    # One line holds all roads, so far apart that no pair reaches from one to the next.
    span_m = 2.0 * (float(np.abs(along_m).max()) + reach_m + 2.0 * float(half_length_m.max()))
    at_m = road * span_m + along_m
    back = back[np.argsort(at_m[back])]
    reach = reach_m + half_length_m[forth] + float(half_length_m.max())
    start = np.searchsorted(at_m[back], at_m[forth] - reach)
    count = np.searchsorted(at_m[back], at_m[forth] + reach, side="right") - start
    one = np.repeat(forth, count)
    other = back[np.arange(count.sum()) - np.repeat(np.cumsum(count) - count, count) + np.repeat(start, count)]
    distance_m = np.abs(at_m[one] - at_m[other]) - half_length_m[one] - half_length_m[other]
    first, second = np.minimum(one, other), np.maximum(one, other)
    order = np.argsort(first * len(road) + second)
    order = order[distance_m[order] <= reach_m]
    return np.stack([first[order], second[order]], axis=1).astype(np.int64, copy=False), distance_m[order]


@dataclass(frozen=True, slots=True)
class NearPairs:
    """Hold the near pairs of one frame and how they follow from those of the frame before.

    Attributes
    ----------
    first, second : (pairs,) indices of the objects in the frame.
    came_from : (pairs,) column of each pair in the frame before, -1 for a new one; None when nothing changed.
    ended : columns of the frame before whose pairs are gone.
    """

    first: PairArray
    second: PairArray
    came_from: PairArray | None
    ended: PairArray


class NearSet:
    """Follow the set of near pairs from frame to frame.

    Objects are told apart by serial numbers that rise in order of first appearance and are never used twice, so that an
    object that takes the place of another makes new pairs.
    """

    __slots__ = ("_keys",)

    def __init__(self) -> None:
        self._keys: PairArray = np.zeros(0, dtype=np.int64)

    def update(self, serials: PairArray, pairs: PairArray, may_enter: BoolArray) -> NearPairs:
        """Take the pairs of one frame that are near enough to stay.

        Parameters
        ----------
        serials : of the objects of the frame, rising, below 2**31.
        pairs : (pairs, 2) as given by `pairs_within`.
        may_enter : (pairs,) which of them are near enough to come in if they were not there in the last frame.
        """
        first, second = pairs[:, 0], pairs[:, 1]
        keys = (serials[first] << 31) | serials[second]
        old = self._keys
        column = np.searchsorted(old, keys)
        column[column == len(old)] = 0
        known = old[column] == keys if len(old) else np.zeros(len(keys), dtype=np.bool_)
        kept = known | may_enter
        if not kept.all():
            first, second, keys, column, known = first[kept], second[kept], keys[kept], column[kept], known[kept]
        if len(keys) == len(old) and known.all():
            return NearPairs(first, second, None, np.zeros(0, dtype=np.int64))
        self._keys = keys
        gone = np.ones(len(old), dtype=np.bool_)
        gone[column[known]] = False
        return NearPairs(first, second, np.where(known, column, -1), np.flatnonzero(gone))
