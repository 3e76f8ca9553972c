"""Every number of the background matters: twice or half of it changes what is said of a small scene."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import cache

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from tests.turned import unnoticed, without_scene
from tests.vision.road.test_rectify import ground_surface
from tests.vision.support import ByteArray, FloatArray, draw_boxes, make_boxes, make_frame, top_view, whole_view
from vision.background.background import AT_THRESHOLD, Background
from vision.background.settings import BackgroundSettings
from vision.background.standing import StandingVehicles
from vision.background.startup import first_sight, noise_of
from vision.road.rectify import RoadImage, RoadRaster
from vision.road.road_colour import RoadColour
from vision.road.settings import RoadSettings
from vision.settings import VisionSettings

SIZE, CAR_CELLS = (120, 40), 3.8
Thing = tuple[float, float, float, float, float]  # east, north, heading, length, width


class Road:
    """A grey road with a line and an arrow, and pictures of things on it."""

    def __init__(self, size_px: tuple[int, int] = SIZE, polygons: list[FloatArray] | None = None) -> None:
        self.size_px = size_px
        polygons = polygons or [whole_view(size_px)]
        self.raster: RoadRaster = ground_surface(top_view(size_px), polygons, size_px).raster
        self.rng = np.random.default_rng(0)
        marks = make_boxes([(28, 5.5, 0, 60, 0.3), (40, 9.0, 0, 3.0, 0.6)])
        texture = 100 + self.rng.normal(0, 4, size_px[::-1])
        self.ground = draw_boxes(size_px, marks, [160.0] * 2, ground=texture)

    def picture(
        self, k: int, things: Sequence[Thing] = (), levels: Sequence[float] = (), *, light: float = 1.0, tint: int = 0
    ) -> RoadImage:
        """Show things; `tint` is their chroma beside the road's 128."""
        luma = draw_boxes(self.size_px, make_boxes(things), levels, ground=self.ground)
        luma = 16 + light * (luma - 16) + self.rng.normal(0, 1, luma.shape)
        image = self.raster.rectify(make_frame(np.clip(luma, 0, 255), index=k, t_us=40_000 * k))
        image.planes[1:] = np.clip(128 + self.rng.normal(0, 1, image.planes[1:].shape), 0, 255)
        if tint:
            where = self.raster.pack(self.raster.grid.paint(make_boxes(things).corners())) > 0
            image.planes[1, where] += tint
        return image


def told(*arrays: NDArray[np.generic]) -> bytes:
    return b"".join(np.ascontiguousarray(one).tobytes() for one in arrays)


@cache
def first_pictures() -> tuple[Road, list[ByteArray]]:
    """Show a road on which cars stand most of the time, once by night."""
    road, samples = Road(), []
    for k in range(40):
        things: list[Thing] = [(20 + (k % 3) * 0.5, 9, 0, 4.5, 1.8)] if k % 8 else []
        things += [(35, 13, 0, 4.5, 1.8)] if k not in (3, 30) else []
        things += [(48, 9, 0, 4.5, 1.8)] if k % 2 else []
        levels = [70.0 + k, 50.0 + (k % 5) * 6, 150.0][: len(things)]
        samples.append(road.picture(k, things, levels, light=0.1 if k == 20 else 1.0, tint=k % 30).planes)
    return road, samples


def bare_road(settings: BackgroundSettings) -> bytes:
    """Read the road off the first pictures."""
    road, samples = first_pictures()
    colour = RoadColour(road.raster, RoadSettings(), car_cells=CAR_CELLS)
    sight = first_sight(samples, colour, settings)
    differences = [cv2.absdiff(one, np.rint(sight.planes).astype(np.uint8))[:1] for one in sight.samples]
    noise = noise_of(differences, sight.is_calm, settings.most_noise_levels)
    return told(sight.planes, sight.unrest, sight.is_calm, noise)


# What stands on a road of 4 m to 15 m north, from west to east, and its level.
STANDING: tuple[tuple[Thing, float], ...] = (
    ((8, 9, 0, 4.5, 1.8), 40.0),  # a car
    ((20, 9, 0, 2.0, 1.6), 40.0),  # something as large as a small car at most
    ((32, 9, 0, 7.0, 2.4), 160.0),  # something bright, of which a little is dark
    ((32, 9, 0, 2.0, 1.2), 50.0),
    ((50, 9, 0, 20.0, 6.5), 60.0),  # leaves
    ((75, 9, 0, 3.0, 9.6), 60.0),  # a gantry, nearly from side to side
    ((90, 9, 0, 4.0, 2.0), 50.0),  # a patch over which cars drive now and then
    ((105, 8, 0, 4.5, 1.8), 86.0),  # a car a little darker than the road
    ((118, 9, 0, 6.0, 5.0), 107.0),  # a pale shade, with something dark in it
    ((118, 9, 0, 3.0, 2.0), 60.0),
)


