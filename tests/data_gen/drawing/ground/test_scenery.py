"""The scenery leaves the road alone, fills the ground, and looks the same to every camera."""

from itertools import combinations

import numpy as np
import pytest
import shapely

from data_gen.drawing.cameras import camera_path
from data_gen.drawing.ground.scenery import Scenery, plan_scenery, shadow_of
from data_gen.drawing.render import make_world
from data_gen.drawing.sun import Clouds, Sun, darken, draw_sun
from data_gen.drawing.view import camera_over
from data_gen.scenario import View
from gis.roads.lanes import Lane
from gis.roads.road_network import RoadNetwork
from tests.data_gen.support import straight_road

SUN = Sun(shadow_rad=0.9, shadow_slope=1.1, phases_rad=(0.0, 0.0))
REGION = shapely.box(300, -120, 700, 120)


def town_road() -> RoadNetwork:
    return RoadNetwork([Lane("a", "a", 0, "a", +1, np.array([[0.0, 0.0], [1000.0, 0.0]]), 3.5, 13.9)])


def planned(network: RoadNetwork, seed: int) -> Scenery:
    return plan_scenery(network, REGION, verge_m=8.0, sun=SUN, rng=np.random.default_rng(seed))


@pytest.mark.parametrize("network", [straight_road(), town_road()], ids=["country", "town"])
@pytest.mark.parametrize("seed", range(3))
def test_no_roof_crown_or_shadow_reaches_the_road(network: RoadNetwork, seed: int) -> None:
    scenery = planned(network, seed)
    shadows = [shadow_of(item.outline, item.height_m, SUN) for item in scenery.buildings]
    shadows += [shadow_of(tree.crown, tree.height_m, SUN) for tree in scenery.trees]
    assert len(shadows) > 10
    assert shapely.union_all(shadows).distance(network.surface()) >= 7.99


@pytest.mark.parametrize("seed", range(3))
def test_parcels_cover_the_ground_without_overlap(seed: int) -> None:
    outlines = [parcel.outline for parcel in planned(straight_road(), seed).parcels]
    assert sum(outline.area for outline in outlines) == pytest.approx(REGION.area, rel=1e-6)
    pairs = combinations(outlines, 2)
    assert all(shapely.intersection(one, other, grid_size=1e-3).area < 0.1 for one, other in pairs)


@pytest.mark.long
def test_slow_roads_run_through_a_town() -> None:
    assert planned(town_road(), 1).is_urban
    assert not planned(straight_road(), 1).is_urban
    assert len(planned(town_road(), 1).buildings) > 2 * len(planned(straight_road(), 1).buildings)


@pytest.mark.parametrize("seed", range(3))
def test_no_building_stands_between_a_slanting_camera_and_the_road(seed: int) -> None:
    rng = np.random.default_rng(seed)
    path = camera_path("oblique", View((500.0, 0.0), 150.0), (320, 180), t_us=np.array([0]), rng=rng)
    scenery = make_world(town_road(), path, rng).scenery
    pose = path.views[0].pose
    assert pose is not None
    lane_m = [np.array([x_m, 0.0]) for x_m in np.arange(400.0, 601.0, 5.0)]
    for item in scenery.buildings:
        for place_m in lane_m:
            # Walk along the line of sight from the road up to the eaves.
            rise = (item.height_m - 0.05) / pose.height_m
            sight = shapely.LineString([place_m, place_m + rise * (pose.place_m[:2] - place_m)])
            assert not shapely.intersects(sight, item.outline)
    assert scenery.buildings


def test_an_overcast_sky_keeps_the_sun_in_its_place_but_hides_it() -> None:
    clear, hidden = (draw_sun(np.random.default_rng(4), weather) for weather in ("sunny", "overcast"))  # type: ignore[arg-type]  # literals
    assert (clear.shadow_rad, clear.is_hidden, hidden.is_hidden) == (hidden.shadow_rad, False, True)


def test_a_wall_in_the_sun_is_brighter_than_one_in_the_shade() -> None:
    towards_sun = -np.array([np.cos(SUN.shadow_rad), np.sin(SUN.shadow_rad)])
    assert SUN.wall_light(towards_sun) == pytest.approx(1.0)
    assert SUN.wall_light(-towards_sun) == pytest.approx(0.55)


def test_the_shadow_of_a_cloud_moves_with_the_wind() -> None:
    clouds = Clouds(np.random.default_rng(2))
    view = camera_over(View((0.0, 0.0), 640.0), (640, 360))
    now, later = (clouds.light(view, t_us).astype(np.float64) for t_us in (0, 4_000_000))
    assert now.min() < 200
    assert np.ptp(now) > 20
    # Try whole shifts: the right one is the wind's way in 4 s, 20 to 44 m or pixels.
    shifts = [(right, down) for right in range(-48, 49, 4) for down in range(-48, 49, 4)]
    inner = np.s_[60:300, 60:580]
    errors = [np.abs(np.roll(now, (down, right), (0, 1))[inner] - later[inner]).mean() for right, down in shifts]
    assert 18 <= np.hypot(*shifts[int(np.argmin(errors))]) <= 46
    assert min(errors) < 1.5


def test_under_a_cloud_brightness_and_colour_fade_alike() -> None:
    picture = np.vstack((np.full((4, 4), 160, np.uint8), np.full((2, 4), 188, np.uint8)))
    darken(picture, np.full((4, 4), 170, np.uint8))
    assert picture[:4].astype(int) == pytest.approx(160 * 170 / 255, abs=1)
    assert picture[4:].astype(int) == pytest.approx(128 + 60 * 170 / 255, abs=1.5)
