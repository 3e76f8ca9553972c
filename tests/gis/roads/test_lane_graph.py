"""Ways along the lanes: distances against a slow walk and against SUMO, places, routes, exits, who is next."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from itertools import product
from pathlib import Path

import libsumo
import numpy as np
import pytest
import shapely
from numpy.typing import ArrayLike, NDArray

from gis.errors import GisError
from gis.roads.lane_graph import LaneGraph, LanePlaces, Route
from gis.roads.lanes import Connection, Lane
from gis.roads.road_network import RoadNetwork
from gis.roads.sumo_net import read_sumo_net
from tests.cases import for_each
from tests.gis.support import CROSSING_NET, two_way_along

FloatArray = NDArray[np.float64]

NETWORKS = Path(__file__).parents[3] / "data_gen" / "scenarios" / "networks"
FILES = {"crossing": CROSSING_NET} | {
    name: NETWORKS / name / "network.net.xml" for name in ("junction", "roundabout", "urban_grid", "queue_passing")
}


def graph_of(name: str, *, keep_lanes: bool = False) -> LaneGraph:
    return LaneGraph(read_sumo_net(FILES[name]), keep_lanes=keep_lanes)


def scattered(graph: LaneGraph, count: int, seed: int) -> LanePlaces:
    rng = np.random.default_rng(seed)
    lane = rng.integers(0, len(graph.lines_m), count)
    return LanePlaces.of(lane, rng.random(count) * graph.length_m[lane])


def project(graph: LaneGraph, network: RoadNetwork, points_m: FloatArray, heading_rad: ArrayLike) -> LanePlaces:
    return graph.project(points_m, np.array(heading_rad, dtype=np.float64), network.locate(points_m))


def way_m(graph: LaneGraph, start: LanePlaces, end: LanePlaces) -> float:
    return float(graph.distances_m(start, end)[0, 0])


def walk(network: RoadNetwork, start: tuple[int, float], *, keep_lanes: bool) -> dict[int, tuple[float, float]]:
    """Walk on from a place over all connections until nothing gets shorter; metres and seconds to each lane's start."""
    ids = [lane.id for lane in network.lanes]
    lines = [lane.centre_line_m for lane in network.lanes]
    speeds = [lane.speed_limit_mps for lane in network.lanes]
    for way in network.connections:
        ends_m = lines[ids.index(way.from_lane)][-1], lines[ids.index(way.to_lane)][0]
        lines.append(np.array(ends_m) if way.via_m is None else way.via_m)
        speeds.append(way.speed_limit_mps)
    metres = [float(np.hypot(*np.diff(line_m, axis=0).T).sum()) for line_m in lines]

    def after(lane: int) -> Iterator[int]:
        for place, way in enumerate(network.connections):
            number = len(ids) + place
            start, end = network.lanes[ids.index(way.from_lane)], network.lanes[ids.index(way.to_lane)]
            if lane < len(ids):
                here = network.lanes[lane]
                if start is here or (start.edge == here.edge and not keep_lanes):
                    yield number
            elif lane == number:
                yield from (
                    k for k, one in enumerate(network.lanes) if one is end or (one.edge == end.edge and not keep_lanes)
                )

    least: dict[int, tuple[float, float]] = {}
    lane, along_m = start
    to_do = [(one, metres[lane] - along_m, (metres[lane] - along_m) / speeds[lane]) for one in after(lane)]
    while to_do:
        one, way_m, time_s = to_do.pop()
        known_m, known_s = least.get(one, (np.inf, np.inf))
        if way_m < known_m or time_s < known_s:
            least[one] = min(way_m, known_m), min(time_s, known_s)
            to_do += [
                (other, least[one][0] + metres[one], least[one][1] + metres[one] / speeds[one]) for other in after(one)
            ]
    return least


