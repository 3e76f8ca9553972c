"""Where are the painted lines and marks of roads? Strips along lanes; stop lines, arrows, crossings at junctions.

The lines along a road follow from the lanes. Lanes alone do not tell who has to stop; the connections of the SUMO
network file do: a lane that a traffic light or a stop sign ends gets an unbroken line, one that gives way a dashed
line, one with priority none.
"""

import math
from collections.abc import Iterator, Mapping
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import shapely
from shapely.ops import substring

from data_gen.drawing.ground.paint import placed
from data_gen.scenario import ParkingStrip
from data_gen.simulation.states import FloatArray
from gis.polyline import offset
from gis.roads.lanes import Lane
from gis.roads.road_network import RoadNetwork

_LINE_WIDTH_M = 0.2
_EDGE_INSET_M = 0.15
_DASH_M = 3.0
_GAP_M = 9.0
_PROBE_M = 0.3
_DOUBLE_M = 0.4
_STOP_LINE_M = 0.5
_GIVE_WAY_M = 0.4
_SETBACK_M = 0.4
"""From the end of the lane to the line's far edge."""
_GIVE_WAY_DASH_M, _GIVE_WAY_GAP_M = 0.5, 0.3
_ZEBRA_BAR_M, _ZEBRA_GAP_M = 0.5, 0.5
_ARROW_PLACES_M = (9.0, 27.0)
_SHORTEST_ARROW_LANE_M = 45.0
_ARROW_DIRECTIONS = {"s": "straight", "l": "left", "L": "left", "r": "right", "R": "right"}


def road_markings(network: RoadNetwork) -> tuple[shapely.Polygon, ...]:
    """Lay out edge lines and dashed lines between lanes.

    Parameters
    ----------
    network : whose lanes are marked. A border with another lane beyond it gets dashes of 3 m every 12 m, one
        between two directions of several lanes each a double line, a border with nothing beyond it an unbroken edge
        line.

    Returns
    -------
    Strips on the ground, none twice.
    """
    return tuple(
        shape
        for index, lane in enumerate(network.lanes)
        for outward in (1, -1)
        for shape in _border_strips(network, index, lane, outward)
    )


def _border_strips(network: RoadNetwork, index: int, lane: Lane, outward: int) -> Iterator[shapely.Polygon]:
    """Paint the left (1) or the right (-1) border of a lane."""
    neighbour = _lane_beyond(network, lane, outward)
    if neighbour < 0:
        yield _strip(offset(lane.centre_line_m, outward * (lane.width_m / 2 - _EDGE_INSET_M)))
    elif index < neighbour:
        border = shapely.LineString(offset(lane.centre_line_m, outward * lane.width_m / 2))
        if _is_double(network, lane, network.lanes[neighbour]):
            for side_m in (-_DOUBLE_M / 2, _DOUBLE_M / 2):
                yield _strip(offset(np.asarray(border.coords), side_m))
            return
        for start_m in np.arange(_GAP_M / 2, border.length - _DASH_M, _DASH_M + _GAP_M):
            dash = substring(border, start_m, start_m + _DASH_M)
            yield _strip(np.asarray(dash.coords))


def _is_double(network: RoadNetwork, lane: Lane, other: Lane) -> bool:
    """Tell whether the border between two lanes parts two directions of a road with several lanes each way."""
    lanes = [candidate for candidate in network.lanes if candidate.road == lane.road]
    one_way = sum(candidate.direction == lane.direction for candidate in lanes)
    return lane.road == other.road and lane.direction != other.direction and min(one_way, len(lanes) - one_way) > 1


def _lane_beyond(network: RoadNetwork, lane: Lane, outward: int) -> int:
    beside_m = offset(lane.centre_line_m, outward * (lane.width_m / 2 + _PROBE_M))
    middle = shapely.LineString(beside_m).interpolate(0.5, normalized=True)
    return int(network.locate(np.array([[middle.x, middle.y]])).lane[0])


def _strip(line_m: FloatArray) -> shapely.Polygon:
    strip = shapely.LineString(line_m).buffer(_LINE_WIDTH_M / 2, cap_style="flat", join_style="mitre")
    assert isinstance(strip, shapely.Polygon)
    return strip


def junction_marks(network: RoadNetwork, network_file: Path) -> tuple[shapely.Geometry, ...]:
    """Lay out the marks where lanes end at junctions.

    Parameters
    ----------
    network : the lanes.
    network_file : the SUMO network that they were read from.

    Returns
    -------
    Shapes on the ground.
    """
    root = ElementTree.parse(network_file).getroot()
    lanes = {lane.id: lane for lane in network.lanes}
    ends = _lane_ends(root)
    return (
        *(mark for name, kind in ends.items() if name in lanes for mark in _line_marks(lanes[name], kind)),
        *(mark for name, turns in _lane_turns(root).items() if name in lanes for mark in _arrows(lanes[name], turns)),
        *_zebras(root),
    )


def _lane_ends(root: ElementTree.Element) -> dict[str, str]:
    """Tell for each lane what ends it: "stop", "give way" or "none"; the strictest of its connections counts."""
    order = ("none", "give way", "stop")
    ends: dict[str, str] = {}
    for connection in root.iter("connection"):
        name = f"{connection.get('from')}_{connection.get('fromLane')}"
        kind = "stop" if "tl" in connection.attrib or connection.get("state") in ("s", "w") else "none"
        if connection.get("state") in ("m", "=") and kind == "none":
            kind = "give way"
        ends[name] = max(ends.get(name, "none"), kind, key=order.index)
    return ends


