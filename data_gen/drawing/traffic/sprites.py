"""How is traffic drawn for a camera straight above? Sprites, sampled at each vehicle's sub-pixel place.

A sprite is a small picture of parts and shadow in the vehicle's own frame, some five times finer than the image and
averaged over the area of one image pixel. Sampling it at the pixel centres then gives anti-aliased edges.
"""

import math
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from data_gen.drawing.ground.paint import Colour, cover_of, coverage_of, fill, lay_over
from data_gen.drawing.sun import Sun
from data_gen.drawing.traffic.vehicle_models import Part, VehicleLooks, height_m, vehicle_parts
from data_gen.drawing.view import CameraView, hull_of, warp_into
from data_gen.simulation.states import FloatArray, VehicleStates

_HEADING_STEP_RAD = math.radians(2)
_REACH_M = 15.0
"""No body or shadow reaches farther from a vehicle's centre."""
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


class SpritePainter:
    """Draws vehicles onto a blue-green-red picture, at sub-pixel places.

    Parameters
    ----------
    size_px : width and height of the picture.
    sun : casts shadows.
    """

    def __init__(self, size_px: tuple[int, int], sun: Sun) -> None:
        self._size_px = size_px
        self._sun = sun
        self._sprites: dict[str, dict[tuple[int, int], Sprite]] = {}

    def draw(self, canvas: NDArray[np.uint8], states: VehicleStates, view: CameraView) -> None:
        """Draw all vehicles with their shadows.

        Parameters
        ----------
        canvas : (h, w, 3), changed.
        states : vehicles, those out of view included.
        view : the camera.
        """
        self._forget_gone(states)
        pixel_from_ground = view.camera.pixel_from_ground
        pixel_m = rows_near_image(states, view)
        # Low ones first: the shadow of a truck falls on the car beside it, never the other way round.
        for row in sorted(pixel_m, key=lambda row: height_m(states.classes[row])):
            sprite = self._sprite(states, row, pixel_m[row])
            to_ground = ground_from_vehicle(states.centre_m[row], float(states.heading_rad[row]))
            self._draw_one(canvas, sprite, pixel_from_ground @ to_ground)

    def _forget_gone(self, states: VehicleStates) -> None:
        for vehicle_id in self._sprites.keys() - set(states.ids):
            del self._sprites[vehicle_id]

    def _sprite(self, states: VehicleStates, row: int, pixel_m: float) -> Sprite:
        heading_step = round(float(states.heading_rad[row]) / _HEADING_STEP_RAD)
        # A tenth of an octave: with a slanting camera the scale changes from place to place.
        scale_step = round(math.log2(pixel_m) * 10)
        made = self._sprites.setdefault(states.ids[row], {})
        if (heading_step, scale_step) not in made:
            made[heading_step, scale_step] = paint_vehicle(
                looks_of(states, row),
                sun=self._sun,
                heading_rad=heading_step * _HEADING_STEP_RAD,
                metres_per_pixel=pixel_m,
            )
        return made[heading_step, scale_step]

    def _draw_one(self, canvas: NDArray[np.uint8], sprite: Sprite, pixel_from_vehicle: FloatArray) -> None:
        to_pixel = pixel_from_vehicle @ sprite.vehicle_from_sprite
        height_px, width_px = sprite.bgra.shape[:2]
        if (found := warp_into(to_pixel, (width_px, height_px), self._size_px)) is None:
            return
        part, to_part = found
        # A camera straight above maps straight lines to parallel ones: no division pixel by pixel.
        layer = cv2.warpAffine(sprite.bgra, to_part[:2] / to_part[2, 2], part.size_px, flags=cv2.INTER_LINEAR)
        blend(canvas[part.window], np.asarray(layer, dtype=np.uint8))


def rows_near_image(states: VehicleStates, view: CameraView) -> dict[int, float]:
    """Find the vehicles that may reach into the image, with their shadows.

    Parameters
    ----------
    states : vehicles, those out of view included.
    view : the camera.

    Returns
    -------
    For each row of such a vehicle, the size of a pixel at its place in m.
    """
    if not states.ids:
        return {}
    pixel_m = view.camera.metres_per_pixel(states.centre_m)
    place_px = view.camera.to_pixels(states.centre_m)
    margin_px = (_REACH_M / pixel_m)[:, None]
    near = (place_px > -margin_px) & (place_px < np.array(view.size_px) + margin_px)
    return {int(row): float(pixel_m[row]) for row in np.flatnonzero(near.all(axis=1))}


