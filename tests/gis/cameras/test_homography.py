"""Fitted homographies against those of OpenCV."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from gis.cameras.homography import fit_homography
from gis.errors import GisError
from tests.gis.support import FloatArray

TRUE = np.array([[9.0, 1.5, 300.0], [0.4, -3.0, 500.0], [0.0004, 0.011, 1.0]])


def project(matrix: FloatArray, points: FloatArray) -> FloatArray:
    mapped = np.column_stack((points, np.ones(len(points)))) @ matrix.T
    return np.asarray(mapped[:, :2] / mapped[:, 2:])


@pytest.mark.parametrize("seed", range(5))
def test_the_squared_error_is_no_larger_than_that_of_opencv(seed: int) -> None:
    rng = np.random.default_rng(seed)
    ground_m = rng.uniform([-20.0, 0.0], [20.0, 80.0], (9, 2))
    pixels_px = project(TRUE, ground_m) + rng.normal(0.0, 2.0, (9, 2))
    peer, _ = cv2.findHomography(ground_m, pixels_px)
    ours = np.square(project(fit_homography(ground_m, pixels_px), ground_m) - pixels_px).sum()
    theirs = np.square(project(np.asarray(peer, dtype=np.float64), ground_m) - pixels_px).sum()
    assert ours <= theirs * (1.0 + 1e-6)


def test_a_long_thin_strip_of_road_is_fitted() -> None:
    ground_m = np.array([[x, y] for x in np.linspace(0.0, 2000.0, 6) for y in (0.0, 3.5)]) + 650_000.0
    matrix = np.array([[0.6, 0.0, -390_000.0], [0.0, -0.9, 585_010.0], [0.0, 0.0, 1.0]])
    fitted = fit_homography(ground_m, project(matrix, ground_m))
    np.testing.assert_allclose(project(fitted, ground_m), project(matrix, ground_m), atol=1e-4)


def test_four_points_of_which_three_are_on_a_line_are_an_error() -> None:
    ground_m = np.array([[0.0, 0.0], [10.0, 0.0], [20.0, 0.0], [5.0, 30.0]])
    with pytest.raises(GisError, match="four of them, no three on a line, got pairs that leave it open"):
        fit_homography(ground_m, project(TRUE, ground_m))
