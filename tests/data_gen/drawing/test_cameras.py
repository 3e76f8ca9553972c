"""Cameras show what a scenario is about, and a drone stays within the bounds that the ground was painted for."""

import math
from typing import get_args

import numpy as np
import pytest

from data_gen.drawing.cameras import CameraKind, CameraPath, camera_path
from data_gen.errors import DataGenError
from data_gen.scenario import View
from tests.data_gen.support import straight_road

VIEW = View(centre_m=(500.0, 20.0), width_m=600.0)
SIZE_PX = (1280, 720)
FIVE_MINUTES_US = np.arange(0, 300_000_000, 1_000_000)


def flight(seed: int, t_us: np.ndarray = FIVE_MINUTES_US, view: View = VIEW) -> CameraPath:
    return camera_path("uav", view, SIZE_PX, t_us=t_us, rng=np.random.default_rng(seed))


def test_the_drone_drifts_turns_and_zooms_by_what_a_drone_does() -> None:
    track = flight(3).track
    assert track is not None
    # Near the plumb line yaw and roll turn about the same axis: their difference is the direction of image up.
    columns = np.array([[pose.x_m, pose.y_m, pose.yaw_rad - pose.roll_rad, pose.focal_px] for pose in track.poses])
    wander_m, _, turn_rad, zoom_px = np.ptp(columns, axis=0)
    assert 15 < wander_m < 60
    assert math.radians(8) < turn_rad < math.radians(40)
    assert 0.03 < zoom_px / columns[:, 3].mean() < 0.21


@pytest.mark.parametrize("seed", range(5))
def test_the_middle_of_the_view_stays_in_the_image_and_all_that_is_seen_within_reach(seed: int) -> None:
    path = flight(seed)
    west_m, south_m, east_m, north_m = path.reach_m
    for seen in path.views:
        assert seen.contains(np.array([[350.0, 20.0], [500.0, 20.0], [650.0, 20.0]])).all()
        outline_m = seen.camera.view_outline(*SIZE_PX)
        assert west_m < outline_m[:, 0].min()
        assert outline_m[:, 0].max() < east_m
        assert south_m < outline_m[:, 1].min()
        assert outline_m[:, 1].max() < north_m


def test_vibration_moves_the_image_by_a_pixel_or_two_from_frame_to_frame() -> None:
    path = flight(1, np.arange(0, 8_000_000, 40_000))
    middle_px = np.concatenate([seen.camera.to_pixels([VIEW.centre_m]) for seen in path.views])
    step_px = np.diff(middle_px, axis=0)
    assert step_px.std(axis=0).min() > 0.3
    assert np.abs(step_px).max() < 5
    assert 0.2 < path.blur_px.std() < 2


def test_a_longer_clip_begins_with_the_shorter_ones_path() -> None:
    short, long = flight(5, FIVE_MINUTES_US[:4]), flight(5)
    assert short.track is not None
    assert long.track is not None
    assert short.track.poses == long.track.poses[:4]
    assert short.reach_m == long.reach_m


@pytest.mark.parametrize("width_m", [150.0, 600.0])
@pytest.mark.parametrize("seed", range(4))
def test_the_slanting_camera_looks_at_the_middle_and_sees_no_sky(width_m: float, seed: int) -> None:
    view = View((10.0, -30.0), width_m)
    path = camera_path("oblique", view, SIZE_PX, t_us=np.array([0, 40_000]), rng=np.random.default_rng(seed))
    camera = path.views[0].camera
    assert camera.to_ground([[639.5, 359.5]])[0] == pytest.approx(view.centre_m, abs=1e-6)
    assert np.isfinite(camera.to_ground([[0, 0], [1279, 0]])).all()
    assert path.views[0] is path.views[1]


@pytest.mark.parametrize("kind", get_args(CameraKind))
def test_only_the_drone_moves(kind: CameraKind) -> None:
    rng, network = np.random.default_rng(1), straight_road()
    path = camera_path(kind, VIEW, SIZE_PX, t_us=np.array([0, 40_000]), rng=rng, network=network)
    matrices = [seen.camera.ground_from_pixel for seen in path.views]
    assert np.array_equal(*matrices) != path.is_moving
    assert (path.track is None) == (kind == "vertical")


def test_a_camera_towards_the_horizon_has_a_limited_reach() -> None:
    rng, network = np.random.default_rng(1), straight_road()
    path = camera_path("mast", VIEW, SIZE_PX, t_us=np.array([0]), rng=rng, network=network)
    west_m, south_m, east_m, north_m = path.reach_m
    assert math.hypot(east_m - west_m, north_m - south_m) < 1500


def test_an_unknown_camera_is_refused() -> None:
    with pytest.raises(DataGenError, match="camera: expected one of vertical, oblique, uav, mast, got 'kite'"):
        camera_path("kite", VIEW, SIZE_PX, t_us=np.array([0]), rng=np.random.default_rng(1))  # type: ignore[arg-type]  # wrong on purpose
