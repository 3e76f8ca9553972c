"""How do occluders come into the picture, and which part of a vehicle's body do they hide?

They are layers over the traffic, and shadows on traffic and ground alike; what they hide is measured on the very layers
that are drawn.
"""

from collections.abc import Sequence

import cv2
import numpy as np
import shapely
from numpy.typing import NDArray

from data_gen.drawing.ground.paint import GroundPainter, cover_of
from data_gen.drawing.occluders import Occluder, shadow_on_ground
from data_gen.drawing.sun import Sun
from data_gen.drawing.traffic.sprites import blend
from data_gen.drawing.traffic.vehicle_models import height_m
from data_gen.drawing.view import CameraView, Raster, Rectangle, at_height, corners_m
from data_gen.simulation.states import ByteArray, FloatArray, Picture, VehicleStates

Layer = tuple[Rectangle, ByteArray]

_SHADE = 0.5
_EDGE_BLUR_M = 0.35
_MARGIN_M = 2.0


class Overlay:
    """The occluders of a scene, ready to be laid over pictures.

    Parameters
    ----------
    occluders : of the scene; may be none.
    pixel_m : size of a pixel of the finest frame.
    sun : casts their shadows.
    rng : source of their textures.
    """

    def __init__(self, occluders: Sequence[Occluder], *, pixel_m: float, sun: Sun, rng: np.random.Generator) -> None:
        self._bodies = [_paint_body(item, pixel_m, rng) for item in occluders]
        self._shadows = [] if sun.is_hidden else [_paint_shadow(item, pixel_m, sun) for item in occluders]
        self._view: CameraView | None = None
        self._layers: list[Layer] = []
        self._shades: list[Layer] = []

    @property
    def is_empty(self) -> bool:
        """Tell whether there is no occluder."""
        return not self._bodies

    def apply(self, picture: ByteArray, part: Rectangle, view: CameraView) -> None:
        """Lay shadows and occluders over a part of the image.

        Parameters
        ----------
        picture : (h, w, 3) of the part's size, changed.
        part : of the image that the picture shows.
        view : the camera.
        """
        self._look_from(view)
        for where, shade in self._shades:
            if (cut := _cut(where, part)) is not None:
                inner, source = cut
                kept = 255 - shade[source].astype(np.uint16)
                picture[inner] = (picture[inner] * kept[:, :, None] + 127) // 255
        for where, layer in self._layers:
            if (cut := _cut(where, part)) is not None:
                inner, source = cut
                blend(picture[inner], layer[source])

    def opacity(self, part: Rectangle, view: CameraView) -> FloatArray:
        """Tell how much of each pixel of a part of the image the occluders hide: (h, w), 0 to 1."""
        self._look_from(view)
        width_px, height_px = part.size_px
        seen_through = np.ones((height_px, width_px))
        for where, layer in self._layers:
            if (cut := _cut(where, part)) is not None:
                inner, source = cut
                seen_through[inner] *= 1 - layer[source][:, :, 3] / 255
        return np.asarray(1 - seen_through, dtype=np.float64)

    def touches(self, part: Rectangle, view: CameraView) -> bool:
        """Tell whether an occluder or its shadow reaches into a part of the image."""
        self._look_from(view)
        return any(_cut(where, part) is not None for where, _ in (*self._layers, *self._shades))

    def _look_from(self, view: CameraView) -> None:
        """Warp all layers for a view, unless they still are."""
        if view is self._view:
            return
        self._view = view
        found = [(raster.patch_in(picture, view, up_m), is_body) for raster, picture, up_m, is_body in self._all()]
        self._layers = [layer for layer, is_body in found if layer is not None and is_body]
        self._shades = [layer for layer, is_body in found if layer is not None and not is_body]

    def _all(self) -> list[tuple[Raster, ByteArray, float, bool]]:
        bodies = [(raster, picture, up_m, True) for raster, picture, up_m in self._bodies]
        return bodies + [(raster, picture, 0.0, False) for raster, picture in self._shadows]


