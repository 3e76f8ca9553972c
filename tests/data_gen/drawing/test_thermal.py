"""The thermal camera sees vehicles as warm spots at their true places, and no shadows."""

import numpy as np
import pytest

from data_gen.drawing.cameras import CameraKind, camera_path
from data_gen.drawing.render import make_world
from data_gen.drawing.thermal import ThermalRenderer, thermal_path
from data_gen.scenario import View
from tests.data_gen.support import states_of, straight_road

VIEW = View((500.0, 0.0), 150.0)
COLOUR_PX, THERMAL_PX = (640, 360), (320, 180)
PLACES = (("a", 470.0, -1.75, 0.0), ("b", 500.0, 1.75, np.pi), ("c", 525.0, -1.75, 0.0))


@pytest.mark.parametrize("camera", ["vertical", "oblique", "uav"])
def test_warm_spots_lie_where_the_thermal_homography_puts_the_vehicles(camera: CameraKind) -> None:
    path = camera_path(camera, VIEW, COLOUR_PX, t_us=np.array([0]), rng=np.random.default_rng(1))
    world = make_world(straight_road(), path, np.random.default_rng(1))
    side = thermal_path(path, VIEW, THERMAL_PX)
    states = states_of(*PLACES)
    renderer = ThermalRenderer(world, side, np.random.default_rng(2))
    luma = renderer.frame(states)[: THERMAL_PX[1]].astype(np.float64)
    empty = renderer.frame(states_of())[: THERMAL_PX[1]].astype(np.float64)
    columns, rows = np.round(side.views[0].camera.to_pixels(states.centre_m)).astype(int).T
    assert (luma[rows, columns] - empty[rows, columns]).min() > 40
    # Nothing gets colder: shadows do not show.
    assert (luma - empty).min() > -20
    warm_m2 = float((luma - empty > 40).sum()) * float(side.views[0].camera.metres_per_pixel([[500.0, 0.0]])[0]) ** 2
    assert 3 * 4.5 * 1.8 * 0.6 < warm_m2 < 3 * 4.5 * 1.8 * 3.2


def test_the_thermal_camera_looks_beside_the_colour_camera() -> None:
    path = camera_path("vertical", VIEW, COLOUR_PX, t_us=np.array([0]), rng=np.random.default_rng(1))
    side = thermal_path(path, VIEW, THERMAL_PX)
    offset_m = side.views[0].camera.to_ground([[159.5, 89.5]])[0] - np.array(VIEW.centre_m)
    assert 0.5 < np.hypot(*offset_m) < 5
    outline_m = side.views[0].camera.view_outline(*THERMAL_PX)
    assert np.ptp(outline_m[:, 0]) > VIEW.width_m


def test_it_is_colourless() -> None:
    path = camera_path("vertical", VIEW, COLOUR_PX, t_us=np.array([0]), rng=np.random.default_rng(1))
    world = make_world(straight_road(), path, np.random.default_rng(1))
    picture = ThermalRenderer(world, thermal_path(path, VIEW, THERMAL_PX), np.random.default_rng(2)).frame(states_of())
    assert (picture[THERMAL_PX[1] :] == 128).all()
