"""What hangs over the road and hides the traffic? A bridge, a sign gantry, and trees whose crowns reach over the lanes.

An occluder is a set of level shapes at one height over the ground, and the shadow that they cast.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np
import shapely
from shapely import affinity

from data_gen.drawing.ground.paint import Colour, placed
from data_gen.drawing.ground.scenery import draw_tree
from data_gen.drawing.sun import Sun
from data_gen.errors import DataGenError
from data_gen.simulation.states import FloatArray
from gis.roads.road_network import RoadNetwork

OccluderKind = Literal["trees", "bridge", "gantry"]

_PLACES = {"bridge": 0.3, "trees": 0.52, "gantry": 0.74}
"""How far along the longest road in view each stands."""
_BRIDGE_M, _BRIDGE_HEIGHT_M = (8.0, 11.0), 6.0
_LONGEST_SPAN_M = 350.0
"""A bridge goes on to the border of the view, but no farther than this."""
_CARRIAGEWAY_GAP_M = 15.0
_FARTHEST_BORDER_M = 60.0
_GANTRY_M, _GANTRY_HEIGHT_M = 1.3, 6.5
_TREE_HEIGHT_M = 7.0
_TREE_ROW_M = (14.0, 26.0)
_DECK_COLOUR: Colour = (126.0, 126.0, 124.0)
_RAIL_COLOUR: Colour = (178.0, 180.0, 182.0)
_STEEL_COLOUR: Colour = (150.0, 152.0, 152.0)
_SIGN_COLOUR: Colour = (140.0, 80.0, 30.0)
_CROWN_COLOUR: Colour = (44.0, 80.0, 58.0)


@dataclass(frozen=True, slots=True)
class Occluder:
    """Something over the road."""

    kind: OccluderKind
    height_m: float
    layers: tuple[tuple[shapely.Geometry, Colour, float], ...]
    """Shapes in the order of painting, each with its colour and the strength of its texture."""

    def outline(self) -> shapely.Geometry:
        """Unite the shapes."""
        return shapely.union_all([shape for shape, _, _ in self.layers])


def occluder_kinds(names: Sequence[str]) -> tuple[OccluderKind, ...]:
    """Check names of occluders.

    Parameters
    ----------
    names : kinds, or "all", or "none".

    Returns
    -------
    The kinds, each once.

    Raises
    ------
    DataGenError
        If there is no such kind.

    Examples
    --------
    >>> occluder_kinds(["gantry", "bridge"])
    ('bridge', 'gantry')
    """
    known: tuple[OccluderKind, ...] = get_args(OccluderKind)
    for name in names:
        if name not in (*known, "all", "none"):
            raise DataGenError(f"occluders: expected none, all or some of {', '.join(known)}, got {name!r}")
    return tuple(kind for kind in known if kind in names or "all" in names)


def plan_occluders(
    kinds: Sequence[OccluderKind], network: RoadNetwork, seen: shapely.Polygon, rng: np.random.Generator
) -> tuple[Occluder, ...]:
    """Place occluders over the longest road in view.

    Parameters
    ----------
    kinds : to place; each has a place of its own along the road.
    network : the roads.
    seen : ground in view.
    rng : source of sizes and crowns; each kind has a generator of its own.

    Returns
    -------
    One for each kind.

    Raises
    ------
    DataGenError
        If no road is in view.
    """
    parts = [
        part
        for road in network.roads
        for part in shapely.get_parts(shapely.intersection(shapely.LineString(road.reference_line_m), seen))
        if isinstance(part, shapely.LineString) and not part.is_empty
    ]
    if not parts:
        raise DataGenError(f"occluders: expected a road in view, got none in {seen.wkt}")
    line = max(parts, key=lambda part: part.length)
    surface = network.surface()
    west_m, south_m, east_m, north_m = seen.bounds
    span_m = min(_LONGEST_SPAN_M, math.hypot(east_m - west_m, north_m - south_m) / 2)
    build = {"trees": _trees, "bridge": _bridge, "gantry": _gantry}
    generators = dict(zip(get_args(OccluderKind), rng.spawn(3), strict=True))
    return tuple(build[kind](_Crossing(line, _PLACES[kind], surface, span_m), generators[kind]) for kind in kinds)


def shadow_on_ground(occluder: Occluder, sun: Sun) -> shapely.Geometry:
    """Give the ground in an occluder's shadow: what hangs in the air casts it away from its foot."""
    return affinity.translate(occluder.outline(), *sun.shadow_offset_m(occluder.height_m))


class _Crossing:
    """A place on a road: along its direction x, across it y, from the middle between its outer borders.

    Carriageways with less than 15 m between them count as one road.
    """

    def __init__(
        self, line: shapely.LineString, share: float, surface: shapely.Polygon | shapely.MultiPolygon, span_m: float
    ) -> None:
        here, ahead = line.interpolate(share, normalized=True), line.interpolate(share * line.length + 1.0)
        self.heading_rad = math.atan2(ahead.y - here.y, ahead.x - here.x)
        self.span_m = span_m
        left = np.array([-math.sin(self.heading_rad), math.cos(self.heading_rad)])
        place_m = np.array([here.x, here.y])
        low_m, high_m = _borders(surface, place_m, left)
        self.width_m = high_m - low_m
        self._middle_m = place_m + (low_m + high_m) / 2 * left

    def placed(self, shape: shapely.Geometry, turn_rad: float = 0.0) -> shapely.Geometry:
        return placed(shape, self._middle_m, self.heading_rad + turn_rad)

    def point_m(self, along_m: float, left_m: float) -> FloatArray:
        return np.asarray(shapely.get_coordinates(self.placed(shapely.Point(along_m, left_m)))[0], dtype=np.float64)