@for_each("case", [(name, keep) for name in FILES for keep in (False, True)])
def test_distances_and_times_are_those_of_a_walk_over_all_connections(case: tuple[str, bool]) -> None:
    name, keep_lanes = case
    network = read_sumo_net(FILES[name])
    graph = LaneGraph(network, keep_lanes=keep_lanes)
    starts, ends = scattered(graph, 12, 1), scattered(graph, 40, 2)
    found_m, found_s = graph.distances_m(starts, ends), graph.travel_times_s(starts, ends)
    speeds = [one.speed_limit_mps for one in network.lanes] + [one.speed_limit_mps for one in network.connections]
    edges = [lane.id if keep_lanes else lane.edge for lane in network.lanes] + list(range(len(network.connections)))
    for row in range(12):
        lane, along_m = int(starts.lane[row, 0]), float(starts.along_m[row, 0])
        least = walk(network, (lane, along_m), keep_lanes=keep_lanes)
        for column in range(40):
            other, at_m = int(ends.lane[column, 0]), float(ends.along_m[column, 0])
            if edges[lane] == edges[other] and at_m >= along_m:
                expected = at_m - along_m, (at_m - along_m) / speeds[lane]
            else:
                way_m, time_s = least.get(other, (np.inf, np.inf))
                expected = way_m + at_m, time_s + at_m / speeds[other]
            assert (found_m[row, column], found_s[row, column]) == pytest.approx(expected), (lane, other)


@for_each("name", ["junction", "roundabout", "urban_grid"])
def test_gaps_of_pairs_are_their_distances_there_and_back(name: str) -> None:
    network, rng = read_sumo_net(FILES[name]), np.random.default_rng(1)
    lines = [shapely.LineString(line_m) for line_m in LaneGraph(network).lines_m]
    samples = [Route((), np.array(rng.choice(lines).coords)).points([share]) for share in rng.random(60)]
    points_m = np.vstack([*(at_m for at_m, _ in samples), [[900.0, 900.0]]])
    for graph in (LaneGraph(network), LaneGraph(network, keep_lanes=True)):
        places = project(graph, network, points_m, [*(rad[0] for _, rad in samples), 0.0])
        assert places.lane.shape == (61, 3)
        pairs = rng.integers(0, 61, (2, 400))
        there_m, back_m = graph.gaps_m(places, pairs)
        distances_m = graph.distances_m(places, places)
        assert there_m.tolist() == pytest.approx(distances_m[pairs[0], pairs[1]].tolist())
        assert back_m.tolist() == pytest.approx(distances_m[pairs[1], pairs[0]].tolist())
        assert graph.gaps_m(places.take([0, 1]), np.zeros((2, 0), dtype=np.int64)).shape == (2, 0)


def meet(network: RoadNetwork, one: tuple[int, float], other: tuple[int, float], *, keep_lanes: bool) -> float:
    """Drive straight on from one place until on the road of the other one, beside whom; metres, inf if never."""
    lanes, ids = network.lanes, [lane.id for lane in network.lanes]
    ends = [(lanes[ids.index(way.from_lane)], lanes[ids.index(way.to_lane)]) for way in network.connections]
    lengths_m = LaneGraph(network).length_m

    def roads(number: int) -> tuple[object, ...]:
        if number < len(lanes):
            return lanes[number].road, lanes[number].direction
        start, end = ends[number - len(lanes)]
        return (start.road, start.direction), (end.road, end.direction)

    def turned_back(number: int) -> tuple[object, ...]:
        if number < len(lanes):
            return lanes[number].road, -lanes[number].direction
        start, end = ends[number - len(lanes)]
        return (end.road, -end.direction), (start.road, -start.direction)

    def turn_rad(way: int) -> float:
        start, end = ends[way]
        out = complex(*(end.centre_line_m[1] - end.centre_line_m[0]))
        return abs(float(np.angle(out / complex(*(start.centre_line_m[-1] - start.centre_line_m[-2])))))

    def after(number: int) -> list[int]:
        if number >= len(lanes):
            end = ends[number - len(lanes)][1]
            return [k for k, lane in enumerate(lanes) if lane is end or (lane.edge == end.edge and not keep_lanes)]
        here = lanes[number]
        ways = [
            way for way, (start, _) in enumerate(ends) if start is here or (start.edge == here.edge and not keep_lanes)
        ]
        is_fork = len({roads(len(lanes) + way)[1] for way in ways}) > 1
        return [len(lanes) + way for way in ways if not is_fork or turn_rad(way) <= np.radians(30.0)]

    least: dict[int, float] = {}
    to_do = [(one[0], 0.0)]
    while to_do:
        number, start_m = to_do.pop()
        if start_m < least.get(number, np.inf):
            least[number] = start_m
            to_do += [(next_one, start_m + float(lengths_m[number])) for next_one in after(number)]
    reached = [start_m + float(lengths_m[k]) for k, start_m in least.items() if roads(k) == turned_back(other[0])]
    return min(reached, default=np.inf) - one[1] - other[1]


