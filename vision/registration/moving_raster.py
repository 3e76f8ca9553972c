"""What is on the road, seen by a camera that moves? The same cells of ground in every frame, wherever the camera looks.

The cells lie on the ground and stay there; what changes is where they are in the picture, which of them are in view,
and of which the background is known. Per frame one perspective warp a plane and strip samples the cells in view.
"""

from collections.abc import Sequence

import cv2
import numpy as np

from vision.background.background import Background
from vision.detection.detector import Expected
from vision.detection.eye import RoadEye
from vision.detection.fusion import Channel
from vision.detection.surfaces.ground_surface import MapSurface, cell_size, painted_road
from vision.errors import VisionError
from vision.objects import BoolArray, FloatArray
from vision.registration.plane_fit import transform
from vision.road.grid import Grid
from vision.road.parallax import Parallax
from vision.road.rectify import RoadCells, RoadImage, check_size
from vision.road.view import GroundView
from vision.settings import VisionSettings
from vision.video.frames import Frame

CORNERS = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
CHROMA_FROM_LUMA = np.array([[0.5, 0.0, 0.0], [0.0, 0.5, -0.25], [0.0, 0.0, 1.0]])  # see `rectify.chroma_places`


class MovingRaster(RoadCells):
    """The road's cells as a moving camera sees them; `road` and `view_edge` are those of the frame last looked at.

    Parameters
    ----------
    grid : of ground, north up.
    road : (rows, columns) cells that are road, in view or not.
    image_size_px : (width, height) of the frames.
    settings : how near to the border, and how coarsely, ground may be seen.

    Attributes
    ----------
    is_seen : (packed_size,) which cells are in view.
    """

    def __init__(
        self, grid: Grid, *, road: BoolArray, image_size_px: tuple[int, int], settings: VisionSettings
    ) -> None:
        super().__init__(grid, road=road, view_edge=np.zeros_like(road))
        self.is_seen = np.ones(self.packed_size, np.bool_)
        self._image_size_px = image_size_px
        self._max_metres_per_pixel = settings.max_metres_per_pixel
        self._border_px, self._edge_cells = settings.registration.border_px, settings.road.edge_cells
        self._known, self._known_edge = road, np.zeros_like(road)
        self._seen, self._inner = road, road
        columns, rows = grid.side, -grid.side
        self._ground_from_cell = np.array([[columns, 0.0, grid.first[0]], [0.0, rows, grid.first[1]], [0.0, 0.0, 1.0]])

    def rectify(self, frame: Frame, pixel_from_ground: FloatArray) -> RoadImage:
        """Sample the cells in view.

        Parameters
        ----------
        frame : a picture of the size given at construction.
        pixel_from_ground : (3, 3) of the frame.

        Returns
        -------
        The road's planes, bilinear between pixels; cells out of view have no meaning.

        Raises
        ------
        VisionError
            If the frame has another size.
        """
        check_size(frame, self._image_size_px)
        planes = np.zeros((3, self.packed_size), np.uint8)
        outline = self.grid.to_cells(self._outline(pixel_from_ground, self._border_px))
        low, high = outline.min(axis=0), outline.max(axis=0)
        luma_from_cell = pixel_from_ground @ self._ground_from_cell
        matrices = (luma_from_cell, *[CHROMA_FROM_LUMA @ luma_from_cell] * 2)
        for strip in self.strips:
            area = strip.area
            # A cell more on either side: cells are seen by their area, and `low` and `high` count centres.
            left, right = max(area.left, int(low[0]) - 1), min(area.right, int(high[0]) + 3)
            top, bottom = max(area.top, int(low[1]) - 1), min(area.bottom, int(high[1]) + 3)
            if left >= right or top >= bottom:
                continue
            corner = np.array([[1.0, 0.0, left], [0.0, 1.0, top], [0.0, 0.0, 1.0]])
            window = slice(top - area.top, bottom - area.top), slice(left - area.left, right - area.left)
            sources = (frame.luma, frame.chroma_u, frame.chroma_v)
            for source, matrix, plane in zip(sources, matrices, planes, strict=True):
                cells = plane[strip.packed].reshape(area.bottom - area.top, area.right - area.left)
                cells[window] = cv2.warpPerspective(
                    source,
                    matrix @ corner,
                    (right - left, bottom - top),
                    flags=cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP,
                    borderMode=cv2.BORDER_REPLICATE,
                )
        return RoadImage(frame.index, frame.t_us, planes, pixel_from_ground)

    def look(self, pixel_from_ground: FloatArray) -> None:
        """Find the cells that a frame shows.

        Parameters
        ----------
        pixel_from_ground : (3, 3) of the frame.
        """
        outline = self._outline(pixel_from_ground, self._border_px)
        self._seen = self.grid.paint([outline]) > 0
        middle_m = outline.mean(axis=0)
        depth = float(pixel_from_ground[2] @ [*middle_m, 1.0])
        cell_px = self.grid.side * np.sqrt(abs(np.linalg.det(pixel_from_ground)) / depth**3)
        inner_px = self._border_px + self._edge_cells * cell_px
        self._inner = self.grid.paint([self._outline(pixel_from_ground, inner_px)]) > 0
        self.is_seen = self.pack(self._seen)
        self._combine()

    def set_known(self, is_known: BoolArray) -> None:
        """Say of which cells the background is known; the others are no part of the road for now.

        Parameters
        ----------
        is_known : (packed_size,).
        """
        self._known = self.unpack(is_known)
        band = np.ones((2 * self._edge_cells + 1, 2 * self._edge_cells + 1), np.uint8)
        road = self.unpack(np.ones_like(is_known))
        self._known_edge = cv2.dilate((road & ~self._known).astype(np.uint8), band) > 0
        self._combine()

    def _combine(self) -> None:
        self.road = self._seen & self._known
        self.view_edge = self.road & (self._known_edge | ~self._inner)

    def _outline(self, pixel_from_ground: FloatArray, border_px: float) -> FloatArray:
        """Outline the ground that is seen finely enough, (k, 2); no ground gives a point."""
        width, height = self._image_size_px
        left, top, right, bottom = border_px, border_px, width - 1 - border_px, height - 1 - border_px
        corners = np.array([[left, top, 1.0], [left, bottom, 1.0], [right, bottom, 1.0], [right, top, 1.0]])
        scale = 1.0 / np.sqrt(abs(np.linalg.det(pixel_from_ground)))
        # Metres per pixel are depth ** 1.5 * scale, and the third coordinate of the inverse map is 1 / depth.
        deepest = (self._max_metres_per_pixel / scale) ** (2 / 3)
        mapped = corners @ np.linalg.inv(pixel_from_ground).T
        mapped = _above(mapped, 1.0 / deepest)
        if len(mapped) == 0:
            return np.zeros((1, 2))
        return np.asarray(mapped[:, :2] / mapped[:, 2:])


