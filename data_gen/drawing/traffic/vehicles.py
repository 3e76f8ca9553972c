"""What does a vehicle look like from straight above? Paints one sprite: its parts, and its shadow.

A sprite is a small picture in the vehicle's own frame, some five times finer than the image and averaged over the
area of one image pixel. Sampling it at the pixel centres then gives anti-aliased edges at any sub-pixel position.
"""

import math
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from data_gen.drawing.ground.paint import Colour, Patch, cover_of
from data_gen.drawing.sun import Sun
from data_gen.drawing.traffic.vehicle_models import Part, VehicleLooks, height_m, vehicle_parts
from data_gen.simulation.states import FloatArray

_OVERSAMPLING, _FINE_OVERSAMPLING, _FINE_PIXEL_M = 5, 3, 0.25
"""Sprite pixels an image pixel, for coarse images and for fine ones; odd, so that averaging shifts nothing."""

SHADOW_COLOUR: Colour = (30, 24, 22)
SHADOW_STRENGTH = 0.55
PENUMBRA_M = 0.15
"""Standard deviation of a shadow's soft edge."""


@dataclass(frozen=True, slots=True, eq=False)
class Sprite:
    """A vehicle with its shadow, ready to be sampled."""

    bgra: NDArray[np.uint8]
    """(h, w, 4), colours already multiplied by their opacity."""
    vehicle_from_sprite: FloatArray
    """(3, 3), sprite pixels to metres in the vehicle's frame."""


def paint_vehicle(looks: VehicleLooks, *, sun: Sun | None, heading_rad: float, metres_per_pixel: float) -> Sprite:
    """Paint a vehicle and its shadow.

    Parameters
    ----------
    looks : class, size and appearance.
    sun : casts the shadow; none without a sun, or with a hidden one.
    heading_rad : turns the shadow relative to the vehicle.
    metres_per_pixel : of the image into which the sprite goes.

    Returns
    -------
    The sprite.
    """
    parts = vehicle_parts(looks)
    lit = sun if sun is not None and not sun.is_hidden else None
    canvas = _Canvas(looks, lit, metres_per_pixel)
    if lit is not None:
        canvas.cast_shadow([shadow_m(part, lit, heading_rad) for part in parts])
    for part in parts:
        if part.base_m is not part.top_m:
            canvas.fill(part.base_m, part.side)
        canvas.fill(part.top_m, part.top)
    return canvas.sprite()


def shadow_m(part: Part, sun: Sun, heading_rad: float) -> FloatArray:
    """Outline a part's shadow.

    Parameters
    ----------
    part : of a vehicle.
    sun : casts the shadow.
    heading_rad : of the vehicle.

    Returns
    -------
    (n, 2), in the vehicle's frame.
    """
    cosine, sine = math.cos(heading_rad), math.sin(heading_rad)
    turn = np.array([[cosine, sine], [-sine, cosine]])
    low_m, high_m = (
        outline_m + turn @ np.array(sun.shadow_offset_m(up_m))
        # A vehicle's skirts hide the light under it: the shadow starts at the ground.
        for outline_m, up_m in ((part.base_m, 0.0), (part.top_m, part.top_height_m))
    )
    hull = cv2.convexHull(np.vstack((low_m, high_m)).astype(np.float32))
    return hull.reshape(-1, 2).astype(np.float64)


class _Canvas:
    """A sprite while it is painted: colour times opacity, and opacity, in float32."""

    def __init__(self, looks: VehicleLooks, sun: Sun | None, metres_per_pixel: float) -> None:
        self._oversampling = _OVERSAMPLING if metres_per_pixel > _FINE_PIXEL_M else _FINE_OVERSAMPLING
        self._pixel_m = metres_per_pixel / self._oversampling
        reach_m = 0.0 if sun is None else sun.shadow_slope * height_m(looks.vehicle_class)
        margin_m = reach_m + 2 * metres_per_pixel + 4 * PENUMBRA_M
        self._half_px = (
            math.ceil((looks.length_m / 2 + margin_m) / self._pixel_m),
            math.ceil((looks.width_m / 2 + margin_m) / self._pixel_m),
        )
        half_x, half_y = self._half_px
        self._picture = np.zeros((2 * half_y + 1, 2 * half_x + 1, 4), dtype=np.float32)

    def fill(self, outline_m: FloatArray, colour: Colour) -> None:
        self._lay(self._coverage(outline_m), colour)

    def cast_shadow(self, outlines_m: list[FloatArray]) -> None:
        """Lay one soft shadow of all outlines together."""
        total = np.zeros(self._picture.shape[:2], dtype=np.float32)
        for outline_m in outlines_m:
            patch = self._coverage(outline_m)
            if patch is not None:
                total[patch.window] = np.maximum(total[patch.window], patch.cover)
        soft = cv2.GaussianBlur(total, (0, 0), PENUMBRA_M / self._pixel_m)
        whole = slice(0, total.shape[0]), slice(0, total.shape[1])
        self._lay(Patch(whole, soft * np.float32(SHADOW_STRENGTH)), SHADOW_COLOUR)

    def sprite(self) -> Sprite:
        """Return what was painted, averaged over the area of an image pixel."""
        # The mean over an image pixel's area: after it, sampling at pixel centres is exact area sampling.
        area = (self._oversampling, self._oversampling)
        averaged = cv2.blur(self._picture, area, borderType=cv2.BORDER_CONSTANT)
        half_x, half_y = self._half_px
        size_m = self._pixel_m
        return Sprite(
            bgra=np.clip(np.round(averaged), 0, 255).astype(np.uint8),
            vehicle_from_sprite=np.array([[size_m, 0, -half_x * size_m], [0, -size_m, half_y * size_m], [0, 0, 1.0]]),
        )

    def _lay(self, patch: Patch | None, colour: Colour) -> None:
        if patch is not None:
            opaque = np.array((*colour, 255.0), dtype=np.float32)
            below = self._picture[patch.window]
            below += patch.cover[:, :, None] * (opaque - below)

    def _coverage(self, outline_m: FloatArray) -> Patch | None:
        half_x, half_y = self._half_px
        height_px, width_px = self._picture.shape[:2]
        sprite_px = outline_m / (self._pixel_m, -self._pixel_m) + (half_x, half_y)
        return cover_of([sprite_px], (width_px, height_px))
