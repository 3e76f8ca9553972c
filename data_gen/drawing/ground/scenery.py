"""What lies around the roads? Parcels with straight edges, hedges, buildings and trees, planned at random.

The plan is made once a scene and knows nothing of pixels: every camera that films the scene paints the same one.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import shapely
from shapely import affinity
from shapely.ops import split

from data_gen.drawing.ground.paint import Colour, placed
from data_gen.drawing.sun import Sun
from data_gen.simulation.states import FloatArray
from gis.roads.road_network import RoadNetwork

_FIELD_COLOURS: tuple[Colour, ...] = (  # blue, green, red: corn, meadow, ripe corn, ploughed, stubble, clover
    (68.0, 118.0, 88.0),
    (74.0, 128.0, 112.0),
    (102.0, 158.0, 172.0),
    (82.0, 104.0, 124.0),
    (112.0, 148.0, 158.0),
    (58.0, 98.0, 70.0),
)
_PLOT_COLOURS: tuple[Colour, ...] = (  # lawn, dry lawn, paving, gravel, garden
    (70.0, 122.0, 96.0),
    (88.0, 136.0, 126.0),
    (132.0, 138.0, 140.0),
    (140.0, 150.0, 158.0),
    (60.0, 100.0, 78.0),
)
_ROOF_COLOURS: tuple[Colour, ...] = (
    (70.0, 82.0, 148.0),
    (92.0, 92.0, 96.0),
    (62.0, 68.0, 112.0),
    (140.0, 146.0, 150.0),
    (84.0, 104.0, 160.0),
)
_GRID_M = 0.001
_URBAN_LIMIT_MPS = 17.0
"""Roads where no more than 60 km/h are allowed run through a town."""
_FIELD_M2, _PLOT_M2 = 22_000.0, 1_100.0
_TREE_M2, _TOWN_TREE_M2 = 2_200.0, 420.0
_FARM_M2, _HOUSE_M2 = 70_000.0, 620.0


@dataclass(frozen=True, slots=True)
class Parcel:
    """A piece of land with one use."""

    outline: shapely.Polygon
    colour: Colour
    furrow_rad: float
    """Direction across the furrows."""
    furrow_m: float
    furrow_strength: float


@dataclass(frozen=True, slots=True)
class Building:
    """A house: a box under a ridge roof of which one half lies in the sun."""

    outline: shapely.Polygon
    sunny_half: shapely.Polygon
    height_m: float
    colour: Colour


@dataclass(frozen=True, slots=True)
class Tree:
    """A crown and how high it reaches."""

    crown: shapely.Geometry
    radius_m: float

    @property
    def height_m(self) -> float:
        """Height of the part that casts the shadow."""
        return 1.8 * self.radius_m


@dataclass(frozen=True, slots=True)
class Scenery:
    """Everything around the roads of one scene."""

    is_urban: bool
    parcels: tuple[Parcel, ...]
    hedges: tuple[shapely.Geometry, ...]
    buildings: tuple[Building, ...]
    trees: tuple[Tree, ...]


def plan_scenery(
    network: RoadNetwork,
    region: shapely.Polygon,
    *,
    verge_m: float,
    keep_free: Sequence[shapely.Geometry] = (),
    sun: Sun,
    rng: np.random.Generator,
) -> Scenery:
    """Plan what lies around the roads.

    Parameters
    ----------
    network : slow roads run through a town, fast ones through the country.
    region : ground to fill.
    verge_m : strip beside the road that trees, buildings and their shadows leave free.
    keep_free : more ground that trees and buildings leave free.
    sun : tells where shadows fall.
    rng : source of every choice.

    Returns
    -------
    The plan.
    """
    is_urban = float(np.median([lane.speed_limit_mps for lane in network.lanes])) <= _URBAN_LIMIT_MPS
    free = shapely.union_all([network.surface().buffer(verge_m), *keep_free], grid_size=_GRID_M)
    area_m2 = region.area
    land = _cut(region, int(area_m2 / (_PLOT_M2 if is_urban else _FIELD_M2)) + 2, rng)
    parcels = tuple(_parcel(outline, rng, is_urban=is_urban) for outline in land)
    if is_urban:
        houses = _town(network, region, int(area_m2 / _HOUSE_M2), rng)
    else:
        houses = _farms(region, int(area_m2 / _FARM_M2) + 1, rng)
    buildings = _fitting(houses, free, sun)
    taken = shapely.union_all(
        [free, *(shadow_of(item.outline, item.height_m, sun) for item in buildings)], grid_size=_GRID_M
    )
    shapely.prepare(taken)
    count = int(area_m2 / (_TOWN_TREE_M2 if is_urban else _TREE_M2))
    trees = tuple(tree for tree in _draw_trees(region, count, rng) if _is_free(tree, taken, sun))
    return Scenery(is_urban, parcels, _hedges(land, rng), buildings, trees)


def _cut(region: shapely.Polygon, count: int, rng: np.random.Generator) -> list[shapely.Polygon]:
    """Cut the largest piece in two by a straight line until there are `count`."""
    pieces = [region]
    main_rad = rng.uniform(-0.15, 0.15)
    while len(pieces) < count:
        pieces.sort(key=lambda piece: piece.area)
        largest = pieces.pop()
        west_m, south_m, east_m, north_m = largest.bounds
        is_wide = east_m - west_m > north_m - south_m
        angle_rad = main_rad + rng.normal(0, 0.06) + (math.pi / 2 if is_wide else 0.0)
        share = rng.uniform(0.35, 0.65)
        x_m, y_m = west_m + share * (east_m - west_m), south_m + share * (north_m - south_m)
        reach_m = east_m - west_m + north_m - south_m
        along = np.array([math.cos(angle_rad), math.sin(angle_rad)]) * reach_m
        line = shapely.LineString([(x_m - along[0], y_m - along[1]), (x_m + along[0], y_m + along[1])])
        pieces += [part for part in split(largest, line).geoms if isinstance(part, shapely.Polygon)]
    return pieces


def _parcel(outline: shapely.Polygon, rng: np.random.Generator, *, is_urban: bool) -> Parcel:
    colours = _PLOT_COLOURS if is_urban else _FIELD_COLOURS
    blue, green, red = np.array(colours[rng.integers(len(colours))]) * rng.uniform(0.88, 1.1)
    return Parcel(
        outline=outline,
        colour=(float(blue), float(green), float(red)),
        furrow_rad=float(rng.uniform(0, math.pi)),
        furrow_m=float(rng.uniform(4, 9)),
        furrow_strength=0.0 if is_urban else float(rng.uniform(0.0, 0.05)),
    )


def _hedges(land: list[shapely.Polygon], rng: np.random.Generator) -> tuple[shapely.Geometry, ...]:
    """Grow hedges along some of the borders, with gaps."""
    hedges: list[shapely.Geometry] = []
    for piece in land:
        ring = np.asarray(piece.exterior.coords)
        for start_m, end_m in pairwise(ring):
            if rng.random() < 0.5:
                first, last = sorted(rng.uniform(0, 1, 2))
                line = shapely.LineString([start_m + first * (end_m - start_m), start_m + last * (end_m - start_m)])
                hedges.append(line.buffer(float(rng.uniform(0.4, 0.9))))
    return tuple(hedges)


def _farms(region: shapely.Polygon, count: int, rng: np.random.Generator) -> Iterator[Building]:
    """Draw groups of buildings around yards."""
    for _ in range(count):
        centre_m, turn_deg = _random_point(region, rng), float(rng.uniform(0, 90))
        for _ in range(rng.integers(2, 5)):
            place_m = centre_m + rng.uniform(-28, 28, 2)
            size_m = float(rng.uniform(12, 30)), float(rng.uniform(8, 13))
            yield _building(place_m, size_m, turn_deg + 90 * float(rng.integers(2)), float(rng.uniform(4, 7)), rng)


def _town(network: RoadNetwork, region: shapely.Polygon, count: int, rng: np.random.Generator) -> Iterator[Building]:
    """Draw houses that stand square to the nearest road."""
    roads = [shapely.LineString(road.reference_line_m) for road in network.roads]
    for _ in range(count):
        place_m = _random_point(region, rng)
        road = min(roads, key=shapely.Point(place_m).distance)
        near_m = road.project(shapely.Point(place_m))
        here, ahead = road.interpolate(max(0.0, near_m - 1)), road.interpolate(near_m + 1)
        turn_deg = math.degrees(math.atan2(ahead.y - here.y, ahead.x - here.x)) + 90 * float(rng.integers(2))
        size_m = float(rng.uniform(9, 24)), float(rng.uniform(8, 13))
        yield _building(place_m, size_m, turn_deg, float(rng.uniform(4, 11)), rng)


def _building(
    place_m: FloatArray, size_m: tuple[float, float], turn_deg: float, height_m: float, rng: np.random.Generator
) -> Building:
    length_m, width_m = size_m
    colour = _ROOF_COLOURS[rng.integers(len(_ROOF_COLOURS))]
    outline, sunny_half = (
        placed(shapely.box(-length_m / 2, low_m, length_m / 2, width_m / 2), place_m, turn_deg * math.pi / 180)
        for low_m in (-width_m / 2, 0)
    )
    return Building(outline, sunny_half, height_m, colour)


def _fitting(houses: Iterator[Building], keep_free: shapely.Geometry, sun: Sun) -> tuple[Building, ...]:
    """Keep the buildings whose shadow falls neither on the road nor on another building."""
    kept: list[Building] = []
    shadows: list[shapely.Geometry] = []
    shapely.prepare(keep_free)
    for house in houses:
        shadow = shadow_of(house.outline, house.height_m, sun)
        if not shapely.intersects(keep_free, shadow) and not any(
            shapely.intersects(shadow, other) for other in shadows
        ):
            kept.append(house)
            shadows.append(shapely.buffer(shadow, 1.5))
    return tuple(kept)


def _draw_trees(region: shapely.Polygon, count: int, rng: np.random.Generator) -> Iterator[Tree]:
    for _ in range(count):
        place_m, radius_m = _random_point(region, rng), float(rng.uniform(1.8, 4.5))
        yield draw_tree(place_m, radius_m, rng)


def draw_tree(place_m: FloatArray, radius_m: float, rng: np.random.Generator) -> Tree:
    """Draw a ragged crown of about a radius around a place."""
    blobs = [
        shapely.Point(place_m + rng.normal(0, radius_m * 0.35, 2)).buffer(radius_m * 0.75, quad_segs=4)
        for _ in range(4)
    ]
    return Tree(shapely.union_all(blobs), radius_m)


def _is_free(tree: Tree, taken: shapely.Geometry, sun: Sun) -> bool:
    return not shapely.intersects(taken, shadow_of(tree.crown, tree.height_m, sun))


def shadow_of(shape: shapely.Geometry, height_m: float, sun: Sun) -> shapely.Geometry:
    """Give the ground that lies in the shadow of an upright prism, its own foot included."""
    return shapely.union(shape, affinity.translate(shape, *sun.shadow_offset_m(height_m))).convex_hull


def _random_point(region: shapely.Polygon, rng: np.random.Generator) -> FloatArray:
    west_m, south_m, east_m, north_m = region.bounds
    return np.array([rng.uniform(west_m, east_m), rng.uniform(south_m, north_m)])
