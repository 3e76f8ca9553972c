"""What is on the road, and only there? The road's cells are sampled from the decoder's planes, frame by frame.

Which image position belongs to which cell is worked out once; per frame, one fixed-point `cv2.remap` per plane and
strip fills the cells. Road is long and thin, so the raster is kept as a few rectangles ("strips") that hold road,
packed one after the other: time and memory follow the area of the road, and cell-wise work on a packed image is a
single call.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeVar

import cv2
import numpy as np
from numpy.typing import NDArray

from vision.errors import VisionError
from vision.objects import BoolArray, ByteArray, FloatArray, IntArray
from vision.road.cover import Rectangle, cover
from vision.road.grid import Grid
from vision.video.frames import Frame

Window = tuple[slice, slice]
NumberT = TypeVar("NumberT", bound=np.generic)

# Cells out of view are never looked at; clipping keeps them inside OpenCV's 16 bits.
LOWEST_PX, HIGHEST_PX = -1.0, 32_000.0


@dataclass(frozen=True, slots=True)
class RoadImage:
    """The cells of the road at one instant.

    Attributes
    ----------
    index, t_us : of the frame.
    planes : (3, n) luma, chroma u, chroma v of the packed cells; some cells are not road, see `RoadCells.road`.
    pixel_from_ground : (3, 3) of the frame, where the camera moves; else None.
    """

    index: int
    t_us: int
    planes: ByteArray
    pixel_from_ground: FloatArray | None = None


@dataclass(frozen=True, slots=True)
class RectifiedFrame(Frame):
    """A frame whose road has been sampled already."""

    road: RoadImage


@dataclass(frozen=True, slots=True)
class Strip:
    """One rectangle of the raster, and its place in packed arrays."""

    area: Rectangle
    packed: slice


class RoadCells:
    """The cells that are road and can be looked at.

    A *packed* array holds the cells of all strips in one dimension.

    Parameters
    ----------
    grid : where the cells are.
    road : (rows, columns) True on cells that are road and in view; at least one.
    view_edge : (rows, columns) True on road cells next to road that is out of view.
    ground : (rows, columns) the part of `road` on which vehicles stand; the rest is what they lean over. None for all.

    Attributes
    ----------
    grid, road, view_edge, ground : as given; where the camera moves, `road` and `view_edge` change from frame to frame.
    strips : rectangles that hold all of the road.
    packed_size : number of packed cells.
    """

    def __init__(self, grid: Grid, *, road: BoolArray, view_edge: BoolArray, ground: BoolArray | None = None) -> None:
        if not road.any():
            raise VisionError("road raster: expected road in view, got none; is the homography for another frame?")
        self.grid = grid
        self.road = road
        self.view_edge = view_edge
        self._ground = ground
        self.strips: list[Strip] = []
        start = 0
        for area in cover(road):
            self.strips.append(Strip(area, slice(start, start + area.size)))
            start += area.size
        self.packed_size = start

    @property
    def ground(self) -> BoolArray:
        """The cells on which vehicles stand."""
        return self.road if self._ground is None else self._ground

    def pack(self, cells: NDArray[NumberT]) -> NDArray[NumberT]:
        """Keep the cells of the strips.

        Parameters
        ----------
        cells : (rows, columns).

        Returns
        -------
        (packed_size,).
        """
        packed = np.empty(self.packed_size, cells.dtype)
        for strip in self.strips:
            packed[strip.packed] = cells[strip.area.slices].ravel()
        return packed

    def unpack(self, packed: NDArray[NumberT]) -> NDArray[NumberT]:
        """Put packed cells back to their places; 0 elsewhere.

        Parameters
        ----------
        packed : (packed_size,).

        Returns
        -------
        (rows, columns).
        """
        return self.window(packed, self.whole)

    @property
    def whole(self) -> Window:
        """The window of all cells."""
        rows, columns = self.grid.shape
        return slice(0, rows), slice(0, columns)

    def window(self, packed: NDArray[NumberT], window: Window) -> NDArray[NumberT]:
        """Put some of the packed cells back to their places; 0 where there are none.

        Parameters
        ----------
        packed : (..., packed_size).
        window : rows and columns of the raster, with both ends.

        Returns
        -------
        (..., rows, columns) of the window.
        """
        rows, columns = window
        cells = np.zeros((*packed.shape[:-1], rows.stop - rows.start, columns.stop - columns.start), packed.dtype)
        for strip in self.strips:
            area = strip.area
            top, bottom = max(area.top, rows.start), min(area.bottom, rows.stop)
            left, right = max(area.left, columns.start), min(area.right, columns.stop)
            if top < bottom and left < right:
                block = packed[..., strip.packed].reshape(*packed.shape[:-1], -1, area.right - area.left)
                part = block[..., top - area.top : bottom - area.top, left - area.left : right - area.left]
                top, left = top - rows.start, left - columns.start
                cells[..., top : top + part.shape[-2], left : left + part.shape[-1]] = part
        return cells

    def places(self, points: FloatArray) -> IntArray:
        """Find cells in packed arrays.

        Parameters
        ----------
        points : (n, 2) positions on the plane, in road cells.

        Returns
        -------
        (n,) places of the nearest cells.
        """
        column, row = np.rint(self.grid.to_cells(points)).astype(np.intp).T
        places = np.zeros(len(points), np.intp)
        for strip in self.strips:
            area = strip.area
            is_here = (row >= area.top) & (row < area.bottom) & (column >= area.left) & (column < area.right)
            inside = (row - area.top) * (area.right - area.left) + column - area.left
            places[is_here] = strip.packed.start + inside[is_here]
        return places


class RoadRaster(RoadCells):
    """The road's cells as a fixed camera sees them.

    Parameters
    ----------
    grid, road, view_edge, ground : see `RoadCells`.
    to_pixels : projects (..., 2) positions on the grid's plane to (..., 2) pixels.
    image_size_px : (width, height) of the frames.
    """

    def __init__(
        self,
        grid: Grid,
        *,
        road: BoolArray,
        view_edge: BoolArray,
        to_pixels: Callable[[FloatArray], FloatArray],
        image_size_px: tuple[int, int],
        ground: BoolArray | None = None,
    ) -> None:
        super().__init__(grid, road=road, view_edge=view_edge, ground=ground)
        self._image_size_px = image_size_px
        pixels = [to_pixels(grid.centres(strip.area)) for strip in self.strips]
        # The image positions of the cells of each strip, in the luma plane and in those of chroma.
        self._maps = [(_fixed_point(places), _fixed_point(chroma_places(places))) for places in pixels]

    def rectify(self, frame: Frame) -> RoadImage:
        """Sample the road's cells.

        Parameters
        ----------
        frame : a picture of the size given at construction.

        Returns
        -------
        The road's planes, bilinear between pixels.

        Raises
        ------
        VisionError
            If the frame has another size.
        """
        check_size(frame, self._image_size_px)
        planes = np.empty((3, self.packed_size), np.uint8)
        sources = (frame.luma, frame.chroma_u, frame.chroma_v)
        for strip, (luma_map, chroma_map) in zip(self.strips, self._maps, strict=True):
            maps = (luma_map, chroma_map, chroma_map)
            for source, (coarse, fine), plane in zip(sources, maps, planes, strict=True):
                target = plane[strip.packed].reshape(coarse.shape[:2])
                cv2.remap(source, coarse, fine, cv2.INTER_LINEAR, dst=target, borderMode=cv2.BORDER_REPLICATE)
        return RoadImage(index=frame.index, t_us=frame.t_us, planes=planes)


def check_size(frame: Frame, image_size_px: tuple[int, int]) -> None:
    """Refuse a frame of another size than announced.

    Raises
    ------
    VisionError
        If it has.
    """
    height, width = frame.luma.shape
    if (width, height) != image_size_px:
        raise VisionError(f"frame {frame.index}: expected {image_size_px!r} px, got {(width, height)!r}")


def chroma_places(pixels: FloatArray) -> FloatArray:
    """Convert positions in the luma plane to those in the chroma planes.

    H.264 puts a chroma sample on the left luma column of its pair, half-way between the two rows.
    """
    return np.asarray(pixels / 2 - np.array([0.0, 0.25]))


def _fixed_point(pixels: FloatArray) -> tuple[cv2.typing.MatLike, cv2.typing.MatLike]:
    clipped = np.clip(pixels, LOWEST_PX, HIGHEST_PX).astype(np.float32)
    return cv2.convertMaps(clipped[..., 0], clipped[..., 1], cv2.CV_16SC2)
