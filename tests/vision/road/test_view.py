"""What a homography says of a view: horizon, scale, slant."""

import numpy as np
import pytest

from gis.cameras.camera import GroundCamera
from gis.cameras.lens import Lens
from tests.vision.support import FloatArray, top_view
from vision.errors import VisionError
from vision.road.view import GroundView
from vision.settings import VisionSettings

SIZE = (640, 360)


def bridge_view(*, height_m: float = 8.0, pitch_rad: float = 0.15, focal_px: float = 800.0) -> FloatArray:
    """Homography of a camera at (0, 0) that looks north and down."""
    forward = np.array([0.0, np.cos(pitch_rad), -np.sin(pitch_rad)])
    right = np.array([1.0, 0.0, 0.0])
    down = np.cross(forward, right)
    rotation = np.stack([right, down, forward])
    lens = np.array([[focal_px, 0, 319.5], [0, focal_px, 179.5], [0, 0, 1.0]])
    offset = -rotation @ np.array([0.0, 0.0, height_m])
    return np.asarray(lens @ np.column_stack([rotation[:, 0], rotation[:, 1], offset]))


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_ground_behind_the_camera_is_not_seen_whatever_the_sign_of_the_homography(sign: float) -> None:
    view = GroundView(sign * bridge_view(), SIZE, VisionSettings())
    assert view.sees(np.array([[0.0, 60.0], [0.0, -60.0], [0.0, 3.0]])).tolist() == [True, False, False]


def test_pixels_above_the_horizon_show_no_ground() -> None:
    view = GroundView(bridge_view(), SIZE, VisionSettings())
    ground_m, is_ground = view.to_ground(np.array([[320.0, 10.0], [320.0, 300.0]]))
    assert is_ground.tolist() == [False, True]
    assert view.to_pixels(ground_m[1]) == pytest.approx([320.0, 300.0])


def test_ground_too_far_to_see_anything_on_it_is_left_out() -> None:
    view = GroundView(bridge_view(), SIZE, VisionSettings())
    _, high = view.extent()
    assert 100 < high[1] < 300


def test_scales_of_a_top_view_are_equal() -> None:
    view = GroundView(top_view(SIZE, 0.25), SIZE, VisionSettings())
    sight = view.sight(np.array([[30.0, 30.0]]))
    assert [sight.across_m[0], sight.along_m[0]] == pytest.approx([0.25, 0.25])
    assert sight.smear_m(1.5).tolist() == [0.0]


def test_low_camera_smears_height_away_from_itself() -> None:
    view = GroundView(bridge_view(), SIZE, VisionSettings())
    sight = view.sight(np.array([[0.0, 60.0]]))
    assert sight.away[0] == pytest.approx([0.0, 1.0])
    assert sight.across_m[0] == pytest.approx(60 / 800, rel=0.02)
    # Seen from 8 m above and 60 m away, a point 1.5 m up hides road 1.5 * 60 / 8 m behind it.
    assert sight.smear_m(1.5)[0] == pytest.approx(1.5 * 60 / 8, rel=0.05)


@pytest.mark.parametrize("matrix", [np.zeros((3, 3)), np.eye(2), np.full((3, 3), np.nan)], ids=["flat", "small", "nan"])
def test_unusable_homography_is_refused(matrix: FloatArray) -> None:
    with pytest.raises(VisionError, match=r"expected an invertible \(3, 3\) homography, got"):
        GroundView(matrix, SIZE, VisionSettings())


def test_view_without_fine_ground_is_refused() -> None:
    with pytest.raises(VisionError, match=r"expected ground at 0.9 m per pixel or finer, got 5"):
        GroundView(top_view(SIZE, 5.0), SIZE, VisionSettings()).extent()


def test_a_lens_after_the_homography_is_that_of_the_ground_camera() -> None:
    lens = Lens(SIZE, -0.3)
    view = GroundView(bridge_view(), SIZE, VisionSettings(), lens)
    camera = GroundCamera.from_homography(np.linalg.inv(bridge_view()), lens)
    pixels = np.random.default_rng(2).uniform((20, SIZE[1] / 2), np.array(SIZE) - 20, (50, 2))
    ground_m, is_below = view.to_ground(pixels)
    assert is_below.all()
    np.testing.assert_allclose(view.to_pixels(ground_m), pixels, atol=1e-8)
    np.testing.assert_allclose(ground_m, camera.to_ground(pixels))
    np.testing.assert_allclose(view.metres_per_pixel(ground_m), camera.metres_per_pixel(ground_m))
    sight, straight = view.sight(ground_m), GroundView(bridge_view(), SIZE, VisionSettings()).sight(ground_m)
    np.testing.assert_allclose(sight.across_m * sight.along_m, camera.metres_per_pixel(ground_m) ** 2)
    assert (sight.across_m > straight.across_m).all()
