"""Who stands before whom is told by the ray through both, and nothing behind the camera reaches the picture."""

import math
from dataclasses import replace

import numpy as np
import pytest

from data_gen.drawing.traffic.solid_painter import Meshes
from data_gen.drawing.traffic.solids import NEAREST_M, clipped_px, entry_m, far_first, rows_in_image
from data_gen.drawing.traffic.vehicle_bodies import vehicle_body
from data_gen.drawing.traffic.vehicle_models import VehicleLooks
from data_gen.drawing.view import CameraView
from data_gen.scenario import VehicleClass
from data_gen.simulation.states import VehicleStates
from gis.cameras.camera_pose import CameraPose
from tests.data_gen.support import states_of

SIZE_PX = (640, 360)
EYE_M = np.zeros(2)


def low_view(height_m: float = 6.0) -> CameraView:
    """Look east from over the origin, a little down."""
    pose = CameraPose(0.0, 0.0, height_m, 0.0, math.radians(-8), 0.0, 600.0)
    return CameraView(pose.camera(*SIZE_PX), SIZE_PX, pose)


def with_truck(states: VehicleStates, row: int) -> VehicleStates:
    lengths_m, widths_m = states.length_m.copy(), states.width_m.copy()
    lengths_m[row], widths_m[row] = 12.0, 2.5
    return replace(states, length_m=lengths_m, width_m=widths_m)


def test_a_car_beside_the_end_of_a_truck_may_be_behind_it_though_its_middle_is_nearer() -> None:
    behind = with_truck(states_of(("truck", 50.0, 20.0, 0.0), ("car", 46.5, 23.5, 0.0)), 0)
    before = with_truck(states_of(("truck", 50.0, 20.0, 0.0), ("car", 53.0, 16.5, 0.0)), 0)
    for states, order in ((behind, [1, 0]), (before, [0, 1])):
        truck_m, car_m = np.hypot(*states.centre_m.T)
        assert (car_m < truck_m) == (order == [1, 0])
        assert far_first(np.arange(2), states, EYE_M) == order


def test_the_order_agrees_with_rays_through_all_bodies() -> None:
    rng = np.random.default_rng(3)
    grid = [(x_m, y_m) for x_m in np.arange(15.0, 120.0, 14.0) for y_m in (-8.0, -4.0, 0.0, 4.0, 8.0)]
    vehicles = [(f"v{n}", x + rng.uniform(-3, 3), y, float(rng.uniform(-0.1, 0.1))) for n, (x, y) in enumerate(grid)]
    states = states_of(*vehicles)
    order = far_first(np.arange(len(grid)), states, EYE_M)
    place = {row: number for number, row in enumerate(order)}
    for ray_rad in np.linspace(-0.6, 0.6, 241):
        rays = np.full(len(grid), ray_rad)
        away_m = entry_m(np.arange(len(grid)), states, EYE_M, rays)
        beside_m = np.abs(states.centre_m @ np.array([-math.sin(ray_rad), math.cos(ray_rad)]))
        hit = sorted(np.flatnonzero(beside_m < 0.6), key=lambda row: -away_m[row])
        assert [place[row] for row in hit] == sorted(place[row] for row in hit)


@pytest.mark.parametrize("x_m", [-4.0, -1.0, 0.5, 3.0])
def test_a_vehicle_at_the_camera_is_cut_and_never_infinite(x_m: float) -> None:
    view, states = low_view(height_m=4.0), states_of(("a", x_m, 2.0, 0.0))
    for solid in Meshes(detailed=True).placed(states, view):
        points_px = solid.around_px()
        assert np.isfinite(points_px).all()
        assert np.abs(points_px).max() < 600.0 * 20.0 / NEAREST_M


def test_an_outline_behind_the_camera_has_no_points() -> None:
    assert len(clipped_px(np.array([[0.0, 0.0, -1.0], [5.0, 0.0, -1.0], [5.0, 5.0, -2.0]]))) == 0


def test_only_what_may_reach_into_the_image_is_placed() -> None:
    states = states_of(("ahead", 60.0, 0.0, 0.0), ("behind", -60.0, 0.0, 0.0), ("aside", 20.0, 60.0, 0.0))
    assert rows_in_image(states, low_view()).tolist() == [0]


@pytest.mark.parametrize("vehicle_class", ["car", "van", "truck", "bus", "motorcycle"])
def test_a_body_keeps_to_its_footprint_and_has_panels_that_look_outwards(vehicle_class: VehicleClass) -> None:
    size_m = {"car": (4.4, 1.8), "van": (5.6, 2.0), "truck": (9.8, 2.5), "bus": (12.0, 2.5), "motorcycle": (2.2, 0.8)}
    length_m, width_m = size_m[vehicle_class]
    for appearance in range(12):
        parts = vehicle_body(VehicleLooks(vehicle_class, length_m, width_m, appearance))
        corners_m = np.concatenate([outline for part in parts for outline in (part.base_m, part.top_m)])
        # Mirrors stick out.
        assert np.abs(corners_m[:, 0]).max() <= length_m / 2 + 0.01
        assert np.abs(corners_m[:, 1]).max() <= width_m / 2 + 0.3
        assert 1.3 < max(part.top_height_m for part in parts) < 4.0
        assert any(panel.is_lamp for part in parts for panel in part.panels)