@pytest.mark.long
@for_each("case", [(name, keep) for name in ("crossing", "roundabout", "urban_grid") for keep in (False, True)])
def test_who_drives_towards_whom_is_known_from_driving_straight_on(case: tuple[str, bool]) -> None:
    name, keep_lanes = case
    network = read_sumo_net(FILES[name])
    graph, rng = LaneGraph(network, keep_lanes=keep_lanes), np.random.default_rng(5)
    places = scattered(graph, 60, 5)
    pairs = rng.integers(0, 60, (2, 50))
    at = list(zip(places.lane[:, 0].tolist(), places.along_m[:, 0].tolist(), strict=True))
    found_m = graph.facing_m(places, pairs).tolist()
    assert graph.facing_m(places, pairs[::-1]).tolist() == pytest.approx(found_m)
    for (one, other), gap_m in zip(pairs.T.tolist(), found_m, strict=True):
        ways_m = [meet(network, at[a], at[b], keep_lanes=keep_lanes) for a, b in ((one, other), (other, one))]
        assert gap_m == pytest.approx(min(ways_m)), (at[one], at[other])
    assert 1 < np.isfinite(found_m).sum() < 50


def test_who_comes_straight_over_a_crossing_is_faced_and_who_may_turn_off_is_not() -> None:
    network = read_sumo_net(CROSSING_NET)
    graph, index = LaneGraph(network, keep_lanes=True), network.lane_index
    places = LanePlaces.of([index[lane] for lane in ("sc_0", "nc_0", "ec_0")], [150.0, 160.0, 150.0])
    gaps_m = graph.facing_m(places, np.array([[0, 0, 1], [1, 2, 2]]))
    south_m, north_m = graph.length_m[index["sc_0"]] - 150.0, graph.length_m[index["nc_0"]] - 160.0
    assert gaps_m[0] == pytest.approx(south_m + north_m + 21.8, abs=1.0)
    assert np.isinf(gaps_m[1:]).all()


def test_who_are_both_in_a_junction_face_each_other_on_any_of_their_ways() -> None:
    network = read_sumo_net(CROSSING_NET)
    graph, rng = LaneGraph(network, keep_lanes=True), np.random.default_rng(3)
    ways = rng.integers(len(network.lanes), len(graph.lines_m), (100, 2)).astype(np.int32)
    places = LanePlaces(ways, rng.random((100, 2)) * graph.length_m[ways])
    pairs = np.array([np.arange(50), np.arange(50, 100)])
    found_m = graph.facing_m(places, pairs)
    each_m = []
    for of_one, of_other in product((0, 1), repeat=2):
        chosen = np.repeat((of_one, of_other), 50), np.arange(100)
        each_m.append(graph.facing_m(LanePlaces.of(ways[chosen[::-1]], places.along_m[chosen[::-1]]), pairs))
    assert found_m == pytest.approx(np.min(each_m, axis=0))
    assert (found_m < each_m[0]).any()


@contextmanager
def sumo(name: str) -> Iterator[None]:
    libsumo.start(["sumo", "-n", str(FILES[name]), "--no-step-log", "--no-warnings", "--seed", "1"])
    try:
        yield
    finally:
        libsumo.close()


