"""Stop lines lie across the lanes that have to stop, right before the junction."""

from pathlib import Path

import numpy as np
import pytest
import shapely

from data_gen.drawing.ground.markings import junction_marks, parking_bays
from data_gen.scenario import ParkingStrip, kind_of, shipped_network
from gis.roads.lanes import Lane
from gis.roads.sumo_net import read_sumo_net

JUNCTION = shipped_network("junction")


def net(tmp_path: Path, connections: str, crossing: str = "") -> Path:
    path = tmp_path / "network.net.xml"
    path.write_text(
        "<net>"
        '<edge id="in" from="a" to="b"><lane id="in_0" index="0" speed="13.9" width="3.5" shape="0,0 100,0"/></edge>'
        '<edge id="out" from="b" to="c">'
        '<lane id="out_0" index="0" speed="13.9" width="3.5" shape="120,0 200,0"/></edge>'
        f"{crossing}{connections}</net>",
        encoding="utf-8",
    )
    return path


@pytest.mark.parametrize(
    ("attributes", "pieces", "covered"),
    [
        ('tl="b" state="o"', 1, 0.9),
        ('state="s"', 1, 0.9),
        ('state="m"', 4, 0.6),
        ('state="M"', 0, 0.0),
    ],
    ids=["light", "stop sign", "give way", "priority"],
)
def test_the_line_tells_who_has_to_stop(tmp_path: Path, attributes: str, pieces: int, covered: float) -> None:
    path = net(tmp_path, f'<connection from="in" to="out" fromLane="0" toLane="0" dir="x" {attributes}/>')
    marks = junction_marks(read_sumo_net(path), path)
    assert len(marks) == pieces
    united = shapely.union_all(list(marks))
    assert shapely.intersection(united, shapely.LineString([(99.5, -1.75), (99.5, 1.75)])).length >= covered * 3.2
    if marks:
        assert united.bounds[2] == pytest.approx(99.6)
        assert united.bounds[1] >= -1.75


def test_arrows_point_where_the_lane_leads(tmp_path: Path) -> None:
    ways = {}
    for way in ("l", "r", "s"):
        path = net(tmp_path, f'<connection from="in" to="out" fromLane="0" toLane="0" dir="{way}" tl="b" state="o"/>')
        arrows = [mark for mark in junction_marks(read_sumo_net(path), path) if mark.bounds[2] < 95]
        assert len(arrows) == 2
        ways[way] = shapely.union_all(arrows).centroid.y
    assert ways["l"] > 0.1
    assert ways["r"] < -0.1
    assert ways["s"] == pytest.approx(0.0)


def test_a_crossing_is_painted_as_bars_along_the_road(tmp_path: Path) -> None:
    crossing = (
        '<edge id=":b_c0" function="crossing"><lane id=":b_c0_0" index="0" speed="1" width="4.0" shape="110,-5 110,5"/>'
        "</edge>"
    )
    path = net(tmp_path, "", crossing)
    bars = junction_marks(read_sumo_net(path), path)
    assert len(bars) == 10
    assert all(np.ptp(np.array(bar.bounds)[[0, 2]]) == pytest.approx(4.0) for bar in bars)


def test_the_signalised_junction_has_a_stop_line_in_each_lane_that_leads_to_it() -> None:
    network = read_sumo_net(JUNCTION)
    lanes = [lane for lane in network.lanes if "_in" in lane.id]
    marks = shapely.union_all(list(junction_marks(network, JUNCTION)))
    for lane in lanes:
        last_m = shapely.LineString(lane.centre_line_m[-2:])
        end = last_m.interpolate(last_m.length - 0.65)
        assert marks.contains(end), lane.id


def test_parked_cars_stand_on_paved_ground() -> None:
    lane = Lane("a", "a", 0, "a", +1, np.array([[0.0, 0.0], [100.0, 0.0]]), 3.0, 13.9)
    strip = ParkingStrip("a", 10.0, 30.0, right_m=2.7, kind=kind_of("car", 1.0), filled=1.0)
    bay = parking_bays(lane, strip)
    assert bay.contains(shapely.box(12.0, -2.7 - 0.95, 16.0, -2.7 + 0.95))
    assert bay.bounds[3] == pytest.approx(-1.5)
