"""How does vision follow a camera that moves, and which ground may it come to look at? By poses, or by the pictures.

It looks at the roads, as far as the site's road mask leaves them.
"""

from collections.abc import Iterable, Sequence
from pathlib import Path

import cv2
import numpy as np
import shapely
from numpy.typing import ArrayLike

from gis.cameras.camera import GroundCamera
from gis.cameras.camera_pose import CameraTrack
from gis.errors import GisError
from gis.roads.road_network import RoadNetwork, plain_rings
from service.errors import SiteError
from service.runs.inputs.sites.site import Motion
from vision.networks.box_detector import Instant
from vision.objects import ByteArray, FloatArray
from vision.registration.registration import Registration
from vision.registration.settings import RegistrationSettings
from vision.video.frame import Frame

# How far the camera may come to look, as a part of the diagonal of its first view: less where there is no network,
# since all ground in reach is road then.
REACH_SHARE, REACH_SHARE_WITHOUT_ROADS = 0.5, 0.25
BRIGHT = 128
NO_PARENT = -1


class StoredPoses:
    """The motion of a camera whose poses are known.

    Parameters
    ----------
    track : the poses.
    size_px : width and height of the frames.
    """

    def __init__(self, track: CameraTrack, size_px: tuple[int, int]) -> None:
        self._track = track
        self._size_px = size_px

    @property
    def refusal(self) -> str:
        """Say why a view is lost."""
        return "expected a pose near in time, got none"

    def locate(self, frame: Instant, vehicles_m: Sequence[FloatArray]) -> FloatArray | None:
        """Look up the map of a frame; None where no pose is near enough in time."""
        try:
            return self._track.at(frame.t_us).camera(*self._size_px).pixel_from_ground
        except GisError:
            return None


def first_camera(camera: GroundCamera | None, motion: Motion | None, size_px: tuple[int, int]) -> GroundCamera:
    """Give the camera of the first frame: that of the poses where there are any.

    Raises
    ------
    GisError
        If the first pose sees no ground.
    """
    if motion is not None and motion.poses is not None:
        return motion.poses.poses[0].camera(*size_px)
    assert camera is not None, "a site with a camera has its first map or its poses"
    return camera


def camera_at_start(
    measured: GroundCamera,
    frames: Iterable[Frame],
    at_us: int,
    size_px: tuple[int, int],
    settings: RegistrationSettings,
) -> GroundCamera:
    """Follow the picture to the one that a camera was measured in; give the camera of the first one.

    Parameters
    ----------
    measured : of the first frame at or after `at_us`.
    frames : from the first one on.
    at_us : media time.
    size_px : width and height of the frames.
    settings : of the registration.

    Raises
    ------
    GisError
        If there is no such frame, or none of the first one's ground is recognised in it.
    """
    there = measured.pixel_from_ground
    follow, here = Registration(there, size_px, settings), None
    for frame in frames:
        here = follow.locate(frame, ())
        if frame.t_us >= at_us:
            break
    else:
        raise GisError(f"camera.measured_at_s: expected a time within the video, got {at_us / 1e6:g} s")
    if here is None:
        expected = "expected the time of a picture that shows ground of the first one"
        raise GisError(f"camera.measured_at_s: {expected}, got {at_us / 1e6:g} s: {follow.refusal}")
    # The first frame was taken for the measured one, and that came out as `here`: the way between them, taken back.
    return GroundCamera.from_homography(np.linalg.inv(there @ np.linalg.inv(here) @ there))


def reach_m(camera: GroundCamera, motion: Motion, size_px: tuple[int, int], *, has_roads: bool) -> float:
    """Tell how far beyond the first view the camera may come to look, in metres.

    Raises
    ------
    GisError
        If a pose sees no ground.
    """
    if motion.reach_m is not None:
        return motion.reach_m
    first = camera.view_outline(*size_px)
    low, high = first.min(axis=0), first.max(axis=0)
    if motion.poses is None:
        share = REACH_SHARE if has_roads else REACH_SHARE_WITHOUT_ROADS
        return share * float(np.hypot(*(high - low)))
    seen = np.concatenate([pose.camera(*size_px).view_outline(*size_px) for pose in motion.poses.poses])
    return float(max((low - seen.min(axis=0)).max(), (seen.max(axis=0) - high).max(), 0.0))


def camera_motion(
    camera: GroundCamera, motion: Motion, size_px: tuple[int, int], settings: RegistrationSettings
) -> StoredPoses | Registration:
    """Follow a camera by its poses where there are any, else by its pictures; `camera` is that of the first frame."""
    if motion.poses is not None:
        return StoredPoses(motion.poses, size_px)
    return Registration(camera.pixel_from_ground, size_px, settings)


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
