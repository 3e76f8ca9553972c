"""Which vehicles does a fixed camera see, where, and how fast? The whole of vision for one camera that stands still.

Frames are rectified to a raster of the road, compared with a background that is learned on the way, and cut into
boxes which a tracker joins over time. What the tracker knows flows back: its predictions divide merged blobs, its
objects keep the background from learning them.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from vision.background import Background
from vision.detector import Detector, MotionDetector
from vision.frames import Frame
from vision.ground_surface import GroundSurface
from vision.image_surface import ImageSurface
from vision.objects import VisionObjects
from vision.rectify import RoadImage
from vision.settings import VisionSettings
from vision.surface import Surface, checked_polygons
from vision.tracker import Tracker
from vision.view import GroundView

FloatArray = NDArray[np.float64]

__all__ = ["FixedCameraVision", "VisionSettings"]


class FixedCameraVision:
    """Frames in, tracked objects out.

    Parameters
    ----------
    pixel_from_ground : (3, 3) homography from ground metres (x east, y north) to pixels.
    road_polygons_m : outlines of the road, (k, 2) each; what lies outside is not looked at.
    image_size_px : (width, height) of the frames.
    settings : constants; the defaults suit daylight traffic.

    Raises
    ------
    VisionError
        If no road is in view, or the geometry is unusable.
    """

    def __init__(
        self,
        pixel_from_ground: FloatArray,
        road_polygons_m: Sequence[FloatArray],
        image_size_px: tuple[int, int],
        settings: VisionSettings | None = None,
    ) -> None:
        self._settings = settings if settings is not None else VisionSettings()
        self._surface = _surface(pixel_from_ground, checked_polygons(road_polygons_m), image_size_px, self._settings)
        self._background = Background(self._surface.raster, self._settings)
        self._detector: Detector = MotionDetector(self._surface, self._background, self._settings)
        self._tracker = Tracker(self._settings, self._surface.holds)
        self._judged_us = 0

    def observe(self, frame: Frame) -> list[VisionObjects]:
        """Take the next frame.

        Parameters
        ----------
        frame : later than the one before.

        Returns
        -------
        Nothing during start-up, then the objects of all held frames at once, then those of each frame.

        Raises
        ------
        VisionError
            If the frame has another size than announced.
        """
        image = self._surface.raster.rectify(frame)
        if self._background.is_ready:
            return [self._follow(image)]
        return [self._follow(held) for held in self._background.hold(image)]

    def finish(self) -> list[VisionObjects]:
        """End the video.

        Returns
        -------
        The objects of frames still held, if the video ended during start-up.
        """
        if self._background.is_ready:
            return []
        return [self._follow(held) for held in self._background.start()]

    def _follow(self, image: RoadImage) -> VisionObjects:
        expected = self._tracker.predict(image.t_us)
        scene = self._detector.detect(image, expected)
        objects = self._tracker.update(scene.detections)
        self._sort_out_ghosts(image)
        claims, is_real = self._tracker.claims()
        self._background.learn(image, scene.foreground, self._surface.appearances(claims).boxes, is_real)
        return objects

    def _sort_out_ghosts(self, image: RoadImage) -> None:
        """Decide about tracks that stand: vehicles are shown and kept, revealed road is learned."""
        if image.t_us - self._judged_us < self._settings.background_period_us:
            return
        self._judged_us = image.t_us
        rows, boxes = self._tracker.standing(self._settings.standing_us)
        if len(rows) == 0:
            return
        seen = self._surface.appearances(boxes).boxes
        verdicts = self._background.judge(image, seen)
        self._tracker.prove(rows[verdicts > 0])
        ghosts = np.flatnonzero(verdicts < 0)
        if len(ghosts) > 0:
            self._background.heal(image, seen.select(ghosts))
            self._tracker.drop(rows[ghosts])


def _surface(
    pixel_from_ground: FloatArray,
    polygons_m: list[FloatArray],
    image_size_px: tuple[int, int],
    settings: VisionSettings,
) -> Surface:
    """Choose the plane of detection: the image, where height would smear a car over more than its own length."""
    view = GroundView(pixel_from_ground, image_size_px, max_metres_per_pixel=settings.max_metres_per_pixel)
    corners = np.concatenate(polygons_m)
    corners = corners[view.sees(corners)]
    if len(corners) == 0:
        corners = np.stack(view.extent()).mean(axis=0)[None]
    smear_m = view.sight(corners).smear_m(settings.usual_height_m)
    if np.median(smear_m) > settings.usual_length_m:
        return ImageSurface(view, polygons_m, image_size_px=image_size_px, settings=settings)
    return GroundSurface(view, polygons_m, image_size_px=image_size_px, settings=settings)
