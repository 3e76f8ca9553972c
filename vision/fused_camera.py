"""Which vehicles do a colour and a thermal camera see together? Two fixed cameras over one ground, one tracker.

Each camera has its own plane of detection, its own background and its own motion detector; what they find is fused on
the ground (`fusion.py`) before the tracker sees it. What the tracker knows flows back to both.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from itertools import starmap

import numpy as np
from numpy.typing import NDArray

from vision.detection.detector import Detections, Expected, MotionDetector
from vision.detection.fusion import Channel, DetectionRate, fuse
from vision.detection.lanes import LaneStrip
from vision.detection.surface import checked_polygons
from vision.fixed_camera import background_of, lane_field_of, surface_of
from vision.objects import VisionObjects
from vision.road.boxes import Boxes
from vision.road.rectify import RoadImage
from vision.settings import VisionSettings
from vision.tracking.tracker import Tracker
from vision.video.frame import Companion
from vision.video.frames import ByteArray, Frame

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]

# Thermal pictures are coarse; a car as wide as one or two pixels still stands out by its warmth.
THERMAL_METRES_PER_PIXEL = 1.5
# By how much a box may lie beside its vehicle: half a shadow in colour, half a coarse pixel in warmth.
COLOUR_BIAS_M = 0.5
THERMAL_BIAS_M = 0.2


@dataclass(frozen=True, slots=True)
class FixedView:
    """Where one of two cameras looks.

    Attributes
    ----------
    pixel_from_ground : (3, 3) homography from ground metres (x east, y north) to pixels.
    image_size_px : (width, height) of its frames.
    """

    pixel_from_ground: FloatArray
    image_size_px: tuple[int, int]


class _Eye:
    """One camera: its surface, background and detector, and how reliable it has been."""

    def __init__(
        self,
        view: FixedView,
        polygons_m: list[FloatArray],
        settings: VisionSettings,
        lanes: Sequence[LaneStrip],
        *,
        bias_m: float,
    ) -> None:
        self._surface = surface_of(view.pixel_from_ground, polygons_m, view.image_size_px, settings)
        self._background = background_of(self._surface, settings)
        field = lane_field_of(self._surface, lanes)
        self._detector = MotionDetector(self._surface, self._background, settings, field)
        self._bias_m = bias_m
        self._rate = DetectionRate()
        self._foreground: ByteArray | None = None
        self._image: RoadImage | None = None

    @property
    def is_ready(self) -> bool:
        return self._background.is_ready

    def rectify(self, frame: Frame) -> RoadImage:
        return self._surface.raster.rectify(frame)

    def hold(self, image: RoadImage) -> bool:
        """Take a frame of the start-up; tell whether it is over."""
        return bool(self._background.hold(image))

    def start(self) -> None:
        """End the start-up with what there is."""
        if not self.is_ready:
            self._background.start()

    def holds(self, points_m: FloatArray) -> BoolArray:
        return self._surface.holds(points_m)

    def look(self, image: RoadImage | None, expected: Expected) -> Channel:
        """Detect in a frame; the channel is closed if there is none, or if it shows something else than the road."""
        self._image, self._foreground = None, None
        if image is not None and not self.is_ready:
            self._background.hold(image)
        elif image is not None:
            scene = self._detector.detect(image, expected)
            self._image, self._foreground = image, scene.foreground
            if not self._background.is_overwhelmed:
                self._rate.learn(scene.detections, expected.known, self.holds(expected.known.centre_m))
                return Channel(scene.detections, self.holds, self._rate.value, bias_m=self._bias_m)
        return Channel(Detections.none(), self.holds, self._rate.value, is_open=False)

    def judge(self, boxes: Boxes) -> NDArray[np.int8]:
        """Say of standing boxes whether the picture has them (1), the background has (-1), or neither is clear (0)."""
        if self._image is None or len(boxes) == 0:
            return np.zeros(len(boxes), np.int8)
        is_in_view = self.holds(boxes.centre_m)
        verdicts = self._background.judge(self._image, self._surface.appearances(boxes).boxes)
        return np.where(is_in_view, verdicts, 0).astype(np.int8)

    def heal(self, ghosts: Boxes) -> None:
        """Learn the present picture where ghosts were."""
        if self._image is not None and len(ghosts) > 0:
            self._background.heal(self._image, self._surface.appearances(ghosts).boxes)

    def learn(self, claims: Boxes, is_real: BoolArray) -> None:
        """Let the background learn, but not where objects are."""
        if self._image is not None and self._foreground is not None:
            seen = self._surface.appearances(claims).boxes
            self._background.learn(self._image, self._foreground, seen, is_real)


class FusedCameraVision:
    """Frames of a colour camera in, objects tracked by colour and warmth out.

    Parameters
    ----------
    colour, thermal : where the cameras look.
    thermal_frames : of the thermal camera, on the time line of the colour one; frames may be missing.
    road_polygons_m : outlines of the road, (k, 2) each; what lies outside is not looked at.
    settings : constants; the defaults suit daylight traffic.
    lanes : of the road, if they are known; they help with vehicles that stand side by side.

    Raises
    ------
    VisionError
        If no road is in view of either camera, or the geometry is unusable.
    """

    def __init__(
        self,
        colour: FixedView,
        thermal: FixedView,
        thermal_frames: Iterable[Frame],
        road_polygons_m: Sequence[FloatArray],
        settings: VisionSettings | None = None,
        *,
        lanes: Sequence[LaneStrip] = (),
    ) -> None:
        self._settings = settings if settings is not None else VisionSettings()
        polygons_m = checked_polygons(road_polygons_m)
        self._colour = _Eye(colour, polygons_m, self._settings, lanes, bias_m=COLOUR_BIAS_M)
        self._thermal = _Eye(thermal, polygons_m, thermal_settings(self._settings), lanes, bias_m=THERMAL_BIAS_M)
        self._companion = Companion(thermal_frames)
        self._tracker = Tracker(self._settings, self._holds)
        self._held: list[tuple[RoadImage, RoadImage | None]] = []
        self._judged_us = 0

    def observe(self, frame: Frame) -> Iterable[VisionObjects]:
        """Take the next frame of the colour camera.

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
            If a frame has another size than announced.
        VideoBroken
            If the thermal video breaks.
        """
        image = self._colour.rectify(frame)
        beside = self._companion.at(frame.t_us)
        warmth = None if beside is None else self._thermal.rectify(beside)
        if self._colour.is_ready:
            return [self._follow(image, warmth)]
        self._held.append((image, warmth))
        if warmth is not None and not self._thermal.is_ready:
            self._thermal.hold(warmth)
        return self._catch_up() if self._colour.hold(image) else []

    def finish(self) -> Iterable[VisionObjects]:
        """End the video.

        Returns
        -------
        The objects of frames still held, if the video ended during start-up.
        """
        self._colour.start()
        return self._catch_up()

    def _catch_up(self) -> Iterable[VisionObjects]:
        self._thermal.start()
        held, self._held = self._held, []
        return starmap(self._follow, held)

    def _follow(self, image: RoadImage, warmth: RoadImage | None) -> VisionObjects:
        expected = self._tracker.predict(image.t_us)
        colour, thermal = self._colour.look(image, expected), self._thermal.look(warmth, expected)
        objects = self._tracker.update(fuse(colour, thermal))
        self._sort_out_ghosts(image.t_us)
        claims, is_real = self._tracker.claims()
        for eye in (self._colour, self._thermal):
            eye.learn(claims, is_real)
        return objects if colour.is_open or thermal.is_open else VisionObjects.lost(image.t_us)

    def _sort_out_ghosts(self, t_us: int) -> None:
        """Decide about tracks that stand: what either camera sees is a vehicle; else what is burned in is learned."""
        if t_us - self._judged_us < self._settings.background_period_us:
            return
        self._judged_us = t_us
        rows, boxes = self._tracker.standing(self._settings.standing_us)
        if len(rows) == 0:
            return
        verdicts = [eye.judge(boxes) for eye in (self._colour, self._thermal)]
        is_seen = (verdicts[0] > 0) | (verdicts[1] > 0)
        self._tracker.prove(rows[is_seen])
        for eye, verdict in zip((self._colour, self._thermal), verdicts, strict=True):
            eye.heal(boxes.select(np.flatnonzero(verdict < 0)))
        is_ghost = ~is_seen & ((verdicts[0] < 0) | (verdicts[1] < 0))
        if is_ghost.any():
            self._tracker.drop(rows[is_ghost])

    def _holds(self, points_m: FloatArray) -> BoolArray:
        return self._colour.holds(points_m) | self._thermal.holds(points_m)


def thermal_settings(settings: VisionSettings) -> VisionSettings:
    """Let coarser ground count than in colour.

    Examples
    --------
    >>> thermal_settings(VisionSettings()).max_metres_per_pixel
    1.5
    """
    coarse_m = max(settings.max_metres_per_pixel, THERMAL_METRES_PER_PIXEL)
    return replace(settings, max_metres_per_pixel=coarse_m)
