"""Many filters at once against one at a time."""

import numpy as np
import pytest

from vision.tracking import kalman
from vision.tracking.kalman import FloatArray


def random_tracks(seed: int, count: int) -> tuple[FloatArray, FloatArray]:
    rng = np.random.default_rng(seed)
    root = rng.normal(size=(count, 4, 4))
    return rng.normal(size=(count, 4)) * 10, root @ root.transpose(0, 2, 1) + np.eye(4)


def textbook_step(
    state: FloatArray, covariance: FloatArray, heading: float, measured: FloatArray, noise: FloatArray, *, dt: float
) -> tuple[FloatArray, FloatArray]:
    """One object, matrices spelled out (Bar-Shalom, Li, Kirubarajan 2001, sections 5.2 and 6.2)."""
    turn = np.array([[np.cos(heading), -np.sin(heading)], [np.sin(heading), np.cos(heading)]])
    acceleration = turn @ np.diag([3.0**2, 1.0**2]) @ turn.T
    transition = np.block([[np.eye(2), dt * np.eye(2)], [np.zeros((2, 2)), np.eye(2)]])
    process = np.block(
        [[dt**3 / 3 * acceleration, dt**2 / 2 * acceleration], [dt**2 / 2 * acceleration, dt * acceleration]]
    )
    state, covariance = transition @ state, transition @ covariance @ transition.T + process
    look = np.hstack([np.eye(2), np.zeros((2, 2))])
    gain = covariance @ look.T @ np.linalg.inv(look @ covariance @ look.T + noise)
    return state + gain @ (measured - look @ state), (np.eye(4) - gain @ look) @ covariance


@pytest.mark.parametrize("dt_s", [0.04, 0.2])
def test_many_tracks_at_once_are_many_single_filters(dt_s: float) -> None:
    rng = np.random.default_rng(1)
    state, covariance = random_tracks(0, 12)
    heading, measured = rng.uniform(-3, 3, 12), rng.normal(size=(12, 2)) * 10
    noise = kalman.oriented_covariance(heading, rng.uniform(0.2, 1, 12), rng.uniform(0.2, 1, 12))
    acceleration = kalman.oriented_covariance(heading, np.full(12, 3.0), np.full(12, 1.0))
    predicted = kalman.predict(state, covariance, acceleration, dt_s)
    fast_state, fast_covariance = kalman.update(*predicted, measured, noise)
    for i in range(12):
        slow = textbook_step(state[i], covariance[i], heading[i], measured[i], noise[i], dt=dt_s)
        assert fast_state[i] == pytest.approx(slow[0])
        assert fast_covariance[i] == pytest.approx(slow[1])


def test_two_short_steps_are_one_long_step() -> None:
    state, covariance = random_tracks(3, 5)
    acceleration = np.broadcast_to(np.diag([9.0, 1.0]), (5, 2, 2))
    once = kalman.predict(state, covariance, acceleration, 0.08)
    twice = kalman.predict(*kalman.predict(state, covariance, acceleration, 0.04), acceleration, 0.04)
    assert once[0] == pytest.approx(twice[0])
    assert once[1] == pytest.approx(twice[1])


def test_distances_are_those_of_the_definition() -> None:
    state, covariance = random_tracks(4, 3)
    measured = np.random.default_rng(5).normal(size=(4, 2)) * 10
    noise = np.broadcast_to(np.diag([0.3, 0.5]), (4, 2, 2))
    fast = kalman.squared_distance(state[:, None], covariance[:, None], measured[None], noise[None])
    for i in range(3):
        for j in range(4):
            difference = measured[j] - state[i, :2]
            slow = difference @ np.linalg.inv(covariance[i, :2, :2] + noise[j]) @ difference
            assert fast[i, j] == pytest.approx(slow)
