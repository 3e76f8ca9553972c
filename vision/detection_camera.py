"""Which vehicles does a camera see, by the boxes of somebody who knows no ground? Boxes in, tracked objects out.

The network or file gives boxes; here they are put on the ground, those off the road are left out, and the tracker that
the motion detector has joins them over time. There is no background: nothing is held back at the start, standing
vehicles are seen as well as driving ones, and a moving camera needs no mosaic.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Generic, Protocol, TypeVar

import numpy as np
import shapely
from numpy.typing import NDArray

from vision.detection.detector import Detections, Expected
from vision.detection.surface import checked_polygons
from vision.networks.box_detector import BoxDetector, GroundBoxes, Instant, whole_boxes
from vision.networks.detection_ground import ground_detections, image_detections
from vision.objects import VisionObjects
from vision.road.view import GroundView
from vision.settings import VisionSettings
from vision.tracking.tracker import Tracker

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]

# Around tracks, when they are told to who follows a moving camera.
OUTLINE_MARGIN_M = 2.0

InstantT = TypeVar("InstantT", bound=Instant)
InstantT_contra = TypeVar("InstantT_contra", bound=Instant, contravariant=True)


class Motion(Protocol[InstantT_contra]):
    """Anything that knows the map to the ground at every instant; `registration.CameraMotion` for frames."""

    def locate(self, frame: InstantT_contra, vehicles_m: Sequence[FloatArray]) -> FloatArray | None:
        """Tell (3, 3) pixel_from_ground; None where it is not known."""
        ...


class Standing:
    """The motion of a camera that stands still."""

    def __init__(self, pixel_from_ground: FloatArray) -> None:
        self._matrix = pixel_from_ground

    def locate(self, frame: Instant, vehicles_m: Sequence[FloatArray]) -> FloatArray | None:
        """Give the one map."""
        return self._matrix


class DetectionVision(Generic[InstantT]):
    """Instants in, tracked objects out.

    Parameters
    ----------
    detector : finds vehicles without knowing the road.
    motion : knows the map to the ground; None if there is no picture, and the boxes are on the ground already.
    road_polygons_m : outlines of the road, (k, 2) each; what lies outside is left out.
    image_size_px : (width, height) of the picture.
    is_moving : whether the map changes and is to be told with the objects.
    settings : constants of tracking.

    Raises
    ------
    VisionError
        If there is no road, or one is no polygon.
    """

    def __init__(
        self,
        detector: BoxDetector[InstantT],
        motion: Motion[InstantT] | None,
        road_polygons_m: Sequence[FloatArray],
        image_size_px: tuple[int, int],
        *,
        is_moving: bool = False,
        settings: VisionSettings | None = None,
    ) -> None:
        self._settings = settings if settings is not None else VisionSettings()
        self._detector = detector
        self._motion = motion
        self._image_size_px = image_size_px
        self._is_moving = is_moving
        rings = [shapely.make_valid(shapely.Polygon(ring)) for ring in checked_polygons(road_polygons_m)]
        self._road = shapely.union_all(rings).buffer(self._settings.road_margin_m)
        shapely.prepare(self._road)
        self._matrix: FloatArray | None = None
        self._view: GroundView | None = None
        self._tracker = Tracker(self._settings, self._holds)

    def observe(self, instant: InstantT) -> list[VisionObjects]:
        """Take the next instant.

        Parameters
        ----------
        instant : later than the one before.

        Returns
        -------
        The objects tracked, or one result that says that the view is lost.

        Raises
        ------
        VisionError
            If the detector fails.
        """
        expected = self._tracker.predict(instant.t_us)
        if self._motion is not None and not self._look(self._motion, instant):
            self._tracker.update(Detections.none())
            return [VisionObjects.lost(instant.t_us)]
        objects = self._tracker.update(self._detect(instant, expected))
        # A detector knows vehicles from road; no ghost has to be waited for.
        self._tracker.prove(self._tracker.standing(0)[0])
        return [replace(objects, pixel_from_ground=self._matrix) if self._is_moving else objects]

    def finish(self) -> list[VisionObjects]:
        """End the video: nothing is held back."""
        return []

    def _look(self, motion: Motion[InstantT], instant: InstantT) -> bool:
        """Find out where the camera looks; tell whether that is known."""
        matrix = motion.locate(instant, list(self._tracker.claims()[0].corners(OUTLINE_MARGIN_M)))
        if matrix is None:
            return False
        if self._matrix is None or not np.array_equal(matrix, self._matrix):
            self._matrix = matrix
            self._view = GroundView(
                matrix, self._image_size_px, max_metres_per_pixel=self._settings.max_metres_per_pixel
            )
        return True

    def _detect(self, instant: InstantT, expected: Expected) -> Detections:
        found = self._detector.detect(instant)
        if isinstance(found, GroundBoxes):
            detections = ground_detections(found, expected, self._settings)
        else:
            assert self._view is not None, "boxes in pixels need a camera"
            size_px = self._image_size_px
            seen = whole_boxes(found, size_px)
            detections = image_detections(seen, self._view, expected, image_size_px=size_px, settings=self._settings)
        return detections.select(self._on_road(detections.boxes.centre_m))

    def _on_road(self, points_m: FloatArray) -> BoolArray:
        return np.asarray(shapely.contains_xy(self._road, points_m), np.bool_)

    def _holds(self, points_m: FloatArray) -> BoolArray:
        """Tell which ground positions are road in view."""
        is_on_road = self._on_road(points_m)
        return is_on_road if self._view is None else is_on_road & self._view.sees(points_m)
