"""Where does a low camera stand beside or over a road, and where does it look?

It hangs 4 to 12 m high and looks 5 to 25 degrees down: from a bridge over a road or from its side, along the
carriageways, or from a corner of a junction across its middle.
"""

import math
from collections.abc import Sequence

import numpy as np
import shapely

from data_gen.scenario import View
from data_gen.simulation.states import FloatArray
from gis.cameras.camera_pose import CameraPose
from gis.roads.road_network import RoadNetwork

_HEIGHT_M = (4.0, 12.0)
_PITCH_DEG = (5.0, 25.0)
_FOCAL_WIDTHS = (0.8, 1.4)
"""Focal length in image widths: 64 to 39 degrees from the left border to the right one."""
_NEAR_JUNCTION_M = 15.0
_BACK_SHARE = (0.15, 0.45)
"""How far before the middle of the view the mast stands, in widths of the view."""
_ROADSIDE_M = (2.0, 7.0)
_CORNER_M = (20.0, 34.0)
_BRIDGE_SHARE = 0.5
_TOWARDS_M = 70.0
"""A camera at the roadside looks at the middle of the road so far ahead."""


def mast_pose(network: RoadNetwork, view: View, size_px: tuple[int, int], rng: np.random.Generator) -> CameraPose:
    """Put a camera on a mast or a bridge.

    Parameters
    ----------
    network : the roads.
    view : of the scenario; the mast stands in it, at a corner where its middle is in or beside a junction.
    size_px : width and height of the image.
    rng : source of place, height and direction.

    Returns
    -------
    The pose.
    """
    height_m = float(rng.uniform(*_HEIGHT_M))
    # A high camera looks down more than a low one, or it would see nothing near.
    share = (height_m - _HEIGHT_M[0]) / (_HEIGHT_M[1] - _HEIGHT_M[0])
    steep = float(np.clip(0.7 * share + 0.3 * rng.uniform(-0.2, 1.2), 0.0, 1.0))
    pitch_deg = _PITCH_DEG[0] + steep * (_PITCH_DEG[1] - _PITCH_DEG[0])
    middle = shapely.Point(view.centre_m)
    at_junction = any(
        shapely.Polygon(junction.outline_m).distance(middle) < _NEAR_JUNCTION_M
        for junction in network.junctions
        if len(junction.outline_m) > 2
    )
    place_m, yaw_rad = (_at_corner if at_junction else _at_road)(network, view, rng)
    return CameraPose(
        x_m=float(place_m[0]),
        y_m=float(place_m[1]),
        height_m=height_m,
        yaw_rad=math.remainder(yaw_rad, math.tau),
        pitch_rad=-math.radians(pitch_deg),
        roll_rad=0.0,
        focal_px=size_px[0] * float(rng.uniform(*_FOCAL_WIDTHS)),
    )


def _at_corner(network: RoadNetwork, view: View, rng: np.random.Generator) -> tuple[FloatArray, float]:
    """Stand on free ground at a corner, and look across the middle."""
    middle_m = np.array(view.centre_m)
    road = network.surface()
    corner_m = middle_m
    for _ in range(200):
        angle_rad, apart_m = float(rng.uniform(0, math.tau)), float(rng.uniform(*_CORNER_M))
        corner_m = middle_m + apart_m * np.array([math.cos(angle_rad), math.sin(angle_rad)])
        if road.distance(shapely.Point(corner_m)) > 1.0:
            break
    east_m, north_m = middle_m - corner_m
    return corner_m, math.atan2(north_m, east_m) + math.radians(float(rng.uniform(-14, 14)))


def _at_road(network: RoadNetwork, view: View, rng: np.random.Generator) -> tuple[FloatArray, float]:
    """Stand over a road, or beside it, and look along it either way."""
    lines = [shapely.LineString(road.reference_line_m) for road in network.roads]
    line = min(lines, key=shapely.Point(view.centre_m).distance)
    sign = float(rng.choice((-1.0, 1.0)))
    middle_m = line.project(shapely.Point(view.centre_m))
    along_m = middle_m - sign * view.width_m * float(rng.uniform(*_BACK_SHARE))
    along_m = min(max(along_m, 0.0), line.length)
    here_m, ahead_m = (_point(line, along_m + shift_m) for shift_m in (0.0, sign * _TOWARDS_M))
    east, north = (ahead_m - here_m) / np.hypot(*(ahead_m - here_m))
    right_m, left_m = _reach_m(network.surface(), here_m, np.array([-north, east]))
    middle_of_road_m = (right_m + left_m) / 2
    if rng.random() < _BRIDGE_SHARE:
        aside_m = float(rng.uniform(right_m + 1.0, left_m - 1.0))
        target_m = 0.5 * aside_m + 0.5 * middle_of_road_m
    else:
        is_right = rng.random() < 0.5
        beyond_m = float(rng.uniform(*_ROADSIDE_M))
        aside_m = right_m - beyond_m if is_right else left_m + beyond_m
        target_m = middle_of_road_m
    place_m = here_m + aside_m * np.array([-north, east])
    look_m = ahead_m + target_m * np.array([-north, east]) - place_m
    return place_m, math.atan2(look_m[1], look_m[0])


def _point(line: shapely.LineString, along_m: float) -> FloatArray:
    return np.asarray(shapely.get_coordinates(shapely.line_interpolate_point(line, along_m))[0], dtype=np.float64)


def _reach_m(surface: shapely.Geometry, place_m: FloatArray, left: FloatArray) -> Sequence[float]:
    """Tell how far all carriageways at a place reach to its right (negative) and to its left."""
    across = shapely.LineString([place_m - 40.0 * left, place_m + 40.0 * left])
    offsets_m = (shapely.get_coordinates(shapely.intersection(across, surface)) - place_m) @ left
    return float(offsets_m.min()), float(offsets_m.max())
