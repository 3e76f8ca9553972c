"""What does the ground look like when nobody is on it? Paints the scene behind the traffic, once.

Fields, verges, trees and farms are drawn at random; road surface and markings come from the road network.
"""

from collections.abc import Sequence

import cv2
import numpy as np
import shapely
from numpy.typing import NDArray
from shapely.ops import substring

from data_gen.countryside import paint_countryside
from data_gen.markings import road_markings
from data_gen.paint import GroundPainter, Picture, fractal_noise, lay_over
from data_gen.sun import Sun
from gis.camera import GroundCamera
from gis.lanes import Lane
from gis.polyline import offset
from gis.road_network import RoadNetwork

Surface = shapely.Polygon | shapely.MultiPolygon

_VERGE_M = 6.0
_GRAVEL_M = 0.7
_VERGE_COLOUR = (72.0, 122.0, 108.0)
_GRAVEL_COLOUR = (118.0, 128.0, 134.0)
_ASPHALT_COLOUR = (108.0, 106.0, 104.0)
_PAINT_COLOUR = (212.0, 214.0, 214.0)
_WHEEL_TRACK_M = 0.85
_WHEEL_TRACK_WIDTH_M = 0.6


def paint_ground(
    network: RoadNetwork, camera: GroundCamera, size_px: tuple[int, int], *, sun: Sun, rng: np.random.Generator
) -> NDArray[np.uint8]:
    """Paint the empty scene.

    Parameters
    ----------
    network : gives road surface and markings.
    camera : maps ground to pixels.
    size_px : width and height.
    sun : shades trees and buildings.
    rng : source of every choice.

    Returns
    -------
    (h, w, 3) blue, green, red.
    """
    painter = GroundPainter(camera, size_px)
    road = network.surface()
    picture = paint_countryside(painter, keep_free=road.buffer(_VERGE_M + 2), sun=sun, rng=rng)
    _paint_verge(picture, painter, road, rng)
    _paint_asphalt(picture, painter, road, network.lanes, rng)
    _paint_markings(picture, painter, network, rng)
    # The lens: without it single pixels are sharper than any camera shows them.
    seen = cv2.GaussianBlur(picture, (3, 3), 0.45)
    return np.clip(np.round(seen), 0, 255).astype(np.uint8)


def _paint_verge(picture: Picture, painter: GroundPainter, road: Surface, rng: np.random.Generator) -> None:
    grass = fractal_noise(rng, painter.size_px, largest_px=14 / painter.metres_per_pixel, octaves=5)
    verge = np.asarray(_VERGE_COLOUR, dtype=np.float32) * (1 + np.float32(0.09) * grass[:, :, None])
    lay_over(picture, painter.coverage([road.buffer(_VERGE_M)]), verge)
    ditch = road.buffer(_VERGE_M * 0.7).difference(road.buffer(_VERGE_M * 0.7 - 1.2))
    lay_over(picture, painter.coverage([ditch]) * np.float32(0.35), (45.0, 70.0, 62.0))
    lay_over(picture, painter.coverage([road.buffer(_GRAVEL_M)]) * np.float32(0.8), _GRAVEL_COLOUR)


def _paint_asphalt(
    picture: Picture,
    painter: GroundPainter,
    road: Surface,
    lanes: Sequence[Lane],
    rng: np.random.Generator,
) -> None:
    scale_px = 1 / painter.metres_per_pixel
    grain = fractal_noise(rng, painter.size_px, largest_px=1, octaves=1)
    stains = fractal_noise(rng, painter.size_px, largest_px=25 * scale_px, octaves=5)
    surface = np.full((*grain.shape, 3), _ASPHALT_COLOUR, dtype=np.float32)
    surface *= (1 + np.float32(0.018) * grain + np.float32(0.03) * stains)[:, :, None]
    tracks = [
        _line(lane, side * _WHEEL_TRACK_M).buffer(_WHEEL_TRACK_WIDTH_M / 2, cap_style="flat")
        for lane in lanes
        for side in (-1, 1)
    ]
    lay_over(surface, painter.coverage(tracks) * np.float32(0.35), (96.0, 94.0, 92.0))
    for patch, shade in _repairs(lanes, rng):
        lay_over(surface, painter.coverage([patch]) * np.float32(0.6), (shade, shade, shade))
    lay_over(picture, painter.coverage([road]), surface)


def _repairs(lanes: Sequence[Lane], rng: np.random.Generator) -> list[tuple[shapely.Geometry, float]]:
    """Draw patches of newer, darker or older, paler asphalt: half a lane wide, 5 to 40 m long, one every 150 m."""
    patches: list[tuple[shapely.Geometry, float]] = []
    for lane in lanes:
        centre = _line(lane, 0.0)
        for _ in range(rng.poisson(centre.length / 150)):
            start_m, length_m = rng.uniform(0, centre.length), rng.uniform(5, 40)
            part = substring(centre, start_m, min(start_m + length_m, centre.length))
            if part.length > 1:
                side = float(rng.choice((-1, 1))) * lane.width_m / 4
                strip = shapely.LineString(offset(np.asarray(part.coords), side))
                patches.append((strip.buffer(lane.width_m / 4, cap_style="flat"), float(rng.uniform(84, 122))))
    return patches


def _paint_markings(picture: Picture, painter: GroundPainter, network: RoadNetwork, rng: np.random.Generator) -> None:
    wear = fractal_noise(rng, painter.size_px, largest_px=8 / painter.metres_per_pixel, octaves=4)
    strength = np.clip(np.float32(0.72) + np.float32(0.2) * wear, 0.15, 0.95).astype(np.float32)
    lay_over(picture, painter.coverage(road_markings(network)) * strength, _PAINT_COLOUR)


def _line(lane: Lane, left_m: float) -> shapely.LineString:
    return shapely.LineString(offset(lane.centre_line_m, left_m))