def _paint_body(item: Occluder, pixel_m: float, rng: np.random.Generator) -> tuple[Raster, ByteArray, float]:
    raster, painter = _raster_around(item.outline(), pixel_m)
    width_px, height_px = raster.size_px
    picture = np.zeros((height_px, width_px, 4), dtype=np.float32)
    texture = painter.texture(rng, largest_m=1.5, octaves=4)
    for shape, colour, strength in item.layers:
        opaque = np.empty_like(picture)
        opaque[:, :, :3] = np.asarray(colour, dtype=np.float32) * (1 + np.float32(strength) * texture[:, :, None])
        opaque[:, :, 3] = 255
        cover: Picture = painter.coverage([shape])
        picture += cover[:, :, None] * (opaque - picture)
    return raster, np.clip(np.round(picture), 0, 255).astype(np.uint8), item.height_m


def _paint_shadow(item: Occluder, pixel_m: float, sun: Sun) -> tuple[Raster, ByteArray]:
    shadow = shadow_on_ground(item, sun)
    raster, painter = _raster_around(shadow, pixel_m)
    soft = cv2.GaussianBlur(painter.coverage([shadow]), (0, 0), _EDGE_BLUR_M / raster.pixel_m)
    return raster, np.clip(np.round(soft * (255 * _SHADE)), 0, 255).astype(np.uint8)


def _raster_around(shape: shapely.Geometry, pixel_m: float) -> tuple[Raster, GroundPainter]:
    west_m, south_m, east_m, north_m = shapely.bounds(shape).tolist()
    reach_m = (west_m - _MARGIN_M, south_m - _MARGIN_M, east_m + _MARGIN_M, north_m + _MARGIN_M)
    raster = Raster(reach_m, pixel_m)
    return raster, GroundPainter(raster.camera, raster.size_px)


def _cut(where: Rectangle, part: Rectangle) -> tuple[tuple[slice, slice], tuple[slice, slice]] | None:
    """Give the common area of two rectangles, in the pixels of the second and of the first one."""
    left, top = max(where.left, part.left), max(where.top, part.top)
    right, bottom = min(where.right, part.right), min(where.bottom, part.bottom)
    if left >= right or top >= bottom:
        return None
    inner = np.s_[top - part.top : bottom - part.top, left - part.left : right - part.left]
    source = np.s_[top - where.top : bottom - where.top, left - where.left : right - where.left]
    return inner, source


def hidden_shares(states: VehicleStates, rows: NDArray[np.intp], view: CameraView, overlay: Overlay) -> FloatArray:
    """Measure how much of some bodies an occluder hides.

    Parameters
    ----------
    states : vehicles.
    rows : (n,), those to measure; all lie in front of the camera.
    view : the camera.
    overlay : the occluders as drawn.

    Returns
    -------
    (n,) from 0 to 1: of the part of the body's outline that lies in the image; 0 where none of it does.
    """
    outlines_m = corners_m(states)
    return np.array(
        [_hidden_share(outlines_m[row], height_m(states.classes[row]), view, overlay) for row in rows],
        dtype=np.float64,
    )


def _hidden_share(footprint_m: FloatArray, up_m: float, view: CameraView, overlay: Overlay) -> float:
    foot_px, roof_px = at_height(footprint_m, 0.0, view), at_height(footprint_m, up_m, view)
    points_px = np.vstack((foot_px, roof_px))
    if (points_px.max(axis=0) < 0).any() or (points_px.min(axis=0) > np.array(view.size_px)).any():
        return 0.0
    silhouette_px = cv2.convexHull(points_px.astype(np.float32)).reshape(-1, 2).astype(np.float64)
    patch = cover_of([silhouette_px], view.size_px)
    if patch is None:
        return 0.0
    rows, columns = patch.window
    part = Rectangle(columns.start, rows.start, columns.stop, rows.stop)
    if not overlay.touches(part, view) or not patch.cover.any():
        return 0.0
    return float((patch.cover * overlay.opacity(part, view)).sum() / patch.cover.sum())
