"""Which way cars turn at junctions, from the roads alone."""

import math

import numpy as np
import pytest

from gis.roads.lanes import Connection, Junction, Lane
from gis.roads.road_network import RoadNetwork
from gis.roads.sumo_net import read_sumo_net
from gis.roads.turns import turns
from tests.gis.support import CROSSING_NET

CROSSING = Junction("x", np.array([[-8.0, -8.0], [8.0, -8.0], [8.0, 8.0], [-8.0, 8.0]]))


def arm(name: str, angle_rad: float, *, inward: bool = True, outward: bool = True, start_m: float = 8.0) -> list[Lane]:
    """Build a road that leaves the origin at an angle, with a lane each way that is asked for."""
    ray = np.array([math.cos(angle_rad), math.sin(angle_rad)])
    left = 1.75 * np.array([-ray[1], ray[0]])
    out_m, in_m = (np.stack([start_m * ray, 90.0 * ray]) - left, np.stack([90.0 * ray, start_m * ray]) + left)
    lanes = [Lane(f"{name} out", name, 0, name, +1, out_m, 3.5, 14.0)] if outward else []
    return lanes + ([Lane(f"{name} in", f"-{name}", 0, name, -1, in_m, 3.5, 14.0)] if inward else [])


def directions(lanes: list[Lane]) -> dict[tuple[str, str], str]:
    return {(turn.from_road, turn.to_road): turn.direction for turn in turns(RoadNetwork(lanes, junctions=[CROSSING]))}


@pytest.mark.parametrize(
    ("left_deg", "expected"),
    [
        *((0, "straight"), (40, "straight"), (50, "left"), (90, "left"), (140, "left"), (160, "uturn")),
        *((-40, "straight"), (-50, "right"), (-90, "right"), (-140, "right"), (-160, "uturn")),
    ],
)
def test_turn_goes_by_the_angle_between_the_roads(left_deg: float, expected: str) -> None:
    lanes = arm("south", -math.pi / 2) + arm("other", math.pi / 2 + math.radians(left_deg))
    assert directions(lanes)["south", "other"] == expected


def test_way_back_is_the_mirror_image_and_the_same_road_a_u_turn() -> None:
    found = directions(arm("south", -math.pi / 2) + arm("east", 0.0))
    assert found == {
        ("south", "south"): "uturn",
        ("south", "east"): "right",
        ("east", "south"): "left",
        ("east", "east"): "uturn",
    }


def test_one_way_roads_are_left_only_the_way_they_lead() -> None:
    found = directions(arm("in", math.pi, outward=False) + arm("out", 0.0, inward=False))
    assert found == {("in", "out"): "straight"}


def test_road_that_ends_elsewhere_takes_no_part() -> None:
    assert ("south", "far") not in directions(arm("south", -math.pi / 2) + arm("far", 0.0, start_m=30.0))


def test_stub_at_the_end_of_a_road_does_not_set_its_direction() -> None:
    bent_m = np.array([[8.0, 0.0], [8.2, 0.6], [90.0, 0.6]])  # the last 0.6 m point north
    lanes = [*arm("west", math.pi), Lane("east", "east", 0, "east", +1, bent_m, 3.5, 14.0)]
    assert directions(lanes)["west", "east"] == "straight"


def test_turns_are_the_ways_that_the_map_allows() -> None:
    network = read_sumo_net(CROSSING_NET)  # made with no-turnarounds
    found = {(turn.from_road, turn.to_road): turn.direction for turn in turns(network)}
    ring = ["cn", "cw", "cs", "ce"]  # counter-clockwise
    way = {1: "right", 2: "straight", 3: "left"}
    assert found == {(ring[i], ring[j]): way[(j - i) % 4] for i in range(4) for j in range(4) if i != j}
    assert {turn.junction for turn in turns(network)} == {"c"}


def test_turns_of_a_map_without_connections_are_guessed_and_differ_in_u_turns_only() -> None:
    network = read_sumo_net(CROSSING_NET)
    guessed = turns(RoadNetwork(network.lanes, network.junctions))
    assert set(turns(network)) == {turn for turn in guessed if turn.direction != "uturn"}


def test_way_over_a_junction_without_an_area_is_no_turn() -> None:
    network = read_sumo_net(CROSSING_NET)
    assert turns(RoadNetwork(network.lanes, connections=network.connections)) == ()


def test_way_back_onto_the_same_road_is_a_u_turn_if_the_map_allows_it() -> None:
    back = Connection("south in", "south out", "x", None, 5.0)
    network = RoadNetwork(arm("south", -math.pi / 2), junctions=[CROSSING], connections=[back])
    assert [(turn.from_road, turn.to_road, turn.direction) for turn in turns(network)] == [("south", "south", "uturn")]


def test_network_without_junctions_has_no_turns() -> None:
    assert turns(RoadNetwork(arm("south", -math.pi / 2))) == ()
