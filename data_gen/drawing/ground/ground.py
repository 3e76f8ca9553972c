"""What does the ground look like when nobody is on it? Paints the scene behind the traffic, once.

Road surface and markings come from the road network, the rest from the plan of the scenery. Of a building only the roof
shows straight from above; a camera with a pose sees each wall whose outside is turned towards it.
"""

from collections.abc import Sequence
from itertools import pairwise

import cv2
import numpy as np
import shapely
from numpy.typing import NDArray
from shapely.ops import substring

from data_gen.drawing.ground.paint import GroundPainter, fill, ground_at, lay_over, scaled
from data_gen.drawing.ground.scenery import Building, Parcel, Scenery, Tree, shadow_of
from data_gen.drawing.ground.sky import Haze, paint_distance
from data_gen.drawing.sun import Sun
from data_gen.drawing.view import CameraView, at_height, plane_camera
from data_gen.simulation.states import Picture
from gis.polyline import offset
from gis.roads.lanes import Lane
from gis.roads.road_network import RoadNetwork

Surface = shapely.Polygon | shapely.MultiPolygon

VERGE_M = 6.0
"""Width of the strip beside a road that belongs to it."""

_GRAVEL_M = 0.7
_PAVEMENT_M = 2.4
_VERGE_COLOUR = (72.0, 122.0, 108.0)
_GRAVEL_COLOUR = (118.0, 128.0, 134.0)
_PAVEMENT_COLOUR = (146.0, 150.0, 152.0)
_KERB_COLOUR = (172.0, 174.0, 174.0)
_ASPHALT_COLOUR = (108.0, 106.0, 104.0)
_PAINT_COLOUR = (212.0, 214.0, 214.0)
_CROWN_COLOUR = (46.0, 84.0, 60.0)
_CROWN_HEIGHT_M = 3.5
_SHADOW_COLOUR = (38.0, 44.0, 34.0)
_BEYOND_M = 1500.0
_GAP_M = 2.0
_WHEEL_TRACK_M = 0.85
_WHEEL_TRACK_WIDTH_M = 0.6
_WALL_COLOUR = (150.0, 160.0, 166.0)


def paint_ground(
    network: RoadNetwork,
    scenery: Scenery,
    view: CameraView,
    *,
    marks: Sequence[shapely.Geometry],
    bays: Sequence[shapely.Geometry],
    sun: Sun,
    haze: Haze,
    rng: np.random.Generator,
) -> NDArray[np.uint8]:
    """Paint the empty scene.

    Parameters
    ----------
    network : gives the road surface.
    scenery : what lies around it.
    view : the camera; with a pose, buildings show their walls.
    marks : painted white on the road.
    bays : ground beside the lanes that is paved as they are, such as parking bays.
    sun : shades trees and buildings.
    haze : pales what is far, for a camera that sees the horizon.
    rng : source of textures and repairs.

    Returns
    -------
    (h, w, 3) blue, green, red.
    """
    painter = GroundPainter(view.camera, view.size_px)
    road = network.surface()
    picture = _paint_parcels(painter, scenery, rng)
    if scenery.is_urban:
        _paint_pavement(picture, painter, road, rng)
    else:
        _paint_verge(picture, painter, road, rng)
    paved = shapely.union_all([road, *bays, *(_beyond_ends(network.lanes, road) if painter.is_low else ())])
    _paint_asphalt(picture, painter, paved, network.lanes, rng)
    _paint_marks(picture, painter, marks, rng)
    if painter.is_low:
        assert view.pose is not None
        if not sun.is_hidden:
            stands = [(tree.crown, tree.height_m) for tree in scenery.trees]
            stands += [(item.outline, item.height_m) for item in scenery.buildings]
            painter.lay(picture, [shadow_of(shape, up_m, sun) for shape, up_m in stands], _SHADOW_COLOUR, 0.6)
        paint_distance(picture, view.pose, sun, haze, rng)
    else:
        _paint_trees(picture, scenery.trees, view, sun=sun, rng=rng)
        paint_buildings(picture, painter, scenery.buildings, view, sun)
    # The lens: without it single pixels are sharper than any camera shows them.
    seen = cv2.GaussianBlur(picture, (3, 3), 0.45)
    return np.clip(np.round(seen), 0, 255).astype(np.uint8)


def _paint_parcels(painter: GroundPainter, scenery: Scenery, rng: np.random.Generator) -> Picture:
    width_px, height_px = painter.size_px
    picture = np.full((height_px, width_px, 3), _VERGE_COLOUR, dtype=np.float32)
    for parcel in scenery.parcels:
        _paint_parcel(picture, painter, parcel)
    picture *= 1 + np.float32(0.06) * painter.texture(rng, largest_m=60, octaves=7)[:, :, None]
    if not painter.is_low:
        painter.lay(picture, scenery.hedges, _CROWN_COLOUR, 0.85)
    return picture


