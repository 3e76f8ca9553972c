"""Pixels to the ground and back, and what a camera sees of it."""

from __future__ import annotations

import numpy as np
import pytest

from gis.cameras.camera import GroundCamera
from gis.errors import GisError
from tests.gis.support import FloatArray

FROM_ABOVE = [[0.5, 0.0, 100.0], [0.0, -0.5, 80.0], [0.0, 0.0, 1.0]]


def tilted_camera(*, pitch_deg: float, height_m: float = 10.0, focal_px: float = 800.0) -> GroundCamera:
    """Look north from above the origin, in an image of 1280 x 720."""
    sine, cosine = np.sin(np.radians(pitch_deg)), np.cos(np.radians(pitch_deg))
    lens = np.array([[focal_px, 0.0, 640.0], [0.0, focal_px, 360.0], [0.0, 0.0, 1.0]])
    turned = np.array([[1.0, 0.0, 0.0], [0.0, -sine, height_m * cosine], [0.0, cosine, height_m * sine]])
    return GroundCamera.from_homography(np.linalg.inv(lens @ turned))


def ground_points(count: int, seed: int) -> FloatArray:
    rng = np.random.default_rng(seed)
    return np.column_stack((rng.uniform(-8.0, 8.0, count), rng.uniform(15.0, 90.0, count)))


def test_pixels_map_to_the_ground_and_back() -> None:
    camera, points_m = tilted_camera(pitch_deg=20.0), ground_points(50, 1)
    np.testing.assert_allclose(camera.to_ground(camera.to_pixels(points_m)), points_m)


def test_the_sign_of_the_homography_does_not_matter() -> None:
    camera = tilted_camera(pitch_deg=20.0)
    same = GroundCamera.from_homography(-3.0 * camera.ground_from_pixel)
    np.testing.assert_allclose(same.to_pixels([[0.0, 30.0]]), camera.to_pixels([[0.0, 30.0]]))
    assert np.isfinite(same.to_ground([[640.0, 700.0]])).all()


def test_pixels_above_the_horizon_and_points_behind_the_camera_have_no_image() -> None:
    camera = tilted_camera(pitch_deg=20.0)
    horizon_px = 360.0 - 800.0 * np.tan(np.radians(20.0))
    assert np.isnan(camera.to_ground([[640.0, horizon_px - 1.0]])).all()
    assert camera.to_ground([[640.0, horizon_px + 1.0]])[0, 1] > 1000.0
    assert np.isnan(camera.to_pixels([[0.0, -50.0]])).all()
    assert np.isnan(camera.metres_per_pixel([[0.0, -50.0]])).all()


def test_metres_per_pixel_is_the_root_of_the_area_of_a_small_square() -> None:
    camera, points_m = tilted_camera(pitch_deg=20.0), ground_points(10, 2)
    east_m, north_m = np.array([0.001, 0.0]), np.array([0.0, 0.001])
    east_px = camera.to_pixels(points_m + east_m) - camera.to_pixels(points_m)
    north_px = camera.to_pixels(points_m + north_m) - camera.to_pixels(points_m)
    area_px = np.abs(east_px[:, 0] * north_px[:, 1] - east_px[:, 1] * north_px[:, 0])
    np.testing.assert_allclose(camera.metres_per_pixel(points_m), 0.001 / np.sqrt(area_px), rtol=1e-3)


def test_metres_per_pixel_seen_from_above_is_the_scale() -> None:
    assert GroundCamera.from_homography(FROM_ABOVE).metres_per_pixel([[3.0, 4.0]]).tolist() == [pytest.approx(0.5)]


def test_the_view_outline_reaches_the_outer_edges_of_the_corner_pixels() -> None:
    outline_m = GroundCamera.from_homography(FROM_ABOVE).view_outline(200, 100)
    assert outline_m.tolist() == [[99.75, 80.25], [99.75, 30.25], [199.75, 30.25], [199.75, 80.25]]


def test_the_view_outline_ends_before_the_horizon() -> None:
    camera = tilted_camera(pitch_deg=20.0)
    outline_m = camera.view_outline(1280, 720)
    assert outline_m.shape == (4, 2)
    assert np.isfinite(outline_m).all()
    assert 300.0 < outline_m[:, 1].max() < 1000.0
    pixels_px = camera.to_pixels(outline_m)
    assert pixels_px[:, 0].min() == pytest.approx(-0.5)
    assert pixels_px[:, 1].max() == pytest.approx(719.5)


def test_a_view_rolled_so_that_one_corner_shows_sky_has_five_corners() -> None:
    roll = np.radians(20.0)
    turn = np.array([[np.cos(roll), -np.sin(roll), 0.0], [np.sin(roll), np.cos(roll), 0.0], [0.0, 0.0, 1.0]])
    camera = GroundCamera.from_homography(tilted_camera(pitch_deg=20.0).ground_from_pixel @ turn)
    assert camera.view_outline(900, 500).shape == (5, 2)


def test_a_view_of_nothing_but_sky_is_an_error() -> None:
    with pytest.raises(GisError, match="expected ground in the 1280 x 720 image, got only sky"):
        tilted_camera(pitch_deg=-40.0).view_outline(1280, 720)


def test_four_point_pairs_give_the_exact_camera() -> None:
    camera, ground_m = tilted_camera(pitch_deg=20.0), np.array([[-4.0, 15.0], [4.0, 15.0], [4.0, 60.0], [-4.0, 60.0]])
    fitted = GroundCamera.from_point_pairs(camera.to_pixels(ground_m), ground_m)
    points_m = ground_points(20, 3)
    np.testing.assert_allclose(fitted.to_pixels(points_m), camera.to_pixels(points_m), atol=1e-6)


