"""What does one eye of a camera see? A plane of detection, a background and a motion detector over one road.

An eye takes what it needs of an instant, says what it detects there, and tells standing vehicles from ghosts. Its
background is frozen under what the tracker knows. A camera (`vision/camera.py`) has one eye or two.
"""

from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import Any, Generic, TypeVar

import numpy as np

from vision.background.background import Background
from vision.detection.detector import Detections, Expected, MotionDetector
from vision.detection.fusion import Channel
from vision.detection.parting.lanes import LaneField, LaneStrip, borders_of
from vision.detection.surfaces.ground_surface import GroundSurface
from vision.detection.surfaces.image_surface import ImageSurface
from vision.detection.surfaces.surface import FixedSurface, Surface
from vision.objects import BoolArray, ByteArray, FloatArray, VerdictArray
from vision.road.boxes import Boxes
from vision.road.rectify import RectifiedFrame, RoadImage
from vision.road.view import GroundView, Lens
from vision.settings import VisionSettings
from vision.video.frame import Companion, Frame

InstantT = TypeVar("InstantT")


class Eye(ABC, Generic[InstantT]):
    """Anything that detects vehicles in instants of a source: frames, or moments of a file.

    Its pictures are its own affair: what `take` gives is what `hold` and `look` get. An eye without a background needs
    no start-up, and nothing of what it sees is a ghost.
    """

    @property
    def is_ready(self) -> bool:
        """Whether it knows the road; until then pictures are held."""
        return True

    @property
    def is_sure(self) -> bool:
        """Whether all that it sees is a vehicle, what stands too: there is no background that may be wrong."""
        return False

    def prepare(self, instant: InstantT) -> InstantT:
        """Do the part of `take` that depends on nothing but the instant; any thread may."""
        return instant

    @abstractmethod
    def take(self, instant: InstantT, pixel_from_ground: FloatArray | None) -> Any | None:  # Any: its own pictures
        """Take what it needs of an instant; None if there is nothing. The (3, 3) map is that of a moving camera."""

    def hold(self, picture: Any) -> None:  # Any: see `take`
        """Take in a picture of the start-up."""

    def start(self) -> None:
        """End the start-up with what there is."""

    @abstractmethod
    def holds(self, points_m: FloatArray) -> BoolArray:
        """Tell which ground positions, (n, 2), are road in view."""

    @abstractmethod
    def look(self, picture: Any | None, expected: Expected) -> Channel:  # Any: see `take`
        """Detect; the channel is closed where there is no picture, or one that shows something else than the road."""

    def judge(self, boxes: Boxes) -> VerdictArray:
        """Say of standing boxes whether the picture has them (1), the background has (-1), or neither is clear (0)."""
        return np.ones(len(boxes), np.int8)

    def heal(self, ghosts: Boxes) -> None:
        """Learn the present picture where ghosts are."""

    def learn(self, claims: Boxes, is_real: BoolArray) -> None:
        """Learn the present picture, but not under objects."""


class RoadEye(Eye[Frame]):
    """An eye with a background; `FixedEye` and `registration.moving_raster.MovingEye` say how pictures are taken.

    Parameters
    ----------
    surface : the plane of detection.
    background : of its raster.
    settings : constants.
    lanes : on the surface's raster, if they are known.
    bias_m : how far its boxes lie beside vehicles; see `fusion.Channel`.
    """

    def __init__(
        self,
        surface: Surface,
        background: Background,
        settings: VisionSettings,
        lanes: LaneField | None = None,
        *,
        bias_m: float = 0.0,
    ) -> None:
        self._surface = surface
        self._background = background
        self._detector = MotionDetector(surface, background, settings, lanes)
        self._bias_m = bias_m
        self._image: RoadImage | None = None
        self._foreground: ByteArray | None = None

    @property
    def is_ready(self) -> bool:
        """Whether there is a background."""
        return self._background.is_ready

    def hold(self, image: RoadImage, covered: Boxes | None = None) -> None:
        """Take in a frame of the start-up, and where vehicles cover the plane in it, if that is known."""
        if not self.is_ready:
            self._background.hold(image, covered)

    def appearances(self, footprints: Boxes) -> Boxes:
        """Predict where boxes on the ground are seen on the plane."""
        return self._surface.appearances(footprints).boxes

    def start(self) -> None:
        """End the start-up with what there is."""
        if not self.is_ready:
            self._background.start()

    def holds(self, points_m: FloatArray) -> BoolArray:
        """Tell which ground positions are road in view."""
        return self._surface.holds(points_m)

    def look(self, image: RoadImage | None, expected: Expected) -> Channel:
        """Detect in a frame; without a background yet, hold it."""
        self._image, self._foreground = None, None
        if image is not None and not self.is_ready:
            self._background.hold(image)
        elif image is not None:
            self._image = image
            detections, self._foreground = self._detector.detect(image, expected)
            if not self._background.is_overwhelmed:
                return Channel(detections, self.holds, bias_m=self._bias_m)
        return Channel(Detections.none(), self.holds, is_open=False)

    def judge(self, boxes: Boxes) -> VerdictArray:
        """Judge by the outlines in picture and background; undecided without a picture."""
        if self._image is None:
            return np.zeros(len(boxes), np.int8)
        return self._background.judge(self._image, self._surface.appearances(boxes).boxes)

    def heal(self, ghosts: Boxes) -> None:
        """Learn the present picture where ghosts are."""
        if self._image is not None and len(ghosts) > 0:
            self._background.heal(self._image, self._surface.appearances(ghosts).boxes)

    def learn(self, claims: Boxes, is_real: BoolArray) -> None:
        """Learn the present picture, but not under objects."""
        if self._image is not None and self._foreground is not None and self._background.is_due(self._image.t_us):
            seen = self._surface.appearances(claims).boxes
            self._background.learn(self._image, self._foreground, seen, is_real)