@cache
def standing_pictures() -> tuple[Road, list[ByteArray]]:
    """Show what stands all the time, and a car that covers a part of the patch now and then."""
    road, samples = Road((280, 40)), []
    things, levels = [thing for thing, _ in STANDING], [level for _, level in STANDING]
    for k in range(12):
        passing: list[Thing] = [(89, 9, 0, 2.0, 2.2)] if k in (4, 8) else []
        samples.append(road.picture(k, [*things, *passing], [*levels, *[200.0] * len(passing)]).planes)
    return road, samples


@cache
def spanning_pictures() -> tuple[Road, list[ByteArray]]:
    """Show things that reach from side to side or nearly, and one from a border to a small traffic island."""
    beside_island = [(39.25, 9, 0, 78.5, 30), (95.75, 9, 0, 28.5, 30), (80, -1, 0, 20, 18), (80, 22, 0, 20, 20)]
    road = Road((220, 40), list(make_boxes(beside_island).corners()))
    things: list[Thing] = [(10 + 15 * i, 9.2, 0, 3.0, 11.8 + 0.4 * i) for i in range(3)]
    things.append((80.2, 4.0, 0, 2.5, 9.0))
    return road, [road.picture(k, things, [50.0] * len(things)).planes for k in range(8)]


def vehicles(settings: BackgroundSettings, road: Road, samples: list[ByteArray]) -> bytes:
    colour = RoadColour(road.raster, RoadSettings(), car_cells=CAR_CELLS)
    sight = first_sight(samples, colour, settings)
    return told(StandingVehicles(colour, settings, margin_cells=2).find(sight))


def standing_vehicles(settings: BackgroundSettings) -> bytes:
    """Find the vehicles among what stands all the time."""
    return vehicles(settings, *standing_pictures()) + vehicles(settings, *spanning_pictures())


def background_of(settings: BackgroundSettings, road: Road, *, finds_standing: bool = False) -> Background:
    whole = replace(VisionSettings(), background=settings)
    return Background(road.raster, whole, car_cells=CAR_CELLS, finds_standing=finds_standing)


@cache
def startup_pictures(step: int, *, is_blocked: bool) -> tuple[Road, list[RoadImage]]:
    """Show a road for a minute or less, with a dark car that stands there all the time or none."""
    road, car = Road(), [(20, 9, 0, 4.5, 1.8)] if is_blocked else []
    return road, [road.picture(k, car, [40.0] * len(car)) for k in range(0, 1600 if is_blocked else 300, step)]


def startup(settings: BackgroundSettings, *, step: int = 1, is_blocked: bool = False) -> tuple[int, bytes]:
    road, pictures = startup_pictures(step, is_blocked=is_blocked)
    background = background_of(settings, road, finds_standing=True)
    ready = next((k for k, image in enumerate(pictures) if background.hold(image)), len(pictures))
    if not background.is_ready:
        background.start()
    return ready, told(background.compare(pictures[-1]))


def short_startup(settings: BackgroundSettings) -> tuple[int, bytes]:
    """Start up on an empty road."""
    return startup(settings)


