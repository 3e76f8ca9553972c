"""What does a building look like from a camera? Its shadow, the walls that face the camera, and its roof.

Straight from above only the roof shows; a camera with a pose sees each wall whose outside is turned towards it.
"""

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
import shapely

from data_gen.drawing.ground.mosaic import plane_to_pixels
from data_gen.drawing.ground.paint import Colour, GroundPainter, cover_of, lay_over
from data_gen.drawing.ground.scenery import Building, shadow_of
from data_gen.drawing.sun import Sun
from data_gen.drawing.view import CameraView
from data_gen.simulation.states import FloatArray, Picture

_SHADOW_COLOUR = (38.0, 44.0, 34.0)
_WALL_COLOUR = np.array((150.0, 160.0, 166.0))


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
            colour = np.array(item.colour)
            for outline, factor in ((item.outline, 0.85), (item.sunny_half, 1.12)):
                roof_px = at_height(np.asarray(outline.exterior.coords), item.height_m, view)
                _fill(picture, roof_px, _scaled(colour, factor), view)


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
            _fill(picture, np.vstack((foot_px, top_px)), _scaled(_WALL_COLOUR, sun.wall_light(outward)), view)


def at_height(points_m: FloatArray, height_m: float, view: CameraView) -> FloatArray:
    """Map points of a level plane into the image: (n, 2) metres to (n, 2) pixels."""
    mapped = np.column_stack((points_m, np.ones(len(points_m)))) @ plane_to_pixels(view, height_m).T
    return np.asarray(mapped[:, :2] / mapped[:, 2:], dtype=np.float64)


def _fill(picture: Picture, outline_px: FloatArray, colour: Colour, view: CameraView) -> None:
    patch = cover_of([outline_px], view.size_px)
    if patch is not None:
        lay_over(picture[patch.window], patch.cover, colour)


def _scaled(colour: FloatArray, factor: float) -> Colour:
    blue, green, red = np.minimum(colour * factor, 255.0).tolist()
    return blue, green, red
