"""Road networks and cameras for the tests of `gis`, and the slow way to find a point on the roads."""

from __future__ import annotations

import json
from itertools import pairwise
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from gis.frames import LocalFrame
from gis.polyline import offset
from gis.roads.lanes import Lane
from gis.roads.road_network import RoadNetwork

FloatArray = NDArray[np.float64]

CROSSING_NET = Path(__file__).parent / "data" / "crossing.net.xml"

TWO_WAY_NET = """
<net>
    <edge id=":e_0" function="internal">
        <lane id=":e_0_0" index="0" speed="3" length="5" width="3.5" shape="100,-1.75 102,0 100,1.75"/>
    </edge>
    <edge id="we" from="w" to="e">
        <lane id="we_0" index="0" speed="25" length="100" width="3.5" shape="0,-1.75 100,-1.75">
            <neigh lane="ew_0"/>
        </lane>
    </edge>
    <edge id="ew" from="e" to="w">
        <lane id="ew_0" index="0" speed="25" length="100" width="3.5" shape="100,1.75 0,1.75">
            <neigh lane="we_0"/>
        </lane>
    </edge>
    <junction id="e" type="priority" x="100" y="0" shape="100,0 100,-3.5 100,0"/>
    <junction id="w" type="priority" x="0" y="0" shape="0,0 0,3.5 0,0"/>
</net>
"""


def straight_lane(
    lane_id: str = "a", *, y_m: float = 0.0, direction: int = 1, road: str = "", width_m: float = 3.5
) -> Lane:
    """Build a lane 100 m long beside the x axis; direction -1 is driven west."""
    line_m = np.array([[0.0, y_m], [100.0, y_m]])[::direction]
    return Lane(lane_id, lane_id, 0, road or lane_id, direction, line_m, width_m, 25.0)


def two_way_along(reference_m: FloatArray, road: str = "bend") -> RoadNetwork:
    """Build a two-way road, two lanes along the line and one against it."""
    lines_m = [offset(reference_m, -5.25), offset(reference_m, -1.75), offset(reference_m, 1.75)[::-1]]
    lanes = [
        Lane(
            f"{road}_{place}", road if place < 2 else f"-{road}", place % 2, road, [1, 1, -1][place], line_m, 3.5, 20.0
        )
        for place, line_m in enumerate(lines_m)
    ]
    return RoadNetwork(lanes)


def arc(*, radius_m: float, turn_rad: float, segments: int) -> FloatArray:
    """Draw an arc that starts at the origin, due east, and turns left if `turn_rad` > 0."""
    angle = np.linspace(0.0, abs(turn_rad), segments + 1)
    return np.column_stack((radius_m * np.sin(angle), np.sign(turn_rad) * radius_m * (1.0 - np.cos(angle))))


def locate_slowly(
    network: RoadNetwork, point_m: FloatArray, tolerance_m: float
) -> tuple[int, float, float, int, int, float]:
    """Locate one point by trying every lane and junction with school geometry.

    Returns road, along_m, across_m, lane, junction, tangent_rad, as in one entry of `RoadPositions`.
    """
    lane_m = [_distance_to_strips(_strips(lane), point_m) for lane in network.lanes]
    junction_m = [_distance_to_ring(junction.outline_m, point_m) for junction in network.junctions]
    lane, junction = _first_zero_lane(network, lane_m, point_m), -1
    if 0.0 in junction_m:
        junction = junction_m.index(0.0)
    if lane < 0 and junction < 0 and min(lane_m + junction_m) <= tolerance_m:
        nearest = int(np.argmin(lane_m + junction_m))
        lane, junction = (nearest, -1) if nearest < len(lane_m) else (-1, nearest - len(lane_m))
    if lane < 0:
        return -1, np.nan, np.nan, -1, junction, np.nan
    road = [one.id for one in network.roads].index(network.lanes[lane].road)
    along_m, across_m, tangent_rad = _road_coordinates(network.roads[road].reference_line_m, point_m)
    return road, along_m, across_m, lane, junction, tangent_rad