@for_each("name", ["junction", "roundabout", "crossing"])
def test_distances_are_those_of_sumo(name: str) -> None:
    network = read_sumo_net(FILES[name])
    graph = LaneGraph(network)
    lengths_m = graph.length_m[: len(network.lanes)]
    starts, ends = (LanePlaces.of(range(len(lengths_m)), share * lengths_m) for share in (0.3, 0.5))
    found_m = graph.distances_m(starts, ends)
    with sumo(name):
        for row, start in enumerate(network.lanes):
            for column, end in enumerate(network.lanes):
                from_m, to_m = 0.3 * libsumo.lane.getLength(start.id), 0.5 * libsumo.lane.getLength(end.id)
                way_m = libsumo.simulation.getDistanceRoad(start.edge, from_m, end.edge, to_m, True)
                # SUMO says no way with a large negative number; bent lanes of one edge have one length there.
                expected = way_m if way_m > -1e6 else np.inf
                assert found_m[row, column] == pytest.approx(expected, abs=2.5 if name == "crossing" else 0.1)


@for_each("name", ["junction", "roundabout"])
def test_who_is_next_ahead_in_sumo_is_as_far_ahead_here(name: str) -> None:
    network = read_sumo_net(FILES[name])
    graph, compared = LaneGraph(network, keep_lanes=True), 0
    entries = [lane.edge for lane in network.lanes if all(lane.id != way.to_lane for way in network.connections)]
    exits = [lane.edge for lane in network.lanes if all(lane.id != way.from_lane for way in network.connections)]
    with sumo(name):
        for step in range(80):
            edges = libsumo.simulation.findRoute(entries[step % len(entries)], exits[step * 3 % len(exits)]).edges
            if edges:
                libsumo.route.add(f"{step}", edges)
                libsumo.vehicle.add(f"{step}", f"{step}", departLane="best", departSpeed="max")
            libsumo.simulation.step()
            ids = libsumo.vehicle.getIDList()
            noses_m = np.array([libsumo.vehicle.getPosition(one) for one in ids]).reshape(-1, 2)
            heading_rad = np.radians([90.0 - libsumo.vehicle.getAngle(one) for one in ids])
            places = project(graph, network, noses_m, heading_rad)
            ahead, ahead_m = graph.next_ahead(places, 60.0)
            for row, one in enumerate(ids):
                leader, gap_m = libsumo.vehicle.getLeader(one, 50.0) or ("", 0.0)
                # In a junction SUMO counts as leaders those whose way is crossed, too.
                if leader and libsumo.vehicle.getLaneID(leader) in network.lane_index:
                    leader_m = gap_m + libsumo.vehicle.getMinGap(one) + libsumo.vehicle.getLength(leader)
                    # Over another way on from here there may be a nearer one.
                    assert ids[ahead[row]] == leader or ahead_m[row] < leader_m or leader_m > 60.0
                    there = places.take([ids.index(leader)])
                    assert way_m(graph, places.take([row]), there) == pytest.approx(leader_m, abs=0.5)
                    compared += 1
    assert compared > 100


@for_each("name", list(FILES))
def test_route_leads_from_place_to_place_in_steps_along_the_lanes(name: str) -> None:
    graph = graph_of(name, keep_lanes=True)
    starts, ends = scattered(graph, 40, 3), scattered(graph, 40, 4)
    lines = [shapely.LineString(line_m) for line_m in graph.lines_m]
    for row, length_m in enumerate(np.diagonal(graph.distances_m(starts, ends)).tolist()):
        start, end = starts.take([row]), ends.take([row])
        route = graph.route(start, end)
        if not np.isfinite(length_m):
            assert route is None
            continue
        assert route is not None
        assert shapely.LineString(route.line_m).length == pytest.approx(length_m, rel=0.01, abs=0.5)
        for place, point_m in ((start, route.line_m[0]), (end, route.line_m[-1])):
            there = lines[int(place.lane[0, 0])].interpolate(float(place.along_m[0, 0]))
            assert point_m.tolist() == pytest.approx([there.x, there.y])
        points_m, heading_rad = route.points(np.linspace(0.0, 1.0, 1 + round(length_m)))
        steps_m = np.diff(points_m, axis=0)
        assert np.hypot(*steps_m.T).max(initial=0.0) < 1.3
        turned_rad = np.angle(np.exp(1j * (np.arctan2(*steps_m.T[::-1]) - heading_rad[:-1])))
        assert np.abs(turned_rad).max(initial=0.0) < 0.8


