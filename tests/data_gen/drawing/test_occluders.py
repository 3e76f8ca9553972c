"""Occluders stand over the road, hide what is under them, and the truth knows how much of it."""

import math

import cv2
import numpy as np
import pytest
import shapely

from data_gen.drawing.cameras import CameraKind, camera_path
from data_gen.drawing.occluders import Occluder, OccluderKind, plan_occluders
from data_gen.drawing.overlay import Overlay, hidden_shares
from data_gen.drawing.render import SceneRenderer, make_world
from data_gen.drawing.sun import Sun
from data_gen.drawing.view import CameraView, Rectangle, camera_over
from data_gen.errors import DataGenError
from data_gen.scenario import View
from data_gen.simulation.states import FloatArray
from tests.data_gen.support import states_of, straight_road

SIZE_PX = (640, 360)
VIEW = View((500.0, 0.0), 200.0)
ABOVE = camera_over(VIEW, SIZE_PX)
SUN = Sun(shadow_rad=0.0, shadow_slope=1.0, phases_rad=(0.0, 0.0))
WHOLE = Rectangle(0, 0, *SIZE_PX)


def planned(*kinds: OccluderKind, seed: int = 1) -> tuple[Occluder, ...]:
    seen = shapely.Polygon(ABOVE.camera.view_outline(*SIZE_PX))
    return plan_occluders(kinds, straight_road(), seen, np.random.default_rng(seed))


def overlay(*occluders: Occluder) -> Overlay:
    return Overlay(occluders, pixel_m=0.3, sun=SUN, rng=np.random.default_rng(0))


def slab(west_m: float, east_m: float) -> Occluder:
    """Hang a plain plate over both lanes."""
    return Occluder("bridge", 6.0, ((shapely.box(west_m, -20.0, east_m, 20.0), (90.0, 90.0, 90.0), 0.0),))


def share_hidden(cover: Overlay, x_m: float, view: CameraView = ABOVE) -> float:
    states = states_of(("a", x_m, -1.75, 0.0))
    return float(hidden_shares(states, np.array([0]), view, cover)[0])


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("kind", ["bridge", "gantry"])
def test_bridge_and_gantry_reach_over_the_whole_road(kind: OccluderKind, seed: int) -> None:
    (item,) = planned(kind, seed=seed)
    across = shapely.intersection(item.outline(), straight_road().surface())
    assert across.bounds[1] == pytest.approx(-3.5, abs=0.05)
    assert across.bounds[3] == pytest.approx(3.5, abs=0.05)


@pytest.mark.parametrize("seed", range(4))
def test_trees_hide_a_stretch_of_each_lane(seed: int) -> None:
    (item,) = planned("trees", seed=seed)
    for y_m in (-1.75, 1.75):
        lane = shapely.LineString([(400.0, y_m), (600.0, y_m)])
        assert 6 < shapely.intersection(lane, item.outline()).length < 40


def test_two_carriageways_are_crossed_as_one_road() -> None:
    from gis.roads.lanes import Lane
    from gis.roads.road_network import RoadNetwork

    south = Lane("s", "s", 0, "s", +1, np.array([[0.0, -8.0], [1000.0, -8.0]]), 7.0, 30.0)
    north = Lane("n", "n", 0, "n", +1, np.array([[1000.0, 8.0], [0.0, 8.0]]), 7.0, 30.0)
    seen = shapely.Polygon(ABOVE.camera.view_outline(*SIZE_PX))
    (gantry,) = plan_occluders(["gantry"], RoadNetwork([south, north]), seen, np.random.default_rng(1))
    assert gantry.outline().bounds[1] == pytest.approx(-13.0, abs=0.3)
    assert gantry.outline().bounds[3] == pytest.approx(13.0, abs=0.3)


def test_without_a_road_in_view_there_is_nothing_to_cross() -> None:
    with pytest.raises(DataGenError, match="occluders: expected a road in view, got none"):
        plan_occluders(["bridge"], straight_road(), shapely.box(0, 500, 10, 510), np.random.default_rng(1))


@pytest.mark.parametrize(
    ("x_m", "expected"), [(480.0, 0.0), (497.75, 0.0), (500.0, 0.5), (505.0, 1.0), (501.125, 0.75)]
)
def test_straight_from_above_the_hidden_share_is_that_of_the_length_under_the_plate(
    x_m: float, expected: float
) -> None:
    assert share_hidden(overlay(slab(500.0, 510.0)), x_m) == pytest.approx(expected, abs=0.05)


def test_a_slanting_camera_sees_the_plate_where_its_height_puts_it() -> None:
    path = camera_path("oblique", VIEW, SIZE_PX, t_us=np.array([0]), rng=np.random.default_rng(1))
    view = path.views[0]
    assert view.pose is not None
    # The camera looks from the south: a plate 6 m up hides ground farther north by its height over the tangent.
    behind_m = 6.0 / math.tan(-view.pose.pitch_rad)
    plate = Occluder("bridge", 6.0, ((shapely.box(480, -2.0, 520, 2.0), (90.0, 90.0, 90.0), 0.0),))
    hidden = overlay(plate)
    states = states_of(("under", 500.0, 0.0, 0.0), ("behind", 500.0, behind_m - 0.5, 0.0))
    under, behind = hidden_shares(states, np.array([0, 1]), view, hidden)
    assert under < 0.4
    assert behind > 0.9


@pytest.mark.long
@pytest.mark.parametrize("camera", ["vertical", "oblique", "uav"])
def test_the_traffic_passes_under_the_occluder(camera: CameraKind) -> None:
    path = camera_path(camera, VIEW, SIZE_PX, t_us=np.array([0]), rng=np.random.default_rng(2))
    world = make_world(straight_road(), path, np.random.default_rng(1), occluders=["bridge"], weather="overcast")
    body = world.overlay.opacity(WHOLE, path.views[0]) > 0.999
    # Vibration blurs the drone's picture by a pixel.
    body = cv2.erode(body.astype(np.uint8), np.ones((5, 5), np.uint8)) > 0
    columns = np.nonzero(body)[1]
    middle_m = path.views[0].camera.to_ground([[float(columns.mean()), 179.5]])[0, 0]
    full = states_of(*((f"v{place}", middle_m + 5.0 * place, -1.75, 0.0) for place in range(-6, 7)))

    def picture(states: object) -> FloatArray:
        drawn = SceneRenderer(world, path, np.random.default_rng(3), noise_sigma=0.0).frame(states)  # type: ignore[arg-type]
        return drawn[: SIZE_PX[1]].astype(np.float64)

    empty, busy = picture(states_of()), picture(full)
    assert np.array_equal(empty[body], busy[body])
    assert np.abs(empty - busy).max() > 20


def test_the_shadow_of_a_plate_darkens_ground_and_not_the_plate() -> None:
    picture = np.full((SIZE_PX[1], SIZE_PX[0], 3), 200, dtype=np.uint8)
    overlay(slab(500.0, 510.0)).apply(picture, ABOVE)
    (plate, shadow, open_ground) = (
        picture[180, round(float(ABOVE.camera.to_pixels([[x_m, 0.0]])[0, 0])), 0] for x_m in (505.0, 513.0, 530.0)
    )
    assert (plate, open_ground) == (90, 200)
    assert 90 <= shadow <= 110
