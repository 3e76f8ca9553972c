"""Which objects found may be which true objects of the same frame, and which of them are?

A score first lists the *candidate pairs* with their similarity, then assigns one to one within each frame. Few objects
have more than one candidate, so whatever has no rival is taken at once and only the rest of a frame is solved.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment
from scipy.spatial import cKDTree

from vision.objects import Table

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
BoolArray = NDArray[np.bool_]
StrArray = NDArray[np.str_]


@dataclass(frozen=True, slots=True, eq=False)
class Pairs(Table):
    """Candidate pairs, ordered by true row, then by found row; both rows of a pair are of the same frame.

    Attributes
    ----------
    true_row, found_row : (p,) rows of the two sides.
    similarity : (p,) in (0, 1]; a pair that is left out has similarity 0.
    """

    true_row: IntArray
    found_row: IntArray
    similarity: FloatArray

    def __len__(self) -> int:
        return len(self.true_row)


def ground_pairs(
    true_frame: IntArray, true_m: FloatArray, found_frame: IntArray, found_m: FloatArray, *, reach_m: float
) -> Pairs:
    """List the pairs of one frame whose centres are less than a reach apart.

    Parameters
    ----------
    true_frame, found_frame : (n,) and (m,) frame numbers.
    true_m, found_m : (n, 2) and (m, 2) centres on the ground.
    reach_m : the distance at which similarity falls to 0; positive.

    Returns
    -------
    Pairs with similarity 1 - distance / reach.

    Examples
    --------
    >>> frame = np.array([0, 1])
    >>> here_m, there_m = np.array([[0.0, 0.0], [0.0, 0.0]]), np.array([[1.0, 0.0], [9.0, 0.0]])
    >>> pairs = ground_pairs(frame, here_m, frame, there_m, reach_m=4.0)
    >>> pairs.true_row.tolist(), pairs.found_row.tolist(), pairs.similarity.tolist()
    ([0], [0], [0.75])
    """
    # One tree for all frames: in the third direction, frames are farther apart than the reach.
    true_tree = cKDTree(np.column_stack((true_m, 2 * reach_m * true_frame)))
    found_tree = cKDTree(np.column_stack((found_m, 2 * reach_m * found_frame)))
    near = true_tree.sparse_distance_matrix(found_tree, reach_m, output_type="ndarray")
    near = near[near["v"] < reach_m]
    order = np.lexsort((near["j"], near["i"]))
    near = near[order]
    return Pairs(near["i"].astype(np.int64), near["j"].astype(np.int64), 1 - near["v"] / reach_m)


def box_pairs(true_frame: IntArray, true_px: FloatArray, found_frame: IntArray, found_px: FloatArray) -> Pairs:
    """List the pairs of one frame whose boxes overlap in the image.

    Parameters
    ----------
    true_frame, found_frame : (n,) and (m,) frame numbers.
    true_px, found_px : (n, 4) and (m, 4) left, top, width, height.

    Returns
    -------
    Pairs whose similarity is intersection over union, as tracker benchmarks have it.

    Examples
    --------
    >>> box_px = np.array([[0.0, 0.0, 10.0, 10.0]])
    >>> box_pairs(np.array([3]), box_px, np.array([3]), box_px + [5.0, 0.0, 0.0, 0.0]).similarity.round(3).tolist()
    [0.333]
    """
    rows, columns, overlaps = [np.zeros(0, np.int64)], [np.zeros(0, np.int64)], [np.zeros(0)]
    for true_rows, found_rows in _rows_by_frame(true_frame, found_frame):
        overlap = _overlap(true_px[true_rows], found_px[found_rows])
        row, column = np.nonzero(overlap > 0)
        rows.append(true_rows[row])
        columns.append(found_rows[column])
        overlaps.append(overlap[row, column])
    pairs = Pairs(np.concatenate(rows), np.concatenate(columns), np.concatenate(overlaps))
    return pairs.select(np.lexsort((pairs.found_row, pairs.true_row)))


def assign(pairs: Pairs, frame: IntArray, score: FloatArray) -> BoolArray:
    """Choose pairs one to one so that their scores sum to the most.

    Parameters
    ----------
    pairs : the candidates.
    frame : (p,) the frame of each candidate.
    score : (p,) positive.

    Returns
    -------
    (p,) which candidates are chosen.

    Examples
    --------
    >>> pairs = Pairs(np.array([0, 0, 1]), np.array([0, 1, 1]), np.array([0.5, 0.6, 0.9]))
    >>> assign(pairs, np.zeros(3, np.int64), pairs.similarity).tolist()
    [True, False, True]
    """
    chosen = is_alone(pairs)
    rivals = np.flatnonzero(~chosen)
    for group in groups_of(frame[rivals]):
        at = rivals[group]
        chosen[at] = choose(pairs.true_row[at], pairs.found_row[at], score[at])
    return chosen


def is_alone(pairs: Pairs) -> BoolArray:
    """Tell which pairs share neither side with another pair."""
    of_true, of_found = np.bincount(pairs.true_row), np.bincount(pairs.found_row)
    return np.asarray((of_true[pairs.true_row] == 1) & (of_found[pairs.found_row] == 1))


def groups_of(key: IntArray) -> Iterator[IntArray]:
    """Yield the places of equal keys, smallest key first."""
    if len(key):
        order = np.argsort(key, kind="stable")
        yield from np.split(order, np.flatnonzero(np.diff(key[order])) + 1)


def choose(true_row: IntArray, found_row: IntArray, score: FloatArray) -> BoolArray:
    """Choose among the candidates of one frame so that their scores sum to the most."""
    rows, row = np.unique(true_row, return_inverse=True)
    columns, column = np.unique(found_row, return_inverse=True)
    table = np.zeros((len(rows), len(columns)))
    table[row, column] = score
    taken = np.zeros(table.shape, np.bool_)
    taken[linear_sum_assignment(-table)] = True
    return np.asarray(taken[row, column])


def _rows_by_frame(true_frame: IntArray, found_frame: IntArray) -> Iterator[tuple[IntArray, IntArray]]:
    """Yield the rows of each frame that has rows on both sides."""
    found = {int(found_frame[rows[0]]): rows for rows in groups_of(found_frame)}
    for rows in groups_of(true_frame):
        others = found.get(int(true_frame[rows[0]]))
        if others is not None:
            yield rows, others


def _overlap(boxes: FloatArray, others: FloatArray) -> FloatArray:
    """Compute intersection over union of (n, 4) and (m, 4) boxes: (n, m)."""
    low = np.maximum(boxes[:, None, :2], others[None, :, :2])
    high = np.minimum((boxes[:, :2] + boxes[:, 2:])[:, None], (others[:, :2] + others[:, 2:])[None])
    shared = np.prod(np.clip(high - low, 0, None), axis=-1)
    whole = np.prod(boxes[:, 2:], axis=1)[:, None] + np.prod(others[:, 2:], axis=1)[None] - shared
    return np.asarray(np.divide(shared, whole, out=np.zeros_like(shared), where=whole > 0))
