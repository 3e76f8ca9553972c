"""What happens to a frame once its road lies before us? Detect, track, and let the background know.

What the tracker knows flows back: its predictions divide merged blobs, its objects keep the background from learning
them. Fixed and moving cameras differ before this point only.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from vision.background.background import Background
from vision.detection.detector import Detections, Detector, MotionDetector
from vision.detection.lane_bodies import TALL_LENGTH_M
from vision.detection.lanes import LaneField
from vision.detection.surface import Surface
from vision.objects import VisionObjects
from vision.road.rectify import RoadImage
from vision.settings import VisionSettings
from vision.tracking.tracker import Tracker

FloatArray = NDArray[np.float64]

# Shadows, and what a vehicle drives in a frame.
OUTLINE_MARGIN_M = 2.0
# Two vehicles side by side are as wide as this; one with its shadow is not, unless it is long, and tall.
PAIR_WIDTH_M = 5.0


class RoadWatch:
    """Detector, tracker and background of one road.

    Parameters
    ----------
    surface : the plane of detection.
    background : of its raster.
    settings : constants.
    lanes : on the surface's raster, if they are known.
    """

    def __init__(
        self, surface: Surface, background: Background, settings: VisionSettings, lanes: LaneField | None = None
    ) -> None:
        self._settings = settings
        self._surface = surface
        self._background = background
        self._detector: Detector = MotionDetector(surface, background, settings, lanes)
        self._tracker = Tracker(settings, surface.holds)
        self._judged_us: int | None = None

    def miss(self, t_us: int) -> None:
        """Let a frame pass in which nothing can be seen: tracks coast, and end when it lasts too long.

        Parameters
        ----------
        t_us : of the frame.
        """
        self._tracker.predict(t_us)
        self._tracker.update(Detections.none())

    def outlines_m(self) -> list[FloatArray]:
        """Outline everything that is tracked.

        Returns
        -------
        (4, 2) each, on the ground, with some room around it.
        """
        return list(self._tracker.claims()[0].corners(OUTLINE_MARGIN_M))

    def follow(self, image: RoadImage) -> VisionObjects:
        """Take in the next frame.

        Parameters
        ----------
        image : its road; the background must be ready.

        Returns
        -------
        The objects tracked.
        """
        expected = self._tracker.predict(image.t_us)
        scene = self._detector.detect(image, expected)
        is_lost = self._background.is_overwhelmed
        objects = self._tracker.update(Detections.none() if is_lost else scene.detections)
        self._sort_out_ghosts(image)
        claims, is_real = self._tracker.claims()
        self._background.learn(image, scene.foreground, self._surface.appearances(claims).boxes, is_real)
        return VisionObjects.lost(image.t_us) if is_lost else objects

    def _sort_out_ghosts(self, image: RoadImage) -> None:
        """Decide about tracks that stand: vehicles are shown and kept, revealed road is learned."""
        if self._judged_us is not None and image.t_us - self._judged_us < self._settings.background_period_us:
            return
        if self._judged_us is None:
            # What is there at the very first need not stand for a while, since a ghost comes only where something drove
            # off; but what may be two vehicles may part yet.
            rows, boxes = self._tracker.standing(0)
            is_one = (boxes.width_m < PAIR_WIDTH_M) | (boxes.length_m > TALL_LENGTH_M)
            rows, boxes = rows[is_one], boxes.select(is_one)
        else:
            rows, boxes = self._tracker.standing(self._settings.standing_us)
        self._judged_us = image.t_us
        if len(rows) == 0:
            return
        seen = self._surface.appearances(boxes).boxes
        verdicts = self._background.judge(image, seen)
        self._tracker.prove(rows[verdicts > 0])
        ghosts = np.flatnonzero(verdicts < 0)
        if len(ghosts) > 0:
            self._background.heal(image, seen.select(ghosts))
            self._tracker.drop(rows[ghosts])
