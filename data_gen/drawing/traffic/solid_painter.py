"""How is traffic drawn for a camera with a pose? As solids with sides and roofs, the far ones first.

Shadows are drawn first, all of them, on the ground: none falls on another vehicle's body.
"""

import math
from collections.abc import Sequence

import cv2
import numpy as np
from numpy.typing import NDArray

from data_gen.drawing.ground.sky import Haze
from data_gen.drawing.ground.standing import Standing
from data_gen.drawing.sun import Sun
from data_gen.drawing.traffic.solids import Mesh, Solid, far_first, finely_placed, hidden_by, place_solid, rows_in_image
from data_gen.drawing.traffic.sprites import (
    PENUMBRA_M,
    SHADOW_COLOUR,
    SHADOW_STRENGTH,
    blend,
    looks_of,
    rows_near_image,
    shadow_m,
)
from data_gen.drawing.traffic.vehicle_bodies import vehicle_body
from data_gen.drawing.traffic.vehicle_models import VehicleLooks, vehicle_parts
from data_gen.drawing.view import CameraView, Rectangle, hull_of, rectangle_around
from data_gen.simulation.states import BoolArray, FloatArray, VehicleStates

_FINE_PIXEL_M = 0.05
"""Edges are drawn at least this fine before they are averaged."""
_CONTACT_STRENGTH = 0.5
"""Under a vehicle it is dark even without a sun."""


class Meshes:
    """The meshes of the vehicles of a clip, each built once.

    Parameters
    ----------
    detailed : with windows, lamps and wheels, for cameras that look at sides; else as for one far above.
    """

    def __init__(self, *, detailed: bool) -> None:
        self.detailed = detailed
        self._meshes: dict[VehicleLooks, Mesh] = {}

    def mesh(self, states: VehicleStates, row: int) -> Mesh:
        """Give the mesh of one vehicle."""
        looks = looks_of(states, row)
        if looks not in self._meshes:
            parts = vehicle_body(looks) if self.detailed else vehicle_parts(looks)
            self._meshes[looks] = Mesh(parts, is_round=self.detailed)
        return self._meshes[looks]

    def placed(self, states: VehicleStates, view: CameraView) -> list[Solid]:
        """Put the vehicles that may reach into the image where they are, the far ones first."""
        assert view.pose is not None
        eye_m = view.pose.place_m[:2]
        pixel_m: dict[int, float] = {}
        if self.detailed:
            rows = far_first(rows_in_image(states, view), states, eye_m)
        else:
            distance_m = np.hypot(*(states.centre_m - eye_m).T)
            pixel_m = rows_near_image(states, view)
            rows = sorted(pixel_m, key=lambda row: -float(distance_m[row]))
        return [place_solid(self.mesh(states, row), row, states, view, pixel_m=pixel_m.get(row)) for row in rows]


