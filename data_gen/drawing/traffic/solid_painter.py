"""How is traffic drawn for a camera with a pose? As solids with sides and roofs, the far ones first.

Shadows are drawn first, all of them, on the ground: none falls on another vehicle's body.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from data_gen.drawing.ground.paint import Colour
from data_gen.drawing.sun import Sun
from data_gen.drawing.traffic.sprites import (
    PENUMBRA_M,
    SHADOW_COLOUR,
    SHADOW_STRENGTH,
    blend,
    looks_of,
    rows_near_image,
    shadow_m,
)
from data_gen.drawing.traffic.vehicle_models import Part, VehicleLooks, vehicle_parts
from data_gen.drawing.view import CameraView, Rectangle, rectangle_around
from data_gen.simulation.states import FloatArray, VehicleStates

_FINE_PIXEL_M = 0.05
"""Edges are drawn at least this fine before they are averaged."""


class SolidPainter:
    """Draws vehicles as solids onto a blue-green-red picture.

    Parameters
    ----------
    size_px : width and height of the picture.
    sun : casts shadows and lights the sides.
    """

    def __init__(self, size_px: tuple[int, int], sun: Sun) -> None:
        self._size_px = size_px
        self._sun = sun
        self._parts: dict[VehicleLooks, tuple[Part, ...]] = {}

    def draw(self, canvas: NDArray[np.uint8], states: VehicleStates, view: CameraView) -> None:
        """Draw all vehicles with their shadows.

        Parameters
        ----------
        canvas : (h, w, 3), changed.
        states : vehicles, those out of view included.
        view : the camera; it has a pose.
        """
        assert view.pose is not None
        space = view.pose.projection(*self._size_px)
        distance_m = np.hypot(*(states.centre_m - view.pose.place_m[:2]).T)
        pixel_m = rows_near_image(states, view)
        far_first = sorted(pixel_m, key=lambda row: -float(distance_m[row]))
        drawn = [self._solid(states, row, space, view.pose.place_m, pixel_m[row]) for row in far_first]
        if not self._sun.is_hidden:
            for solid in drawn:
                _shade(canvas, solid, self._size_px, self._sun)
        for solid in drawn:
            _fill(canvas, solid, self._size_px, self._sun)

    def _solid(self, states: VehicleStates, row: int, space: FloatArray, eye_m: FloatArray, pixel_m: float) -> "_Solid":
        """Place a vehicle in space."""
        looks = looks_of(states, row)
        if looks not in self._parts:
            self._parts[looks] = vehicle_parts(looks)
        place = _Place(states.centre_m[row], float(states.heading_rad[row]), pixel_m)
        return _Solid(self._parts[looks], place, space=space, eye_m=eye_m)


@dataclass(frozen=True, slots=True, eq=False)
class _Place:
    """Where a vehicle is, and how large a pixel is there."""

    centre_m: FloatArray
    heading_rad: float
    pixel_m: float


class _Solid:
    """One vehicle in space, as the camera sees it."""

    def __init__(self, parts: tuple[Part, ...], place: _Place, *, space: FloatArray, eye_m: FloatArray) -> None:
        self.parts = parts
        self.heading_rad = heading_rad = place.heading_rad
        self.pixel_m = place.pixel_m
        self._centre_m = place.centre_m
        self._space = space
        cosine, sine = math.cos(heading_rad), math.sin(heading_rad)
        self._turn = np.array([[cosine, sine], [-sine, cosine]])
        # The camera's place in the vehicle's frame.
        self.eye_m = np.array([*(self._turn @ (eye_m[:2] - place.centre_m)), eye_m[2]])
        self.fineness = max(2, min(6, math.ceil(place.pixel_m / _FINE_PIXEL_M)))

    def to_pixels(self, outline_m: FloatArray, up_m: float) -> FloatArray:
        """Map points of a level outline in the vehicle's frame: (n, 2) metres to (n, 2) pixels."""
        ground_m = outline_m @ self._turn + self._centre_m
        mapped = np.column_stack((ground_m, np.full(len(ground_m), up_m), np.ones(len(ground_m)))) @ self._space.T
        return np.asarray(mapped[:, :2] / mapped[:, 2:], dtype=np.float64)

    def faces(self, sun: Sun) -> Iterator[tuple[FloatArray, Colour]]:
        """Give the faces that the camera sees, in the order of drawing: outline in pixels and colour."""
        for part in sorted(self.parts, key=self._order):
            base_px = self.to_pixels(part.base_m, part.base_height_m)
            top_px = self.to_pixels(part.top_m, part.top_height_m)
            if part.top_height_m > part.base_height_m:
                yield from self._sides(part, base_px, top_px, sun)
            yield top_px, part.top

    def _order(self, part: Part) -> tuple[float, float]:
        """Lower levels first; of two blocks that stand side by side the one farther from the camera."""
        return part.level, -float(np.hypot(part.block_x_m - self.eye_m[0], self.eye_m[1]))

    def _sides(
        self, part: Part, base_px: FloatArray, top_px: FloatArray, sun: Sun
    ) -> Iterator[tuple[FloatArray, Colour]]:
        following_m = np.roll(part.base_m, -1, axis=0)
        along_m = following_m - part.base_m
        outward = np.column_stack((along_m[:, 1], -along_m[:, 0]))
        # How far the sides lean in: a windscreen may be seen although the camera stands behind its foot.
        lean = (part.base_m - part.top_m) / (part.top_height_m - part.base_height_m)
        rise = (outward * lean).sum(axis=1)
        to_eye = self.eye_m[:2] - part.base_m
        seen = (outward * to_eye).sum(axis=1) + rise * (self.eye_m[2] - part.base_height_m) > 0
        for corner in np.flatnonzero(seen):
            after = (corner + 1) % len(base_px)
            quad = np.array([base_px[corner], base_px[after], top_px[after], top_px[corner]])
            normal = outward[corner] / max(1e-9, float(np.hypot(*outward[corner])))
            light = sun.wall_light(normal @ self._turn)
            blue, green, red = (light * value for value in part.side)
            yield quad, (blue, green, red)


