"""Homographies from pairs of points, some of them wrong."""

import cv2
import numpy as np

from tests.vision.support import FloatArray
from vision.registration.plane_fit import fit_plane, transform
from vision.registration.settings import RegistrationSettings

CORNERS = np.array([[0.0, 0.0], [1279, 0], [1279, 719], [0, 719]])
TILTED = np.array([[1.02, 0.05, 14.0], [-0.04, 0.98, -9.0], [4e-6, -3e-6, 1.0]])


def pairs(rng: np.random.Generator, count: int) -> tuple[FloatArray, FloatArray]:
    source = rng.uniform(0, [1280, 720], (count, 2))
    return source, transform(TILTED, source)


def test_exact_pairs_give_the_exact_map() -> None:
    source, target = pairs(np.random.default_rng(1), 50)
    fit = fit_plane(source, target, RegistrationSettings())
    assert fit is not None
    assert fit.is_inlier.all()
    assert np.allclose(fit.matrix, TILTED, rtol=1e-5, atol=1e-7)


def test_wrong_pairs_are_left_out() -> None:
    rng = np.random.default_rng(2)
    for share in (0.1, 0.3, 0.5):
        source, target = pairs(rng, 80)
        target += rng.normal(0, 0.2, target.shape)
        wrong = rng.permutation(80) < share * 80
        target[wrong] += rng.uniform(20, 200, (int(wrong.sum()), 2))
        fit = fit_plane(source, target, RegistrationSettings())
        assert fit is not None
        assert not fit.is_inlier[wrong].any()
        oracle = cv2.findHomography(source[~wrong], target[~wrong])[0]  # least squares, told which pairs are right
        assert np.abs(transform(fit.matrix, CORNERS) - transform(oracle, CORNERS)).max() < 0.25


def test_pairs_without_a_common_map_give_none() -> None:
    rng = np.random.default_rng(3)
    assert fit_plane(rng.uniform(0, 1000, (60, 2)), rng.uniform(0, 1000, (60, 2)), RegistrationSettings()) is None


def test_too_few_pairs_give_none() -> None:
    source, target = pairs(np.random.default_rng(4), 7)
    assert fit_plane(source, target, RegistrationSettings()) is None
