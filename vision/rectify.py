"""What is on the road, and only there? The road's cells are sampled from the decoder's planes, frame by frame.

Which image position belongs to which cell is worked out once; per frame, one fixed-point `cv2.remap` per plane and
strip fills the cells. Road is long and thin, so the raster is kept as a few rectangles ("strips") that hold road,
packed one after the other: time and memory follow the area of the road, and cell-wise work on a packed image is a
single call.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from vision.cover import Rectangle, cover
from vision.errors import VisionError
from vision.frames import ByteArray, Frame
from vision.grid import Grid

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]

# Cells out of view are never looked at; clipping keeps them inside OpenCV's 16 bits.
LOWEST_PX, HIGHEST_PX = -1.0, 32_000.0


@dataclass(frozen=True, slots=True)
class RoadImage:
    """The cells of the road at one instant.

    Attributes
    ----------
    index, t_us : of the frame.
    planes : (3, n) luma, chroma u, chroma v of the packed cells; some cells are not road, see `RoadRaster.road`.
    """

    index: int
    t_us: int
    planes: ByteArray


@dataclass(frozen=True, slots=True)
class _Strip:
    """One rectangle of the raster, its place in packed arrays, and the image positions of its cells."""

    area: Rectangle
    packed: slice
    luma_map: tuple[cv2.typing.MatLike, cv2.typing.MatLike]
    chroma_map: tuple[cv2.typing.MatLike, cv2.typing.MatLike]


class RoadRaster:
    """The cells that are road and in view of a fixed camera.

    A *packed* array holds the cells of all strips in one dimension.

    Parameters
    ----------
    grid : where the cells are.
    road : (rows, columns) True on cells that are road and in view; at least one.
    view_edge : (rows, columns) True on road cells next to road that is out of view.
    to_pixels : projects (..., 2) positions on the grid's plane to (..., 2) pixels.
    image_size_px : (width, height) of the frames.

    Attributes
    ----------
    grid, road, view_edge : as given.
    packed_size : number of packed cells.
    """

    def __init__(
        self,
        grid: Grid,
        *,
        road: BoolArray,
        view_edge: BoolArray,
        to_pixels: Callable[[FloatArray], FloatArray],
        image_size_px: tuple[int, int],
    ) -> None:
        if not road.any():
            raise VisionError("road raster: expected road in view, got none; is the homography for another frame?")
        self.grid = grid
        self.road = road
        self.view_edge = view_edge
        self._image_size_px = image_size_px
        self._strips: list[_Strip] = []
        start = 0
        for area in cover(road):
            packed = slice(start, start + area.size)
            pixels = to_pixels(grid.centres(area))
            # H.264 puts a chroma sample on the left luma column of its pair, half-way between the two rows.
            chroma = pixels / 2 - np.array([0.0, 0.25])
            self._strips.append(_Strip(area, packed, _fixed_point(pixels), _fixed_point(chroma)))
            start = packed.stop
        self.packed_size = start

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
        height, width = frame.luma.shape
        if (width, height) != self._image_size_px:
            raise VisionError(f"frame {frame.index}: expected {self._image_size_px!r} px, got {(width, height)!r}")
        planes = np.empty((3, self.packed_size), np.uint8)
        sources = (frame.luma, frame.chroma_u, frame.chroma_v)
        for strip in self._strips:
            maps = (strip.luma_map, strip.chroma_map, strip.chroma_map)
            for source, (coarse, fine), plane in zip(sources, maps, planes, strict=True):
                target = plane[strip.packed].reshape(coarse.shape[:2])
                cv2.remap(source, coarse, fine, cv2.INTER_LINEAR, dst=target, borderMode=cv2.BORDER_REPLICATE)
        return RoadImage(index=frame.index, t_us=frame.t_us, planes=planes)

    def pack(self, cells: NDArray[np.uint8]) -> ByteArray:
        """Keep the cells of the strips.

        Parameters
        ----------
        cells : (rows, columns).

        Returns
        -------
        (packed_size,).
        """
        packed = np.empty(self.packed_size, np.uint8)
        for strip in self._strips:
            packed[strip.packed] = cells[strip.area.slices].ravel()
        return packed

    def unpack(self, packed: NDArray[np.uint8]) -> ByteArray:
        """Put packed cells back to their places; 0 elsewhere.

        Parameters
        ----------
        packed : (packed_size,).

        Returns
        -------
        (rows, columns).
        """
        cells = np.zeros(self.grid.shape, np.uint8)
        for strip in self._strips:
            target = cells[strip.area.slices]
            target[...] = packed[strip.packed].reshape(target.shape)
        return cells


def _fixed_point(pixels: FloatArray) -> tuple[cv2.typing.MatLike, cv2.typing.MatLike]:
    clipped = np.clip(pixels, LOWEST_PX, HIGHEST_PX).astype(np.float32)
    return cv2.convertMaps(clipped[..., 0], clipped[..., 1], cv2.CV_16SC2)
