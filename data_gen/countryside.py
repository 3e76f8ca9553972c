"""What lies around the road? Fields with straight edges, hedges, trees and farms, drawn at random."""

import math

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely import affinity

from data_gen.paint import GroundPainter, Picture, fractal_noise, lay_over
from data_gen.states import FloatArray
from data_gen.sun import Sun

_FIELD_COLOURS = (  # blue, green, red: young corn, meadow, ripe corn, ploughed, stubble, clover
    (68.0, 118.0, 88.0),
    (74.0, 128.0, 112.0),
    (102.0, 158.0, 172.0),
    (82.0, 104.0, 124.0),
    (112.0, 148.0, 158.0),
    (58.0, 98.0, 70.0),
)
_ROOF_COLOURS = ((70.0, 82.0, 148.0), (92.0, 92.0, 96.0), (62.0, 68.0, 112.0), (140.0, 146.0, 150.0))
_CROWN_COLOUR = (46.0, 84.0, 60.0)
_SHADOW_COLOUR = (38.0, 44.0, 34.0)
_FIELD_M2 = 22_000.0
_TREE_M2 = 2_200.0
_FARM_M2 = 70_000.0


def paint_countryside(
    painter: GroundPainter, *, keep_free: shapely.Geometry, sun: Sun, rng: np.random.Generator
) -> Picture:
    """Paint fields, hedges, trees and buildings over the whole image.

    Parameters
    ----------
    painter : of the image.
    keep_free : ground that trees, buildings and their shadows leave free.
    sun : gives the shadows.
    rng : source of every choice.

    Returns
    -------
    (h, w, 3).
    """
    east_m, north_m = painter.ground_of_pixels()
    fields = _split_into_fields(east_m, north_m, int(painter.view.area / _FIELD_M2) + 2, rng)
    picture = _paint_fields(fields, east_m, north_m, rng)
    soil = fractal_noise(rng, painter.size_px, largest_px=60 / painter.metres_per_pixel, octaves=7)
    picture *= 1 + np.float32(0.06) * soil[:, :, None]
    _paint_hedges(picture, painter, fields, rng)
    for _ in range(int(painter.view.area / _FARM_M2) + 1):
        keep_free = shapely.union(keep_free, _paint_farm(picture, painter, keep_free, sun, rng))
    _paint_trees(picture, painter, keep_free, sun, rng)
    return picture


def _split_into_fields(
    east_m: FloatArray, north_m: FloatArray, count: int, rng: np.random.Generator
) -> NDArray[np.int32]:
    """Label each pixel with its field: the largest field is cut by a straight line until there are `count`."""
    fields = np.zeros(east_m.shape, dtype=np.int32)
    main_rad = rng.uniform(-0.15, 0.15)
    for number in range(1, count):
        largest = fields == np.bincount(fields.ravel()).argmax()
        x_m, y_m = east_m[largest], north_m[largest]
        across = np.ptp(x_m) > np.ptp(y_m)
        angle_rad = main_rad + rng.normal(0, 0.06) + (0.0 if across else math.pi / 2)
        along_m = x_m * math.cos(angle_rad) + y_m * math.sin(angle_rad)
        cut_m = np.quantile(along_m, rng.uniform(0.35, 0.65))
        fields[largest] = np.where(along_m > cut_m, number, fields[largest])
    return fields


def _paint_fields(
    fields: NDArray[np.int32], east_m: FloatArray, north_m: FloatArray, rng: np.random.Generator
) -> Picture:
    picture = np.empty((*fields.shape, 3), dtype=np.float32)
    for number in range(int(fields.max()) + 1):
        inside = fields == number
        colour = np.array(_FIELD_COLOURS[rng.integers(len(_FIELD_COLOURS))]) * rng.uniform(0.88, 1.1)
        angle_rad, period_m = rng.uniform(0, math.pi), rng.uniform(4, 9)
        along_m = east_m[inside] * math.cos(angle_rad) + north_m[inside] * math.sin(angle_rad)
        furrows = rng.uniform(0.0, 0.05) * np.sin(math.tau * along_m / period_m)
        picture[inside] = colour * (1 + furrows[:, None])
    return picture


