"""Which vehicles does a moving camera see, where, and how fast? The whole of vision for a camera on a drone.

Every frame's map to the ground comes from a `CameraMotion`: registration against key frames, or a file of poses. The
road's cells lie on the ground and stay there, so from there on everything is as for a fixed camera, except that the
background is known only where the camera has been for a while. Where the map is lost nothing is said at all: tracks
coast out of sight, and a frame's result says that the view is lost.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from vision.detection.surface import checked_polygons
from vision.objects import VisionObjects
from vision.registration.mosaic import MosaicBackground
from vision.registration.moving_raster import MovingGroundSurface
from vision.registration.registration import CameraMotion
from vision.road.rectify import RoadImage
from vision.road_watch import RoadWatch
from vision.settings import VisionSettings
from vision.video.frames import Frame

FloatArray = NDArray[np.float64]


class MovingCameraVision:
    """Frames in, tracked objects out.

    Parameters
    ----------
    pixel_from_ground : (3, 3) homography of the first frame, from ground metres (x east, y north) to pixels.
    road_polygons_m : outlines of the road, (k, 2) each; what lies outside is not looked at.
    image_size_px : (width, height) of the frames.
    motion : knows the maps of all frames.
    reach_m : how far beyond the first view the camera may come to look; road farther away is not watched.
    settings : constants; the defaults suit daylight traffic.

    Raises
    ------
    VisionError
        If no road is in reach, or the geometry is unusable.
    """

    def __init__(
        self,
        pixel_from_ground: FloatArray,
        road_polygons_m: Sequence[FloatArray],
        image_size_px: tuple[int, int],
        motion: CameraMotion[Frame],
        *,
        reach_m: float,
        settings: VisionSettings | None = None,
    ) -> None:
        settings = settings if settings is not None else VisionSettings()
        self._motion = motion
        self._surface = MovingGroundSurface(
            facing(pixel_from_ground),
            checked_polygons(road_polygons_m),
            image_size_px=image_size_px,
            reach_m=reach_m,
            settings=settings,
        )
        self._background = MosaicBackground(self._surface.raster, settings)
        self._watch = RoadWatch(self._surface, self._background, settings)
        self._held_lost_us: list[int] = []

    def observe(self, frame: Frame) -> Iterable[VisionObjects]:
        """Take the next frame.

        Parameters
        ----------
        frame : later than the one before.

        Returns
        -------
        Nothing during start-up, then the objects of all held frames, then those of each frame. Those of held frames
        are found while they are taken: take them all before the next frame.

        Raises
        ------
        VisionError
            If the frame has another size than announced.
        """
        matrix = self._motion.locate(frame, self._watch.outlines_m())
        if matrix is None:
            return self._miss(frame.t_us)
        image = self._surface.raster.rectify(frame, facing(matrix))
        if self._background.is_ready:
            return [self._follow(image)]
        return self._catch_up(self._background.hold(image))

    def finish(self) -> Iterable[VisionObjects]:
        """End the video.

        Returns
        -------
        The objects of frames still held, if the video ended during start-up; that the view was lost all the time.
        """
        if self._background.is_ready:
            return []
        held = self._background.start()
        if not held:  # There was never a map, as with poses on another clock.
            return [VisionObjects.lost(t_us) for t_us in self._held_lost_us]
        return self._catch_up(held)

    def _miss(self, t_us: int) -> list[VisionObjects]:
        if not self._background.is_ready:
            self._held_lost_us.append(t_us)
            return []
        self._watch.miss(t_us)
        return [VisionObjects.lost(t_us)]

    def _catch_up(self, held: list[RoadImage]) -> Iterator[VisionObjects]:
        """Go through the frames of the start-up, those without a view among them."""
        if not held:
            return
        lost_us, self._held_lost_us = self._held_lost_us, []
        for image in held:
            while lost_us and lost_us[0] < image.t_us:
                yield from self._miss(lost_us.pop(0))
            yield self._follow(image)
        for t_us in lost_us:
            yield from self._miss(t_us)

    def _follow(self, image: RoadImage) -> VisionObjects:
        assert image.pixel_from_ground is not None
        self._surface.look(image.pixel_from_ground)
        objects = self._watch.follow(image)
        return objects if objects.is_lost else replace(objects, pixel_from_ground=image.pixel_from_ground)


def facing(pixel_from_ground: FloatArray) -> FloatArray:
    """Choose the sign of a homography that makes depth positive in front of the camera.

    Parameters
    ----------
    pixel_from_ground : (3, 3), of a right-handed ground (x east, y north) seen from above.

    Returns
    -------
    The same map, with a negative determinant.

    Examples
    --------
    >>> float(facing(-np.diag([2.0, -2.0, 1.0]))[2, 2])
    1.0
    """
    matrix = np.asarray(pixel_from_ground, np.float64)
    return -matrix if np.linalg.det(matrix) > 0 else matrix
