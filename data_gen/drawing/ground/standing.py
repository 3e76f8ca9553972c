"""What stands beside the road in a low view? Trees, houses, hedges, rails, posts, lamps and a sign gantry.

All of it is painted once, with its distance: a vehicle farther away than what stands at a pixel is hidden there.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import cv2
import numpy as np
import shapely

from data_gen.drawing.ground.paint import Colour, scaled
from data_gen.drawing.ground.scenery import Building, Scenery, Tree
from data_gen.drawing.ground.sky import Haze
from data_gen.drawing.sun import Sun
from data_gen.drawing.view import CameraView
from data_gen.simulation.states import ByteArray, FloatArray, Picture
from gis.cameras.camera_pose import CameraPose
from gis.roads.road_network import RoadNetwork

_FINENESS = 2
_FARTHEST_M, _NEAREST_M = 600.0, 0.5
_CLEAR_M = 130.0
"""So far away nothing stands between the camera and a road."""
_RAIL_ASIDE_M, _POST_ASIDE_M, _LAMP_ASIDE_M = 0.9, 1.2, 1.4
_RAIL_LIMIT_MPS, _TOWN_LIMIT_MPS = 30.0, 17.0
_LEAVES: Colour = (44.0, 88.0, 62.0)
_TRUNK: Colour = (52.0, 62.0, 72.0)
_STEEL: Colour = (164.0, 166.0, 166.0)
_WHITE: Colour = (216.0, 218.0, 218.0)
_SIGN: Colour = (150.0, 84.0, 26.0)
_WALLS: tuple[Colour, ...] = ((176, 196, 206), (150, 160, 166), (120, 150, 190), (196, 200, 200), (92, 104, 150))
_PANE: Colour = (70.0, 62.0, 56.0)


@dataclass(frozen=True, slots=True, eq=False)
class Standing:
    """Everything upright that does not move, as one camera sees it."""

    bgra: ByteArray
    """(h, w, 4), colours already multiplied by their opacity."""
    away_m: Picture
    """(h, w), how far from the camera's foot; infinite where nothing stands."""


@dataclass(frozen=True, slots=True, eq=False)
class _Board:
    """A flat, convex shape in space."""

    outline_m: FloatArray
    """(n, 3)."""
    colour: Colour
    whole_m: FloatArray | None = None
    """(2,), the middle of the house that it belongs to; its boards are painted together, in their order."""


def stands_clear(outline: shapely.Geometry, road: shapely.Geometry, eye_m: FloatArray) -> bool:
    """Tell whether something hides no road next to the camera, and does not stand on the camera itself."""
    points_m = shapely.get_coordinates(shapely.convex_hull(outline))
    away_m = np.hypot(*(points_m - eye_m).T)
    if away_m.min() > _CLEAR_M:
        return True
    behind_m = eye_m + (points_m - eye_m) * (_CLEAR_M / np.maximum(1.0, away_m))[:, None]
    hidden = shapely.MultiPoint(np.vstack((points_m, behind_m))).convex_hull
    return bool(away_m.min() > 6.0 and not shapely.intersects(hidden, road))


