"""Which vehicles does a fixed camera see, where, and how fast? The whole of vision for one camera that stands still.

Frames are rectified to a raster of the road, compared with a background that is learned on the way, and cut into
boxes which a tracker joins over time. What the tracker knows flows back: its predictions divide merged blobs, its
objects keep the background from learning them.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import NDArray

from vision.background.background import Background
from vision.detection.ground_surface import GroundSurface
from vision.detection.image_surface import ImageSurface
from vision.detection.lanes import LaneField, LaneStrip, borders_of
from vision.detection.surface import FixedSurface, checked_polygons
from vision.objects import VisionObjects
from vision.road.rectify import RectifiedFrame
from vision.road.view import GroundView
from vision.road_watch import RoadWatch
from vision.settings import VisionSettings
from vision.video.frames import Frame

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
    lanes : of the road, if they are known; they help with vehicles that stand side by side.

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
        *,
        lanes: Sequence[LaneStrip] = (),
    ) -> None:
        self._settings = settings if settings is not None else VisionSettings()
        self._surface = surface_of(pixel_from_ground, checked_polygons(road_polygons_m), image_size_px, self._settings)
        self._background = background_of(self._surface, self._settings, lanes)
        field = lane_field_of(self._surface, lanes)
        self._watch = RoadWatch(self._surface, self._background, self._settings, field)

    def prepare(self, frame: Frame) -> Frame:
        """Do the part of `observe` that depends on nothing but the frame; any thread may.

        Parameters
        ----------
        frame : of the video, in whatever order.

        Returns
        -------
        The frame with its road, for `observe`.

        Raises
        ------
        VisionError
            If the frame has another size than announced.
        """
        road = self._surface.raster.rectify(frame)
        return RectifiedFrame(frame.index, frame.t_us, frame.luma, frame.chroma_u, frame.chroma_v, road)

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
        image = frame.road if isinstance(frame, RectifiedFrame) else self._surface.raster.rectify(frame)
        if self._background.is_ready:
            return [self._watch.follow(image)]
        return map(self._watch.follow, self._background.hold(image))

    def finish(self) -> Iterable[VisionObjects]:
        """End the video.

        Returns
        -------
        The objects of frames still held, if the video ended during start-up.
        """
        if self._background.is_ready:
            return []
        return map(self._watch.follow, self._background.start())


def surface_of(
    pixel_from_ground: FloatArray,
    polygons_m: list[FloatArray],
    image_size_px: tuple[int, int],
    settings: VisionSettings,
) -> FixedSurface:
    """Choose the plane of detection: the image, where height would smear a car over more than its own length.

    Parameters
    ----------
    pixel_from_ground, polygons_m, image_size_px, settings : as of `FixedCameraVision`.

    Raises
    ------
    VisionError
        If no road is in view, or the geometry is unusable.
    """
    view = GroundView(pixel_from_ground, image_size_px, max_metres_per_pixel=settings.max_metres_per_pixel)
    corners = np.concatenate(polygons_m)
    corners = corners[view.sees(corners)]
    if len(corners) == 0:
        corners = np.stack(view.extent()).mean(axis=0)[None]
    smear_m = view.sight(corners).smear_m(settings.usual_height_m)
    if np.median(smear_m) > settings.usual_length_m:
        return ImageSurface(view, polygons_m, image_size_px=image_size_px, settings=settings)
    return GroundSurface(view, polygons_m, image_size_px=image_size_px, settings=settings)


def background_of(surface: FixedSurface, settings: VisionSettings, lanes: Sequence[LaneStrip] = ()) -> Background:
    """Make the background of a fixed camera's surface."""
    car_cells = settings.car_width_m / surface.metres_per_cell
    # Only on a map do vehicles keep their size, and keep apart.
    is_map = surface.raster.grid.is_north_up
    borders = borders_of(lanes, surface.raster.grid) if is_map else None
    return Background(surface.raster, settings, car_cells=car_cells, finds_standing=is_map, borders=borders)


def lane_field_of(surface: FixedSurface, lanes: Sequence[LaneStrip]) -> LaneField | None:
    """Lay the lanes on a fixed camera's surface; None if there are none."""
    if not lanes:
        return None
    if isinstance(surface, ImageSurface):
        return surface.lane_field(lanes)
    return LaneField(surface.raster.grid, lanes)