def full_startup(settings: BackgroundSettings) -> tuple[int, bytes]:
    """Start up with a part of the memory for held frames, as this picture is small."""
    return startup(replace(settings, startup_bytes=settings.startup_bytes // 1000))


def long_startup(settings: BackgroundSettings) -> tuple[int, bytes]:
    """Start up where a car stands all the time."""
    return startup(settings, step=25, is_blocked=True)


@cache
def later_pictures() -> tuple[Road, list[RoadImage], list[RoadImage]]:
    """Show a road with dark and restless parts, and then changes of all kinds, five times a second."""
    road = Road()
    road.ground[:, 80:90], road.ground[:, 90:100] = 30.0, 60.0
    start = [road.picture(5 * k) for k in range(26)]
    for image in start:
        image.planes[0, ::7] = np.clip(image.planes[0, ::7] + road.rng.normal(0, 7, image.planes[0, ::7].shape), 0, 255)
    later = []
    for k in range(26, 90):
        things: list[Thing] = [(15, 9, 0, 4.5, 1.8), (30, 9, 0, 4.5, 1.8), (5, 14, 0, 8, 3)]
        levels = [40.0, 170.0, 100.0 + 0.15 * k]
        stripes = 3 if 60 <= k < 68 else 6 if k >= 72 else 0  # half of the view, or nearly all of it
        things += [(5 + 9 * i, 9, 0, 9, 30) for i in range(stripes)]
        levels += [200.0, 40.0, 170.0, 50.0, 140.0, 60.0][:stripes]
        later.append(road.picture(5 * k, things, levels, light=0.6 if k % 9 == 0 else 1.0))
    return road, start, later


def life(settings: BackgroundSettings) -> bytes:
    """Compare with a background and let it learn; one of two standing things is known for an object."""
    road, start, later = later_pictures()
    background, differences = background_of(settings, road), []
    for image in start:
        background.hold(image)
    background.start()
    known = make_boxes([(15, 9, 0, 4.5, 1.8)])
    for image in later:
        differences.append(background.compare(image))
        background.learn(image, (differences[-1] > AT_THRESHOLD).astype(np.uint8), known, np.ones(1, np.bool_))
    return told(*differences)


@cache
def learned_pictures() -> tuple[Road, list[RoadImage], RoadImage]:
    """Show things from the start on, and then others beside them."""
    road, rng = Road(), np.random.default_rng(3)
    old: list[Thing] = [(8 + 9 * i, 5 + 8 * (i % 2), 0, 4.5, 1.8) for i in range(5)]
    new: list[Thing] = [(8 + 9 * i + rng.uniform(-2, 2), 13 - 8 * (i % 2), 0, 4.5, 1.8) for i in range(5)]
    start = [road.picture(5 * k, old, [40.0, 170.0, 60.0, 140.0, 80.0]) for k in range(26)]
    new += [(8 + 9 * i, 5 + 8 * (i % 2) + 0.3 * i, 0, 4.0, 0.3 + 0.2 * i) for i in range(5)]
    return road, start, road.picture(130, new, [60.0, 150.0, 75.0, 130.0, 85.0, 60.0, 130.0, 75.0, 160.0, 85.0])


def verdicts(settings: BackgroundSettings) -> bytes:
    """Judge boxes around old and new things, and beside them."""
    road, start, image = learned_pictures()
    background, rng = background_of(settings, road), np.random.default_rng(4)
    for one in start:
        background.hold(one)
    background.compare(image)
    places = [
        (8 + 9 * (i % 5) + rng.uniform(-2, 2), 5 + 8 * ((i + i // 5) % 2) + rng.uniform(-1, 1)) for i in range(60)
    ]
    boxes = make_boxes([(*place, 0, 4.5, 1.8) for place in places])
    return told(background.judge(image, boxes))


@cache
def shaded_pictures() -> tuple[Road, list[RoadImage], FloatArray]:
    """Show a bare road, and at last with a tenth of the light to all of it in stripes, the colour changed or not."""
    road = Road()
    pictures = [road.picture(5 * k) for k in range(26)]
    things: list[Thing] = [(4 + 7 * i, 9, 0, 6, 12) for i in range(8)]
    pictures.append(road.picture(130, things, [16 + 84 * (0.12 * i + 0.1) for i in range(8)]))
    rows, columns = np.nonzero(road.raster.road)
    points = road.raster.grid.to_plane(np.stack([columns, rows], axis=-1).astype(float))
    pictures[-1].planes[2, road.raster.places(points)] += (np.arange(len(points)) % 15).astype(np.uint8)
    return road, pictures, points


def shade(settings: BackgroundSettings) -> bytes:
    """Look for cells that are known road with less light."""
    road, pictures, points = shaded_pictures()
    background = background_of(settings, road)
    for image in pictures[:-1]:
        background.hold(image)
    background.compare(pictures[-1])
    return told(background.shaded(pictures[-1], points))


def looked_at(settings: BackgroundSettings) -> bytes:
    """Look ten times at cars that stand all the time, of which each look misses some."""
    road = Road()
    cars: list[Thing] = [(5 + 9 * i, 9, 0, 4.5, 1.8) for i in range(6)]
    background = background_of(settings, road)
    for k in range(10):
        seen = [car for i, car in enumerate(cars) if k >= 2 * i]
        background.hold(road.picture(k, cars, [60.0] * len(cars)), make_boxes(seen))
    background.start()
    return told(background.compare(road.picture(200)))


# Which scene notices which number.
NOTICED_IN = {
    bare_road: (
        *("most_noise_levels", "chroma_weight", "least_gain", "same_levels", "calmest_samples", "noise_samples"),
        *("calm_widths", "dark_from_levels", "dark_most_levels", "colour_from_levels", "colour_most_levels"),
        *("bright_weight", "unrest_levels"),
    ),
    standing_vehicles: (
        *("least_calm_samples", "strange_levels", "beyond_widths", "strange_share", "least_widths2"),
        *("least_dark_widths2", "most_widths2", "side_widths", "around_widths", "ground_share"),
    ),
    short_startup: ("startup_us", "startup_samples"),
    full_startup: ("startup_bytes",),
    long_startup: ("startup_most_us",),
    life: (
        *("period_us", "tau_us", "heal_us", "lost_fraction", "lost_us", "gain_least_level"),
        *("least_difference_levels", "most_difference_levels", "noise_factor"),
    ),
    verdicts: ("object_ratio", "ghost_ratio", "plain_share", "plain_ratio"),
    looked_at: ("least_bare_share",),
    shade: ("shade_deepest", "shade_lightest", "shade_chroma_levels"),
}


def test_every_number_has_a_scene() -> None:
    assert without_scene(BackgroundSettings(), NOTICED_IN.values()) == []


@pytest.mark.slow
def test_twice_or_half_of_any_number_is_noticed() -> None:
    assert unnoticed(BackgroundSettings(), NOTICED_IN, small=5) == []
