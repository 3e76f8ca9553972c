"""How do occluders come into the picture, and which part of a vehicle's body do they hide?

They are layers over the traffic, and shadows on traffic and ground alike; what they hide is measured on the very layers
that are drawn.
"""

from collections.abc import Iterable, Iterator, Sequence

import cv2
import numpy as np
import shapely
from numpy.typing import NDArray

from data_gen.drawing.ground.paint import GroundPainter, cover_of, lay_over
from data_gen.drawing.occluders import Occluder, shadow_on_ground
from data_gen.drawing.sun import Sun
from data_gen.drawing.traffic.sprites import blend
from data_gen.drawing.traffic.vehicle_models import height_m
from data_gen.drawing.view import CameraView, Raster, Rectangle, corners_m, silhouette_px, widened
from data_gen.simulation.states import ByteArray, FloatArray, VehicleStates

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
        self.is_empty = not occluders
        """Whether there is no occluder."""
        self._bodies = [(*_paint_body(item, pixel_m, rng), item.height_m) for item in occluders]
        self._shadows = [] if sun.is_hidden else [(*_paint_shadow(item, pixel_m, sun), 0.0) for item in occluders]
        self._view: CameraView | None = None
        self._layers: list[Layer] = []
        self._shades: list[Layer] = []

    def apply(self, picture: ByteArray, view: CameraView) -> None:
        """Lay shadows and occluders over the image of a camera, (h, w, 3), in place."""
        self._look_from(view)
        for where, shade in self._shades:
            kept = 255 - shade.astype(np.uint16)
            picture[where.window] = (picture[where.window] * kept[:, :, None] + 127) // 255
        for where, layer in self._layers:
            blend(picture[where.window], layer)

    def opacity(self, part: Rectangle, view: CameraView) -> FloatArray:
        """Tell how much of each pixel of a part of the image the occluders hide: (h, w), 0 to 1."""
        self._look_from(view)
        width_px, height_px = part.size_px
        seen_through = np.ones((height_px, width_px))
        for inner, layer in _cut(self._layers, part):
            seen_through[inner] *= 1 - layer[:, :, 3] / 255
        return np.asarray(1 - seen_through, dtype=np.float64)

    def _look_from(self, view: CameraView) -> None:
        """Warp all layers for a view, unless they still are."""
        if view is self._view:
            return
        self._view = view
        self._layers, self._shades = (
            [layer for raster, picture, up_m in plates if (layer := raster.patch_in(picture, view, up_m)) is not None]
            for plates in (self._bodies, self._shadows)
        )


def _paint_body(item: Occluder, pixel_m: float, rng: np.random.Generator) -> tuple[Raster, ByteArray]:
    raster, painter = _raster_around(item.outline(), pixel_m)
    width_px, height_px = raster.size_px
    picture = np.zeros((height_px, width_px, 4), dtype=np.float32)
    texture = painter.texture(rng, largest_m=1.5, octaves=4)
    for shape, colour, strength in item.layers:
        opaque = np.empty_like(picture)
        opaque[:, :, :3] = np.asarray(colour, dtype=np.float32) * (1 + np.float32(strength) * texture[:, :, None])
        opaque[:, :, 3] = 255
        lay_over(picture, painter.coverage([shape]), opaque)
    return raster, np.clip(np.round(picture), 0, 255).astype(np.uint8)


def _paint_shadow(item: Occluder, pixel_m: float, sun: Sun) -> tuple[Raster, ByteArray]:
    shadow = shadow_on_ground(item, sun)
    raster, painter = _raster_around(shadow, pixel_m)
    soft = cv2.GaussianBlur(painter.coverage([shadow]), (0, 0), _EDGE_BLUR_M / raster.pixel_m)
    return raster, np.clip(np.round(soft * (255 * _SHADE)), 0, 255).astype(np.uint8)


def _raster_around(shape: shapely.Geometry, pixel_m: float) -> tuple[Raster, GroundPainter]:
    west_m, south_m, east_m, north_m = shapely.bounds(shape).tolist()
    raster = Raster(widened((west_m, south_m, east_m, north_m), _MARGIN_M), pixel_m)
    return raster, GroundPainter(raster.camera, raster.size_px)


def _cut(layers: Iterable[Layer], part: Rectangle) -> Iterator[tuple[tuple[slice, slice], ByteArray]]:
    """Give what layers show in a part of the image: where in the part's own pixels, and the piece of the layer."""
    for where, picture in layers:
        left, top = max(where.left, part.left), max(where.top, part.top)
        right, bottom = min(where.right, part.right), min(where.bottom, part.bottom)
        if left < right and top < bottom:
            inner = np.s_[top - part.top : bottom - part.top, left - part.left : right - part.left]
            yield inner, picture[top - where.top : bottom - where.top, left - where.left : right - where.left]


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
    seen_px = silhouette_px(footprint_m, up_m, view)
    if (seen_px.max(axis=0) < 0).any() or (seen_px.min(axis=0) > np.array(view.size_px)).any():
        return 0.0
    patch = cover_of([seen_px], view.size_px)
    if patch is None:
        return 0.0
    rows, columns = patch.window
    part = Rectangle(columns.start, rows.start, columns.stop, rows.stop)
    if not patch.cover.any():
        return 0.0
    return float((patch.cover * overlay.opacity(part, view)).sum() / patch.cover.sum())
