"""How does the camera see the scene at each step? Draws the traffic over the ground, as I420 pictures.

Where the camera stands still only the rectangles that hold a vehicle are drawn and converted; the rest is the ground,
converted once. Where it moves the ground is warped out of one large raster for each frame. At last the sensor adds
drifting light, blur by vibration, and noise; noise is cut from a stock of noise pictures at random places, which costs
less than drawing it anew.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import cv2
import numpy as np
import shapely
from numpy.typing import NDArray

from data_gen.drawing.cameras import CameraPath
from data_gen.drawing.ground.ground import VERGE_M, hides_ground, paint_ground
from data_gen.drawing.ground.scenery import Scenery, plan_scenery
from data_gen.drawing.ground.sky import Haze, draw_haze
from data_gen.drawing.ground.standing import Standing, paint_standing, stands_clear
from data_gen.drawing.occluders import Occluder, OccluderKind, plan_occluders
from data_gen.drawing.overlay import Overlay
from data_gen.drawing.sun import Clouds, Sun, Weather, darken, draw_sun
from data_gen.drawing.traffic.solid_painter import SolidPainter
from data_gen.drawing.traffic.sprites import SpritePainter, blend
from data_gen.drawing.view import CameraView, Raster
from data_gen.errors import DataGenError
from data_gen.simulation.states import ByteArray, FloatArray, VehicleStates
from gis.roads.road_network import RoadNetwork

_MARGIN_M = 40.0
NOISE_SIGMA = 1.8
"""Standard deviation of a good sensor in daylight, in steps of luma."""

_STOCK = 6
_MARGIN_PX = 64
_SIGMAS_IN_RANGE = 5


@dataclass(frozen=True, slots=True, eq=False)
class World:
    """Everything on the ground that does not move, and its light: what every camera of a scene films."""

    network: RoadNetwork
    marks: tuple[shapely.Geometry, ...]
    """Painted white on the road."""
    bays: tuple[shapely.Geometry, ...]
    """Paved ground beside the lanes."""
    scenery: Scenery
    sun: Sun
    haze: Haze
    standing: Standing | None
    """What stands beside the road, as a low camera sees it."""
    clouds: Clouds | None
    occluders: tuple[Occluder, ...]
    overlay: Overlay
    """The occluders as the colour camera sees them."""


def make_world(
    network: RoadNetwork,
    path: CameraPath,
    rng: np.random.Generator,
    *,
    marks: Sequence[shapely.Geometry] = (),
    bays: Sequence[shapely.Geometry] = (),
    weather: Weather = "sunny",
    occluders: Sequence[OccluderKind] = (),
) -> World:
    """Plan the world that a camera films.

    Parameters
    ----------
    network : the roads.
    path : of the camera; all that it may see is planned.
    rng : source of every choice; sun, scenery, clouds and occluders have a generator of their own each.
    marks, bays : see `World`.
    weather : sunny, with drifting clouds, or overcast.
    occluders : what hangs over the road.

    Returns
    -------
    The world.

    Raises
    ------
    DataGenError
        If something shall hang over the road of a low camera.
    """
    if path.is_low and occluders:
        # They are plates painted from above, of which a low camera would see the edge.
        raise DataGenError(f"camera 'mast': expected no occluders, got {', '.join(occluders)}")
    sun_rng, scenery_rng, cloud_rng, occluder_rng, haze_rng, standing_rng = rng.spawn(6)
    sun = draw_sun(sun_rng, weather)
    region = shapely.box(*path.reach_m).buffer(_MARGIN_M, join_style="mitre")
    seen = shapely.Polygon(path.views[0].camera.view_outline(*path.views[0].size_px))
    hung = plan_occluders(occluders, network, seen, occluder_rng) if occluders else ()
    decks = [item.outline() for item in hung]
    # A little more than the verge: crowns and roofs have no straight edges to line up with it.
    scenery = plan_scenery(network, region, verge_m=VERGE_M + 2, keep_free=decks, sun=sun, rng=scenery_rng)
    if path.is_low and path.track is not None:
        road, eye_m = network.surface(), path.track.poses[0].place_m[:2]
        hedges = (item for item in scenery.hedges if shapely.distance(item, road) > VERGE_M)
        scenery = replace(
            scenery,
            buildings=tuple(item for item in scenery.buildings if stands_clear(item.outline, road, eye_m)),
            trees=tuple(item for item in scenery.trees if stands_clear(item.crown, road, eye_m)),
            hedges=tuple(item for item in hedges if stands_clear(item, road, eye_m)),
        )
    elif not path.is_moving:
        # The renderer draws traffic over buildings: none may stand in front of a road.
        road, view = network.surface(), path.views[0]
        clear = tuple(item for item in scenery.buildings if not hides_ground(item, road, view))
        scenery = replace(scenery, buildings=clear)
    haze = draw_haze(sun, haze_rng)
    return World(
        network=network,
        marks=tuple(marks),
        bays=tuple(bays),
        scenery=scenery,
        sun=sun,
        haze=haze,
        standing=(
            paint_standing(network, scenery, path.views[0], sun=sun, haze=haze, rng=standing_rng)
            if path.is_low
            else None
        ),
        clouds=Clouds(cloud_rng) if weather == "clouds" else None,
        occluders=hung,
        overlay=Overlay(hung, pixel_m=path.finest_pixel_m, sun=sun, rng=occluder_rng),
    )


class SceneRenderer:
    """Draws one scene, frame by frame.

    Parameters
    ----------
    world : to film.
    path : of the camera; its image size is even both ways.
    rng : source of textures and noise; consumed further by each frame.
    noise_sigma : of the sensor, in steps of luma.
    """

    def __init__(
        self, world: World, path: CameraPath, rng: np.random.Generator, *, noise_sigma: float = NOISE_SIGMA
    ) -> None:
        size_px = path.views[0].size_px
        self._world = world
        self._path = path
        self._height_px = size_px[1]
        self._ground = GroundPicture(world, path, rng)
        self._painter: SpritePainter | SolidPainter = (
            SpritePainter(size_px, world.sun)
            if path.track is None
            # To a drone far above the traffic is roofs; others see sides too.
            else SolidPainter(size_px, world.sun, detailed=path.sees_sides, haze=world.haze, standing=world.standing)
        )
        self._sensor = Sensor(size_px, noise_sigma=noise_sigma, rng=rng)

    def frame(self, states: VehicleStates, number: int = 0) -> ByteArray:
        """Draw one frame.

        Parameters
        ----------
        states : vehicles at the frame's time; those out of view cost nothing.
        number : of the frame on the camera's path; any of them where the camera stands still.

        Returns
        -------
        (h * 3 / 2, w): luma, then both chroma planes at half size, packed as I420. A new array each time.
        """
        view = self._path.views[number]
        canvas = self._ground.seen(view)
        self._painter.draw(canvas, states, view)
        self._world.overlay.apply(canvas, view)
        picture = np.asarray(cv2.cvtColor(canvas, cv2.COLOR_BGR2YUV_I420), dtype=np.uint8)
        luma = picture[: self._height_px]
        if self._world.clouds is not None:
            darken(picture, self._world.clouds.light(view, states.t_us))
        self._sensor.expose(luma, gain=self._world.sun.gain(states.t_us), blur_px=self._path.blur_px[number])
        return picture


class GroundPicture:
    """The empty scene as a camera sees it: painted once, and warped for each frame if the camera moves.

    Parameters
    ----------
    world : to film.
    path : of the camera.
    rng : source of textures and repairs.
    """

    def __init__(self, world: World, path: CameraPath, rng: np.random.Generator) -> None:
        self._raster = Raster(path.reach_m, path.finest_pixel_m) if path.is_moving else None
        painted_from = path.views[0] if self._raster is None else CameraView(self._raster.camera, self._raster.size_px)
        self._picture = paint_ground(
            world.network,
            world.scenery,
            painted_from,
            marks=world.marks,
            bays=world.bays,
            sun=world.sun,
            haze=world.haze,
            rng=rng,
        )
        if world.standing is not None:
            blend(self._picture, world.standing.bgra)

    def seen(self, view: CameraView) -> ByteArray:
        """Give the ground in a view of the path, (h, w, 3), a new array each time."""
        return self._picture.copy() if self._raster is None else self._raster.seen_by(self._picture, view)


class Sensor:
    """Turns a clean luma plane into one as recorded.

    Parameters
    ----------
    size_px : width and height of the image.
    noise_sigma : standard deviation of the noise, in steps of luma.
    rng : source of the noise; consumed further by each frame.
    """

    def __init__(self, size_px: tuple[int, int], *, noise_sigma: float, rng: np.random.Generator) -> None:
        self._size_px = size_px
        self._zero = min(127, max(16, math.ceil(_SIGMAS_IN_RANGE * noise_sigma)))
        self._stock = _noise_stock(size_px, noise_sigma, self._zero, rng)
        self._rng = rng

    def expose(self, luma: ByteArray, *, gain: float, blur_px: FloatArray) -> None:
        """Record one frame.

        Parameters
        ----------
        luma : (h, w), changed in place.
        gain : brightness of the scene, about 1.
        blur_px : (2,), how far the image moves right and down during the exposure.
        """
        width_px, height_px = self._size_px
        if np.abs(blur_px).max() > 0.05:
            columns, rows = (_smear(float(length_px)) for length_px in blur_px)
            cv2.sepFilter2D(luma, -1, columns, rows, dst=luma)
        cv2.LUT(luma, _light_table(gain, self._zero), dst=luma)
        stock, left, top = self._rng.integers((_STOCK, _MARGIN_PX, _MARGIN_PX))
        cv2.add(luma, self._stock[stock][top : top + height_px, left : left + width_px], dst=luma)


def _smear(length_px: float) -> NDArray[np.float32]:
    """Give three weights with the variance of a smear of some length, at most 2 px: a**2 / 12 each way."""
    side = min(length_px**2 / 12, 1 / 3) / 2
    return np.array([side, 1 - 2 * side, side], dtype=np.float32)


def _light_table(gain: float, noise_zero: int) -> ByteArray:
    """Map luma to luma under a gain, less the zero of the noise stock that is added next."""
    lit = 16 + (np.arange(256) - 16) * gain - noise_zero
    return np.clip(np.round(lit), 0, 255).astype(np.uint8)


def _noise_stock(size_px: tuple[int, int], sigma: float, zero: int, rng: np.random.Generator) -> tuple[ByteArray, ...]:
    shape = (size_px[1] + _MARGIN_PX, size_px[0] + _MARGIN_PX)
    stock = (zero + sigma * rng.standard_normal(shape, dtype=np.float32) for _ in range(_STOCK))
    return tuple(np.clip(np.round(noise), 0, 2 * zero).astype(np.uint8) for noise in stock)