def paint_standing(
    network: RoadNetwork, scenery: Scenery, view: CameraView, *, sun: Sun, haze: Haze, rng: np.random.Generator
) -> Standing:
    """Paint what stands beside the roads.

    Parameters
    ----------
    network : the roads; fast ones have rails or posts at their sides, those of a town lamps.
    scenery : its trees, buildings and hedges; none of them hides a road next to the camera.
    view : the camera; it has a pose.
    sun : lights walls and crowns.
    haze : pales what is far.
    rng : source of colours and shapes.
    """
    assert view.pose is not None
    width_px, height_px = view.size_px
    fine = np.zeros((height_px * _FINENESS, width_px * _FINENESS, 4), dtype=np.uint8)
    depth = np.full(fine.shape[:2], np.inf, dtype=np.float32)
    space, eye_m = view.pose.projection(*view.size_px), view.pose.place_m[:2]
    boards = [*_nature(scenery, view.pose, sun, rng), *_furniture(network, view.pose, rng)]
    places_m = [board.outline_m[:, :2].mean(axis=0) if board.whole_m is None else board.whole_m for board in boards]
    away_m = np.hypot(*(np.array(places_m) - eye_m).T).tolist()
    for place in np.argsort(-np.array(away_m), kind="stable").tolist():
        mapped = np.column_stack((boards[place].outline_m, np.ones(len(boards[place].outline_m)))) @ space.T
        if away_m[place] > _FARTHEST_M or mapped[:, 2].min() < _NEAREST_M:
            continue
        fine_px = (mapped[:, :2] / mapped[:, 2:] + 0.5) * _FINENESS - 0.5
        if np.abs(fine_px).max() > 30_000:
            continue
        whole = np.round(fine_px * 16).astype(np.int32)
        colour = haze.pale(np.array([boards[place].colour]), away_m[place])[0].tolist()
        cv2.fillConvexPoly(fine, whole, (*colour, 255.0), shift=4)
        cv2.fillConvexPoly(depth, whole, (away_m[place],), shift=4)
    bgra = cv2.resize(fine, view.size_px, interpolation=cv2.INTER_AREA)
    nearest_m = depth.reshape(height_px, _FINENESS, width_px, _FINENESS).min(axis=(1, 3))
    return Standing(np.asarray(bgra, dtype=np.uint8), np.asarray(nearest_m, dtype=np.float32))


def _nature(scenery: Scenery, pose: CameraPose, sun: Sun, rng: np.random.Generator) -> Iterator[_Board]:
    for tree in scenery.trees:
        yield from _tree(tree, pose, sun, rng)
    for building in scenery.buildings:
        middle_m = np.array([building.outline.centroid.x, building.outline.centroid.y])
        yield from (replace(board, whole_m=middle_m) for board in _house(building, pose, sun, rng))
    for hedge in scenery.hedges:
        yield from _prism(
            shapely.get_coordinates(shapely.convex_hull(hedge))[:-1], float(rng.uniform(0.9, 1.8)), _LEAVES, pose, sun
        )


def _tree(tree: Tree, pose: CameraPose, sun: Sun, rng: np.random.Generator) -> Iterator[_Board]:
    """Grow a trunk under blobs of leaves: dark ones first, those towards the sun and the sky bright."""
    foot_m = shapely.get_coordinates(shapely.centroid(tree.crown))[0]
    right = _right_of(foot_m, pose)
    radius_m, middle_m = tree.radius_m, tree.radius_m * float(rng.uniform(1.2, 1.7))
    yield _upright(foot_m - 0.07 * radius_m * right, foot_m + 0.07 * radius_m * right, (0.0, middle_m), _TRUNK)
    tint = scaled(_LEAVES, float(rng.uniform(0.75, 1.25)))
    angles = np.linspace(0, math.tau, 9, endpoint=False)
    sunny = -float(right @ np.array(sun.shadow_offset_m(1.0))) * (0.0 if sun.is_hidden else 1.0)
    for blob in range(26):
        share = 0.6 if blob < 8 else float(rng.uniform(0.22, 0.36))
        side, up = rng.uniform(-0.7, 0.7, 2) * (0.55 if blob < 8 else 1.0) * radius_m
        light = (
            0.7
            if blob < 8
            else 0.95 + 0.25 * up / radius_m + 0.2 * sunny * side / radius_m + float(rng.normal(0, 0.06))
        )
        edge_m = share * radius_m * (1 + rng.uniform(-0.15, 0.15, 9))
        level_m = foot_m + (side + edge_m * np.cos(angles))[:, None] * right
        yield _Board(np.column_stack((level_m, middle_m + up + edge_m * np.sin(angles))), scaled(tint, light))