def test_pairs_clicked_with_an_error_give_a_camera_close_to_the_true_one() -> None:
    camera, ground_m = tilted_camera(pitch_deg=20.0), ground_points(30, 4)
    clicked_px = camera.to_pixels(ground_m) + np.random.default_rng(5).normal(0.0, 1.0, (30, 2))
    fitted = GroundCamera.from_point_pairs(clicked_px, ground_m)
    # A rigid shift of the image plane is unseen by the pairs themselves, so compare on other points.
    error_px = np.hypot(*(fitted.to_pixels(ground_points(50, 6)) - camera.to_pixels(ground_points(50, 6))).T)
    assert np.median(error_px) < 0.7


def test_a_wrong_pair_is_named_with_the_residuals() -> None:
    camera, ground_m = tilted_camera(pitch_deg=20.0), ground_points(8, 4)
    pixels_px = camera.to_pixels(ground_m)
    pixels_px[5, 0] += 120.0
    with pytest.raises(GisError) as caught:
        GroundCamera.from_point_pairs(pixels_px, ground_m)
    message = str(caught.value)
    assert message.startswith("camera: expected point pairs that one camera explains within 10 px, got these ")
    assert message.count(",") == 9  # two in the words, seven between eight residuals
    assert message.endswith("; without pair 6 the others are within 0.0 px")


def test_a_looser_limit_lets_the_wrong_pair_pass() -> None:
    camera, ground_m = tilted_camera(pitch_deg=20.0), ground_points(8, 4)
    pixels_px = camera.to_pixels(ground_m)
    pixels_px[5, 0] += 60.0
    GroundCamera.from_point_pairs(pixels_px, ground_m, max_residual_px=80.0)


SQUARE_PX = np.array([[100.0, 100.0], [500.0, 100.0], [500.0, 400.0], [100.0, 400.0]])
SQUARE_M = np.array([[0.0, 30.0], [40.0, 30.0], [40.0, 0.0], [0.0, 0.0]])


@pytest.mark.parametrize(
    ("pixels_px", "ground_m", "message"),
    [
        (SQUARE_PX[:3], SQUARE_M[:3], "at least 4 pairs of points, got 3 pixels and 3 ground points"),
        (SQUARE_PX, SQUARE_M[:3], "at least 4 pairs of points, got 4 pixels and 3 ground points"),
        (
            SQUARE_PX,
            SQUARE_M * [1, 0],
            r"ground points that spread over an area, got points on one line: \[\[0.0, 0.0\]",
        ),
        (
            SQUARE_PX[[0, 1, 0, 1]] + [[0], [0], [1], [1]],
            SQUARE_M,
            "pixels that spread over an area, got points on one",
        ),
        (SQUARE_PX[[0, 1, 2, 2]], SQUARE_M[[0, 1, 2, 2]], "four of them, no three on a line, got pairs that leave it"),
        (SQUARE_PX * np.nan, SQUARE_M, "finite coordinates in all point pairs, got nan or infinity"),
        (SQUARE_PX, SQUARE_M * [1, -1], "x east and y north, got points that form a mirror image of it"),
        (SQUARE_PX, [[0, 0], [40, 30], [40, 0], [0, 30]], r"one side of the horizon, got points \[.*\] beyond it"),
    ],
    ids=["three", "unequal", "ground line", "pixel line", "doubled", "nan", "mirrored", "crossed"],
)
def test_point_pairs_that_fix_no_camera_are_an_error(pixels_px: FloatArray, ground_m: FloatArray, message: str) -> None:
    with pytest.raises(GisError, match=f"camera: expected .*{message}"):
        GroundCamera.from_point_pairs(pixels_px, ground_m)


@pytest.mark.parametrize(
    ("matrix", "message"),
    [
        ("no", "a homography of 3 rows of 3 numbers, got 'no'"),
        ([[1.0, 2.0], [3.0, 4.0]], r"a homography of shape \(3, 3\), got shape \(2, 2\)"),
        (np.ones((3, 3)), "a finite, invertible homography, got"),
        (np.zeros((3, 3)), "a finite, invertible homography, got"),
        ([[1.0, 0.0, 5e5], [2.0, 0.0, 6e6], [0.0, 0.0, 1.0]], "a finite, invertible homography, got"),
        (np.full((3, 3), np.inf), "a finite, invertible homography, got"),
        (np.eye(3), "x right and y down in the image to become x east and y north on the ground, got a mirrored"),
    ],
    ids=["text", "shape", "singular", "zero", "one column", "infinite", "mirrored"],
)
def test_a_matrix_that_is_no_ground_camera_is_an_error(matrix: FloatArray, message: str) -> None:
    with pytest.raises(GisError, match=f"camera: expected {message}"):
        GroundCamera.from_homography(matrix)


def test_points_of_a_wrong_shape_are_an_error() -> None:
    with pytest.raises(GisError, match=r"expected points of shape \(n, 2\), got shape \(2,\)"):
        GroundCamera.from_homography(FROM_ABOVE).to_ground([1.0, 2.0])


@pytest.mark.parametrize("scale", [1.0, 1e200, 1e-200, -1.0])
def test_small_pixels_far_from_the_origin_are_a_camera_at_any_scale(scale: float) -> None:
    matrix = np.array([[0.001, 0.0, 533_000.0], [0.0, -0.001, 6_475_000.0], [0.0, 0.0, 1.0]]) * scale
    camera = GroundCamera.from_homography(matrix)
    np.testing.assert_allclose(camera.to_ground([[1000.0, 2000.0]]), [[533_001.0, 6_474_998.0]], atol=1e-6)
    np.testing.assert_allclose(camera.to_pixels([[533_001.0, 6_474_998.0]]), [[1000.0, 2000.0]], atol=1e-3)