def _first_zero_lane(network: RoadNetwork, lane_m: list[float], point_m: FloatArray) -> int:
    inside = [place for place, distance in enumerate(lane_m) if distance == 0.0]
    off_centre_m = [_distance_to_line(network.lanes[place].centre_line_m, point_m) for place in inside]
    return inside[int(np.argmin(off_centre_m))] if inside else -1


def _strips(lane: Lane) -> list[FloatArray]:
    """Cut a lane area into one four-cornered ring for each segment; areas are one centimetre wider than the lane."""
    left_m = offset(lane.centre_line_m, lane.width_m / 2 + 0.01)
    right_m = offset(lane.centre_line_m, -lane.width_m / 2 - 0.01)
    return [
        np.array([right_m[i], right_m[i + 1], left_m[i + 1], left_m[i]]) for i in range(len(lane.centre_line_m) - 1)
    ]


def _distance_to_strips(strips: list[FloatArray], point_m: FloatArray) -> float:
    return min(_distance_to_ring(strip, point_m) for strip in strips)


def _distance_to_ring(ring_m: FloatArray, point_m: FloatArray) -> float:
    inside = False
    for (x1, y1), (x2, y2) in zip(ring_m, np.roll(ring_m, -1, axis=0), strict=True):
        if (y1 > point_m[1]) != (y2 > point_m[1]) and point_m[0] < x1 + (point_m[1] - y1) / (y2 - y1) * (x2 - x1):
            inside = not inside
    return 0.0 if inside else _distance_to_line(np.vstack((ring_m, ring_m[:1])), point_m)


def _distance_to_line(line_m: FloatArray, point_m: FloatArray) -> float:
    best = np.inf
    for a, b in pairwise(line_m):
        share = np.clip(np.dot(point_m - a, b - a) / np.dot(b - a, b - a), 0.0, 1.0)
        best = min(best, float(np.hypot(*(point_m - a - share * (b - a)))))
    return best


def _road_coordinates(line_m: FloatArray, point_m: FloatArray) -> tuple[float, float, float]:
    """Draw, for each segment, the parallel of the whole line through the point; take the segment it then lies on."""
    best = (np.nan, np.inf, np.nan)
    behind_m, last = 0.0, len(line_m) - 2
    for i, (a, b) in enumerate(pairwise(line_m)):
        size_m = float(np.hypot(*(b - a)))
        ahead = (b - a) / size_m
        across_m = float(ahead[0] * (point_m - a)[1] - ahead[1] * (point_m - a)[0])
        parallel_m = offset(line_m, across_m)
        drawn_m = float(np.dot(parallel_m[i + 1] - parallel_m[i], ahead))
        forward_m = float(np.dot(point_m - parallel_m[i], ahead))
        is_on = (forward_m >= 0 or i == 0) and (forward_m <= drawn_m or i == last) and drawn_m > 0
        if is_on and abs(across_m) < abs(best[1]):
            share_m = min(max(forward_m / drawn_m, 0.0), 1.0) * size_m
            past_m = min(forward_m, 0.0) + max(forward_m - drawn_m, 0.0)
            best = (behind_m + share_m + past_m, across_m, float(np.arctan2(ahead[1], ahead[0])))
        behind_m += size_m
    return best


def write_geojson(network: RoadNetwork, path: Path, frame: LocalFrame) -> None:
    """Write a road network as GeoJSON, positions to a tenth of a millimetre."""
    features = []
    for lane in network.lanes:
        names = ("id", "road", "edge", "index", "direction", "width_m", "speed_limit_mps")
        line = frame.to_wgs84(lane.centre_line_m).round(9).tolist()
        geometry = {"type": "LineString", "coordinates": line}
        features.append({"properties": {name: getattr(lane, name) for name in names}, "geometry": geometry})
    for junction in network.junctions:
        ring = frame.to_wgs84(junction.outline_m).round(9).tolist()
        geometry = {"type": "Polygon", "coordinates": [[*ring, ring[0]]]}
        features.append({"properties": {"id": junction.id}, "geometry": geometry})
    path.write_text(json.dumps({"type": "FeatureCollection", "features": features}), encoding="utf-8")