def _house(item: Building, pose: CameraPose, sun: Sun, rng: np.random.Generator) -> Iterator[_Board]:
    """Build walls with windows under a ridge roof."""
    corners_m = shapely.get_coordinates(shapely.geometry.polygon.orient(item.outline))[:4]
    colour, up_m = _WALLS[rng.integers(len(_WALLS))], item.height_m
    yield from _prism(corners_m, up_m, colour, pose, sun, has_windows=True)
    if np.hypot(*(corners_m[1] - corners_m[0])) < np.hypot(*(corners_m[2] - corners_m[1])):
        corners_m = np.roll(corners_m, -1, axis=0)
    ridge_m = np.array([(corners_m[1] + corners_m[2]) / 2, (corners_m[3] + corners_m[0]) / 2])
    top_m = up_m + 0.3 * float(np.hypot(*(corners_m[2] - corners_m[1])))
    for first, last, ridge, paint in (
        (0, 1, (0, 1), item.colour),
        (2, 3, (1, 0), item.colour),
        (1, 2, (0,), colour),
        (3, 0, (1,), colour),
    ):
        points_m = np.vstack((corners_m[[first, last]], ridge_m[list(ridge)]))
        outward = np.array([points_m[1, 1] - points_m[0, 1], points_m[0, 0] - points_m[1, 0]])
        if outward @ (pose.place_m[:2] - points_m[0]) > 0:
            light = float(sun.wall_light(outward / np.hypot(*outward)))
            heights_m = [up_m, up_m, *(top_m for _ in ridge)]
            yield _Board(
                np.column_stack((points_m, heights_m)), scaled(paint, 0.4 + 0.6 * light if len(ridge) > 1 else light)
            )


def _prism(
    corners_m: FloatArray, up_m: float, colour: Colour, pose: CameraPose, sun: Sun, *, has_windows: bool = False
) -> Iterator[_Board]:
    """Build the walls of a convex outline that look at the camera."""
    for start_m, end_m in zip(corners_m, np.roll(corners_m, -1, axis=0), strict=True):
        outward = np.array([end_m[1] - start_m[1], start_m[0] - end_m[0]])
        length_m = float(np.hypot(*outward))
        if length_m < 0.05 or abs(outward @ (pose.place_m[:2] - start_m)) <= 0:
            continue
        facing = outward / length_m
        if not has_windows and facing @ (pose.place_m[:2] - start_m) < 0:
            facing = -facing
        if facing @ (pose.place_m[:2] - start_m) <= 0:
            continue
        light = sun.wall_light(facing)
        yield _upright(start_m, end_m, (0.0, up_m), scaled(colour, light))
        if has_windows:
            for floor_m in np.arange(0.9, up_m - 1.6, 2.8):
                for along_m in np.arange(1.2, length_m - 1.8, 2.6):
                    ends_m = [start_m + share / length_m * (end_m - start_m) for share in (along_m, along_m + 1.1)]
                    yield _upright(ends_m[0], ends_m[1], (floor_m, floor_m + 1.3), _PANE)


def _furniture(network: RoadNetwork, pose: CameraPose, rng: np.random.Generator) -> Iterator[_Board]:
    """Set up rails along motorways, posts along other roads of the country, and lamps in a town."""
    limit_mps = float(np.median([lane.speed_limit_mps for lane in network.lanes]))
    road, here = network.surface(), shapely.Point(pose.place_m[:2])
    if limit_mps <= _TOWN_LIMIT_MPS:
        for foot_m, _ in _along(road, _LAMP_ASIDE_M, 28.0, here):
            side_m = 0.07 * _right_of(foot_m, pose)
            yield _upright(foot_m - side_m, foot_m + side_m, (0.0, 7.0), scaled(_STEEL, 0.7))
            yield _upright(foot_m - 6 * side_m, foot_m + 6 * side_m, (7.0, 7.15), scaled(_STEEL, 0.6))
    elif limit_mps < _RAIL_LIMIT_MPS:
        for foot_m, _ in _along(road, _POST_ASIDE_M, 50.0, here):
            side_m = 0.07 * _right_of(foot_m, pose)
            for up_m, colour in (((0.0, 1.0), _WHITE), ((0.72, 0.9), _PANE)):
                yield _upright(foot_m - side_m, foot_m + side_m, up_m, colour)
    else:
        for foot_m, next_m in _along(road, _RAIL_ASIDE_M, 4.0, here, nearest_m=3.0):
            side_m = 0.06 * _right_of(foot_m, pose)
            yield _upright(foot_m - side_m, foot_m + side_m, (0.0, 0.7), scaled(_STEEL, 0.75))
            for up_m, light in (((0.45, 0.58), 0.85), ((0.58, 0.62), 0.6), ((0.62, 0.76), 1.05)):
                yield _upright(foot_m, next_m, up_m, scaled(_STEEL, light))
        yield from _gantry(road, pose, rng)


