"""SUMO networks: which edges make a road, and what is left out."""

from __future__ import annotations

import gzip
from pathlib import Path

import pytest

from gis.errors import GisError
from gis.roads.road_network import RoadNetwork
from gis.roads.sumo_net import read_sumo_net
from tests.gis.support import CROSSING_NET, TWO_WAY_NET


def read(tmp_path: Path, text: str) -> RoadNetwork:
    path = tmp_path / "roads.net.xml"
    path.write_text(text, encoding="utf-8")
    return read_sumo_net(path)


def test_opposite_edges_with_neigh_lanes_form_one_road(tmp_path: Path) -> None:
    network = read(tmp_path, TWO_WAY_NET)
    (road,) = network.roads
    # "ew" comes before "we" in the alphabet, so it names the road and its direction.
    assert (road.id, road.lanes) == ("ew", ("we_0", "ew_0"))
    assert road.reference_line_m.tolist() == [[100.0, 0.0], [0.0, 0.0]]
    assert [(lane.id, lane.edge, lane.index, lane.direction) for lane in network.lanes] == [
        ("we_0", "we", 0, -1),
        ("ew_0", "ew", 0, 1),
    ]


def test_opposite_edges_side_by_side_form_one_road_without_neigh_lanes(tmp_path: Path) -> None:
    text = TWO_WAY_NET.replace('<neigh lane="ew_0"/>', "").replace('<neigh lane="we_0"/>', "")
    assert [road.id for road in read(tmp_path, text).roads] == ["ew"]


def test_carriageways_with_a_verge_between_them_are_two_roads(tmp_path: Path) -> None:
    text = TWO_WAY_NET.replace('<neigh lane="ew_0"/>', "").replace('<neigh lane="we_0"/>', "")
    text = text.replace("100,1.75 0,1.75", "100,8.75 0,8.75")
    assert [road.id for road in read(tmp_path, text).roads] == ["we", "ew"]


def test_one_neigh_is_enough_to_join_edges_between_other_nodes(tmp_path: Path) -> None:
    text = TWO_WAY_NET.replace('<neigh lane="we_0"/>', "").replace('from="e" to="w"', 'from="e2" to="w2"')
    assert [road.id for road in read(tmp_path, text).roads] == ["ew"]


def test_the_way_back_with_a_leading_minus_does_not_name_the_road(tmp_path: Path) -> None:
    text = TWO_WAY_NET.replace('"ew"', '"-we"').replace("ew_0", "-we_0")
    network = read(tmp_path, text)
    assert [(road.id, road.reference_line_m[0].tolist()) for road in network.roads] == [("we", [0.0, 0.0])]


def test_lanes_inside_junctions_and_dead_ends_are_left_out(tmp_path: Path) -> None:
    network = read(tmp_path, TWO_WAY_NET)
    assert {lane.id for lane in network.lanes} == {"we_0", "ew_0"}
    assert network.junctions == ()


def test_connections_lead_over_the_lanes_inside_the_junction() -> None:
    ways = {(one.from_lane, one.to_lane): one for one in read_sumo_net(CROSSING_NET).connections}
    assert len(ways) == 16
    left = ways["nc_1", "ce_1"]  # over :c_3_0 and :c_16_0, which share a point
    assert left.junction == "c"
    assert left.speed_limit_mps == 9.23
    assert left.via_m is not None
    assert left.via_m[[0, 1, -1]].tolist() == [[-1.65, 11.17], [-0.89, 5.9], [11.27, -0.72]]
    assert len(left.via_m) == 6


def test_connection_without_lanes_inside_the_junction_has_the_speed_of_the_lane_after_it(tmp_path: Path) -> None:
    way = (
        '<connection from="we" to="ew" fromLane="0" toLane="0"/><connection from="we" to="x" fromLane="0" toLane="0"/>'
    )
    (back,) = read(tmp_path, TWO_WAY_NET.replace("</net>", f"{way}</net>")).connections
    assert (back.from_lane, back.to_lane, back.junction) == ("we_0", "ew_0", "e")
    assert (back.via_m, back.speed_limit_mps) == (None, 25.0)


def test_lanes_inside_a_junction_that_lead_round_in_a_circle_end(tmp_path: Path) -> None:
    ways = (
        '<connection from="we" to="ew" fromLane="0" toLane="0" via=":e_0_0"/>'
        '<connection from=":e_0" to="ew" fromLane="0" toLane="0" via=":e_0_0"/>'
    )
    (back,) = read(tmp_path, TWO_WAY_NET.replace("</net>", f"{ways}</net>")).connections
    assert back.via_m is not None
    assert back.via_m.tolist() == [[100.0, -1.75], [102.0, 0.0], [100.0, 1.75]]


