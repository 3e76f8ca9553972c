"""What does a vehicle look like from above? Paints one sprite: body, screens, roof and shadow.

A sprite is a small picture in the vehicle's own frame, some five times finer than the image and averaged over the
area of one image pixel. Sampling it at the pixel centres then gives anti-aliased edges at any sub-pixel position.
"""

import math
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from data_gen.scenario import VehicleClass
from data_gen.states import FloatArray
from data_gen.sun import Sun

Colour = tuple[float, float, float]
Box = tuple[float, float, float, float]
"""Rear, front, right, left: metres in the vehicle's frame, x forward from the centre, y to the left."""

OVERSAMPLING = 5
"""Sprite pixels an image pixel; odd, so that averaging does not shift the picture."""

_SUPERSAMPLING = 4
_PAINTS: tuple[tuple[float, Colour], ...] = (  # share; blue, green, red
    (0.24, (222, 224, 224)),
    (0.18, (172, 176, 177)),
    (0.15, (128, 128, 126)),
    (0.14, (84, 83, 82)),
    (0.11, (46, 44, 43)),
    (0.07, (42, 44, 150)),
    (0.08, (128, 78, 44)),
    (0.03, (62, 88, 54)),
)
_TARPAULINS: tuple[Colour, ...] = ((214, 216, 216), (180, 150, 120), (120, 140, 90), (90, 100, 180), (150, 155, 158))
_GLASS: Colour = (52, 46, 42)
_SHADOW: Colour = (30, 24, 22)
_SHADOW_STRENGTH = 0.55
_PENUMBRA_M = 0.15
_CAR_BONNET_HEIGHT_M = 0.95
_CAR_ROOF_HEIGHT_M = 1.45
_TRUCK_HEIGHT_M = 3.4
_CAB_M = 2.2


