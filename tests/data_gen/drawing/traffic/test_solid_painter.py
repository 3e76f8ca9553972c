"""Solids stand on their true footprint, fill the outline of their box, and hide what stands behind them."""

import math

import cv2
import numpy as np
import pytest

from data_gen.drawing.sun import Sun
from data_gen.drawing.traffic.solid_painter import SolidPainter
from data_gen.drawing.traffic.vehicle_models import height_m
from data_gen.drawing.view import CameraView, corners_m
from data_gen.scenario import VehicleClass
from data_gen.simulation.states import FloatArray, VehicleStates
from gis.cameras.camera_pose import CameraPose
from tests.data_gen.support import states_of

SIZE_PX = (640, 360)
NO_SUN = Sun(shadow_rad=0.0, shadow_slope=1.0, phases_rad=(0.0, 0.0), is_hidden=True)


def view_of(pitch_deg: float, *, distance_m: float = 90.0, focal_px: float = 1100.0) -> CameraView:
    """Look at the ground's origin from the south."""
    pitch_rad = math.radians(pitch_deg)
    pose = CameraPose(
        0.0, -distance_m * math.cos(pitch_rad), distance_m * math.sin(pitch_rad), math.pi / 2, -pitch_rad, 0.0, focal_px
    )
    return CameraView(pose.camera(*SIZE_PX), SIZE_PX, pose)


def cover(view: CameraView, states: VehicleStates, sun: Sun = NO_SUN) -> FloatArray:
    pictures = []
    for ground in (0, 255):
        canvas = np.full((SIZE_PX[1], SIZE_PX[0], 3), ground, dtype=np.uint8)
        SolidPainter(SIZE_PX, sun).draw(canvas, states, view)
        pictures.append(canvas[:, :, 0].astype(np.float64))
    return np.asarray(1 - (pictures[1] - pictures[0]) / 255, dtype=np.float64)


def box_outline_px(view: CameraView, states: VehicleStates, top_m: float) -> FloatArray:
    """Project the eight corners of the body's box, one by one."""
    assert view.pose is not None
    points = []
    for x_m, y_m in corners_m(states)[0]:
        for up_m in (0.0, top_m):
            x, y, depth = view.pose.projection(*SIZE_PX) @ np.array([x_m, y_m, up_m, 1.0])
            points.append((x / depth, y / depth))
    return cv2.convexHull(np.array(points, dtype=np.float32)).reshape(-1, 2).astype(np.float64)


@pytest.mark.parametrize("pitch_deg", [38.0, 60.0, 89.0])
@pytest.mark.parametrize("heading_rad", [0.0, 0.7, 2.2, -1.3])
def test_a_truck_fills_the_outline_of_its_box(pitch_deg: float, heading_rad: float) -> None:
    view, states = view_of(pitch_deg), states_of(("a", 3.0, -2.0, heading_rad), truck=True)
    drawn = cover(view, states) > 0.5
    expected = np.zeros(drawn.shape, dtype=np.uint8)
    cv2.fillConvexPoly(expected, np.round(box_outline_px(view, states, height_m("truck"))).astype(np.int32), 1)
    both, either = (drawn & (expected > 0)).sum(), (drawn | (expected > 0)).sum()
    assert both / either > 0.8
    # The lowest parts stay 40 cm off the ground and the cab is lower than the box: nothing may stick out.
    grown = cv2.dilate(expected, np.ones((3, 3), np.uint8))
    assert not (drawn & (grown == 0)).any()


def test_from_high_above_a_car_lies_on_its_true_place() -> None:
    pose = CameraPose(0.0, 0.0, 2000.0, math.pi / 2, -math.pi / 2, 0.0, 2000.0 / 0.2)
    view = CameraView(pose.camera(*SIZE_PX), SIZE_PX, pose)
    states = states_of(("a", 4.0, 3.0, 0.4))
    opacity = cover(view, states)
    y_px, x_px = np.nonzero(opacity > 0.01)
    weight = opacity[y_px, x_px]
    middle_px = np.array([(x_px * weight).sum(), (y_px * weight).sum()]) / weight.sum()
    assert middle_px == pytest.approx(view.camera.to_pixels(states.centre_m)[0], abs=0.15)
    assert weight.sum() * 0.2**2 == pytest.approx(4.5 * 1.8, rel=0.06)


def test_the_nearer_vehicle_hides_the_farther_one() -> None:
    view = view_of(40.0)
    near, far = ("near", 0.0, 0.0, 0.0), ("far", 0.0, 2.6, 0.0)
    together = np.zeros((SIZE_PX[1], SIZE_PX[0], 3), dtype=np.uint8)
    alone = together.copy()
    SolidPainter(SIZE_PX, NO_SUN).draw(alone, states_of(near, truck=True), view)
    # Whatever the order of the rows.
    SolidPainter(SIZE_PX, NO_SUN).draw(together, states_of(near, far, truck=True), view)
    covered = cover(view, states_of(near, truck=True)) > 0.99
    assert covered.sum() > 1000
    assert np.array_equal(together[covered], alone[covered])


def test_the_shadow_lies_on_the_ground_away_from_the_sun() -> None:
    view, states = view_of(60.0), states_of(("a", 0.0, 0.0, 0.0))
    east = Sun(shadow_rad=0.0, shadow_slope=1.2, phases_rad=(0.0, 0.0))
    shadow = np.maximum(cover(view, states, east) - cover(view, states), 0)
    front, rear = view.camera.to_pixels([[2.3, 0.0], [-2.3, 0.0]])[:, 0].round().astype(int)
    assert shadow[:, front:].sum() > 50
    assert shadow[:, :rear].sum() < 0.05 * shadow[:, front:].sum()


@pytest.mark.parametrize("vehicle_class", ["car", "van", "truck", "bus", "motorcycle"])
def test_every_class_can_be_drawn(vehicle_class: VehicleClass) -> None:
    states = states_of(("a", 0.0, 0.0, 0.5))
    drawn = VehicleStates(
        **{name: getattr(states, name) for name in VehicleStates.__slots__ if name != "classes"},
        classes=(vehicle_class,),
    )
    assert cover(view_of(50.0), drawn).max() == 1


def test_vehicles_behind_the_camera_are_left_out() -> None:
    canvas = np.zeros((SIZE_PX[1], SIZE_PX[0], 3), dtype=np.uint8)
    SolidPainter(SIZE_PX, NO_SUN).draw(canvas, states_of(("a", 0.0, -400.0, 0.0)), view_of(40.0))
    assert not canvas.any()
