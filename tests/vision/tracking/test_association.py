"""Assignment against trying every choice."""

from itertools import permutations

import numpy as np
import pytest

from tests.cases import for_each
from vision.tracking.association import NEVER_ALONE, FloatArray, assign


def best_by_trying(cost: FloatArray, alone: float) -> float:
    """The least cost of all ways to deal columns to rows, some of which are left alone."""
    rows, columns = cost.shape
    wide = np.concatenate([cost, np.full((rows, rows), alone)], axis=1)
    return min(float(wide[np.arange(rows), order].sum()) for order in permutations(range(columns + rows), rows))


@for_each("seed", range(20))
@pytest.mark.parametrize("alone", [NEVER_ALONE, 16.0, 6.0])
def test_assignment_is_the_best_of_all(seed: int, alone: float) -> None:
    rng = np.random.default_rng(seed)
    cost = rng.uniform(0, 16, tuple(rng.integers(1, 5, 2)))
    cost[rng.random(cost.shape) < 0.4] = np.inf
    rows, columns = assign(cost, alone=alone)
    assert len(set(rows)) == len(set(columns)) == len(rows)
    total = cost[rows, columns].sum() + alone * (len(cost) - len(rows))
    assert total == pytest.approx(best_by_trying(cost, alone), rel=1e-12)


def test_nothing_allowed_gives_no_pair() -> None:
    assert [len(side) for side in assign(np.full((2, 3), np.inf))] == [0, 0]
    assert [len(side) for side in assign(np.zeros((0, 3)))] == [0, 0]
