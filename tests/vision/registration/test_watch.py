from __future__ import annotations

from collections.abc import Callable

import cv2
import numpy as np
import pytest

from tests.vision.moving_world import METRES_PER_PIXEL, ROAD, SIZE, Car, MovingWorld, view
from tests.vision.support import FloatArray, make_frame
from vision.background.settings import BackgroundSettings
from vision.camera import fixed_camera
from vision.registration.settings import RegistrationSettings
from vision.registration.watch import MovementWatch, noticed_px
from vision.settings import VisionSettings

SECOND = 25


def noticed(path: Callable[[float], FloatArray], seconds: int = 6) -> float | None:
    """Watch a world with cars through a camera on a path: after how many seconds is it noticed, if ever?"""
    world, watch = MovingWorld(), MovementWatch(SIZE, RegistrationSettings(), least_px=3.0)
    for k in range(seconds * SECOND):
        t_s = k / SECOND
        cars: list[Car] = [(30.0 * i + 12 * t_s, 48.0, 0.0, 4.5, 1.8) for i in range(4)]
        if watch.look(world.frame(path(t_s), k, cars, [190.0, 55.0, 210.0, 40.0])):
            return t_s
    return None


@pytest.mark.long
def test_camera_that_stands_or_shakes_is_not_said_to_move() -> None:
    assert noticed(lambda t_s: view()) is None
    shake_m = 1.5 * METRES_PER_PIXEL
    assert noticed(lambda t_s: view(east_m=shake_m * np.sin(9 * t_s), north_m=shake_m * np.cos(7 * t_s))) is None


@pytest.mark.parametrize(
    "path",
    [
        lambda t_s: view(east_m=max(t_s - 2, 0) * 2.0),
        lambda t_s: view(north_m=max(t_s - 2, 0) * 20.0),
        lambda t_s: view(turn_rad=max(t_s - 2, 0) * 0.06),
        lambda t_s: view(zoom=1 + max(t_s - 2, 0) * 0.08),
    ],
    ids=["drift", "tilt", "turn", "zoom"],
)
def test_motion_is_noticed_within_a_second_of_three_pixels(path: Callable[[float], FloatArray]) -> None:
    def shift_px(t_s: float) -> float:
        lattice = np.stack(np.meshgrid([0, SIZE[0] / 2, SIZE[0]], [0, SIZE[1] / 2, SIZE[1]], [1]), axis=-1).reshape(
            -1, 3
        )
        moved = lattice @ (path(t_s) @ np.linalg.inv(view())).T
        return float(np.median(np.hypot(*(moved - lattice)[:, :2].T)))

    away_s = next(k / SECOND for k in range(200) if shift_px(k / SECOND) > 3.0)
    noticed_s = noticed(path)
    assert noticed_s is not None
    assert 2.0 < noticed_s <= away_s + 1.0


def test_vehicle_that_fills_the_picture_is_no_motion_of_the_camera() -> None:
    rng = np.random.default_rng(5)
    road, lorry = (110 + rng.normal(0, 9, (SIZE[1], SIZE[0])), 60 + 90 * rng.random((SIZE[1] - 40, 250)))
    watch = MovementWatch(SIZE, RegistrationSettings(), least_px=3.0)
    for k in range(3 * SECOND):
        luma = road.copy()
        left = -250 + 8 * k
        seen = slice(max(left, 0), min(left + 250, SIZE[0]))
        luma[20:-20, seen] = lorry[:, seen.start - left : seen.stop - left] if seen.stop > seen.start else 0
        assert not watch.look(make_frame(np.clip(luma, 0, 255), index=k, t_us=40_000 * k))


@pytest.mark.parametrize("side", [(1.0, 0.0), (0.0, -1.0), (0.7, 0.7)])
def test_a_blurred_view_that_drifts_by_two_pixels_has_moved(side: tuple[float, float]) -> None:
    soft = cv2.GaussianBlur(np.random.default_rng(3).normal(0, 300, (SIZE[1] + 40, SIZE[0] + 40)), (0, 0), 6.0)
    watch, said = MovementWatch(SIZE, RegistrationSettings(), least_px=2.0), []
    for k in range(0, 4 * SECOND, 5):
        shift = 0.8 * k / SECOND  # 3 px in the end
        there = np.float64([[1, 0, 20 + shift * side[0]], [0, 1, 20 + shift * side[1]]])
        luma = cv2.warpAffine(soft, there, SIZE, flags=cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP)
        said.append((shift, watch.look(make_frame(np.clip(110 + luma, 0, 255), index=k, t_us=40_000 * k))))
    assert not any(moved for shift, moved in said if shift < 1.5)
    assert said[-1][1]


def test_where_vehicles_are_small_a_smaller_shift_matters() -> None:
    settings = VisionSettings()
    car_px = 1.8 / METRES_PER_PIXEL
    assert noticed_px(view(), SIZE, settings) == pytest.approx(car_px / 2, rel=0.05)
    assert car_px / 2 < settings.registration.moved_px


def test_where_vehicles_are_large_a_small_shift_does_not_matter() -> None:
    settings = VisionSettings()
    assert noticed_px(view(zoom=4.0), SIZE, settings) == settings.registration.moved_px
    assert noticed_px(view(zoom=40.0), SIZE, settings) == pytest.approx(0.1 * 1.8 * 40 / METRES_PER_PIXEL, rel=0.05)


@pytest.mark.long
def test_fixed_camera_that_begins_to_move_goes_on_as_one_that_moves() -> None:
    settings = VisionSettings(background=BackgroundSettings(startup_us=1_000_000))
    camera = fixed_camera(view(), [ROAD], SIZE, settings, reach_m=40.0)
    world, results = MovingWorld(), []
    for k in range(12 * SECOND):
        t_s = k / SECOND
        car: Car = (20.0 + 8 * t_s, 48.0, 0.0, 4.5, 1.8)
        where = view(east_m=5 * np.sin(0.5 * max(t_s - 4, 0)))
        results += camera.observe(world.frame(where, k, [car], [200.0]))
    results += camera.finish()
    assert [one.t_us for one in results] == [40_000 * k for k in range(12 * SECOND)]
    assert len({name for one in results if one.t_us > 6_000_000 for name in one.ids}) <= 3
    late = [one for one in results if one.t_us >= 9_000_000 and len(one.ids)]
    assert len(late) > 2 * SECOND
    for one in late:
        true_m = np.array([20.0 + 8 * one.t_us / 1e6, 48.0])
        assert np.hypot(*(one.centre_m - true_m).T).min() < 1.5
    (note,) = camera.notes()
    assert "the camera moves, seen from 4." in note or "the camera moves, seen from 5." in note