class SolidPainter:
    """Draws vehicles as solids onto a blue-green-red picture.

    Parameters
    ----------
    size_px : width and height of the picture.
    sun : casts shadows and lights the sides.
    detailed : with windows, lamps and wheels.
    haze : pales what is far, where something stands beside the road.
    standing : hides what is behind it; none without.
    """

    def __init__(
        self,
        size_px: tuple[int, int],
        sun: Sun,
        *,
        detailed: bool = False,
        haze: Haze | None = None,
        standing: Standing | None = None,
    ) -> None:
        self._size_px = size_px
        self._sun = sun
        self._haze = None if standing is None else haze
        self._standing = standing
        self._meshes = Meshes(detailed=detailed)

    def draw(self, canvas: NDArray[np.uint8], states: VehicleStates, view: CameraView) -> None:
        """Draw all vehicles with their shadows.

        Parameters
        ----------
        canvas : (h, w, 3), changed.
        states : vehicles, those out of view included.
        view : the camera; it has a pose.
        """
        placed = self._meshes.placed(states, view)
        for solid in placed:
            if self._meshes.detailed:
                self._shade_round(canvas, solid, states, view)
            elif not self._sun.is_hidden:
                _shade(canvas, solid, self._size_px, self._sun)
        for solid in placed:
            self._fill(canvas, solid, states, view)

    def _shade_round(self, canvas: NDArray[np.uint8], solid: Solid, states: VehicleStates, view: CameraView) -> None:
        """Lay the dark under a vehicle, and its shadow."""
        sun = self._sun
        corners_m = solid.mesh.corners_m
        shapes = [(solid.level_px(solid.mesh.under_m), _CONTACT_STRENGTH)]
        if not sun.is_hidden:
            cosine, sine = math.cos(solid.heading_rad), math.sin(solid.heading_rad)
            slope = np.array([[cosine, sine], [-sine, cosine]]) @ np.array(sun.shadow_offset_m(1.0))
            outline_m = hull_of(corners_m[:, :2] + corners_m[:, 2:] * slope)
            shapes.append((solid.level_px(outline_m), SHADOW_STRENGTH))
        across_px = PENUMBRA_M / solid.pixel_m
        around_px = np.vstack([outline_px for outline_px, _ in shapes])
        part = rectangle_around(around_px, self._size_px, margin_px=2 * across_px + 2)
        if part is None:
            return
        dark = _raster(part, shapes, 2 if solid.pixel_m > _FINE_PIXEL_M else 1)
        # A soft edge on the ground is flat in the picture.
        flat = solid.eye_m[2] / max(1.0, solid.distance_m)
        flat_px = max(0.3, across_px * min(1.0, flat))
        soft = np.asarray(cv2.GaussianBlur(dark, (0, 0), max(0.3, across_px), sigmaY=flat_px), dtype=np.uint8)
        if self._standing is not None:
            soft[hidden_by(self._standing, solid, part, states, view)] = 0
        light = cv2.cvtColor(255 - soft, cv2.COLOR_GRAY2BGR)
        cv2.multiply(canvas[part.window], light, dst=canvas[part.window], scale=1 / 255)

    def _fill(self, canvas: NDArray[np.uint8], solid: Solid, states: VehicleStates, view: CameraView) -> None:
        part = rectangle_around(solid.around_px(), self._size_px, margin_px=1)
        if part is None:
            return
        faces = solid.seen_faces()
        colours = solid.colours(self._sun)[faces]
        if self._haze is not None:
            colours = self._haze.pale(colours, solid.distance_m)
        fineness = _fineness(solid)
        fine = np.zeros((*_finer_shape(part, fineness), 4), dtype=np.uint8)
        solid.fill(fine, part, fineness, zip(faces, ((*colour, 255.0) for colour in colours.tolist()), strict=True))
        layer = np.asarray(cv2.resize(fine, part.size_px, interpolation=cv2.INTER_AREA), dtype=np.uint8)
        if self._standing is not None:
            _hide(layer, self._standing, hidden_by(self._standing, solid, part, states, view), part)
        blend(canvas[part.window], layer)


def _hide(layer: NDArray[np.uint8], standing: Standing, hidden: BoolArray, part: Rectangle) -> None:
    """Let what stands before a vehicle show instead of it, as far as it is opaque."""
    if not hidden.any():
        return
    front = standing.bgra[part.window].astype(np.float32) * hidden[:, :, None]
    own, opacity = layer[:, :, :3].astype(np.float32), layer[:, :, 3:].astype(np.float32) / 255
    layer[:, :, :3] = np.round(own * (1 - front[:, :, 3:] / 255) + opacity * front[:, :, :3])


def _fineness(solid: Solid) -> int:
    return max(2, min(6, math.ceil(solid.pixel_m / _FINE_PIXEL_M)))


def _shade(canvas: NDArray[np.uint8], solid: Solid, size_px: tuple[int, int], sun: Sun) -> None:
    outlines_px = [solid.level_px(shadow_m(part, sun, solid.heading_rad)) for part in solid.mesh.parts]
    soft_px = PENUMBRA_M / solid.pixel_m
    part = rectangle_around(np.vstack(outlines_px), size_px, margin_px=3 * soft_px + 1)
    if part is None:
        return
    cover = _raster(part, [(outline_px, 1.0) for outline_px in outlines_px], _fineness(solid))
    soft = cv2.GaussianBlur(cover, (0, 0), max(0.3, soft_px))
    alpha = soft.astype(np.float32)[:, :, None] * np.float32(SHADOW_STRENGTH / 255)
    window = canvas[part.window]
    window[:] = np.round(window + alpha * (np.asarray(SHADOW_COLOUR, dtype=np.float32) - window)).astype(np.uint8)


def _raster(part: Rectangle, shapes: Sequence[tuple[FloatArray, float]], fineness: int) -> NDArray[np.uint8]:
    """Draw outlines of some opacity over one another into a rectangle, finely, and average."""
    fine = np.zeros(_finer_shape(part, fineness), dtype=np.uint8)
    for outline_px, opacity in shapes:
        cv2.fillConvexPoly(fine, finely_placed(outline_px, part, fineness), 255 * opacity, shift=4)
    return np.asarray(cv2.resize(fine, part.size_px, interpolation=cv2.INTER_AREA), dtype=np.uint8)


def _finer_shape(part: Rectangle, fineness: int) -> tuple[int, int]:
    width_px, height_px = part.size_px
    return height_px * fineness, width_px * fineness