def _bridge(crossing: _Crossing, rng: np.random.Generator) -> Occluder:
    half_m = float(rng.uniform(*_BRIDGE_M)) / 2
    reach_m = crossing.width_m / 2 + crossing.span_m
    skew_rad = float(rng.uniform(-0.2, 0.2))

    def laid(low_m: float, high_m: float) -> shapely.Geometry:
        return crossing.placed(shapely.box(low_m, -reach_m, high_m, reach_m), skew_rad)

    rails = shapely.union(laid(-half_m, -half_m + 0.5), laid(half_m - 0.5, half_m))
    line = [
        crossing.placed(shapely.box(-0.1, start_m, 0.1, start_m + 3.0), skew_rad)
        for start_m in np.arange(-reach_m + 2.0, reach_m - 5.0, 9.0)
    ]
    layers = (
        (laid(-half_m, half_m), _DECK_COLOUR, 0.03),
        (shapely.union_all(line), (206.0, 208.0, 208.0), 0.0),
        (rails, _RAIL_COLOUR, 0.02),
    )
    return Occluder("bridge", _BRIDGE_HEIGHT_M, layers)


def _gantry(crossing: _Crossing, rng: np.random.Generator) -> Occluder:
    half_m, reach_m = _GANTRY_M / 2, crossing.width_m / 2 + 1.5
    beams = [crossing.placed(shapely.box(low_m, -reach_m, low_m + 0.35, reach_m)) for low_m in (-half_m, half_m - 0.35)]
    struts = [
        crossing.placed(shapely.LineString([(-half_m, start_m), (half_m, start_m + 1.0)]).buffer(0.14))
        for start_m in np.arange(-reach_m, reach_m - 1.0, 1.4)
    ]
    middle_m = float(rng.uniform(-0.2, 0.2)) * crossing.width_m
    panel = crossing.placed(shapely.box(-half_m - 0.5, middle_m - 2.4, -half_m, middle_m + 2.4))
    layers = ((shapely.union_all([*beams, *struts]), _STEEL_COLOUR, 0.0), (panel, _SIGN_COLOUR, 0.0))
    return Occluder("gantry", _GANTRY_HEIGHT_M, layers)


def _trees(crossing: _Crossing, rng: np.random.Generator) -> Occluder:
    """Grow a row of crowns on each side that meet over the road."""
    crowns: list[shapely.Geometry] = []
    for side in (-1.0, 1.0):
        row_m = float(rng.uniform(*_TREE_ROW_M))
        for along_m in np.arange(-row_m / 2, row_m / 2, 4.5):
            radius_m = float(rng.uniform(3.2, 4.6))
            left_m = side * (crossing.width_m / 2 - 0.4 + float(rng.normal(0, 0.8)))
            crowns.append(draw_tree(crossing.point_m(along_m + float(rng.normal(0, 0.8)), left_m), radius_m, rng).crown)
    foliage = shapely.union_all(crowns)
    # Light falls through here and there.
    holes = [
        shapely.Point(crossing.point_m(float(rng.uniform(-13, 13)), float(rng.uniform(-6, 6)))).buffer(
            float(rng.uniform(0.2, 0.5))
        )
        for _ in range(30)
    ]
    tips = shapely.union_all([affinity.scale(crown, 0.5, 0.5) for crown in crowns])
    leaves = shapely.difference(foliage, shapely.union_all(holes))
    light = shapely.intersection(tips, leaves)
    brighter = (60.0, 108.0, 80.0)
    return Occluder("trees", _TREE_HEIGHT_M, ((leaves, _CROWN_COLOUR, 0.2), (light, brighter, 0.2)))


def _borders(
    surface: shapely.Polygon | shapely.MultiPolygon, place_m: FloatArray, left: FloatArray
) -> tuple[float, float]:
    """Measure how far the outer borders of a road lie to the left of a place on it: right one, left one."""
    ends_m = [place_m - _FARTHEST_BORDER_M * left, place_m + _FARTHEST_BORDER_M * left]
    section = shapely.intersection(shapely.LineString(ends_m), surface.buffer(_CARRIAGEWAY_GAP_M / 2))
    pieces = [part for part in shapely.get_parts(section) if isinstance(part, shapely.LineString)]
    own = min(pieces, key=shapely.Point(place_m).distance)
    offsets_m = (shapely.get_coordinates(own) - place_m) @ left
    # The closing of gaps widened the outer borders too.
    return float(offsets_m.min()) + _CARRIAGEWAY_GAP_M / 2, float(offsets_m.max()) - _CARRIAGEWAY_GAP_M / 2
