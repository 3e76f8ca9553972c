"""Which pairs of objects are near enough to be looked at, and since when?

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

    __slots__ = ("_enter_m", "_keys", "_leave_m")

    def __init__(self, *, enter_radius_m: float, leave_radius_m: float) -> None:
        self._enter_m = enter_radius_m
        self._leave_m = leave_radius_m
        self._keys: PairArray = np.zeros(0, dtype=np.int64)

    def update(self, serials: PairArray, centre_m: FloatArray, half_length_m: FloatArray) -> NearPairs:
        """Take the objects of one frame, in rising order of their serial numbers (below 2**31)."""
        pairs, distance_m = pairs_within(centre_m, half_length_m, self._leave_m)
        first, second = pairs[:, 0], pairs[:, 1]
        keys = (serials[first] << 31) | serials[second]
        old = self._keys
        column = np.searchsorted(old, keys)
        column[column == len(old)] = 0
        known = old[column] == keys if len(old) else np.zeros(len(keys), dtype=np.bool_)
        kept = known | (distance_m <= self._enter_m)
        if not kept.all():
            first, second, keys, column, known = first[kept], second[kept], keys[kept], column[kept], known[kept]
        if len(keys) == len(old) and known.all():
            return NearPairs(first, second, None, np.zeros(0, dtype=np.int64))
        self._keys = keys
        gone = np.ones(len(old), dtype=np.bool_)
        gone[column[known]] = False
        return NearPairs(first, second, np.where(known, column, -1), np.flatnonzero(gone))
