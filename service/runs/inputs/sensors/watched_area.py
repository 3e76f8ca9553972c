"""Which part of the ground does vision look at? The roads, as far as the site's road mask leaves them."""

from pathlib import Path

import cv2
import numpy as np
import shapely
from numpy.typing import ArrayLike

from gis.cameras.camera import GroundCamera
from gis.roads.road_network import RoadNetwork, plain_rings
from service.errors import SiteError
from service.runs.inputs.sensors.moving_camera import reach_m
from service.runs.inputs.sites.site import Motion
from vision.objects import ByteArray, FloatArray

BRIGHT = 128
NO_PARENT = -1


def watched_area(
    camera: GroundCamera,
    network: RoadNetwork | None,
    road_mask: Path | None,
    size_px: tuple[int, int],
    motion: Motion | None = None,
) -> tuple[FloatArray, ...]:
    """Outline what vision looks at, or may come to look at.

    Parameters
    ----------
    camera : of the first frame.
    network : its surface; without one, all ground in view, or in reach of a camera that moves.
    road_mask : an image of the frame's size, bright where there is road; None for no further limit.
    size_px : width and height of the frames.
    motion : of the camera; None if it stands still.

    Returns
    -------
    Rings (k, 2) in metres.

    Raises
    ------
    GisError
        If a pose sees no ground.
    SiteError
        If the mask is no image, has another size, or leaves nothing to look at.
    """
    area: shapely.Geometry = network.surface() if network else _ground_in_reach(camera, motion, size_px)
    if road_mask is not None:
        area = shapely.intersection(area, _bright_area(camera, _read_mask(road_mask, size_px)))
    rings = plain_rings(area)
    if not rings:
        raise SiteError(f"{road_mask}: expected a mask that is bright on some road in view, got none")
    return rings


def _ground_in_reach(camera: GroundCamera, motion: Motion | None, size_px: tuple[int, int]) -> shapely.Geometry:
    seen = shapely.Polygon(camera.view_outline(*size_px))
    if motion is None:
        return seen
    return seen.buffer(reach_m(camera, motion, size_px, has_roads=False), join_style="mitre")


def _read_mask(path: Path, size_px: tuple[int, int]) -> ByteArray:
    mask = cv2.imread(str(path), cv2.IMREAD_GRAYSCALE)
    if mask is None:
        raise SiteError(f"{path}: expected an image that OpenCV can read, got another file")
    if (mask.shape[1], mask.shape[0]) != size_px:
        expected, came = f"{size_px[0]} x {size_px[1]}", f"{mask.shape[1]} x {mask.shape[0]}"
        raise SiteError(f"{path}: expected a mask of the frame's size {expected}, got {came}")
    return np.asarray(mask, np.uint8)


def _bright_area(camera: GroundCamera, mask: ByteArray) -> shapely.Geometry:
    """Project the bright parts of a mask to the ground, islands left out."""
    contours, hierarchy = cv2.findContours((mask >= BRIGHT).astype(np.uint8), cv2.RETR_CCOMP, cv2.CHAIN_APPROX_SIMPLE)
    parents = hierarchy[0][:, 3] if hierarchy is not None else []
    rings = [(_ground_polygon(camera, ring), parent) for ring, parent in zip(contours, parents, strict=True)]
    outer = [ring for ring, parent in rings if parent == NO_PARENT]
    islands = [ring for ring, parent in rings if parent != NO_PARENT]
    return shapely.difference(shapely.union_all(outer), shapely.union_all(islands))


def _ground_polygon(camera: GroundCamera, ring_px: ArrayLike) -> shapely.Geometry:
    points_m = camera.to_ground(np.asarray(ring_px, np.float64).reshape(-1, 2))
    points_m = points_m[np.isfinite(points_m).all(axis=1)]  # beyond the horizon
    return shapely.make_valid(shapely.Polygon(points_m)) if len(points_m) >= 3 else shapely.Polygon()