@dataclass(frozen=True, slots=True)
class VehicleLooks:
    """What a sprite depends on besides the sun."""

    vehicle_class: VehicleClass
    length_m: float
    width_m: float
    appearance: int
    """Seed of paint and tint."""


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
    sun : casts the shadow; none without a sun.
    heading_rad : turns the shadow relative to the vehicle.
    metres_per_pixel : of the image into which the sprite goes.

    Returns
    -------
    The sprite.
    """
    canvas = _Canvas(looks, sun, metres_per_pixel)
    if sun is not None:
        canvas.cast_shadow(_solids(looks), sun, heading_rad)
    if looks.vehicle_class == "truck":
        _paint_truck(canvas, looks)
    else:
        _paint_car(canvas, looks)
    return canvas.sprite()


def height_m(vehicle_class: VehicleClass) -> float:
    """Tell how high a vehicle of a class reaches, in metres."""
    return _TRUCK_HEIGHT_M if vehicle_class == "truck" else _CAR_ROOF_HEIGHT_M


def _solids(looks: VehicleLooks) -> tuple[tuple[Box, float], ...]:
    """List the boxes that cast the shadow, with their heights."""
    half_m, side_m = looks.length_m / 2, looks.width_m / 2
    whole = (-half_m, half_m, -side_m, side_m)
    if looks.vehicle_class == "truck":
        return ((whole, _TRUCK_HEIGHT_M),)
    cabin = (-0.36 * looks.length_m, 0.14 * looks.length_m, -0.42 * looks.width_m, 0.42 * looks.width_m)
    return ((whole, _CAR_BONNET_HEIGHT_M), (cabin, _CAR_ROOF_HEIGHT_M))


def _paint_car(canvas: "_Canvas", looks: VehicleLooks) -> None:
    rng = np.random.default_rng(looks.appearance)
    paint = _draw_paint(rng)
    length_m, width_m = looks.length_m, looks.width_m
    # An estate's roof runs to the back, a saloon has a boot.
    roof_rear = float(rng.choice((-0.40, -0.24)))
    canvas.fill(_rounded(length_m, width_m, 0.28), _shade(paint, 0.96))
    glass = 0.43 * width_m
    canvas.fill(_trapezoid((roof_rear - 0.08) * length_m, 0.20 * length_m, 0.40 * width_m, glass), _GLASS)
    canvas.fill(_trapezoid(roof_rear * length_m, 0.08 * length_m, 0.36 * width_m, 0.37 * width_m), _shade(paint, 1.06))
    canvas.fill(_trapezoid(0.24 * length_m, 0.44 * length_m, 0.36 * width_m, 0.30 * width_m), _shade(paint, 1.03))


def _paint_truck(canvas: "_Canvas", looks: VehicleLooks) -> None:
    rng = np.random.default_rng(looks.appearance)
    half_m, side_m = looks.length_m / 2, looks.width_m / 2
    tarpaulin = _shade(_TARPAULINS[rng.integers(len(_TARPAULINS))], float(rng.uniform(0.85, 1.1)))
    cab = _draw_paint(rng)
    canvas.fill(_trapezoid(-half_m, half_m, side_m, side_m), (40, 40, 40))
    canvas.fill(_trapezoid(-half_m, half_m - _CAB_M - 0.3, side_m, side_m), tarpaulin)
    canvas.fill(_trapezoid(-half_m + 0.3, half_m - _CAB_M - 0.6, side_m * 0.8, side_m * 0.8), _shade(tarpaulin, 1.06))
    canvas.fill(_trapezoid(half_m - _CAB_M, half_m, side_m * 0.98, side_m * 0.94), cab)
    canvas.fill(_trapezoid(half_m - 0.65, half_m - 0.15, side_m * 0.85, side_m * 0.8), _GLASS)


def _draw_paint(rng: np.random.Generator) -> Colour:
    shares = np.array([share for share, _ in _PAINTS])
    _, colour = _PAINTS[rng.choice(len(_PAINTS), p=shares / shares.sum())]
    return _shade(colour, float(rng.uniform(0.85, 1.15)))


def _shade(colour: Colour, factor: float) -> Colour:
    blue, green, red = (min(255.0, part * factor) for part in colour)
    return blue, green, red


def _trapezoid(rear_m: float, front_m: float, half_rear_m: float, half_front_m: float) -> FloatArray:
    return np.array([[rear_m, -half_rear_m], [front_m, -half_front_m], [front_m, half_front_m], [rear_m, half_rear_m]])


def _rounded(length_m: float, width_m: float, radius_m: float) -> FloatArray:
    """Outline a rectangle with cut-off corners, (8, 2)."""
    x_m, y_m = length_m / 2, width_m / 2
    quarter = np.array([[x_m, y_m - radius_m], [x_m - radius_m, y_m]])
    mirrored = quarter[::-1] * (-1, 1)
    return np.vstack((quarter, mirrored, -quarter, -mirrored))


class _Canvas:
    """A sprite while it is painted: colour times opacity, and opacity, in float32."""

    def __init__(self, looks: VehicleLooks, sun: Sun | None, metres_per_pixel: float) -> None:
        self._pixel_m = metres_per_pixel / OVERSAMPLING
        reach_m = 0.0 if sun is None else sun.shadow_slope * height_m(looks.vehicle_class)
        margin_m = reach_m + 2 * metres_per_pixel + 4 * _PENUMBRA_M
        self._half_px = (
            math.ceil((looks.length_m / 2 + margin_m) / self._pixel_m),
            math.ceil((looks.width_m / 2 + margin_m) / self._pixel_m),
        )
        half_x, half_y = self._half_px
        self._picture = np.zeros((2 * half_y + 1, 2 * half_x + 1, 4), dtype=np.float32)

    def fill(self, outline_m: FloatArray, colour: Colour) -> None:
        self._lay(self._coverage(outline_m), colour)

    def cast_shadow(self, solids: tuple[tuple[Box, float], ...], sun: Sun, heading_rad: float) -> None:
        """Lay the soft shadow of solids, each a box and the height of its top in m."""
        turn = np.array(
            [[math.cos(heading_rad), math.sin(heading_rad)], [-math.sin(heading_rad), math.cos(heading_rad)]]
        )
        total = np.zeros(self._picture.shape[:2], dtype=np.float32)
        for (rear_m, front_m, right_m, left_m), top_m in solids:
            corners_m = np.array([[rear_m, right_m], [front_m, right_m], [front_m, left_m], [rear_m, left_m]])
            shifted_m = corners_m + turn @ np.array(sun.shadow_offset_m(top_m))
            hull = cv2.convexHull(np.vstack((corners_m, shifted_m)).astype(np.float32))
            total = np.maximum(total, self._coverage(hull.reshape(-1, 2).astype(np.float64)))
        soft = cv2.GaussianBlur(total, (0, 0), _PENUMBRA_M / self._pixel_m)
        self._lay(soft * np.float32(_SHADOW_STRENGTH), _SHADOW)

    def sprite(self) -> Sprite:
        """Return what was painted, averaged over the area of an image pixel."""
        # The mean over an image pixel's area: after it, sampling at pixel centres is exact area sampling.
        averaged = cv2.blur(self._picture, (OVERSAMPLING, OVERSAMPLING), borderType=cv2.BORDER_CONSTANT)
        half_x, half_y = self._half_px
        size_m = self._pixel_m
        return Sprite(
            bgra=np.clip(np.round(averaged), 0, 255).astype(np.uint8),
            vehicle_from_sprite=np.array([[size_m, 0, -half_x * size_m], [0, -size_m, half_y * size_m], [0, 0, 1.0]]),
        )

    def _lay(self, alpha: NDArray[np.float32], colour: Colour) -> None:
        opaque = np.array((*colour, 255.0), dtype=np.float32)
        self._picture += alpha[:, :, None] * (opaque - self._picture)

    def _coverage(self, outline_m: FloatArray) -> NDArray[np.float32]:
        half_x, half_y = self._half_px
        height_px, width_px = self._picture.shape[:2]
        sprite_px = outline_m / (self._pixel_m, -self._pixel_m) + (half_x, half_y)
        fine_px = (sprite_px + 0.5) * _SUPERSAMPLING - 0.5
        fine = np.zeros((height_px * _SUPERSAMPLING, width_px * _SUPERSAMPLING), dtype=np.uint8)
        cv2.fillPoly(fine, [np.round(fine_px * 16).astype(np.int32)], (255,), shift=4)
        area = cv2.resize(fine, (width_px, height_px), interpolation=cv2.INTER_AREA)
        return area.astype(np.float32) / np.float32(255)
