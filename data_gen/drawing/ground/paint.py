"""How are shapes and textures put onto an image? Anti-aliased coverage of ground polygons, and fractal noise.

Everything here runs once a scene, not once a frame, and works in float32, in the rectangle that a shape needs.
"""

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TypeVar

import cv2
import numpy as np
import shapely
from shapely import affinity

from data_gen.simulation.states import FloatArray, Picture
from gis.cameras.camera import GroundCamera

Colour = tuple[float, float, float]
"""Blue, green, red in 0 to 255."""

_Shape = TypeVar("_Shape", bound=shapely.Geometry)

_SUPERSAMPLING = 4
_SHIFT_BITS = 4
_CLIP_MARGIN_M = 50.0
_CLIP_MARGIN_PX = 300.0
_NEXT_TO_HORIZON_PX = 1.0
_TILE = 256
"""Blotches after which noise on the ground repeats."""
_GAIN = 0.6
"""Strength of each octave of noise relative to the one before."""
_GRID_M = 0.001


@dataclass(frozen=True, slots=True, eq=False)
class Patch:
    """The part of an image that a shape covers."""

    window: tuple[slice, slice]
    """Rows and columns."""
    cover: Picture
    """Part of each pixel that is covered, 0 to 1, of the window's size."""


class GroundPainter:
    """Paints ground shapes onto the image of one camera.

    Parameters
    ----------
    camera : maps ground to pixels.
    size_px : width and height of the image.
    """

    def __init__(self, camera: GroundCamera, size_px: tuple[int, int]) -> None:
        self.camera = camera
        self.size_px = size_px
        self.view = shapely.Polygon(camera.view_outline(*size_px))
        self._clip = self.view.buffer(_CLIP_MARGIN_M)
        self.is_low = not np.isfinite(camera.to_pixels(np.asarray(self._clip.exterior.coords))).all()
        """Whether some of the ground about the view lies behind the camera."""
        if self.is_low:
            self._clip = _ground_ahead(camera, size_px)
        centre_m = np.array([[self.view.centroid.x, self.view.centroid.y]])
        self.metres_per_pixel = float(camera.metres_per_pixel(centre_m)[0])

    def coverage(self, shapes: Iterable[shapely.Geometry]) -> Picture:
        """Measure which part of each pixel a set of shapes covers.

        Parameters
        ----------
        shapes : polygons in the local ground frame; those out of view are skipped, holes are kept.

        Returns
        -------
        (h, w) from 0 to 1; where shapes overlap they count once.
        """
        return coverage_of(self.patches(shapes), self.size_px)

    def patches(self, shapes: Iterable[shapely.Geometry]) -> Iterator[Patch]:
        """Give the covered parts of the image.

        Parameters
        ----------
        shapes : as for `coverage`; they are united first.

        Yields
        ------
        One patch for each connected area.
        """
        # On a grid: without one GEOS was seen to lose a piece whose border nearly met its neighbour's.
        area = shapely.intersection(shapely.union_all(list(shapes), grid_size=_GRID_M), self._clip, grid_size=_GRID_M)
        for part in shapely.get_parts(area):
            if isinstance(part, shapely.Polygon) and not part.is_empty:
                rings_px = [self.camera.to_pixels(np.asarray(ring.coords)) for ring in (part.exterior, *part.interiors)]
                patch = cover_of(rings_px, self.size_px)
                if patch is not None:
                    yield patch

    def lay(
        self,
        picture: Picture,
        shapes: Iterable[shapely.Geometry],
        colour: Picture | Colour,
        strength: float | Picture = 1.0,
    ) -> None:
        """Paint shapes in one colour, or with a texture.

        Parameters
        ----------
        picture : (h, w, 3), changed.
        shapes : as for `coverage`.
        colour : one colour or (h, w, 3).
        strength : opacity, 0 to 1; one for all or (h, w).
        """
        for patch in self.patches(shapes):
            here = colour[patch.window] if isinstance(colour, np.ndarray) else colour
            opacity = strength[patch.window] if isinstance(strength, np.ndarray) else np.float32(strength)
            lay_over(picture[patch.window], patch.cover * opacity, here)

    def texture(self, rng: np.random.Generator, *, largest_m: float, octaves: int) -> Picture:
        """Draw noise whose largest blotches measure so much in the middle of the view; see `fractal_noise`."""
        if self.is_low and largest_m > 0:
            return self._noise_on_ground(rng, largest_m=largest_m, octaves=octaves)
        return fractal_noise(rng, self.size_px, largest_px=largest_m / self.metres_per_pixel, octaves=octaves)

    def _noise_on_ground(self, rng: np.random.Generator, *, largest_m: float, octaves: int) -> Picture:
        """Draw noise that lies on the ground; of octaves finer than the pixels of a row nothing is left there."""
        ground_m, apart_m = self._grid_m
        total = np.zeros(ground_m.shape[:2], dtype=np.float32)
        power = 0.0
        for octave in range(octaves):
            blotch_m, gain = largest_m / 2**octave, 0.6**octave
            cells = ground_m % np.float32(_TILE * blotch_m) / np.float32(blotch_m)
            tile = rng.standard_normal((_TILE, _TILE), dtype=np.float32)
            wave = cv2.remap(tile, cells[:, :, 0], cells[:, :, 1], cv2.INTER_LINEAR, borderMode=cv2.BORDER_WRAP)
            fade = np.clip(1.2 * blotch_m / apart_m - 0.2, 0, 1)
            total += (gain * fade).astype(np.float32)[:, None] * wave
            power += gain**2
        return np.asarray(total / np.float32(0.7 * math.sqrt(power)), dtype=np.float32)

    @cached_property
    def _grid_m(self) -> tuple[Picture, FloatArray]:
        """Ground under each pixel, (h, w, 2), 0 where there is none, and how far apart rows are there, (h,)."""
        width_px, height_px = self.size_px
        rows = np.arange(height_px)
        east, north, depth = (
            row[0] * np.arange(width_px)[None, :] + (row[1] * rows + row[2])[:, None]
            for row in self.camera.ground_from_pixel
        )
        ground_m = np.stack((east, north), axis=2) / np.where(depth > 0, depth, np.inf)[:, :, None]
        middle_m = ground_at(self.camera, np.array([width_px / 2]), rows.astype(np.float64))[:, 0]
        apart_m = np.hypot(*np.gradient(middle_m, axis=0).T)
        return ground_m.astype(np.float32), np.nan_to_num(apart_m, nan=np.inf)


