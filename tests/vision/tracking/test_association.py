"""Assignment against trying every choice."""

from itertools import permutations

import numpy as np
import pytest

from tests.cases import for_each
from vision.tracking.association import FloatArray, assign


def best_by_trying(cost: FloatArray) -> tuple[int, float]:
    """Every way to deal columns to rows: most pairs first, then least cost."""
    size = max(cost.shape)
    square = np.full((size, size), np.inf)
    square[: cost.shape[0], : cost.shape[1]] = cost
    results = []
    for order in permutations(range(size)):
        taken = square[np.arange(size), order]
        results.append((-int(np.isfinite(taken).sum()), float(taken[np.isfinite(taken)].sum())))
    count, total = min(results)
    return -count, total


@for_each("seed", range(20))
def test_assignment_is_the_best_of_all(seed: int) -> None:
    rng = np.random.default_rng(seed)
    cost = rng.uniform(0, 16, tuple(rng.integers(1, 6, 2)))
    cost[rng.random(cost.shape) < 0.4] = np.inf
    rows, columns = assign(cost)
    count, total = best_by_trying(cost)
    assert len(rows) == count
    assert len(set(rows)) == len(set(columns)) == count
    assert cost[rows, columns].sum() == pytest.approx(total)


def test_nothing_allowed_gives_no_pair() -> None:
    assert [len(side) for side in assign(np.full((2, 3), np.inf))] == [0, 0]
    assert [len(side) for side in assign(np.zeros((0, 3)))] == [0, 0]