def test_route_over_a_change_of_lanes_goes_evenly_from_one_to_the_other() -> None:
    network = two_way_along(np.array([[0.0, 0.0], [100.0, 0.0]]))
    route = LaneGraph(network).route(LanePlaces.of([0], [20.0]), LanePlaces.of([1], [80.0]))
    assert route is not None
    assert route.lanes == (0, 1)
    assert route.points([0.0, 0.5, 1.0])[0].tolist() == [
        pytest.approx(at_m) for at_m in ([20, -5.25], [50, -3.5], [80, -1.75])
    ]
    assert LaneGraph(network, keep_lanes=True).route(LanePlaces.of([0], [20.0]), LanePlaces.of([1], [80.0])) is None


def test_route_of_no_length_is_a_point() -> None:
    graph = graph_of("crossing")
    place = LanePlaces.of([3], [5.0])
    route = graph.route(place, place)
    assert route is not None
    assert np.ptp(route.points([0.0, 1.0])[0], axis=0).tolist() == [0.0, 0.0]


def test_a_way_leads_round_and_back_to_a_place_behind() -> None:
    graph = graph_of("roundabout")
    (ring,) = (
        place for place, lane in enumerate(read_sumo_net(FILES["roundabout"]).lanes) if lane.id == "ring_west_south_0"
    )
    ahead, behind = LanePlaces.of([ring], [9.0]), LanePlaces.of([ring], [4.0])
    assert way_m(graph, behind, ahead) == 5.0
    assert way_m(graph, ahead, behind) == pytest.approx(2 * np.pi * 20 - 5.0, rel=0.05)
    route = graph.route(ahead, behind)
    assert route is not None
    assert len(route.lanes) == 9


