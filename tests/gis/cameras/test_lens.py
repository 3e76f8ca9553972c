"""Lenses that bend the picture, and cameras fitted through them."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from gis.cameras.camera import GroundCamera
from gis.cameras.homography import fit_camera
from gis.cameras.lens import Lens
from gis.errors import GisError
from tests.gis.support import FloatArray

SIZE_PX = (640, 480)
FOCAL_PX = 700.0


def brown_pixels(ground_m: FloatArray, brown: float, *, pitch_rad: float, height_m: float) -> FloatArray:
    """See ground through OpenCV's lens, which is another model than ours; nan out of the picture."""
    sine, cosine = np.sin(pitch_rad), np.cos(pitch_rad)
    turn = np.array([[1.0, 0.0, 0.0], [0.0, -sine, -cosine], [0.0, cosine, -sine]])
    shift = -turn @ np.array([0.0, 0.0, height_m])
    points = np.column_stack((ground_m, np.zeros(len(ground_m))))
    inner = np.array([[FOCAL_PX, 0.0, 319.5], [0.0, FOCAL_PX, 239.5], [0.0, 0.0, 1.0]])
    seen = cv2.projectPoints(points, cv2.Rodrigues(turn)[0], shift, inner, np.array([brown, 0.0, 0.0, 0.0]))[0][:, 0]
    ahead = points @ turn.T + shift
    tangent = np.hypot(*(ahead[:, :2] / ahead[:, 2:]).T)
    outside = (ahead[:, 2] < 1) | (tangent > 0.75) | ((seen < 0) | (seen > np.array(SIZE_PX) - 1)).any(axis=1)
    return np.where(outside[:, None], np.nan, seen)


@pytest.mark.parametrize("radial", [-0.7, -0.2, 0.0, 0.2, 0.7])
def test_pixels_are_straightened_and_bent_back(radial: float) -> None:
    lens = Lens(SIZE_PX, radial)
    pixels = np.random.default_rng(3).uniform((0, 0), SIZE_PX, (4, 50, 2))
    np.testing.assert_allclose(lens.bend(lens.straighten(pixels)), pixels, atol=1e-9)


@pytest.mark.parametrize("radial", [-0.5, 0.3])
def test_the_derivative_is_that_of_small_steps(radial: float) -> None:
    lens = Lens(SIZE_PX, radial)
    points = lens.straighten(np.random.default_rng(4).uniform((0, 0), SIZE_PX, (30, 2)))
    steps = 1e-4 * np.eye(2)
    columns = [(lens.bend(points + step) - lens.bend(points - step)) / 2e-4 for step in steps]
    np.testing.assert_allclose(lens.derivative(points), np.stack(columns, axis=2), atol=1e-6)


@pytest.mark.parametrize("radial", [-0.7, 0.2, 0.7])
def test_what_is_out_of_the_picture_stays_out(radial: float) -> None:
    lens, way = Lens(SIZE_PX, radial), np.geomspace(1.0, 1e9, 60)
    corner = lens.straighten([[639.5, 479.5]]) - [319.5, 239.5]
    bent = lens.bend([319.5, 239.5] + way[:, None] * corner)
    assert (bent[1:] > [639.0, 479.0]).all()


def test_a_camera_with_a_lens_maps_to_the_ground_and_back() -> None:
    camera = GroundCamera.from_homography(
        [[0.02, 0.0, -5.0], [0.0, -0.05, 40.0], [0.0, 0.001, 1.0]], Lens(SIZE_PX, -0.3)
    )
    pixels = np.random.default_rng(5).uniform((0, 0), SIZE_PX, (60, 2))
    np.testing.assert_allclose(camera.to_pixels(camera.to_ground(pixels)), pixels, atol=1e-8)
    step_px = np.array([[1e-3, 0.0], [0.0, 1e-3]])
    east, south = (camera.to_ground(pixels + step) - camera.to_ground(pixels - step) for step in step_px)
    area_m2 = np.abs(east[:, 0] * south[:, 1] - east[:, 1] * south[:, 0]) / 4e-6
    np.testing.assert_allclose(camera.metres_per_pixel(camera.to_ground(pixels)), np.sqrt(area_m2), rtol=1e-5)


def test_the_outline_of_a_bent_view_holds_all_that_is_seen() -> None:
    import shapely

    camera = GroundCamera.from_homography([[0.1, 0.0, 0.0], [0.0, -0.1, 0.0], [0.0, 0.0, 1.0]], Lens(SIZE_PX, -0.4))
    outline = shapely.Polygon(camera.view_outline(*SIZE_PX)).buffer(0.05)
    pixels = np.random.default_rng(6).uniform((0, 0), np.array(SIZE_PX) - 1, (300, 2))
    assert shapely.contains_xy(outline, *camera.to_ground(pixels).T).all()