def blend(picture: NDArray[np.uint8], layer: NDArray[np.uint8]) -> None:
    """Lay a picture whose colours are already multiplied by their opacity over another one.

    Parameters
    ----------
    picture : (h, w, 3), changed.
    layer : (h, w, 4).
    """
    kept = picture * (255 - layer[:, :, 3:].astype(np.uint16))
    picture[:] = layer[:, :, :3] + (kept + 127) // 255


def looks_of(states: VehicleStates, row: int) -> VehicleLooks:
    """Gather what one vehicle looks like."""
    return VehicleLooks(
        vehicle_class=states.classes[row],
        length_m=float(states.length_m[row]),
        width_m=float(states.width_m[row]),
        appearance=int(states.appearance[row]),
    )


def ground_from_vehicle(centre_m: FloatArray, heading_rad: float) -> FloatArray:
    """Give the map from a vehicle's frame to the ground, (3, 3)."""
    east, north = math.cos(heading_rad), math.sin(heading_rad)
    return np.array([[east, -north, centre_m[0]], [north, east, centre_m[1]], [0.0, 0.0, 1.0]])


def paint_vehicle(looks: VehicleLooks, *, sun: Sun, heading_rad: float, metres_per_pixel: float) -> Sprite:
    """Paint a vehicle and its shadow.

    Parameters
    ----------
    looks : class, size and appearance.
    sun : casts the shadow; none if it is hidden.
    heading_rad : turns the shadow relative to the vehicle.
    metres_per_pixel : of the image into which the sprite goes.

    Returns
    -------
    The sprite.
    """
    parts = vehicle_parts(looks)
    canvas = _Canvas(looks, sun, metres_per_pixel)
    if not sun.is_hidden:
        canvas.cast_shadow([shadow_m(part, sun, heading_rad) for part in parts])
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
    return hull_of(np.vstack((low_m, high_m)))


class _Canvas:
    """A sprite while it is painted: colour times opacity, and opacity, in float32."""

    def __init__(self, looks: VehicleLooks, sun: Sun, metres_per_pixel: float) -> None:
        self._oversampling = _OVERSAMPLING if metres_per_pixel > _FINE_PIXEL_M else _FINE_OVERSAMPLING
        self._pixel_m = metres_per_pixel / self._oversampling
        reach_m = 0.0 if sun.is_hidden else sun.shadow_slope * height_m(looks.vehicle_class)
        margin_m = reach_m + 2 * metres_per_pixel + 4 * PENUMBRA_M
        self._half_px = (
            math.ceil((looks.length_m / 2 + margin_m) / self._pixel_m),
            math.ceil((looks.width_m / 2 + margin_m) / self._pixel_m),
        )
        half_x, half_y = self._half_px
        self._picture = np.zeros((2 * half_y + 1, 2 * half_x + 1, 4), dtype=np.float32)

    def fill(self, outline_m: FloatArray, colour: Colour) -> None:
        fill(self._picture, self._to_pixels(outline_m), (*colour, 255.0))

    def cast_shadow(self, outlines_m: list[FloatArray]) -> None:
        """Lay one soft shadow of all outlines together."""
        height_px, width_px = self._picture.shape[:2]
        size_px = width_px, height_px
        total = coverage_of((cover_of([self._to_pixels(outline_m)], size_px) for outline_m in outlines_m), size_px)
        soft = cv2.GaussianBlur(total, (0, 0), PENUMBRA_M / self._pixel_m)
        lay_over(self._picture, soft * np.float32(SHADOW_STRENGTH), (*SHADOW_COLOUR, 255.0))

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

    def _to_pixels(self, outline_m: FloatArray) -> FloatArray:
        return np.asarray(outline_m / (self._pixel_m, -self._pixel_m) + self._half_px, dtype=np.float64)