class FixedEye(RoadEye):
    """An eye that stands still.

    Parameters
    ----------
    pixel_from_ground : (3, 3) homography from ground metres (x east, y north) to pixels.
    polygons_m : outlines of the road.
    image_size_px : (width, height) of the frames.
    settings : constants.
    lanes : of the road, may be none.
    companion : a video of its own, looked at beside the camera's frames; None to look at these.
    bias_m : as of `RoadEye`.
    lens : bends the picture of the homography; None for a straight one.

    Raises
    ------
    VisionError
        If no road is in view, or the geometry is unusable.
    """

    def __init__(
        self,
        pixel_from_ground: FloatArray,
        polygons_m: list[FloatArray],
        image_size_px: tuple[int, int],
        settings: VisionSettings,
        lanes: Sequence[LaneStrip],
        *,
        companion: Companion | None = None,
        bias_m: float = 0.0,
        lens: Lens | None = None,
    ) -> None:
        view = GroundView(pixel_from_ground, image_size_px, settings, lens)
        surface = _choose_surface(view, polygons_m, image_size_px, settings)
        grid = surface.raster.grid
        # Only on a map do vehicles keep their size, and keep apart.
        is_map = grid.is_north_up
        background = Background(
            surface.raster,
            settings,
            car_cells=settings.car_width_m / surface.metres_per_cell,
            finds_standing=is_map,
            borders=borders_of(lanes, grid, settings.detection) if is_map else None,
        )
        super().__init__(surface, background, settings, surface.lane_field(lanes) if lanes else None, bias_m=bias_m)
        self._raster = surface.raster
        self._companion = companion

    def prepare(self, frame: Frame) -> Frame:
        """Sample the road of a frame."""
        if self._companion is not None:
            return frame
        road = self._raster.rectify(frame)
        return RectifiedFrame(frame.index, frame.t_us, frame.luma, frame.chroma_u, frame.chroma_v, road)

    def take(self, frame: Frame, pixel_from_ground: FloatArray | None) -> RoadImage | None:
        """Sample the road of a frame, or of the one beside it; None if there is none."""
        del pixel_from_ground
        seen = frame if self._companion is None else self._companion.at(frame.t_us)
        if isinstance(seen, RectifiedFrame):
            return seen.road
        return None if seen is None else self._raster.rectify(seen)


def _choose_surface(
    view: GroundView,
    polygons_m: list[FloatArray],
    image_size_px: tuple[int, int],
    settings: VisionSettings,
) -> FixedSurface:
    surface = ImageSurface if is_slanting(view, polygons_m, settings) else GroundSurface
    return surface(view, polygons_m, image_size_px=image_size_px, settings=settings)


def is_slanting(view: GroundView, polygons_m: Sequence[FloatArray], settings: VisionSettings) -> bool:
    """Tell whether height would smear a car over more than its own length: the plane of detection is then the image."""
    corners = np.concatenate([*polygons_m, np.empty((0, 2))])
    corners = corners[view.sees(corners)]
    if len(corners) == 0:
        corners = np.stack(view.extent()).mean(axis=0)[None]
    smear_m = view.sight(corners).smear_m(settings.usual_height_m)
    return bool(np.median(smear_m) > settings.usual_length_m)