def test_fits_through_another_lens_model_read_the_ground() -> None:
    rng = np.random.default_rng(1)
    wrong, straight = {}, []
    for brown in np.linspace(-0.35, 0.2, 12):
        ground_m = rng.uniform((-25, 5), (25, 60), (600, 2))
        seen_px = brown_pixels(ground_m, brown, pitch_rad=0.6, height_m=12.0)
        inside = np.isfinite(seen_px).all(axis=1)
        ground_m, seen_px = ground_m[inside], seen_px[inside]
        noisy_px = np.clip(seen_px[:20] + rng.normal(0.0, 0.5, (20, 2)), 0, np.array(SIZE_PX) - 1)
        camera = GroundCamera.from_point_pairs(noisy_px, ground_m[:20], size_px=SIZE_PX)
        error_px = np.hypot(*(camera.to_pixels(ground_m[20:]) - seen_px[20:]).T)
        wrong[f"{brown:.2f}"] = float(np.sqrt((error_px**2).mean()))
        if abs(brown) >= 0.1:
            plane = GroundCamera.from_point_pairs(noisy_px, ground_m[:20], max_residual_px=1e3)
            straight.append(np.sqrt((np.hypot(*(plane.to_pixels(ground_m[20:]) - seen_px[20:]).T) ** 2).mean()))
    assert {brown: error for brown, error in wrong.items() if error > 1.5} == {}
    assert min(straight) > 1.5


@pytest.mark.long
def test_a_straight_lens_is_not_bent_by_clicks_that_are_a_pixel_off() -> None:
    bent = []
    for seed in range(40):
        rng = np.random.default_rng(seed)
        ground_m = rng.uniform((-12, 12), (12, 40), (60, 2))
        seen_px = brown_pixels(ground_m, 0.0, pitch_rad=0.6, height_m=12.0)
        inside = np.flatnonzero(np.isfinite(seen_px).all(axis=1))[:12]
        noisy_px = seen_px[inside] + rng.normal(0.0, 1.0, (len(inside), 2))
        if fit_camera(ground_m[inside], noisy_px, SIZE_PX)[1] is not None:
            bent.append(seed)
    assert len(bent) <= 1


def test_a_known_lens_is_taken_and_a_fit_of_few_points_has_none() -> None:
    lens, plane = Lens(SIZE_PX, -0.25), GroundCamera.from_homography([[0.1, 0, 0], [0, -0.1, 48], [0, 0.001, 1]])
    ground_m = plane.to_ground([[100, 100], [500, 90], [520, 400], [90, 380], [300, 200], [200, 300], [420, 250]])
    pixels = lens.bend(plane.to_pixels(ground_m))
    assert fit_camera(ground_m, pixels, SIZE_PX)[1] is None
    known = GroundCamera.from_point_pairs(pixels, ground_m, size_px=SIZE_PX, radial=-0.25)
    np.testing.assert_allclose(known.to_ground(pixels), ground_m, atol=1e-6)
    more_m = np.vstack((ground_m, plane.to_ground([[320, 60]])))
    fitted = fit_camera(more_m, lens.bend(plane.to_pixels(more_m)), SIZE_PX)[1]
    assert fitted is not None
    assert fitted.radial == pytest.approx(-0.25, abs=1e-4)
    assert fit_camera(more_m, lens.bend(plane.to_pixels(more_m)), SIZE_PX, 0.0)[1] is None


@pytest.mark.parametrize(
    ("size_px", "radial", "message"),
    [
        (SIZE_PX, 0.9, "lens: expected a radial of -0.8 to 0.8, got 0.9"),
        (SIZE_PX, float("nan"), "lens: expected a radial of -0.8 to 0.8, got nan"),
        ((1, 480), 0.1, "lens: expected a picture of at least 2 x 2 px, got (1, 480)"),
    ],
)
def test_a_lens_that_cannot_be_is_refused(size_px: tuple[int, int], radial: float, message: str) -> None:
    with pytest.raises(GisError) as caught:
        Lens(size_px, radial)
    assert str(caught.value) == message


def test_points_outside_of_the_picture_are_refused() -> None:
    pixels, ground_m = [[0, 0], [700, 0], [600, 400], [0, 400]], [[0, 50], [50, 50], [50, 0], [0, 0]]
    with pytest.raises(GisError, match=r"inside the picture of 640 x 480 px, got pair 2 at \[700.0, 0.0\]"):
        GroundCamera.from_point_pairs(pixels, ground_m, size_px=SIZE_PX)
