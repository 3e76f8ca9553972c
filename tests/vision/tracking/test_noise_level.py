"""The noise of detections: learned where they claim too little, left alone where they do not."""

import numpy as np
import pytest

from vision.tracking.noise_level import NoiseLevel
from vision.tracking.settings import TrackingSettings

SETTINGS = TrackingSettings()
STEP_US = 40_000


@pytest.mark.parametrize("variance_ratio", [1.5, 2.25, 4.0])
def test_factor_is_found_by_which_claims_fall_short(variance_ratio: float) -> None:
    rng, level = np.random.default_rng(1), NoiseLevel(SETTINGS)
    factors = []
    for _ in range(1000):
        level.learn(rng.chisquare(2, 10) * variance_ratio / level.factor, STEP_US)
        factors.append(level.factor)
    assert np.mean(factors[500:]) == pytest.approx(variance_ratio, rel=0.15)


def test_claims_that_are_right_or_too_modest_stay_as_they_are() -> None:
    rng = np.random.default_rng(1)
    for variance_ratio, most in ((1.0, 1.2), (0.3, 1.0)):
        level = NoiseLevel(SETTINGS)
        for _ in range(1000):
            level.learn(rng.chisquare(2, 10) * variance_ratio / level.factor, STEP_US)
        assert 1.0 <= level.factor <= most


def test_the_odd_false_sighting_moves_it_no_more_than_any_other() -> None:
    near, far = NoiseLevel(SETTINGS), NoiseLevel(SETTINGS)
    near.learn(np.array([2.0, 2.0]), STEP_US)
    far.learn(np.array([2.0, 1e9]), STEP_US)
    assert near.factor == far.factor > 1.0


def test_factor_is_bounded_and_nothing_seen_changes_nothing() -> None:
    level = NoiseLevel(SETTINGS)
    level.learn(np.zeros(0), STEP_US)
    assert level.factor == 1.0
    level.learn(np.full(10_000, 100.0), STEP_US)
    assert level.factor == pytest.approx(SETTINGS.most_noise)