def _lane_turns(root: ElementTree.Element) -> Mapping[str, frozenset[str]]:
    """Tell which ways lead on from each lane that a traffic light ends."""
    turns: dict[str, set[str]] = {}
    for connection in root.iter("connection"):
        way = _ARROW_DIRECTIONS.get(connection.get("dir", ""))
        if way is not None and "tl" in connection.attrib:
            turns.setdefault(f"{connection.get('from')}_{connection.get('fromLane')}", set()).add(way)
    return {name: frozenset(ways) for name, ways in turns.items()}


def _line_marks(lane: Lane, kind: str) -> Iterator[shapely.Geometry]:
    if kind == "none":
        return
    end_m, heading_rad = _end(lane, _SETBACK_M)
    half_m = lane.width_m / 2 - 0.15
    if kind == "stop":
        yield placed(shapely.box(-_STOP_LINE_M, -half_m, 0.0, half_m), end_m, heading_rad)
    else:
        for right_m in np.arange(-half_m, half_m - _GIVE_WAY_DASH_M + 1e-9, _GIVE_WAY_DASH_M + _GIVE_WAY_GAP_M):
            yield placed(shapely.box(-_GIVE_WAY_M, right_m, 0.0, right_m + _GIVE_WAY_DASH_M), end_m, heading_rad)


def _arrows(lane: Lane, turns: frozenset[str]) -> Iterator[shapely.Geometry]:
    if shapely.LineString(lane.centre_line_m).length < _SHORTEST_ARROW_LANE_M:
        return
    for back_m in _ARROW_PLACES_M:
        place_m, heading_rad = _end(lane, back_m)
        yield placed(shapely.union_all(list(_arrow_parts(turns))), place_m, heading_rad)


def _arrow_parts(turns: frozenset[str]) -> Iterator[shapely.Geometry]:
    """Draw an arrow of 5 m that points along x."""
    yield shapely.box(-5.0, -0.08, -1.6, 0.08)
    if "straight" in turns:
        yield shapely.box(-1.6, -0.08, -1.2, 0.08)
        yield shapely.Polygon([(-1.2, -0.45), (0.0, 0.0), (-1.2, 0.45)])
    for way, side in (("left", 1), ("right", -1)):
        if way in turns:
            yield shapely.Polygon([(-2.8, 0.0), (-2.4, 0.0), (-1.7, 0.7 * side), (-2.1, 0.7 * side)])
            yield shapely.Polygon([(-2.5, 0.55 * side), (-1.2, 0.5 * side), (-1.7, 1.2 * side)])


def _zebras(root: ElementTree.Element) -> Iterator[shapely.Geometry]:
    for edge in root.iter("edge"):
        if edge.get("function") != "crossing":
            continue
        for lane in edge.iter("lane"):
            line_m = np.array(
                [[float(part) for part in point.split(",")[:2]] for point in lane.get("shape", "").split()]
            )
            if len(line_m) >= 2:
                yield from _zebra(line_m, float(lane.get("width", "4.0")))


def _zebra(line_m: FloatArray, width_m: float) -> Iterator[shapely.Geometry]:
    """Lay bars across a walker's way over the road."""
    line = shapely.LineString(line_m)
    heading_rad = math.atan2(*(line_m[-1] - line_m[0])[::-1])
    for along_m in np.arange(_ZEBRA_GAP_M / 2, line.length - _ZEBRA_BAR_M, _ZEBRA_BAR_M + _ZEBRA_GAP_M):
        point = line.interpolate(along_m)
        bar = shapely.box(0.0, -width_m / 2, _ZEBRA_BAR_M, width_m / 2)
        yield placed(bar, np.array([point.x, point.y]), heading_rad)


def _end(lane: Lane, back_m: float) -> tuple[FloatArray, float]:
    """Give the point so far before the lane's end, and the direction of the lane there."""
    line = shapely.LineString(lane.centre_line_m)
    here, before = line.interpolate(line.length - back_m), line.interpolate(line.length - back_m - 0.5)
    return np.array([here.x, here.y]), math.atan2(here.y - before.y, here.x - before.x)


def parking_bays(lane: Lane, strip: ParkingStrip) -> shapely.Geometry:
    """Give the ground beside a lane on which cars park, from the lane's border outwards.

    Parameters
    ----------
    lane : beside which they stand.
    strip : where along it, and how wide the cars are.

    Returns
    -------
    The ground.
    """
    part = substring(shapely.LineString(lane.centre_line_m), strip.first_m, strip.last_m)
    right_m, width_m = strip.right_m, strip.kind.width_m[1]
    outer_m = abs(right_m) + width_m / 2 + 0.3
    inner_m = min(lane.width_m / 2, abs(right_m))
    middle_m = math.copysign((inner_m + outer_m) / 2, right_m)
    middle = shapely.LineString(offset(np.asarray(part.coords), -middle_m))
    return middle.buffer((outer_m - inner_m) / 2, cap_style="flat")
