"""On which road, and where along it, is a point?

Lane and junction areas lie in one shapely STRtree; a point takes the lane that contains it, or the nearest area
within a tolerance. Coordinates are those of the ROAD, so they run on when a car drives in the oncoming lane.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely
from numpy.typing import ArrayLike

from gis.errors import GisError
from gis.polyline import MITRE_LIMIT, FloatArray, GeometryArray, IndexArray, IntArray, ReferenceLines, counter_clockwise
from gis.roads.lanes import Connection, Junction, Lane, roads_of

# Net files round to the centimetre: lanes are widened by as much, so that no point falls between two of them.
ROUNDING_M = 0.01
# Gaps up to twice this between lane ends and junction outlines do not break the surface apart.
_CLOSING_M = 0.1


@dataclass(frozen=True, slots=True, eq=False)
class RoadPositions:
    """Where points are on the network: arrays with one entry a point.

    Attributes
    ----------
    road : (n,) index into `network.roads`, -1 off every road.
    along_m : (n,) from the start of the road's reference line, which goes on straight past its ends; nan off-road.
    across_m : (n,) positive to the left of the reference line; nan off-road.
    lane : (n,) index into `network.lanes`, -1 off every lane.
    junction : (n,) index into `network.junctions`, -1 outside them.
    tangent_rad : (n,) direction of the reference line there, in (-pi, pi]; nan off-road.
    """

    road: IntArray
    along_m: FloatArray
    across_m: FloatArray
    lane: IntArray
    junction: IntArray
    tangent_rad: FloatArray


class RoadNetwork:
    """Lanes, roads and junctions of one site, with look-up by place and by id.

    Parameters
    ----------
    lanes : at least one.
    junctions : may be none.
    connections : the ways on that the map allows; none where it says nothing of them.

    Raises
    ------
    GisError
        If there is no lane, an id comes twice, or a connection names a lane that is not there.

    Examples
    --------
    >>> east = Lane("we_0", "we", 0, "we", +1, np.array([[0.0, -1.75], [100.0, -1.75]]), 3.5, 25.0)
    >>> west = Lane("ew_0", "ew", 0, "we", -1, np.array([[100.0, 1.75], [0.0, 1.75]]), 3.5, 25.0)
    >>> network = RoadNetwork([east, west])
    >>> at = network.locate(np.array([[30.0, -2.0], [40.0, 2.0], [40.0, 9.0]]))
    >>> at.along_m.tolist(), at.across_m.tolist(), at.lane.tolist()
    ([30.0, 40.0, nan], [-2.0, 2.0, nan], [0, 1, -1])
    """

    def __init__(
        self,
        lanes: Sequence[Lane],
        junctions: Sequence[Junction] = (),
        connections: Sequence[Connection] = (),
    ) -> None:
        if not lanes:
            raise GisError("road network: expected at least one lane, got none")
        self.lanes = tuple(lanes)
        self.roads = roads_of(lanes)
        self.junctions = tuple(junctions)
        self.connections = tuple(connections)
        self.lane_index = _index_by_id("lane", [lane.id for lane in self.lanes])
        self._road_index = _index_by_id("road", [road.id for road in self.roads])
        _index_by_id("junction", [junction.id for junction in self.junctions])
        self._check_connections()
        self._build_index()

    def locate(self, points_m: ArrayLike, *, tolerance_m: float = 0.0) -> RoadPositions:
        """Find the lane, road, junction and road coordinates of points.

        Of several lanes that contain a point the one whose centre line is nearest is taken. A point may be in a lane
        and in a junction at once, where their areas overlap. A point that nothing contains goes to the nearest lane
        or junction within the tolerance, if there is one.

        Parameters
        ----------
        points_m : (n, 2); a point with a coordinate that is not finite is off-road.
        tolerance_m : >= 0.

        Returns
        -------
        One entry a point.

        Raises
        ------
        GisError
            If the shape is wrong or the tolerance is negative.
        """
        points_m = np.ascontiguousarray(points_m, dtype=np.float64)
        if points_m.ndim != 2 or points_m.shape[1] != 2:
            raise GisError(f"locate: expected points of shape (n, 2) in metres, got shape {points_m.shape!r}")
        if not tolerance_m >= 0.0:
            raise GisError(f"locate: tolerance_m must be >= 0, got {tolerance_m!r}")
        points: GeometryArray = np.asarray(shapely.points(points_m), dtype=np.object_)
        lane, junction = self._containing_areas(points, points_m)
        if tolerance_m > 0.0:
            nowhere = ((lane < 0) & (junction < 0)).nonzero()[0]
            if len(nowhere):
                nowhere = nowhere[np.isfinite(points_m[nowhere]).all(axis=1)]
                self._add_nearest_areas(lane, junction, nowhere, points[nowhere], tolerance_m)
        return self._positions(points_m, points, lane, junction)

    def surface(self) -> shapely.Polygon | shapely.MultiPolygon:
        """Unite all lane and junction areas; hairline gaps between them are closed."""
        united = shapely.union_all(self._areas)
        grown = shapely.buffer(united, _CLOSING_M, cap_style="flat", join_style="mitre")
        closed = shapely.buffer(grown, -_CLOSING_M, cap_style="flat", join_style="mitre")
        assert isinstance(closed, shapely.Polygon | shapely.MultiPolygon)
        return closed

    def _check_connections(self) -> None:
        for connection in self.connections:
            for lane_id in (connection.from_lane, connection.to_lane):
                if lane_id not in self.lane_index:
                    raise GisError(f"connection: expected two lanes of the network, got {lane_id!r}")

    def _build_index(self) -> None:
        self._centre_lines: GeometryArray = np.array([shapely.LineString(lane.centre_line_m) for lane in self.lanes])
        widths_m = np.array([lane.width_m for lane in self.lanes])
        lane_areas = shapely.buffer(
            self._centre_lines, widths_m / 2 + ROUNDING_M, cap_style="flat", join_style="mitre", mitre_limit=MITRE_LIMIT
        )
        junction_areas = [shapely.make_valid(shapely.Polygon(junction.outline_m)) for junction in self.junctions]
        self._areas: GeometryArray = np.concatenate((lane_areas, np.array(junction_areas, dtype=np.object_)))
        shapely.prepare(self._areas)
        self._tree = shapely.STRtree(self._areas)
        self._road_of_lane = np.array([self._road_index[lane.road] for lane in self.lanes] + [-1], dtype=np.int32)
        self.reference_lines = ReferenceLines([road.reference_line_m for road in self.roads])

    def _containing_areas(self, points: GeometryArray, points_m: FloatArray) -> tuple[IntArray, IntArray]:
        lane = np.full(len(points), -1, dtype=np.int32)
        junction = lane.copy()
        point, area = self._tree.query(points)
        inside = shapely.intersects_xy(self._areas.take(area), *points_m.take(point, axis=0).T)
        point, area = point[inside], area[inside]
        in_lane = area < len(self.lanes)
        if not in_lane.all():
            in_junction = ~in_lane
            # Reversed, so that of two junctions the one that comes first in the network stays.
            junction[point[in_junction][::-1]] = area[in_junction][::-1] - len(self.lanes)
            point, area = point[in_lane], area[in_lane]
        lane[point] = area
        # The query gives the points in order, so a point in several lanes has its hits side by side.
        again = point[1:][point[1:] == point[:-1]]
        if len(again):
            shared = np.isin(point, again)
            point, area = point[shared], area[shared]
            off_centre_m = shapely.distance(points[point], self._centre_lines[area])
            nearest_last = np.lexsort((-area, -off_centre_m))
            lane[point[nearest_last]] = area[nearest_last]
        return lane, junction

    def _add_nearest_areas(
        self, lane: IntArray, junction: IntArray, nowhere: IndexArray, points: GeometryArray, tolerance_m: float
    ) -> None:
        point, area = self._tree.query_nearest(points, max_distance=tolerance_m)
        order = np.argsort(-area, kind="stable")
        point, area = nowhere[point[order]], area[order]
        in_lane = area < len(self.lanes)
        junction[point[~in_lane]] = area[~in_lane] - len(self.lanes)
        lane[point[in_lane]] = area[in_lane]
        junction[point[in_lane]] = -1

    def _positions(
        self, points_m: FloatArray, points: GeometryArray, lane: IntArray, junction: IntArray
    ) -> RoadPositions:
        road = self._road_of_lane.take(lane)
        along_m = np.full(len(points_m), np.nan)
        across_m, tangent_rad = along_m.copy(), along_m.copy()
        on_road = (road >= 0).nonzero()[0]
        if len(on_road):
            along_m[on_road], across_m[on_road], tangent_rad[on_road] = self.reference_lines.project(
                points_m[on_road], points[on_road], road[on_road]
            )
        return RoadPositions(road, along_m, across_m, lane, junction, tangent_rad)


def _index_by_id(kind: str, ids: Sequence[str]) -> dict[str, int]:
    index: dict[str, int] = {}
    for place, name in enumerate(ids):
        if name in index:
            raise GisError(f"road network: expected every {kind} id once, got {name!r} twice")
        index[name] = place
    return index


def plain_rings(area: shapely.Geometry) -> tuple[FloatArray, ...]:
    """Cut an area into rings without holes that together cover it.

    Parameters
    ----------
    area : polygons; lines and points among its parts have no area and are left out.

    Returns
    -------
    Rings (k, 2), counter-clockwise, open.

    Examples
    --------
    >>> island = shapely.box(0, 0, 10, 10) - shapely.box(4, 4, 6, 6)
    >>> len(plain_rings(island))
    2
    """
    polygons = [part for part in shapely.get_parts(area) if isinstance(part, shapely.Polygon)]
    parts = [part for polygon in polygons for part in _without_holes(polygon)]
    return tuple(counter_clockwise(shapely.get_coordinates(part.exterior)[:-1]) for part in parts)


def _without_holes(polygon: shapely.Polygon) -> list[shapely.Polygon]:
    if not polygon.interiors:
        return [polygon]
    west_m, south_m, east_m, north_m = polygon.bounds
    cut_m = polygon.interiors[0].centroid.x
    halves = (shapely.box(west_m, south_m, cut_m, north_m), shapely.box(cut_m, south_m, east_m, north_m))
    parts = [part for half in halves for part in shapely.get_parts(shapely.intersection(polygon, half))]
    return [piece for part in parts if isinstance(part, shapely.Polygon) for piece in _without_holes(part)]
