"""A mast is low, stands off the road or over it, and its picture is full of road."""

import math
from dataclasses import replace

import numpy as np
import pytest
import shapely

from data_gen.drawing.mast import mast_pose
from data_gen.drawing.view import CameraView
from data_gen.scenarios.catalogue import scenario_named
from gis.cameras.camera_pose import CameraPose
from gis.roads.road_network import RoadNetwork
from gis.roads.sumo_net import read_sumo_net

SIZE_PX = (1280, 720)
SCENARIOS = ("motorway", "rural_overtaking", "junction")


def masts(scenario: str) -> tuple[RoadNetwork, dict[int, CameraPose]]:
    plan = scenario_named(scenario)
    network = read_sumo_net(plan.network_file)
    return network, {seed: mast_pose(network, plan.view, SIZE_PX, np.random.default_rng(seed)) for seed in range(30)}


@pytest.mark.parametrize("scenario", SCENARIOS)
def test_a_mast_is_low_and_looks_a_little_down(scenario: str) -> None:
    _, poses = masts(scenario)
    heights_m = [pose.height_m for pose in poses.values()]
    pitches_deg = [math.degrees(-pose.pitch_rad) for pose in poses.values()]
    assert 4 <= min(heights_m) < 6
    assert 10 < max(heights_m) <= 12
    assert 5 <= min(pitches_deg) < 10
    assert 20 < max(pitches_deg) <= 25


@pytest.mark.parametrize("scenario", SCENARIOS)
def test_a_mast_sees_road_in_front_of_it(scenario: str) -> None:
    network, poses = masts(scenario)
    road = network.surface()

    for seed, pose in poses.items():
        seen = CameraView(pose.camera(*SIZE_PX), SIZE_PX, pose)
        here = shapely.Polygon(seen.camera.view_outline(*SIZE_PX)) & shapely.Point(pose.place_m[:2]).buffer(120)
        assert (here & road).area > 200, seed


def test_a_mast_at_a_junction_stands_beside_the_road() -> None:
    network, poses = masts("junction")
    road = network.surface()
    assert all(road.distance(shapely.Point(pose.place_m[:2])) > 0 for pose in poses.values())


def test_a_mast_stands_at_the_end_of_a_road_that_is_shorter_than_the_view() -> None:
    network = read_sumo_net(scenario_named("urban_grid").network_file)
    view = replace(scenario_named("urban_grid").view, width_m=250.0)
    for road in network.roads:
        view = replace(view, centre_m=tuple(road.reference_line_m.mean(axis=0).tolist()))
        for seed in range(3):
            pose = mast_pose(network, view, SIZE_PX, np.random.default_rng(seed))
            assert np.isfinite([*pose.place_m, pose.yaw_rad]).all(), (road.id, seed)
