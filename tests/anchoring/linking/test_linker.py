"""The best one-to-one choice against trying every choice."""

import itertools
import math

import numpy as np
import pytest

from anchoring.linking.linker import Looks, assign, fit_costs, keep_order
from anchoring.settings import AnchoringSettings
from tests.cases import for_each


def best_of_all(costs: np.ndarray, unmatched: float) -> tuple[float, set[tuple[int, int]]]:
    """Try every way to give each row a column of its own, or none."""
    rows, columns = costs.shape
    best: tuple[float, set[tuple[int, int]]] = (math.inf, set())
    for choice in itertools.product(range(-1, columns), repeat=rows):
        taken = [column for column in choice if column >= 0]
        if len(set(taken)) < len(taken):
            continue
        total = sum(unmatched if column < 0 else costs[row, column] for row, column in enumerate(choice))
        if total < best[0]:
            best = (total, {(row, column) for row, column in enumerate(choice) if column >= 0})
    return best


@for_each("seed", range(60))
def test_assignment_is_the_best_of_all_and_clear(seed: int) -> None:
    rng = np.random.default_rng(seed)
    costs = rng.uniform(0, 4, (int(rng.integers(1, 5)), int(rng.integers(1, 5))))
    costs[rng.random(costs.shape) < 0.3] = np.inf
    total, pairs = best_of_all(costs, 3.0)
    expected = set()
    for pair in pairs:
        without = costs.copy()
        without[pair] = np.inf
        if best_of_all(without, 3.0)[0] - total >= 0.5:
            expected.add(pair)
    assert set(assign(costs, unmatched=3.0, margin=0.5)) == expected


def looks(x_m: list[float], y_m: list[float], *, heading_rad: float = 0.0, length_m: float = 4.5) -> Looks:
    count = len(x_m)
    none = np.full(count, np.nan)
    speed = np.array([math.cos(heading_rad), math.sin(heading_rad)]) * 10.0
    return Looks(
        centre_m=np.stack([np.array(x_m), np.array(y_m)], axis=1),
        velocity_mps=np.tile(speed, (count, 1)),
        heading_rad=np.full(count, heading_rad),
        length_m=np.full(count, length_m),
        road=np.full(count, -1, dtype=np.int32),
        along_m=none,
        across_m=none,
        tangent_rad=none,
    )


def cost(seen: Looks, lost: Looks, elapsed_s: float = 1.0) -> float:
    settings = AnchoringSettings()
    return float(
        fit_costs(seen, lost, np.array([elapsed_s]), has_length=np.ones(1, dtype=bool), settings=settings)[0, 0]
    )


def test_perfect_fit_costs_nothing() -> None:
    assert cost(looks([3.0], [4.0]), looks([3.0], [4.0])) == 0.0


@pytest.mark.parametrize(
    "seen",
    [
        pytest.param(looks([6.0], [0.0]), id="too far along"),
        pytest.param(looks([0.0], [3.0]), id="too far across"),
        pytest.param(looks([0.0], [0.0], heading_rad=math.pi), id="oncoming"),
        pytest.param(looks([0.0], [0.0], length_m=12.0), id="too long"),
    ],
)
def test_what_misses_a_window_is_impossible(seen: Looks) -> None:
    assert cost(seen, looks([0.0], [0.0])) == math.inf


def test_window_along_the_road_grows_with_time() -> None:
    seen, lost = looks([6.0], [0.0]), looks([0.0], [0.0])
    assert cost(seen, lost, elapsed_s=1.0) == math.inf
    assert cost(seen, lost, elapsed_s=2.0) < 1.0


def test_cars_in_one_lane_keep_their_order() -> None:
    seen, lost = looks([0.0, 6.0], [0.0, 0.5]), looks([0.0, 6.0], [0.0, 0.5])
    assert keep_order([(0, 0), (1, 1)], seen, lost, same_lane_m=2.0) == [(0, 0), (1, 1)]
    assert keep_order([(0, 1), (1, 0)], seen, lost, same_lane_m=2.0) == []


def test_cars_in_two_lanes_may_change_their_order() -> None:
    seen, lost = looks([0.0, 6.0], [0.0, 3.5]), looks([6.0, 0.0], [0.0, 3.5])
    assert keep_order([(0, 0), (1, 1)], seen, lost, same_lane_m=2.0) == [(0, 0), (1, 1)]