def _shade(canvas: NDArray[np.uint8], solid: _Solid, size_px: tuple[int, int], sun: Sun) -> None:
    outlines_px = [solid.to_pixels(shadow_m(part, sun, solid.heading_rad), 0.0) for part in solid.parts]
    soft_px = PENUMBRA_M / solid.pixel_m
    part = rectangle_around(np.vstack(outlines_px), size_px, margin_px=3 * soft_px + 1)
    if part is None:
        return
    cover = _raster(part, [(outline_px, (255.0,)) for outline_px in outlines_px], solid.fineness, channels=1)
    soft = cv2.GaussianBlur(cover, (0, 0), max(0.3, soft_px))
    alpha = soft.astype(np.float32)[:, :, None] * np.float32(SHADOW_STRENGTH / 255)
    window = canvas[part.window]
    window[:] = np.round(window + alpha * (np.asarray(SHADOW_COLOUR, dtype=np.float32) - window)).astype(np.uint8)


def _fill(canvas: NDArray[np.uint8], solid: _Solid, size_px: tuple[int, int], sun: Sun) -> None:
    faces = list(solid.faces(sun))
    part = rectangle_around(np.vstack([outline_px for outline_px, _ in faces]), size_px, margin_px=1)
    if part is None:
        return
    opaque = [(outline_px, (*colour, 255.0)) for outline_px, colour in faces]
    blend(canvas[part.window], _raster(part, opaque, solid.fineness, channels=4))


def _raster(
    part: Rectangle, shapes: Sequence[tuple[FloatArray, tuple[float, ...]]], fineness: int, *, channels: int
) -> NDArray[np.uint8]:
    """Draw shapes over one another into a rectangle, finely, and average."""
    width_px, height_px = part.size_px
    shape = (height_px * fineness, width_px * fineness, channels)[: 3 if channels > 1 else 2]
    fine = np.zeros(shape, dtype=np.uint8)
    for outline_px, value in shapes:
        fine_px = (outline_px - (part.left, part.top) + 0.5) * fineness - 0.5
        cv2.fillConvexPoly(fine, np.round(fine_px * 16).astype(np.int32), value, shift=4)
    return np.asarray(cv2.resize(fine, part.size_px, interpolation=cv2.INTER_AREA), dtype=np.uint8)