def _ground_ahead(camera: GroundCamera, size_px: tuple[int, int]) -> shapely.Polygon:
    """Outline the ground in a somewhat larger image, from its lower border to next to the horizon."""
    width_px, height_px = size_px
    x_px, slope_x, slope_y = (width_px - 1) / 2, *camera.ground_from_pixel[2, :2]
    assert abs(slope_x) < 1e-6 * abs(slope_y)  # no roll: the horizon is a row
    horizon_px = -camera.ground_from_pixel[2, 2] / slope_y
    top_px = max(-_CLIP_MARGIN_PX, horizon_px + _NEXT_TO_HORIZON_PX)
    bottom_px, side_px = height_px + _CLIP_MARGIN_PX, width_px / 2 + _CLIP_MARGIN_PX
    border_px = [(x_px - side_px, top_px), (x_px - side_px, bottom_px), (x_px + side_px, bottom_px)]
    return shapely.Polygon(camera.to_ground(np.array([*border_px, (x_px + side_px, top_px)])))


def ground_at(camera: GroundCamera, columns: FloatArray, rows: FloatArray) -> FloatArray:
    """Give the ground under a grid of pixels, (rows, columns, 2) metres."""
    x_px, y_px = np.meshgrid(columns, rows)
    return camera.to_ground(np.column_stack((x_px.ravel(), y_px.ravel()))).reshape(*x_px.shape, 2)


