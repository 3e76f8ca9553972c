"""Near pairs against comparing everything with everything."""

import numpy as np
import pytest

from qsr.measuring.pairs import NearSet, facing_within, pair_keys, pairs_within


@pytest.mark.parametrize("count", [0, 1, 2, 40, 61, 300])
def test_pairs_within_are_those_of_all_pairs(count: int) -> None:
    rng = np.random.default_rng(count)
    centre_m, half_m = rng.uniform(0, 200, (count, 2)), rng.uniform(1, 8, count)
    pairs, _ = pairs_within(centre_m, half_m, 30.0)
    expected = [
        [i, j]
        for i in range(count)
        for j in range(i + 1, count)
        if np.hypot(*(centre_m[i] - centre_m[j])) - half_m[i] - half_m[j] <= 30.0
    ]
    assert pairs.T.tolist() == expected


@pytest.mark.parametrize("count", [0, 1, 2, 40, 300])
def test_facing_pairs_are_those_of_all_pairs_on_one_road_with_opposite_directions(count: int) -> None:
    rng = np.random.default_rng(count)
    road, along_m = rng.integers(-1, 4, count).astype(np.float64), rng.uniform(-20, 600, count)
    travel, half_m = rng.choice([-1.0, 0.0, 1.0], count), rng.uniform(1, 8, count)
    pairs, distance_m = facing_within(road, along_m, travel=travel, half_length_m=half_m, reach_m=60.0)
    expected = {
        (i, j): abs(along_m[i] - along_m[j]) - half_m[i] - half_m[j]
        for i in range(count)
        for j in range(i + 1, count)
        if road[i] == road[j] >= 0 and travel[i] * travel[j] < 0
    }
    near = {pair: apart_m for pair, apart_m in expected.items() if apart_m <= 60.0}
    assert [tuple(pair) for pair in pairs.T.tolist()] == list(near)
    assert distance_m == pytest.approx(list(near.values()))


def test_pair_stays_between_the_radii_only_if_it_was_near() -> None:
    near_set = NearSet()
    serials, half_m = np.array([0, 1]), np.full(2, 2.0)
    sizes = []
    for x_m in (47.0, 43.0, 47.0, 50.0, 47.0):
        pairs, distance_m = pairs_within(np.array([[0.0, 0.0], [x_m, 0.0]]), half_m, 45.0)
        sizes.append(len(near_set.update(pair_keys(serials, pairs), distance_m <= 40.0).rows))
    assert sizes == [0, 1, 1, 0, 0]


def test_columns_of_the_last_frame_are_found_again() -> None:
    near_set = NearSet()
    row_m = np.array([[0.0, 0.0], [10.0, 0.0], [20.0, 0.0]])
    found, distance_m = pairs_within(row_m, np.zeros(3), 45.0)
    near_set.update(pair_keys(np.array([0, 1, 2]), found), distance_m <= 40.0)
    pairs = near_set.update(pair_keys(np.array([0, 2, 3]), found), distance_m <= 40.0)
    assert pairs.came_from is not None
    assert pairs.came_from.tolist() == [1, -1, -1]  # columns were (0, 1), (0, 2), (1, 2)
    assert pairs.ended.tolist() == [0, 2]


def test_nothing_new_is_said_when_the_pairs_stay() -> None:
    near_set = NearSet()
    arguments = pair_keys(np.array([0, 1]), np.array([[0], [1]])), np.array([True])
    near_set.update(*arguments)
    assert near_set.update(*arguments).came_from is None