def test_lanes_without_motor_traffic_are_left_out(tmp_path: Path) -> None:
    pavement = '<lane id="we_p" index="1" allow="pedestrian" speed="2" length="100" width="2" shape="0,-5 100,-5"/>'
    closed = '<lane id="we_c" index="2" disallow="all" speed="2" length="100" width="2" shape="0,-7 100,-7"/>'
    bus = '<lane id="we_b" index="3" allow="bus bicycle" speed="9" length="100" shape="0,-9 100,-9"/>'
    text = TWO_WAY_NET.replace(
        '<edge id="ew"', f'<edge id="x" from="a" to="b">{pavement}{closed}{bus}</edge><edge id="ew"'
    )
    network = read(tmp_path, text)
    assert [lane.id for lane in network.lanes] == ["we_0", "we_b", "ew_0"]
    assert network.lanes[1].width_m == 3.2


def test_a_crossing_made_by_netconvert_has_four_roads_and_a_junction() -> None:
    network = read_sumo_net(CROSSING_NET)
    assert [road.id for road in network.roads] == ["ce", "cn", "cs", "cw"]
    assert [junction.id for junction in network.junctions] == ["c"]
    assert network.locate([[0.0, 0.0]]).junction.tolist() == [0]
    assert network.surface().geom_type == "Polygon"


def test_reference_lines_of_a_bent_road_follow_the_edge_shape_netconvert_was_given() -> None:
    network = read_sumo_net(CROSSING_NET)
    line_m = next(road for road in network.roads if road.id == "ce").reference_line_m
    assert line_m[1:].tolist() == [pytest.approx(point, abs=0.02) for point in ([60, 5], [120, 30], [200, 10])]


def test_heights_in_shapes_are_ignored_and_gzip_is_read(tmp_path: Path) -> None:
    path = tmp_path / "roads.net.xml.gz"
    path.write_bytes(gzip.compress(TWO_WAY_NET.replace("0,-1.75 100,-1.75", "0,-1.75,7.5 100,-1.75,8").encode()))
    assert read_sumo_net(path).lanes[0].centre_line_m.tolist() == [[0.0, -1.75], [100.0, -1.75]]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("<net>", "expected XML, got no element found: line 1, column 5"),
        ("<routes/>", "expected the root element 'net' of a SUMO network, got 'routes'"),
        ("<net/>", "expected at least one edge with a lane for motor traffic, got none"),
        (TWO_WAY_NET.replace(' from="w"', ""), "edge 'we': expected the attribute 'from', got none"),
        (TWO_WAY_NET.replace('speed="25"', 'speed="fast"'), "lane 'we_0': expected a number in 'speed', got 'fast'"),
        (
            TWO_WAY_NET.replace("0,-1.75 100,-1.75", "0 -1.75 100"),
            "lane 'we_0': expected 'x,y x,y ...' in 'shape', got '0 -1.75 100'",
        ),
        (
            TWO_WAY_NET.replace("0,-1.75 100,-1.75", "5,5"),
            "lane 'we_0': expected a line of at least 2 different points, got [[5.0, 5.0]]",
        ),
        (
            TWO_WAY_NET.replace("</net>", '<connection from="we" to="ew" fromLane="0" toLane="0" via="no"/></net>'),
            "connection 'we_0' to 'ew_0': expected 'via' to name a lane, got 'no'",
        ),
        (
            TWO_WAY_NET.replace("</net>", '<connection from="we" to="ew" toLane="0"/></net>'),
            "connection 'we': expected the attribute 'fromLane', got none",
        ),
        (TWO_WAY_NET.replace('width="3.5"', 'width="0"'), "lane 'we_0': width_m must be > 0 metres, got 0.0"),
        (TWO_WAY_NET.replace('"we_0"', '"ew_0"'), "road network: expected every lane id once, got 'ew_0' twice"),
    ],
    ids=[
        "broken",
        "other root",
        "empty",
        "no from",
        "no number",
        "no points",
        "one point",
        "no via",
        "no lane",
        "no width",
        "twice",
    ],
)
def test_a_file_that_is_no_sumo_net_is_an_error(tmp_path: Path, text: str, message: str) -> None:
    with pytest.raises(GisError) as caught:
        read(tmp_path, text)
    assert str(caught.value) == f"{tmp_path / 'roads.net.xml'}: {message}"


def test_a_missing_file_is_an_error(tmp_path: Path) -> None:
    with pytest.raises(GisError, match=r"none.net.xml: expected a readable SUMO network file, got .*No such file"):
        read_sumo_net(tmp_path / "none.net.xml")


def test_a_file_that_only_claims_to_be_gzip_is_an_error(tmp_path: Path) -> None:
    path = tmp_path / "roads.net.xml.gz"
    path.write_text(TWO_WAY_NET)
    with pytest.raises(GisError, match="expected a readable SUMO network file, got Not a gzipped file"):
        read_sumo_net(path)