def _paint_parcel(picture: Picture, painter: GroundPainter, parcel: Parcel) -> None:
    for patch in painter.patches([parcel.outline]):
        colour = np.asarray(parcel.colour, dtype=np.float32)
        # Far furrows are finer than the pixels of a low view.
        if parcel.furrow_strength == 0 or painter.is_low:
            lay_over(picture[patch.window], patch.cover, parcel.colour)
            continue
        rows, columns = (np.arange(part.start, part.stop, dtype=np.float64) for part in patch.window)
        ground_m = ground_at(painter.camera, columns, rows).astype(np.float32)
        east_m, north_m = ground_m[:, :, 0], ground_m[:, :, 1]
        across_m = east_m * np.float32(np.cos(parcel.furrow_rad)) + north_m * np.float32(np.sin(parcel.furrow_rad))
        furrows = np.float32(parcel.furrow_strength) * np.sin(across_m * np.float32(np.pi * 2 / parcel.furrow_m))
        lay_over(picture[patch.window], patch.cover, colour * (1 + furrows[:, :, None]))


def _paint_verge(picture: Picture, painter: GroundPainter, road: Surface, rng: np.random.Generator) -> None:
    grass = painter.texture(rng, largest_m=14, octaves=5)
    verge = np.asarray(_VERGE_COLOUR, dtype=np.float32) * (1 + np.float32(0.09) * grass[:, :, None])
    painter.lay(picture, [road.buffer(VERGE_M)], verge)
    ditch = road.buffer(VERGE_M * 0.7).difference(road.buffer(VERGE_M * 0.7 - 1.2))
    painter.lay(picture, [ditch], (45.0, 70.0, 62.0), 0.35)
    painter.lay(picture, [road.buffer(_GRAVEL_M)], _GRAVEL_COLOUR, 0.8)


def _paint_pavement(picture: Picture, painter: GroundPainter, road: Surface, rng: np.random.Generator) -> None:
    wear = painter.texture(rng, largest_m=6, octaves=5)
    slabs = np.asarray(_PAVEMENT_COLOUR, dtype=np.float32) * (1 + np.float32(0.03) * wear[:, :, None])
    painter.lay(picture, [road.buffer(_PAVEMENT_M, join_style="mitre")], slabs)
    painter.lay(picture, [road.buffer(0.18, join_style="mitre")], _KERB_COLOUR, 0.9)


def _paint_asphalt(
    picture: Picture,
    painter: GroundPainter,
    paved: shapely.Geometry,
    lanes: Sequence[Lane],
    rng: np.random.Generator,
) -> None:
    grain = painter.texture(rng, largest_m=0, octaves=1)
    stains = painter.texture(rng, largest_m=25, octaves=5)
    shade = 1 + np.float32(0.018) * grain + np.float32(0.03) * stains
    painter.lay(picture, [paved], shade[:, :, None] * np.asarray(_ASPHALT_COLOUR, dtype=np.float32))
    tracks = [
        _line(lane, side * _WHEEL_TRACK_M).buffer(_WHEEL_TRACK_WIDTH_M / 2, cap_style="flat")
        for lane in lanes
        for side in (-1, 1)
    ]
    painter.lay(picture, tracks, (96.0, 94.0, 92.0), 0.35)
    for patch, brightness in _repairs(lanes, rng):
        painter.lay(picture, [patch], (brightness, brightness, brightness), 0.6)


def _beyond_ends(lanes: Sequence[Lane], road: Surface) -> list[shapely.Geometry]:
    """Let lanes that end nowhere run on: a low camera sees beyond the network."""
    ways: list[shapely.Geometry] = []
    for lane in lanes:
        for end_m, before_m in (lane.centre_line_m[[0, 1]], lane.centre_line_m[[-1, -2]]):
            onward = (end_m - before_m) / np.hypot(*(end_m - before_m))
            if road.distance(shapely.Point(end_m + _GAP_M * onward)) > 0:
                way = shapely.LineString([end_m - onward, end_m + _BEYOND_M * onward])
                ways.append(way.buffer(lane.width_m / 2 + 0.05, cap_style="flat"))
    return ways


def _repairs(lanes: Sequence[Lane], rng: np.random.Generator) -> list[tuple[shapely.Geometry, float]]:
    """Draw patches of newer, darker or older, paler asphalt: half a lane wide, 5 to 40 m long, one every 150 m."""
    patches: list[tuple[shapely.Geometry, float]] = []
    for lane in lanes:
        centre = _line(lane, 0.0)
        for _ in range(rng.poisson(centre.length / 150)):
            start_m, length_m = rng.uniform(0, centre.length), rng.uniform(5, 40)
            part = substring(centre, start_m, min(start_m + length_m, centre.length))
            if part.length > 1:
                side = float(rng.choice((-1, 1))) * lane.width_m / 4
                strip = shapely.LineString(offset(np.asarray(part.coords), side))
                patches.append((strip.buffer(lane.width_m / 4, cap_style="flat"), float(rng.uniform(84, 122))))
    return patches