def cover_of(rings_px: list[FloatArray], size_px: tuple[int, int]) -> Patch | None:
    """Rasterise one polygon with soft edges.

    Parameters
    ----------
    rings_px : (n, 2) each, the outline first and then the holes; a pixel's centre has whole numbers.
    size_px : width and height of the image.

    Returns
    -------
    The smallest patch that holds it; None if it lies outside the image.
    """
    outline_px = rings_px[0]
    low, high = np.floor(outline_px.min(axis=0)), np.ceil(outline_px.max(axis=0)) + 1
    left, top = (max(0, int(edge)) for edge in low)
    right, bottom = (min(size, int(edge)) for size, edge in zip(size_px, high, strict=True))
    if left >= right or top >= bottom:
        return None
    fine = np.zeros(((bottom - top) * _SUPERSAMPLING, (right - left) * _SUPERSAMPLING), dtype=np.uint8)
    # A pixel's centre is at a whole number; its _SUPERSAMPLING sub-pixels lie evenly around it.
    fine_px = [(ring - (left, top) + 0.5) * _SUPERSAMPLING - 0.5 for ring in rings_px]
    cv2.fillPoly(fine, [np.round(ring * (1 << _SHIFT_BITS)).astype(np.int32) for ring in fine_px], (255,), shift=4)
    area = cv2.resize(fine, (right - left, bottom - top), interpolation=cv2.INTER_AREA)
    return Patch((slice(top, bottom), slice(left, right)), area.astype(np.float32) / np.float32(255))


def coverage_of(patches: Iterable[Patch | None], size_px: tuple[int, int]) -> Picture:
    """Lay patches out on one image, (h, w) from 0 to 1; where they overlap they count once."""
    width_px, height_px = size_px
    total = np.zeros((height_px, width_px), dtype=np.float32)
    for patch in patches:
        if patch is not None:
            total[patch.window] = np.maximum(total[patch.window], patch.cover)
    return total


def fill(picture: Picture, outline_px: FloatArray, colour: Sequence[float]) -> None:
    """Paint the inside of an outline, (n, 2) pixels, onto a picture, (h, w, k), in a colour of k channels."""
    patch = cover_of([outline_px], (picture.shape[1], picture.shape[0]))
    if patch is not None:
        lay_over(picture[patch.window], patch.cover, colour)


def scaled(colour: Colour, factor: float) -> Colour:
    """Make a colour lighter or darker, at most white."""
    blue, green, red = (min(255.0, part * factor) for part in colour)
    return blue, green, red


def placed(shape: _Shape, place_m: FloatArray, turn_rad: float) -> _Shape:
    """Turn a shape about the origin and move that to a place."""
    turned = affinity.rotate(shape, turn_rad, origin=(0, 0), use_radians=True)
    return affinity.translate(turned, float(place_m[0]), float(place_m[1]))


def lay_over(picture: Picture, alpha: Picture, colour: Picture | Sequence[float]) -> None:
    """Blend a colour, or another picture, into a picture in place.

    Parameters
    ----------
    picture : (h, w, k), changed.
    alpha : (h, w) from 0 (keep) to 1 (replace).
    colour : one colour or (h, w, k).
    """
    picture += alpha[:, :, None] * (np.asarray(colour, dtype=np.float32) - picture)


def fractal_noise(rng: np.random.Generator, size_px: tuple[int, int], *, largest_px: float, octaves: int) -> Picture:
    """Draw a random texture that has detail at several sizes.

    Parameters
    ----------
    rng : source of the noise.
    size_px : width and height.
    largest_px : size of the largest blotches; each octave halves it.
    octaves : number of sizes, each weaker than the one before; those under a pixel are left out but for one.

    Returns
    -------
    (h, w), mean 0, standard deviation 1.
    """
    width_px, height_px = size_px
    total = np.zeros((height_px, width_px), dtype=np.float32)
    for octave in range(octaves):
        blotch_px = max(1.0, largest_px / 2**octave)
        cells = (int(height_px / blotch_px) + 3, int(width_px / blotch_px) + 3)
        grid = rng.standard_normal(cells, dtype=np.float32) * np.float32(_GAIN**octave)
        total += cv2.resize(grid, size_px, interpolation=cv2.INTER_LINEAR if blotch_px < 4 else cv2.INTER_CUBIC)
        if blotch_px == 1.0:
            break
    total -= total.mean()
    return np.asarray(total / total.std(), dtype=np.float32)
