"""How does the camera see the scene at each step? Draws the traffic over the ground, as I420 pictures.

Only the rectangles that hold a vehicle are drawn and converted; the rest is the ground, converted once. Light drifts
through a look-up table on the luma plane, and sensor noise is cut from a stock of noise pictures at random places.
"""

import math
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from data_gen.ground import paint_ground
from data_gen.states import FloatArray, VehicleStates
from data_gen.sun import Sun, draw_sun
from data_gen.vehicles import Sprite, VehicleLooks, height_m, paint_vehicle
from gis.camera import GroundCamera
from gis.road_network import RoadNetwork

ByteArray = NDArray[np.uint8]

_NOISE_STOCK = 6
_NOISE_MARGIN_PX = 64
_NOISE_ZERO = 16
_NOISE_SIGMA = 1.8
_HEADING_STEP_RAD = math.radians(2)


@dataclass(frozen=True, slots=True)
class _Rectangle:
    """Part of the image, edges on even pixels as chroma needs it."""

    left: int
    top: int
    right: int
    bottom: int


class SceneRenderer:
    """Draws one scene, frame by frame.

    Parameters
    ----------
    network : road surface and markings.
    camera : maps ground to pixels.
    size_px : width and height, both even.
    rng : source of scenery, sun and noise; consumed further by each frame.
    """

    def __init__(
        self, network: RoadNetwork, camera: GroundCamera, size_px: tuple[int, int], rng: np.random.Generator
    ) -> None:
        self.sun: Sun = draw_sun(rng)
        self._size_px = size_px
        self._painter = VehiclePainter(camera, size_px, self.sun)
        self._ground = paint_ground(network, camera, size_px, sun=self.sun, rng=rng)
        self._ground_i420 = cv2.cvtColor(self._ground, cv2.COLOR_BGR2YUV_I420).astype(np.uint8)
        self._canvas = self._ground.copy()
        self._noise = _noise_stock(size_px, rng)
        self._rng = rng

    def frame(self, states: VehicleStates) -> ByteArray:
        """Draw one frame.

        Parameters
        ----------
        states : vehicles at the frame's time; those out of view cost nothing.

        Returns
        -------
        (h * 3 / 2, w): luma, then both chroma planes at half size, packed as I420. A new array each time.
        """
        width_px, height_px = self._size_px
        picture = self._ground_i420.copy()
        touched = self._painter.draw(self._canvas, states)
        for part in touched:
            self._convert(picture, part)
        for part in touched:
            window = np.s_[part.top : part.bottom, part.left : part.right]
            self._canvas[window] = self._ground[window]
        luma = picture[:height_px]
        cv2.LUT(luma, _light_table(self.sun.gain(states.t_us)), dst=luma)
        stock, left, top = self._rng.integers((_NOISE_STOCK, _NOISE_MARGIN_PX, _NOISE_MARGIN_PX))
        cv2.add(luma, self._noise[stock][top : top + height_px, left : left + width_px], dst=luma)
        return picture

    def _convert(self, picture: ByteArray, part: _Rectangle) -> None:
        """Copy a part of the canvas into the I420 picture."""
        width_px, height_px = self._size_px
        rows, columns = part.bottom - part.top, part.right - part.left
        converted = cv2.cvtColor(self._canvas[part.top : part.bottom, part.left : part.right], cv2.COLOR_BGR2YUV_I420)
        picture[part.top : part.bottom, part.left : part.right] = converted[:rows]
        chroma = picture[height_px:].reshape(2, height_px // 2, width_px // 2)
        chroma[:, part.top // 2 : part.bottom // 2, part.left // 2 : part.right // 2] = converted[rows:].reshape(
            2, rows // 2, columns // 2
        )


class VehiclePainter:
    """Draws vehicles onto a blue-green-red picture, at sub-pixel places.

    Parameters
    ----------
    camera : maps ground to pixels.
    size_px : width and height of the picture.
    sun : casts shadows; none without.
    """

    def __init__(self, camera: GroundCamera, size_px: tuple[int, int], sun: Sun | None) -> None:
        self._pixel_from_ground = camera.pixel_from_ground
        self._camera = camera
        self._size_px = size_px
        self._sun = sun
        self._sprites: dict[str, dict[tuple[int, int], Sprite]] = {}

    def draw(self, canvas: ByteArray, states: VehicleStates) -> list[_Rectangle]:
        """Draw all vehicles with their shadows.

        Parameters
        ----------
        canvas : (h, w, 3), changed.
        states : vehicles, those out of view included.

        Returns
        -------
        The rectangles that were changed.
        """
        self._forget_gone(states)
        pixel_m = self._camera.metres_per_pixel(states.centre_m)
        touched: list[_Rectangle] = []
        # Low ones first: the shadow of a truck falls on the car beside it, never the other way round.
        for row in sorted(range(len(states.ids)), key=lambda row: height_m(states.classes[row])):
            if np.isfinite(pixel_m[row]):
                sprite = self._sprite(states, row, float(pixel_m[row]))
                part = self._draw_one(canvas, sprite, states.centre_m[row], float(states.heading_rad[row]))
                touched += [part] if part is not None else []
        return touched

    def _forget_gone(self, states: VehicleStates) -> None:
        for vehicle_id in self._sprites.keys() - set(states.ids):
            del self._sprites[vehicle_id]

    def _sprite(self, states: VehicleStates, row: int, pixel_m: float) -> Sprite:
        heading_step = round(float(states.heading_rad[row]) / _HEADING_STEP_RAD)
        # A tenth of an octave: with a slanting camera the scale changes from place to place.
        scale_step = round(math.log2(pixel_m) * 10)
        made = self._sprites.setdefault(states.ids[row], {})
        if (heading_step, scale_step) not in made:
            looks = VehicleLooks(
                vehicle_class=states.classes[row],
                length_m=float(states.length_m[row]),
                width_m=float(states.width_m[row]),
                appearance=int(states.appearance[row]),
            )
            made[heading_step, scale_step] = paint_vehicle(
                looks, sun=self._sun, heading_rad=heading_step * _HEADING_STEP_RAD, metres_per_pixel=pixel_m
            )
        return made[heading_step, scale_step]

    def _draw_one(
        self, canvas: ByteArray, sprite: Sprite, centre_m: FloatArray, heading_rad: float
    ) -> _Rectangle | None:
        to_pixel = self._pixel_from_ground @ _ground_from_vehicle(centre_m, heading_rad) @ sprite.vehicle_from_sprite
        part = self._bounds(sprite, to_pixel)
        if part is None:
            return None
        # Into the rectangle's own pixels.
        to_pixel[:2] -= np.outer((part.left, part.top), to_pixel[2])
        size = (part.right - part.left, part.bottom - part.top)
        layer = cv2.warpPerspective(sprite.bgra, to_pixel, size, flags=cv2.INTER_LINEAR)
        window = canvas[part.top : part.bottom, part.left : part.right]
        kept = window * (255 - layer[:, :, 3:].astype(np.uint16))
        window[:] = layer[:, :, :3] + (kept + 127) // 255
        return part

    def _bounds(self, sprite: Sprite, to_pixel: FloatArray) -> _Rectangle | None:
        height, width = sprite.bgra.shape[:2]
        corners = to_pixel @ np.array([[0, width, width, 0], [0, 0, height, height], [1.0, 1, 1, 1]])
        x_px, y_px = corners[:2] / corners[2]
        left, right = max(0, int(x_px.min()) & ~1), min(self._size_px[0], (int(x_px.max()) + 2 + 1) & ~1)
        top, bottom = max(0, int(y_px.min()) & ~1), min(self._size_px[1], (int(y_px.max()) + 2 + 1) & ~1)
        return _Rectangle(left, top, right, bottom) if left < right and top < bottom else None


def _ground_from_vehicle(centre_m: FloatArray, heading_rad: float) -> FloatArray:
    east, north = math.cos(heading_rad), math.sin(heading_rad)
    return np.array([[east, -north, centre_m[0]], [north, east, centre_m[1]], [0.0, 0.0, 1.0]])


def _light_table(gain: float) -> ByteArray:
    """Map luma to luma under a gain, less the zero of the noise stock that is added next."""
    lit = 16 + (np.arange(256) - 16) * gain - _NOISE_ZERO
    return np.clip(np.round(lit), 0, 255).astype(np.uint8)


def _noise_stock(size_px: tuple[int, int], rng: np.random.Generator) -> tuple[ByteArray, ...]:
    shape = (size_px[1] + _NOISE_MARGIN_PX, size_px[0] + _NOISE_MARGIN_PX)
    stock = (_NOISE_ZERO + _NOISE_SIGMA * rng.standard_normal(shape, dtype=np.float32) for _ in range(_NOISE_STOCK))
    return tuple(np.clip(np.round(noise), 0, 2 * _NOISE_ZERO).astype(np.uint8) for noise in stock)
