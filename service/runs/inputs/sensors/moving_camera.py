"""How does vision follow a camera that moves? By its poses where the site file has them, else by the pictures."""

from collections.abc import Iterable, Sequence

import numpy as np

from gis.cameras.camera import GroundCamera
from gis.cameras.camera_pose import CameraTrack
from gis.errors import GisError
from service.runs.inputs.sites.site import Motion
from vision.networks.box_detector import Instant
from vision.objects import FloatArray
from vision.registration.registration import Registration
from vision.registration.settings import RegistrationSettings
from vision.video.frame import Frame

# How far the camera may come to look, as a part of the diagonal of its first view: less where there is no network,
# since all ground in reach is road then.
REACH_SHARE, REACH_SHARE_WITHOUT_ROADS = 0.5, 0.25


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
