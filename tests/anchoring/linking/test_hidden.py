"""Where hidden cars were: many at once as one by one, from where they were seen last to where they were seen next."""

from dataclasses import replace
from functools import partial

import numpy as np

from anchoring.linking.frame import RoadMap
from anchoring.linking.hidden import hidden_path
from anchoring.linking.ways import Looks
from anchoring.settings import AnchoringSettings
from gis.roads.lanes import Lane
from gis.roads.road_network import RoadNetwork

S = 1_000_000
EAST = Lane("we_0", "we", 0, "we", +1, np.array([[0.0, 0.0], [200.0, 0.0]]), 8.0, 25.0)
SETTINGS = AnchoringSettings()
ROADS = RoadMap(RoadNetwork([EAST]), SETTINGS)
path = partial(hidden_path, roads=ROADS, settings=SETTINGS)


def looks(t_us: np.ndarray, x_m: np.ndarray, y_m: np.ndarray, speed_mps: np.ndarray) -> Looks:
    """Look at cars that drive along the road where they are on it, and north elsewhere."""
    centre_m = np.stack([x_m, y_m], axis=1)
    at = ROADS.locate(centre_m)
    heading_rad = np.where(at.road < 0, np.pi / 2, at.tangent_rad)
    size_m = np.full(len(t_us), 4.0)
    return Looks(
        t_us=t_us,
        centre_m=centre_m,
        velocity_mps=speed_mps[:, None] * np.stack([np.cos(heading_rad), np.sin(heading_rad)], axis=1),
        heading_rad=heading_rad,
        length_m=size_m,
        has_front=size_m > 0.0,
        width_m=size_m,
        is_whole=size_m > 0.0,
        road=at.road,
        along_m=at.along_m,
        across_m=at.across_m,
        tangent_rad=at.tangent_rad,
    )


def test_many_hidden_cars_are_followed_as_each_alone() -> None:
    rng = np.random.default_rng(3)
    count = 40
    begun_us = rng.integers(0, S, count)
    # A quarter each: on along the road, to where it stands or crawls, off the road, and from the open to the road.
    before_m = rng.uniform((10, -3), (60, 3), (count, 2)) + np.repeat([[0, 0], [0, 0], [0, 50], [0, 50]], 10, axis=0)
    after_m = before_m + np.repeat([[35, 0], [1, 0], [5, 30], [5, -50]], 10, axis=0)
    end = looks(begun_us, *before_m.T, rng.uniform(0, 30, count))
    start = looks(begun_us + 3 * S, *after_m.T, rng.uniform(0, 30, count))
    span = np.arange(count).repeat(31)
    t_us = (begun_us[:, None] + np.arange(31) * S // 10).ravel()

    sigma_m = rng.uniform(0.0, 2.0, count)
    centre_m, heading_rad, speed_mps = path(end, start, span, t_us, sigma_m=sigma_m)

    for car in range(count):
        own = span == car
        row = np.array([car])
        only = np.zeros(31, np.int64)
        alone = path(end.take(row), start.take(row), only, t_us[own], sigma_m=sigma_m[row])
        together = centre_m[:, own], heading_rad[own], speed_mps[own]
        for one, other in zip(together, alone, strict=True):
            np.testing.assert_allclose(one, other, rtol=0, atol=1e-12)
        np.testing.assert_allclose(alone[0][:, 0], before_m[car], atol=1e-9)
        np.testing.assert_allclose(alone[0][:, -1], after_m[car], atol=1e-9)
        if car < 20:  # nobody drives back along the road
            assert np.all(np.diff(ROADS.locate(alone[0].T).along_m) > -1e-6)


def test_hidden_car_that_stood_still_in_between_is_told_as_slow_not_as_backing() -> None:
    end = looks(np.array([0]), np.array([20.0]), np.zeros(1), np.array([20.0]))
    start = looks(np.array([4 * S]), np.array([30.0]), np.zeros(1), np.array([20.0]))
    t_us = np.arange(0, 4 * S + 1, S // 5)

    only = np.zeros(len(t_us), np.int64)
    centre_m, _, speed_mps = path(end, start, only, t_us, sigma_m=np.zeros(1))

    assert np.all(np.diff(centre_m[0]) >= 0.0)
    assert speed_mps.min() < 1.0
    assert speed_mps.max() > 2.5
    faster = replace(start, centre_m=np.array([[90.0, 0.0]]), along_m=np.array([90.0]))
    assert path(end, faster, only[:1], t_us[:1], sigma_m=np.zeros(1))[2] == 20.0