class MovingGroundSurface(MapSurface):
    """The ground as the plane of detection of a moving camera; see `surface.Surface`.

    Parameters
    ----------
    pixel_from_ground : (3, 3) of the first frame.
    polygons_m : outlines of the road.
    image_size_px : (width, height).
    reach_m : how far beyond the first frame's view the camera may look.
    settings : cell size, margins, noise.

    Raises
    ------
    VisionError
        If no road is in reach.
    """

    raster: MovingRaster

    def __init__(
        self,
        pixel_from_ground: FloatArray,
        polygons_m: Sequence[FloatArray],
        *,
        image_size_px: tuple[int, int],
        reach_m: float,
        settings: VisionSettings,
    ) -> None:
        self._settings = settings
        self._image_size_px = image_size_px
        view = self._view(pixel_from_ground)
        low, high = view.extent()
        corners = np.concatenate(list(polygons_m))
        low = np.maximum(low - reach_m, corners.min(axis=0) - settings.road_margin_m)
        high = np.minimum(high + reach_m, corners.max(axis=0) + settings.road_margin_m)
        if np.any(high <= low):
            raise VisionError(f"road raster: expected road within {reach_m!r} m of the first view, got none")
        grid = Grid.between(low, high, side=cell_size(view, polygons_m, settings), is_north_up=True)
        raster = MovingRaster(
            grid,
            road=painted_road(grid, polygons_m, margin_m=settings.road_margin_m),
            image_size_px=image_size_px,
            settings=settings,
        )
        super().__init__(raster, Parallax(view, settings), settings)
        self._smeared_by = pixel_from_ground
        self._corners_m = self._view(pixel_from_ground).to_ground(CORNERS * np.array(image_size_px))[0]

    def look(self, pixel_from_ground: FloatArray) -> None:
        """Turn to the view of a frame.

        Parameters
        ----------
        pixel_from_ground : (3, 3) of the frame.
        """
        self.raster.look(pixel_from_ground)
        moved_px = transform(pixel_from_ground, self._corners_m) - transform(self._smeared_by, self._corners_m)
        if np.abs(moved_px).max() < self._settings.registration.smear_shift * max(self._image_size_px):
            return
        self._smeared_by = pixel_from_ground
        self._parallax = Parallax(self._view(pixel_from_ground), self._settings)

    def _view(self, pixel_from_ground: FloatArray) -> GroundView:
        return GroundView(pixel_from_ground, self._image_size_px, self._settings)


class MovingEye(RoadEye):
    """An eye that moves over the ground.

    Parameters
    ----------
    surface : of the ground in reach.
    background : of its raster.
    settings : constants.
    """

    def __init__(self, surface: MovingGroundSurface, background: Background, settings: VisionSettings) -> None:
        super().__init__(surface, background, settings)
        self._ground = surface

    def take(self, frame: Frame, pixel_from_ground: FloatArray | None) -> RoadImage:
        """Sample the cells in view."""
        assert pixel_from_ground is not None, "an eye that moves needs the map of each frame"
        return self._ground.raster.rectify(frame, pixel_from_ground)

    def look(self, image: RoadImage | None, expected: Expected) -> Channel:
        """Turn to the view of a frame, and detect."""
        if image is not None:
            assert image.pixel_from_ground is not None
            self._ground.look(image.pixel_from_ground)
        return super().look(image, expected)


def _above(ring: FloatArray, least: float) -> FloatArray:
    """Keep the part of a ring of homogeneous points whose third coordinate is at least so large."""
    height = ring[:, 2] - least
    if (height >= 0).all():
        return ring
    kept = []
    for here, after in zip(range(len(ring)), [*range(1, len(ring)), 0], strict=True):
        if height[here] >= 0:
            kept.append(ring[here])
        if (height[here] >= 0) != (height[after] >= 0):
            share = height[here] / (height[here] - height[after])
            kept.append(ring[here] + share * (ring[after] - ring[here]))
    return np.array(kept).reshape(-1, 3)
