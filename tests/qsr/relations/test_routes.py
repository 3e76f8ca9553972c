"""Relations of cars that are not on one road but one after the other on a route."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pytest

from gis.roads.lane_graph import LaneGraph, LanePlaces, Route
from gis.roads.road_network import RoadNetwork
from gis.roads.sumo_net import read_sumo_net
from qsr.changes.crossings import Value
from qsr.measuring.footprints import FloatArray, Footprints
from qsr.observer import RelationObserver
from qsr.settings import RelationSettings
from tests.gis.support import CROSSING_NET
from tests.qsr.oracle import Oracle
from tests.qsr.scenes import footprints_at

NETWORKS = Path(__file__).parents[3] / "data_gen" / "scenarios" / "networks"
CROSSING = read_sumo_net(CROSSING_NET)
ROUNDABOUT = read_sumo_net(NETWORKS / "roundabout" / "network.net.xml")

RINGS = "ring_west_south_0", "ring_east_north_0"

# For each car: x, y, heading and speed, frame by frame.
Drives = Mapping[str, FloatArray]


def drive(network: RoadNetwork, start: str, end: str, *, from_m: float, speed_mps: float, frames: int) -> FloatArray:
    """Drive from a lane to a lane at ten frames a second, `from_m` after the start of the first one."""
    graph, index = LaneGraph(network, keep_lanes=True), network.lane_index
    route = graph.route(LanePlaces.of([index[start]], [0.0]), LanePlaces.of([index[end]], [80.0]))
    assert route is not None
    length_m = np.hypot(*np.diff(route.line_m, axis=0).T).sum()
    at_m = from_m + speed_mps * 0.1 * np.arange(frames)
    assert at_m[-1] < length_m
    points_m, heading_rad = route.points(at_m / length_m)
    return np.column_stack((points_m, heading_rad, np.full(frames, speed_mps)))


def frames_of(network: RoadNetwork, drives: Drives) -> list[Footprints]:
    rows = zip(*drives.values(), strict=True)
    return [footprints_at(network, place * 100_000, tuple(drives), np.array(row)) for place, row in enumerate(rows)]


def observer_of(
    network: RoadNetwork, *, graph: LaneGraph | None, settings: RelationSettings | None = None
) -> RelationObserver:
    roads, junctions = [road.id for road in network.roads], [one.id for one in network.junctions]
    return RelationObserver(roads, junctions, settings, graph=graph)


def values(network: RoadNetwork, drives: Drives, name: str, *, with_routes: bool = True) -> list[Value]:
    """List the values of a relation of a and b, one after the other."""
    graph = LaneGraph(network, keep_lanes=True) if with_routes else None
    observer = observer_of(network, graph=graph)
    changes = [change for frame in frames_of(network, drives) for change in observer.observe(frame)]
    return [change.new for change in changes if (change.name, change.args) == (name, ("a", "b"))]


@pytest.mark.long
@pytest.mark.parametrize(("start", "end"), [("sc_0", "ce_0"), ("sc_1", "cw_1")], ids=["right", "left"])
def test_who_follows_round_a_corner_stays_behind(start: str, end: str) -> None:
    a, b = (drive(CROSSING, start, end, from_m=from_m, speed_mps=8.0, frames=70) for from_m in (160.0, 175.0))
    for name in ("behind", "same_direction", "following"):
        assert values(CROSSING, {"a": a, "b": b}, name) == [True], name
    assert False in values(CROSSING, {"a": a, "b": b}, "behind", with_routes=False)


def test_who_closes_up_round_a_corner_is_dated_by_the_way_along_the_lanes() -> None:
    # 20 m behind along the lanes and 3 m/s faster: 1 s of 10 m/s from bumper to bumper are left after 5.5 m.
    a = drive(CROSSING, "sc_0", "ce_0", from_m=165.0, speed_mps=10.0, frames=60)
    b = drive(CROSSING, "sc_0", "ce_0", from_m=185.0, speed_mps=7.0, frames=60)
    observer = observer_of(CROSSING, graph=LaneGraph(CROSSING, keep_lanes=True))
    changes = [one for frame in frames_of(CROSSING, {"a": a, "b": b}) for one in observer.observe(frame)]
    told = {(one.name, one.new): one.t_us for one in changes if one.args == ("a", "b")}
    assert told["short_headway", True] == pytest.approx(5.5 / 3.0 * 1e6, abs=100_000)
    assert told["behind", False] == pytest.approx(15.5 / 3.0 * 1e6, abs=100_000)


def test_who_comes_from_another_arm_is_not_behind() -> None:
    a = drive(CROSSING, "sc_0", "cn_0", from_m=170.0, speed_mps=4.0, frames=50)
    b = drive(CROSSING, "wc_1", "ce_1", from_m=185.0, speed_mps=4.0, frames=50)
    assert True not in values(CROSSING, {"a": a, "b": b}, "behind")


def test_nobody_is_behind_who_is_on_the_other_side_of_a_ring() -> None:
    ways = [Route((), ROUNDABOUT.lanes[ROUNDABOUT.lane_index[one]].centre_line_m) for one in RINGS]
    a, b = (
        np.array([[*points_m[0], *heading_rad, 5.0]]) for points_m, heading_rad in (way.points([0.5]) for way in ways)
    )
    assert values(ROUNDABOUT, {"a": a, "b": b}, "behind") == [False]


def test_who_overtakes_in_the_oncoming_lane_is_behind_but_does_not_follow() -> None:
    a = drive(CROSSING, "sc_1", "cn_1", from_m=150.0, speed_mps=8.0, frames=20)
    b = drive(CROSSING, "sc_1", "cn_1", from_m=192.0, speed_mps=0.0, frames=20)
    assert values(CROSSING, {"a": a, "b": b}, "following")[-1] is True
    a[:, 0] -= 3.3
    assert values(CROSSING, {"a": a, "b": b}, "following") == [False]
    assert values(CROSSING, {"a": a, "b": b}, "behind") == [True]


def test_who_comes_over_the_crossing_is_oncoming_until_they_have_met() -> None:
    # 60 m apart along the road, each at 10 m/s: less than 3 s from bumper to bumper once 56 m are left.
    a = drive(CROSSING, "sc_0", "cn_0", from_m=150.0, speed_mps=10.0, frames=50)
    b = drive(CROSSING, "nc_0", "cs_0", from_m=150.0, speed_mps=10.0, frames=50)
    observer = observer_of(CROSSING, graph=LaneGraph(CROSSING, keep_lanes=True))
    changes = [one for frame in frames_of(CROSSING, {"a": a, "b": b}) for one in observer.observe(frame)]
    told = [(one.t_us / 1e6, one.new) for one in changes if (one.name, one.args) == ("oncoming", ("a", "b"))]
    apart_m = a[:, 1] - b[:, 1]
    met_s = 0.1 * float(np.interp(0.0, apart_m + 4.5, np.arange(50)))
    assert [value for _, value in told][:3] == [False, True, False]
    assert told[1][0] == pytest.approx(met_s - 3.0, abs=0.1)
    assert told[2][0] == pytest.approx(met_s, abs=0.1)
    assert True not in values(CROSSING, {"a": a, "b": b}, "oncoming", with_routes=False)


def test_who_turns_off_is_not_oncoming_to_who_comes_straight_on() -> None:
    a = drive(CROSSING, "sc_1", "cw_1", from_m=175.0, speed_mps=5.0, frames=60)
    b = drive(CROSSING, "ec_0", "cw_0", from_m=160.0, speed_mps=10.0, frames=60)
    assert True not in values(CROSSING, {"a": a, "b": b}, "oncoming")


@pytest.mark.long
@pytest.mark.parametrize("seed", [0, 1, *(pytest.param(one, marks=pytest.mark.slow) for one in range(2, 6))])
def test_observer_equals_the_slow_version_where_cars_turn(seed: int) -> None:
    network, rng = (CROSSING, ROUNDABOUT)[seed % 2], np.random.default_rng(seed)
    starts = [lane.id for lane in network.lanes if all(lane.id != way.to_lane for way in network.connections)]
    ends = [lane.id for lane in network.lanes if all(lane.id != way.from_lane for way in network.connections)]
    graph = LaneGraph(network, keep_lanes=True)
    drives = {}
    while len(drives) < 10:
        start, end = (network.lane_index[str(rng.choice(names))] for names in (starts, ends))
        if not np.isfinite(graph.distances_m(LanePlaces.of([start], [0.0]), LanePlaces.of([end], [80.0]))).all():
            continue
        from_m = graph.length_m[start] - rng.uniform(0.0, 40.0)
        ids = network.lanes[start].id, network.lanes[end].id
        one = drive(network, *ids, from_m=from_m, speed_mps=rng.uniform(0.0, 10.0), frames=40)
        drives[f"car{len(drives)}"] = one + rng.normal(0.0, [0.2, 0.2, 0.03, 0.2], one.shape)
    settings = RelationSettings(backdate_us=700_000)
    fast = observer_of(network, graph=graph, settings=settings)
    places = [road.id for road in network.roads], [one.id for one in network.junctions]
    slow, told = Oracle(*places, settings, graph=graph), 0
    for frame in frames_of(network, drives):
        got = {(c.name, c.args): c for c in fast.observe(frame)}
        expected = {(c.name, c.args): c for c in slow.observe(frame)}
        assert got.keys() == expected.keys()
        for key, change in got.items():
            assert (change.old, change.new) == (expected[key].old, expected[key].new), key
            assert abs(change.t_us - expected[key].t_us) <= 1  # rounding
        told += len(got)
    assert told > 200