def _paint_hedges(
    picture: Picture, painter: GroundPainter, fields: NDArray[np.int32], rng: np.random.Generator
) -> None:
    border = np.zeros(fields.shape, dtype=np.float32)
    border[:, 1:] += fields[:, 1:] != fields[:, :-1]
    border[1:] += fields[1:] != fields[:-1]
    patchy = fractal_noise(rng, painter.size_px, largest_px=30 / painter.metres_per_pixel, octaves=5)
    lay_over(picture, np.minimum(border, 1) * np.clip(0.5 + 0.5 * patchy, 0, 0.9).astype(np.float32), _CROWN_COLOUR)


def _paint_farm(
    picture: Picture, painter: GroundPainter, keep_free: shapely.Geometry, sun: Sun, rng: np.random.Generator
) -> shapely.Geometry:
    """Paint some buildings around a yard; returns the ground they take."""
    taken: list[shapely.Geometry] = []
    centre_m = _random_point(painter, rng)
    turn_deg = float(rng.uniform(0, 90))
    for _ in range(rng.integers(2, 5)):
        place_m = centre_m + rng.uniform(-28, 28, 2)
        length_m, width_m, height_m = rng.uniform(12, 30), rng.uniform(8, 13), float(rng.uniform(4, 7))
        turn = turn_deg + 90 * float(rng.integers(2))
        roof = _place(shapely.box(-length_m / 2, -width_m / 2, length_m / 2, width_m / 2), place_m, turn)
        sunny_half = _place(shapely.box(-length_m / 2, 0, length_m / 2, width_m / 2), place_m, turn)
        shadow = shapely.union(roof, affinity.translate(roof, *sun.shadow_offset_m(height_m))).convex_hull
        if any(shadow.intersects(shape) for shape in (keep_free, *taken)):
            continue
        taken.append(shadow)
        colour = np.array(_ROOF_COLOURS[rng.integers(len(_ROOF_COLOURS))])
        _blend(picture, painter, shadow, 0.6, _SHADOW_COLOUR)
        _blend(picture, painter, roof, 1.0, tuple(colour * 0.85))
        _blend(picture, painter, sunny_half, 1.0, tuple(colour * 1.12))
    return shapely.union_all(taken)


def _paint_trees(
    picture: Picture, painter: GroundPainter, keep_free: shapely.Geometry, sun: Sun, rng: np.random.Generator
) -> None:
    shadows: list[shapely.Geometry] = []
    crowns: list[shapely.Geometry] = []
    tips: list[shapely.Geometry] = []
    for _ in range(int(painter.view.area / _TREE_M2)):
        place_m, radius_m = _random_point(painter, rng), float(rng.uniform(1.8, 4.5))
        crown = shapely.union_all(
            [shapely.Point(place_m + rng.normal(0, radius_m * 0.35, 2)).buffer(radius_m * 0.75) for _ in range(4)]
        )
        shadow = affinity.translate(crown, *sun.shadow_offset_m(1.8 * radius_m))
        if not shapely.union(crown, shadow).intersects(keep_free):
            shadows.append(shadow)
            crowns.append(crown)
            east_m, north_m = sun.shadow_offset_m(-0.3 * radius_m)
            tips.append(affinity.translate(affinity.scale(crown, 0.6, 0.6), east_m, north_m))
    leaves = fractal_noise(rng, painter.size_px, largest_px=2.5 / painter.metres_per_pixel, octaves=3)
    foliage = np.asarray(_CROWN_COLOUR, dtype=np.float32) * (1 + np.float32(0.16) * leaves[:, :, None])
    lay_over(picture, painter.coverage(shadows) * np.float32(0.6), _SHADOW_COLOUR)
    lay_over(picture, painter.coverage(crowns), foliage)
    lay_over(picture, painter.coverage(tips) * np.float32(0.6), foliage * np.float32(1.35))


def _random_point(painter: GroundPainter, rng: np.random.Generator) -> FloatArray:
    west_m, south_m, east_m, north_m = painter.view.bounds
    return np.array([rng.uniform(west_m, east_m), rng.uniform(south_m, north_m)])


def _place(shape: shapely.Geometry, place_m: FloatArray, turn_deg: float) -> shapely.Geometry:
    turned = affinity.rotate(shape, turn_deg, origin=(0, 0))
    return affinity.translate(turned, float(place_m[0]), float(place_m[1]))


def _blend(
    picture: Picture,
    painter: GroundPainter,
    shape: shapely.Geometry,
    strength: float,
    colour: tuple[float, float, float],
) -> None:
    lay_over(picture, painter.coverage([shape]) * np.float32(strength), colour)
