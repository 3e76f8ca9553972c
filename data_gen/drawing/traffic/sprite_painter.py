"""How is traffic drawn for a camera straight above? Sprites, sampled at each vehicle's sub-pixel place."""

import math

import cv2
import numpy as np
from numpy.typing import NDArray

from data_gen.drawing.sun import Sun
from data_gen.drawing.traffic.vehicle_models import VehicleLooks, height_m
from data_gen.drawing.traffic.vehicles import Sprite, paint_vehicle
from data_gen.drawing.view import CameraView, Rectangle, rectangle_around
from data_gen.simulation.states import FloatArray, VehicleStates

_HEADING_STEP_RAD = math.radians(2)
_REACH_M = 15.0
"""No body or shadow reaches farther from a vehicle's centre."""


class SpritePainter:
    """Draws vehicles onto a blue-green-red picture, at sub-pixel places.

    Parameters
    ----------
    size_px : width and height of the picture.
    sun : casts shadows; none without.
    """

    def __init__(self, size_px: tuple[int, int], sun: Sun | None) -> None:
        self._size_px = size_px
        self._sun = sun
        self._sprites: dict[str, dict[tuple[int, int], Sprite]] = {}

    def draw(self, canvas: NDArray[np.uint8], states: VehicleStates, view: CameraView) -> list[Rectangle]:
        """Draw all vehicles with their shadows.

        Parameters
        ----------
        canvas : (h, w, 3), changed.
        states : vehicles, those out of view included.
        view : the camera.

        Returns
        -------
        The rectangles that were changed.
        """
        self._forget_gone(states)
        pixel_from_ground = view.camera.pixel_from_ground
        pixel_m = rows_near_image(states, view)
        touched: list[Rectangle] = []
        # Low ones first: the shadow of a truck falls on the car beside it, never the other way round.
        for row in sorted(pixel_m, key=lambda row: height_m(states.classes[row])):
            sprite = self._sprite(states, row, pixel_m[row])
            to_ground = ground_from_vehicle(states.centre_m[row], float(states.heading_rad[row]))
            part = self._draw_one(canvas, sprite, pixel_from_ground @ to_ground)
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
            made[heading_step, scale_step] = paint_vehicle(
                looks_of(states, row),
                sun=self._sun,
                heading_rad=heading_step * _HEADING_STEP_RAD,
                metres_per_pixel=pixel_m,
            )
        return made[heading_step, scale_step]

    def _draw_one(self, canvas: NDArray[np.uint8], sprite: Sprite, pixel_from_vehicle: FloatArray) -> Rectangle | None:
        to_pixel = pixel_from_vehicle @ sprite.vehicle_from_sprite
        height, width = sprite.bgra.shape[:2]
        corners = to_pixel @ np.array([[0, width, width, 0], [0, 0, height, height], [1.0, 1, 1, 1]])
        part = rectangle_around((corners[:2] / corners[2]).T, self._size_px)
        if part is None:
            return None
        # Into the rectangle's own pixels.
        to_pixel[:2] -= np.outer((part.left, part.top), to_pixel[2])
        # A camera straight above maps straight lines to parallel ones: no division pixel by pixel.
        layer = cv2.warpAffine(sprite.bgra, to_pixel[:2] / to_pixel[2, 2], part.size_px, flags=cv2.INTER_LINEAR)
        blend(canvas[part.window], np.asarray(layer, dtype=np.uint8))
        return part


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
