"""Which way does a car turn that comes from one road, crosses a junction and leaves on another road?

The ways are those that the map's connections allow. A map without any is guessed: a road meets a junction where one end
of its reference line lies in or near the junction's outline, and from every way in there is one to every way out. The
turn is the angle between the direction in which the first road arrives and that in which the second one leaves, taken
over the last stretch before the junction, whatever way the car takes across.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Literal

import shapely

from gis.polyline import FloatArray
from gis.roads.lanes import Road
from gis.roads.road_network import RoadNetwork

TurnDirection = Literal["left", "right", "straight", "uturn"]

# Roads end at the stop lines or at the outline; both lie within a car's length of it.
_REACH_M = 5.0
# The direction at an end is that of the chord over this length: the last segment may be a stub.
_CHORD_M = 15.0
_STRAIGHT_RAD = math.radians(45.0)
_BACK_RAD = math.radians(150.0)


@dataclass(frozen=True, slots=True)
class Turn:
    """Say what the way from one road over a junction to a road is; `from_road` and `to_road` may be the same."""

    from_road: str
    junction: str
    to_road: str
    direction: TurnDirection


@dataclass(frozen=True, slots=True)
class _Arm:
    """One end of a road at a junction; `out_rad` points away from the junction."""

    road: str
    out_rad: float
    has_way_in: bool
    has_way_out: bool


def turns(network: RoadNetwork) -> tuple[Turn, ...]:
    """List the turns at all junctions, in the order of the connections, or else of junctions and roads.

    Examples
    --------
    >>> import numpy as np
    >>> from gis.roads.lanes import Junction, Lane
    >>> west = Lane("west", "west", 0, "west", +1, np.array([[-50.0, 0.0], [-5.0, 0.0]]), 3.5, 14.0)
    >>> north = Lane("north", "north", 0, "north", +1, np.array([[0.0, 5.0], [0.0, 50.0]]), 3.5, 14.0)
    >>> crossing = Junction("x", np.array([[-5.0, -5.0], [5.0, -5.0], [5.0, 5.0], [-5.0, 5.0]]))
    >>> turns(RoadNetwork([west, north], junctions=[crossing]))
    (Turn(from_road='west', junction='x', to_road='north', direction='left'),)
    """
    if network.connections:
        return tuple(_allowed_turns(network))
    directions: dict[str, set[int]] = {}
    for lane in network.lanes:
        directions.setdefault(lane.road, set()).add(lane.direction)
    found: list[Turn] = []
    for junction in network.junctions:
        area = shapely.make_valid(shapely.Polygon(junction.outline_m))
        arms = [arm for road in network.roads for arm in _arms(road, area, directions[road.id])]
        found += _turns_between(arms, junction.id)
    return tuple(found)


def _allowed_turns(network: RoadNetwork) -> Iterator[Turn]:
    lanes = {lane.id: lane for lane in network.lanes}
    line_m = {road.id: road.reference_line_m for road in network.roads}
    junctions = {junction.id for junction in network.junctions}
    ways = {
        (one.junction, lanes[one.from_lane].road, lanes[one.to_lane].road): one
        for one in network.connections
        if one.junction in junctions
    }
    for (junction, from_road, to_road), one in ways.items():
        back_rad = _direction(line_m[from_road][:: -lanes[one.from_lane].direction])
        out_rad = _direction(line_m[to_road][:: lanes[one.to_lane].direction])
        yield Turn(from_road, junction, to_road, _turn(back_rad, out_rad, same_road=from_road == to_road))


def _arms(road: Road, area: shapely.Geometry, directions: set[int]) -> Iterator[_Arm]:
    for line_m, inward in ((road.reference_line_m, -1), (road.reference_line_m[::-1], +1)):
        if shapely.distance(area, shapely.Point(line_m[0])) <= _REACH_M:
            # Lanes that run towards the line's first point lead into the junction.
            yield _Arm(road.id, _direction(line_m), inward in directions, -inward in directions)


def _direction(line_m: FloatArray) -> float:
    far = shapely.line_interpolate_point(shapely.LineString(line_m), _CHORD_M)
    return math.atan2(far.y - line_m[0, 1], far.x - line_m[0, 0])


def _turns_between(arms: Sequence[_Arm], junction: str) -> Iterator[Turn]:
    told = set()
    for arm in arms:
        for other in arms:
            key = arm.road, other.road
            if arm.has_way_in and other.has_way_out and key not in told:
                told.add(key)
                turn = _turn(arm.out_rad, other.out_rad, same_road=arm.road == other.road)
                yield Turn(arm.road, junction, other.road, turn)


def _turn(back_rad: float, out_rad: float, *, same_road: bool) -> TurnDirection:
    """Name a turn by the directions of the two roads, both away from the junction."""
    if same_road:
        return "uturn"
    left_rad = math.remainder(out_rad - (back_rad + math.pi), math.tau)
    if abs(left_rad) <= _STRAIGHT_RAD:
        return "straight"
    if abs(left_rad) >= _BACK_RAD:
        return "uturn"
    return "left" if left_rad > 0 else "right"