@for_each("name", ["crossing", "junction", "roundabout", "urban_grid"])
def test_place_in_a_junction_is_on_a_way_that_runs_there(name: str) -> None:
    network, rng = read_sumo_net(FILES[name]), np.random.default_rng(1)
    graph = LaneGraph(network)
    ways = np.arange(len(network.lanes), len(graph.lines_m))
    points = [Route((), graph.lines_m[way]).points([0.3, 0.6]) for way in ways]
    points_m = np.vstack([at_m for at_m, _ in points]) + rng.normal(0.0, 0.3, (2 * len(ways), 2))
    heading_rad = np.concatenate([rad for _, rad in points]) + rng.normal(0.0, 0.03, 2 * len(ways))
    places = project(graph, network, points_m, heading_rad)
    in_junction = network.locate(points_m).lane < 0
    assert in_junction.mean() > 0.9
    for row in in_junction.nonzero()[0].tolist():
        way = ways[row // 2]
        assert way in places.lane[row], (name, row)
        along_m = places.along_m[row, places.lane[row].tolist().index(way)]
        assert along_m == pytest.approx((0.3, 0.6)[row % 2] * graph.length_m[way], abs=1.5)
        known = [lane for lane in places.lane[row].tolist() if lane >= 0]
        assert len(set(known)) == len(known)


def test_who_drives_against_the_lane_is_on_the_nearest_one_of_the_other_direction() -> None:
    network = two_way_along(np.array([[0.0, 0.0], [100.0, 0.0]]))
    places = project(
        LaneGraph(network), network, np.array([[30.0, 1.75], [30.0, 1.75], [30.0, -5.25]]), [0.0, 3.1, 3.1]
    )
    assert (places.lane[:, 0].tolist(), places.along_m[:, 0].round(6).tolist()) == ([1, 2, 2], [30.0, 70.0, 70.0])


def test_who_is_off_the_lanes_or_drives_against_a_one_way_road_is_nowhere() -> None:
    network = read_sumo_net(FILES["roundabout"])
    ring = next(lane for lane in network.lanes if lane.id == "ring_west_south_0")
    middle_m = Route((), ring.centre_line_m).points([0.5])
    points_m = np.vstack([[[500.0, 500.0], [np.nan, 0.0]], middle_m[0]])
    places = project(LaneGraph(network), network, points_m, [0.0, 0.0, float(middle_m[1][0]) + np.pi])
    assert (places.lane == -1).all()
    assert np.isinf(LaneGraph(network).distances_m(places, places)).all()
    assert LaneGraph(network).next_ahead(places, 100.0)[0].tolist() == [-1, -1, -1]


def test_exits_are_where_a_vehicle_can_come_out_of_a_junction() -> None:
    network = read_sumo_net(CROSSING_NET)
    south = network.lane_index["sc_0"]
    (within_60, within_20) = (
        LaneGraph(network).exits_within(LanePlaces.of([south], [160.0]), reach_m)[0] for reach_m in (60.0, 20.0)
    )
    assert {network.lanes[lane].edge for lane in within_60} == {"cw", "cn", "ce"}
    assert within_60[network.lane_index["cn_0"]] == pytest.approx(29.4 + 21.77, abs=0.1)
    assert within_20 == {}


def test_network_without_connections_has_distances_on_its_edges_only() -> None:
    graph = LaneGraph(two_way_along(np.array([[0.0, 0.0], [100.0, 0.0]])))
    places = LanePlaces.of([0, 1, 2], [10.0, 30.0, 40.0])
    assert graph.distances_m(places, places).tolist() == [
        [0.0, 20.0, np.inf],
        [np.inf, 0.0, np.inf],
        [np.inf, np.inf, 0.0],
    ]
    assert graph.exits_within(places, 100.0) == [{}, {}, {}]


def test_no_graph_is_made_without_connections_or_of_a_whole_city(monkeypatch: pytest.MonkeyPatch) -> None:
    assert LaneGraph.of(two_way_along(np.array([[0.0, 0.0], [100.0, 0.0]]))) is None
    network = read_sumo_net(CROSSING_NET)
    assert LaneGraph.of(network) is not None
    monkeypatch.setattr("gis.roads.lane_graph._MOST_LANES", len(network.lanes) + len(network.connections) - 1)
    assert LaneGraph.of(network) is None


def test_no_places_have_no_distances() -> None:
    graph = graph_of("crossing")
    assert graph.distances_m(LanePlaces.of([], []), scattered(graph, 3, 1)).shape == (0, 3)
    assert graph.next_ahead(LanePlaces.of([], []), 60.0)[1].tolist() == []


def test_connection_without_a_line_is_a_straight_way() -> None:
    lanes = [
        Lane(name, name, 0, name, +1, np.array([[x_m, 0.0], [x_m + 40.0, 0.0]]), 3.5, 10.0)
        for name, x_m in (("a", 0.0), ("b", 50.0), ("c", 90.0))
    ]
    ways = [Connection("a", "b", "x", None, 5.0), Connection("b", "c", "y", None, 5.0)]
    graph = LaneGraph(RoadNetwork(lanes, connections=ways))
    assert way_m(graph, LanePlaces.of([0], [30.0]), LanePlaces.of([2], [5.0])) == 65.0


def test_connection_to_a_lane_that_is_not_there_is_an_error() -> None:
    lane = Lane("a", "a", 0, "a", +1, np.array([[0.0, 0.0], [40.0, 0.0]]), 3.5, 10.0)
    with pytest.raises(GisError, match="connection: expected two lanes of the network, got 'b'"):
        RoadNetwork([lane], connections=[Connection("a", "b", "x", None, 5.0)])
    with pytest.raises(GisError, match=r"connection 'a' to 'b': speed_limit_mps must be > 0 m/s, got 0.0"):
        Connection("a", "b", "x", None, 0.0)