def _paint_marks(
    picture: Picture, painter: GroundPainter, marks: Sequence[shapely.Geometry], rng: np.random.Generator
) -> None:
    wear = painter.texture(rng, largest_m=8, octaves=4)
    strength = np.clip(np.float32(0.72) + np.float32(0.2) * wear, 0.15, 0.95).astype(np.float32)
    painter.lay(picture, marks, _PAINT_COLOUR, strength)


def _paint_trees(
    picture: Picture, trees: Sequence[Tree], view: CameraView, *, sun: Sun, rng: np.random.Generator
) -> None:
    """Paint crowns; a camera with a pose sees their dark lower side below the upper one."""
    painter = GroundPainter(view.camera, view.size_px)
    leaves = painter.texture(rng, largest_m=2.5, octaves=3)
    if not sun.is_hidden:
        shadows = [shadow_of(tree.crown, tree.height_m, sun) for tree in trees]
        painter.lay(picture, shadows, _SHADOW_COLOUR, 0.6)
    foliage = np.asarray(_CROWN_COLOUR, dtype=np.float32) * (1 + np.float32(0.16) * leaves[:, :, None])
    above = painter if view.pose is None else GroundPainter(plane_camera(view, _CROWN_HEIGHT_M), view.size_px)
    if view.pose is not None:
        painter.lay(picture, [tree.crown for tree in trees], foliage * np.float32(0.6))
    above.lay(picture, [tree.crown for tree in trees], foliage)
    above.lay(picture, [_tip(tree, sun) for tree in trees], foliage * np.float32(1.35), 0.6)


def _tip(tree: Tree, sun: Sun) -> shapely.Geometry:
    """Give the part of a crown that catches the sun."""
    east_m, north_m = sun.shadow_offset_m(-0.3 * tree.radius_m)
    return shapely.affinity.translate(shapely.affinity.scale(tree.crown, 0.6, 0.6), east_m, north_m)


def _line(lane: Lane, left_m: float) -> shapely.LineString:
    return shapely.LineString(offset(lane.centre_line_m, left_m))


def paint_buildings(
    picture: Picture, painter: GroundPainter, buildings: Sequence[Building], view: CameraView, sun: Sun
) -> None:
    """Paint buildings with their shadows, the far ones first.

    Parameters
    ----------
    picture : (h, w, 3), changed.
    painter : of the view's image.
    buildings : to paint.
    view : the camera.
    sun : casts the shadows and lights the walls.
    """
    if not sun.is_hidden:
        painter.lay(picture, [shadow_of(item.outline, item.height_m, sun) for item in buildings], _SHADOW_COLOUR, 0.6)
    eye_m = np.zeros(2) if view.pose is None else view.pose.place_m[:2]
    for item in sorted(buildings, key=lambda item: -item.outline.distance(shapely.Point(eye_m))):
        if painter.view.distance(item.outline) < 30:
            if view.pose is not None:
                _paint_walls(picture, item, view, sun)
            for outline, factor in ((item.outline, 0.85), (item.sunny_half, 1.12)):
                roof_px = at_height(np.asarray(outline.exterior.coords), item.height_m, view)
                fill(picture, roof_px, scaled(item.colour, factor))


def hides_ground(item: Building, ground: shapely.Geometry, view: CameraView) -> bool:
    """Tell whether a building stands between a camera and some ground.

    Parameters
    ----------
    item : the building.
    ground : to be seen.
    view : the camera; straight from above nothing hides more than its own foot.

    Returns
    -------
    True if walls or roof cover a part of it.
    """
    foot_m = np.asarray(item.outline.exterior.coords)
    # Where the lines of sight over the eaves come down behind the building.
    behind_m = view.camera.to_ground(at_height(foot_m, item.height_m, view))
    if not np.isfinite(behind_m).all():
        return False
    return bool(shapely.intersects(shapely.MultiPoint(np.vstack((foot_m, behind_m))).convex_hull, ground))


def _paint_walls(picture: Picture, item: Building, view: CameraView, sun: Sun) -> None:
    assert view.pose is not None
    ring = np.asarray(shapely.geometry.polygon.orient(item.outline).exterior.coords)
    for start_m, end_m in pairwise(ring):
        # Counter-clockwise: outside is to the right of each wall.
        outward = np.array([end_m[1] - start_m[1], start_m[0] - end_m[0]]) / np.hypot(*(end_m - start_m))
        if outward @ (view.pose.place_m[:2] - start_m) > 0:
            foot_px = at_height(np.array([start_m, end_m]), 0.0, view)
            top_px = at_height(np.array([end_m, start_m]), item.height_m, view)
            fill(picture, np.vstack((foot_px, top_px)), scaled(_WALL_COLOUR, sun.wall_light(outward)))
