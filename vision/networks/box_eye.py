"""Which vehicles does a camera see by the boxes of somebody who knows no ground? An eye without a background.

The network or file gives boxes; here they are put on the ground, and those off the road are left out. Nothing is held
back at the start, and standing vehicles are seen as well as driving ones: a detector tells them from the road. What a
vehicle is does not change, so a network looks a few times a second; in between, all are where their motion takes them.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np
import shapely

from vision.detection.detector import Detections, Expected
from vision.detection.eye import Eye
from vision.detection.fusion import Channel
from vision.detection.parting.lanes import LaneStrip
from vision.detection.surfaces.surface import road_area
from vision.networks.box_detector import BoxDetector, Flow, GroundBoxes, ImageBoxes, Instant, whole_boxes
from vision.networks.detection_ground import farther, ground_detections, image_detections
from vision.objects import BoolArray, FloatArray
from vision.road.boxes import distance_to_boxes
from vision.road.view import GroundView, Lens
from vision.settings import VisionSettings

InstantT = TypeVar("InstantT", bound=Instant)


@dataclass(frozen=True, slots=True)
class FoundBoxes:
    """What a detector found in an instant, None between looks; and the map, None for boxes on the ground already."""

    boxes: ImageBoxes | GroundBoxes | None
    pixel_from_ground: FloatArray | None


class BoxEye(Eye[InstantT]):
    """Boxes on the road.

    Parameters
    ----------
    detector : finds vehicles without knowing the road.
    road_polygons_m : outlines of the road, (k, 2) each; what lies outside is left out.
    image_size_px : (width, height) of the picture.
    settings : constants.
    pixel_from_ground : of a camera that stands; None if it moves, or there is no picture.
    lens : bends the picture of the homography; None for a straight one.
    looks_hz : how often it looks; None for every instant.
    lanes : of the road, if they are known: what has never moved lies along them.
    flow : follows boxes in the picture between looks, for their speeds; None for speeds by looks alone.
    """

    def __init__(
        self,
        detector: BoxDetector[InstantT],
        road_polygons_m: Sequence[FloatArray],
        image_size_px: tuple[int, int],
        settings: VisionSettings,
        pixel_from_ground: FloatArray | None = None,
        *,
        lens: Lens | None = None,
        looks_hz: float | None = None,
        lanes: Sequence[LaneStrip] = (),
        flow: Flow[InstantT] | None = None,
    ) -> None:
        self._detector = detector
        self._image_size_px = image_size_px
        self._settings = settings
        self._standing = pixel_from_ground
        self._lens = lens
        self._lanes = lanes
        self._flow = flow
        self._road = road_area(road_polygons_m).buffer(settings.road_margin_m)
        shapely.prepare(self._road)
        self._period_us = 0 if looks_hz is None else round(1_000_000 / looks_hz)
        self._next_us: int | None = None
        self._matrix: FloatArray | None = None
        self._view: GroundView | None = None

    @property
    def is_sure(self) -> bool:
        """A detector knows vehicles from road."""
        return True

    def detect_when_due(self, instant: InstantT) -> ImageBoxes | GroundBoxes | None:
        """Find vehicles; None where the next look is due later. Instants come in order."""
        self._next_us = instant.t_us if self._next_us is None else self._next_us
        if instant.t_us < self._next_us:
            if self._flow is not None:
                self._flow.keep(instant, self._next_us)
            return None
        # By the clock and not from this look, or a period that is no multiple of a frame's would grow.
        due = 1 + (instant.t_us - self._next_us) // max(self._period_us, 1)
        self._next_us += due * self._period_us
        boxes = self._detector.detect(instant)
        if isinstance(boxes, GroundBoxes):
            return boxes
        boxes = whole_boxes(boxes, self._image_size_px)
        return boxes if self._flow is None else replace(boxes, shifts=self._flow.shifts(instant, boxes))

    def found(self, boxes: ImageBoxes | GroundBoxes | None, pixel_from_ground: FloatArray | None) -> FoundBoxes:
        """Join boxes with the map to the ground."""
        return FoundBoxes(boxes, self._standing if pixel_from_ground is None else pixel_from_ground)

    def take(self, instant: InstantT, pixel_from_ground: FloatArray | None) -> FoundBoxes:
        """Find vehicles if it is time to look, with the map to the ground."""
        return self.found(self.detect_when_due(instant), pixel_from_ground)

    def metres_per_pixel(self, points_m: FloatArray) -> FloatArray:
        """Give the scale, (n,), at places of the view looked at last."""
        assert self._view is not None, "the scale of a view is known once it was looked at"
        return self._view.metres_per_pixel(points_m)

    def holds(self, points_m: FloatArray) -> BoolArray:
        """Tell which ground positions are road in view."""
        is_on_road = self._on_road(points_m)
        return is_on_road if self._view is None else is_on_road & self._view.sees(points_m)

    def look(self, found: FoundBoxes | None, expected: Expected) -> Channel:
        """Put the boxes on the ground."""
        if found is None:
            return Channel(Detections.none(), self.holds, is_open=False)
        self._turn(found.pixel_from_ground)
        if found.boxes is None:
            return Channel(Detections.none(), self.holds, is_between=True)
        if isinstance(found.boxes, GroundBoxes):
            detections = ground_detections(found.boxes, expected, self._settings)
        else:
            assert self._view is not None, "boxes in pixels need a camera"
            detections = image_detections(
                found.boxes,
                self._view,
                expected,
                image_size_px=self._image_size_px,
                settings=self._settings,
                lanes=self._lanes,
            )
        if self._period_us:
            detections = replace(detections, weight=self._settings.networks.look_evidence * detections.weights())
        # What is too weak to tell of a vehicle may still tell where one is (Zhang et al., ByteTrack, 2022).
        is_known = (distance_to_boxes(detections.boxes.centre_m, expected.known) < 0).any(axis=1)
        is_taken = self._on_road(detections.boxes.centre_m) & (is_known | (detections.weights() > 0))
        return Channel(detections.select(is_taken), self.holds)

    def _turn(self, pixel_from_ground: FloatArray | None) -> None:
        if pixel_from_ground is None or (self._matrix is not None and np.array_equal(pixel_from_ground, self._matrix)):
            return
        self._matrix = pixel_from_ground
        self._view = GroundView(pixel_from_ground, self._image_size_px, farther(self._settings), self._lens)

    def _on_road(self, points_m: FloatArray) -> BoolArray:
        return np.asarray(shapely.contains_xy(self._road, points_m), np.bool_)