def _gantry(road: shapely.Geometry, pose: CameraPose, rng: np.random.Generator) -> Iterator[_Board]:
    """Span a beam with signs over the road ahead."""
    sight = np.array([math.cos(pose.yaw_rad), math.sin(pose.yaw_rad)])
    middle_m = pose.place_m[:2] + float(rng.uniform(110, 240)) * sight
    across = np.array([sight[1], -sight[0]])
    cut = shapely.intersection(shapely.LineString([middle_m - 60 * across, middle_m + 60 * across]), road)
    if rng.random() < 0.4 or cut.is_empty:
        return
    offsets_m = (shapely.get_coordinates(cut) - middle_m) @ across
    low_m, high_m = offsets_m.min() - 1.8, offsets_m.max() + 1.8
    for end_m in (low_m, high_m):
        yield _upright(
            middle_m + (end_m - 0.2) * across, middle_m + (end_m + 0.2) * across, (0.0, 7.6), scaled(_STEEL, 0.8)
        )
    yield _upright(middle_m + low_m * across, middle_m + high_m * across, (6.6, 7.1), scaled(_STEEL, 0.9))
    for share in (0.2, 0.45, 0.75):
        place_m = low_m + share * (high_m - low_m)
        first_m, last_m = (middle_m + (place_m + side_m) * across - 0.3 * sight for side_m in (-1.9, 1.9))
        yield _upright(first_m, last_m, (5.6, 7.9), _SIGN if rng.random() < 0.7 else _WHITE)


def _along(
    road: shapely.Geometry, aside_m: float, apart_m: float, here: shapely.Point, *, nearest_m: float = 12.0
) -> Iterator[tuple[FloatArray, FloatArray]]:
    """Give places along the borders of a road, each with the next one; none at the camera or beyond its reach."""
    for line in shapely.get_parts(shapely.boundary(shapely.buffer(road, aside_m, join_style="mitre"))):
        count = max(2, int(line.length / apart_m))
        places_m = shapely.get_coordinates(shapely.line_interpolate_point(line, np.linspace(0, line.length, count + 1)))
        away_m = np.hypot(*(places_m - shapely.get_coordinates(here)[0]).T)
        for place in np.flatnonzero((away_m[:-1] < _FARTHEST_M) & (away_m[:-1] > nearest_m)):
            # Where a road ends the border runs across it.
            if shapely.distance(road, shapely.Point((places_m[place] + places_m[place + 1]) / 2)) > 0.9 * aside_m:
                yield places_m[place], places_m[place + 1]


def _upright(start_m: FloatArray, end_m: FloatArray, up_m: Sequence[float], colour: Colour) -> _Board:
    points_m = np.vstack((start_m, end_m, end_m, start_m))
    return _Board(np.column_stack((points_m, [up_m[0], up_m[0], up_m[1], up_m[1]])), colour)


def _right_of(place_m: FloatArray, pose: CameraPose) -> FloatArray:
    """Give the direction across the line of sight to a place."""
    east, north = (place_m - pose.place_m[:2]) / max(1e-6, float(np.hypot(*(place_m - pose.place_m[:2]))))
    return np.array([north, -east])
