"""Every number of registration matters: twice or half of it changes what is said of a small scene."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import cache

import cv2
import numpy as np
import pytest

from tests.turned import unnoticed, without_scene
from tests.vision.moving_world import ROAD, SIZE, MovingWorld, drift, first_key, view
from tests.vision.road.test_view import bridge_view
from tests.vision.support import FloatArray, make_boxes, make_frame
from vision.background.settings import BackgroundSettings
from vision.camera import facing
from vision.registration.key_frames import Landmarks, corners_of, half_size
from vision.registration.mosaic import MosaicBackground
from vision.registration.moving_raster import MovingGroundSurface
from vision.registration.plane_fit import fit_plane, transform
from vision.registration.registration import Registration
from vision.registration.settings import RegistrationSettings
from vision.registration.watch import MovementWatch, noticed_px
from vision.road.boxes import Boxes
from vision.settings import VisionSettings
from vision.video.frames import Frame

Told = tuple[tuple[float, ...], ...]


def told(*arrays: FloatArray | None) -> Told:
    """Round, so that what is equal but for the last bits is equal."""
    return tuple(() if one is None else tuple(np.asarray(one, np.float64).ravel().round(6).tolist()) for one in arrays)


@cache
def first_frame() -> Frame:
    return MovingWorld().frame(view(), 0)


def corners(settings: RegistrationSettings) -> Told:
    """Choose the corners of a picture with texture everywhere, and of one with a few strong ones."""
    luma = half_size(first_frame().luma)
    weak = (90 + 0.1 * luma).astype(np.uint8)
    for i in range(35):
        left, top = 20 + 17 * (i % 7), 20 + 12 * (i // 7)
        cv2.rectangle(weak, (left, top), (left + 3, top + 3), (160,), -1)
    return told(*(corners_of(one, [], settings) for one in (luma, weak)))


def followed(settings: RegistrationSettings) -> Told:
    """Follow the corners into a view that is some metres away."""
    key = first_key(half_size(first_frame().luma), [], settings)
    there = view(east_m=4.0, north_m=1.0, turn_rad=0.02)
    fit, expected = key.follow(half_size(MovingWorld().frame(there, 1).luma), view(), settings)
    return told(None if fit is None else fit.matrix, np.array([expected]))


def known_again(settings: RegistrationSettings) -> Told:
    """Guess a turned view by the looks of corners."""
    key = first_key(half_size(first_frame().luma), [], settings)
    there = half_size(MovingWorld().frame(view(east_m=12.0, turn_rad=0.5), 1).luma)
    return told(*(guess for _, guess in Landmarks(settings).guess(there, [key])))


@cache
def pairs() -> tuple[FloatArray, FloatArray]:
    """Give pairs of points of a tilted view, of which some are off by a little, and some by a lot."""
    rng = np.random.default_rng(1)
    source = rng.uniform(0, 600, (60, 2))
    tilted = np.array([[0.99, 0.05, 12.0], [-0.05, 0.99, -3.0], [2e-5, -3e-5, 1.0]])
    target = transform(tilted, source) + rng.normal(0, 1, (60, 2)) * np.linspace(0, 6, 60)[:, None]
    return source, target


def fitted(settings: RegistrationSettings) -> Told:
    """Fit maps to many pairs, and to a few."""
    source, target = pairs()
    fits = [fit_plane(source[:count], target[:count], settings) for count in (60, 12, 6)]
    return told(*(None if fit is None else fit.matrix for fit in fits))


def located(
    settings: RegistrationSettings, frames: Sequence[Frame], hidden_m: Sequence[FloatArray] = ()
) -> tuple[Told, int]:
    registration = Registration(view(), SIZE, settings)
    maps = [registration.locate(frame, hidden_m if k == 0 else []) for k, frame in enumerate(frames)]
    return told(*maps), registration.key_count


@cache
def flight() -> list[Frame]:
    """Fly along the road and back, turning and zooming."""
    world, frames = MovingWorld(), []
    path = [*np.linspace(0, 90, 25), *np.linspace(84, 0, 15)]
    for k, east_m in enumerate(path):
        frames.append(world.frame(view(east_m=float(east_m), turn_rad=0.004 * k, zoom=1 + 0.012 * k), k))
    return frames


def flown(settings: RegistrationSettings) -> tuple[Told, int]:
    """Follow the flight."""
    return located(settings, flight())


@cache
def hidden_views() -> list[Frame]:
    """Show one place again and again behind more and more fog, from the west and then from the north."""
    frames, rng = [first_frame()], np.random.default_rng(2)
    for k in range(1, 21):
        luma = MovingWorld().frame(view(), k).luma.astype(np.float64)
        part = np.s_[:, : 27 * k] if k < 11 else np.s_[: 16 * (k - 10)]
        luma[part] = rng.normal(100, 12, luma[part].shape)
        frames.append(make_frame(np.clip(luma, 0, 255), index=k, t_us=40_000 * k))
    return frames


def half_seen(settings: RegistrationSettings) -> tuple[Told, int]:
    """Look through the fog, with all corners of the place and with few."""
    rows = [np.array([[0.0, north], [300, north], [300, north + 11], [0, north + 11]]) for north in range(10, 100, 15)]
    many, few = located(settings, hidden_views()), located(settings, hidden_views(), rows)
    return (*many[0], *few[0]), 0


@cache
def jumps() -> list[Frame]:
    """Jump between two frames, farther every time, and after a second in which nothing is seen."""
    frames: list[Frame] = []
    blank = np.full(SIZE[::-1], 90.0)
    for k, east_m in enumerate((0, 12, 0, 18, 0, 24, 0, 34, 0, 44)):
        frames.append(MovingWorld().frame(view(east_m=east_m), k))
    for east_m in (60, 0, 80, 0, 95, 0):
        k = frames[-1].t_us // 40_000
        frames.append(make_frame(blank, index=k + 1, t_us=40_000 * (k + 1)))
        frames.append(MovingWorld().frame(view(east_m=east_m), k + 25))
    return frames


def jumped(settings: RegistrationSettings) -> tuple[Told, int]:
    """Follow the jumps."""
    return located(settings, jumps())


@cache
def places() -> list[Frame]:
    """Fly to and fro over much ground, lose the view, and begin again at the first place."""
    world, frames = MovingWorld(), []
    for k in range(46):
        east_m, north_m = 9.0 * (k % 12 if k // 12 % 2 == 0 else 11 - k % 12), 9.0 * (k // 12)
        frames.append(world.frame(view(east_m=east_m, north_m=north_m), k))
    blank = np.full(SIZE[::-1], 90.0)
    frames += [make_frame(blank, index=k, t_us=40_000 * k) for k in range(46, 50)]
    return frames + [world.frame(view(turn_rad=0.3), k) for k in range(50, 75)]


def found_again(settings: RegistrationSettings) -> tuple[Told, int]:
    """Fly with key frames at every few metres."""
    return located(replace(settings, key_share=0.96), places())


def raster_of(settings: RegistrationSettings) -> Told:
    """Tell which cells are in view, and what the smear of height is while a slanting view moves a little at a time."""
    whole, size_px = VisionSettings(registration=settings), (640, 360)
    slanting = facing(bridge_view(pitch_rad=0.7, height_m=60.0))
    road = np.array([[-60.0, 30], [60, 30], [60, 120], [-60, 120]])
    surface = MovingGroundSurface(slanting, [road], image_size_px=size_px, reach_m=20.0, settings=whole)
    seen = []
    for i in range(6):
        surface.look(slanting @ np.array([[1, 0, 0], [0, 1, 0.7 * i], [0, 0, 1]]))
        boxes = surface.appearances(make_boxes([(3.0, 70.0, 0.3, 4.5, 1.8)])).boxes
        seen += [boxes.length_m, surface.raster.is_seen.sum()]
    return told(*seen)


@cache
def drifting() -> list[Frame]:
    """Drift over the road, five times a second."""
    world = MovingWorld()
    return [world.frame(drift(k), k) for k in range(0, 250, 5)]


def grown(settings: RegistrationSettings) -> list[bytes]:
    """Let the background grow."""
    whole = VisionSettings(
        background=BackgroundSettings(startup_us=2_400_000), registration=settings, car_width_cells=2.0
    )
    surface = MovingGroundSurface(facing(drift(0)), [ROAD], image_size_px=SIZE, reach_m=20.0, settings=whole)
    background, found = MosaicBackground(surface.raster, whole), []
    nobody = Boxes.none(), np.zeros(0, np.bool_)
    for k, frame in zip(range(0, 250, 5), drifting(), strict=True):
        image = surface.raster.rectify(frame, facing(drift(k)))
        if background.is_ready:
            surface.look(facing(drift(k)))
            found.append(background.compare(image).tobytes())
            background.learn(image, np.zeros(surface.raster.packed_size, np.uint8), *nobody)
        else:
            background.hold(image)
    return found


@cache
def wandering() -> list[Frame]:
    """Stand, then drift away slowly."""
    world = MovingWorld()
    return [world.frame(view(east_m=0.03 * max(k - 20, 0)), k) for k in range(0, 160, 2)]


def halves() -> list[Frame]:
    """Show a picture of which five eighths move, and the others stay."""
    world, frames = MovingWorld(), []
    for k in range(0, 60, 5):
        there = world.frame(view(), k).luma.copy()
        moved = world.frame(view(east_m=0.3 * k), k).luma
        there[:, :200] = moved[:, :200]
        frames.append(make_frame(there.astype(np.float64), index=k, t_us=40_000 * k))
    return frames


def noticed(settings: RegistrationSettings) -> object:
    """Watch a camera: when is it said to move?"""
    thresholds = [noticed_px(view(zoom=zoom), SIZE, VisionSettings(registration=settings)) for zoom in (30.0, 1.0)]
    said = []
    for frames, least_px in ((wandering(), settings.moved_px), (wandering(), 0.5), (halves(), 3.0)):
        watch = MovementWatch(SIZE, settings, least_px=least_px)
        said.append([watch.look(frame) for frame in frames])
    return thresholds, said


NOTICED_IN = {
    corners: ("corners", "corner_spacing", "corner_quality", "enough_corners", "corner_border_px"),
    followed: ("window_px",),
    known_again: ("descriptors", "match_ratio"),
    fitted: ("rough_px", "close_px", "least_pairs"),
    flown: ("key_share", "key_zoom", "key_inliers", "redraw_px"),
    half_seen: ("least_inliers", "least_share", "least_spread", "least_likeness"),
    jumped: ("jump_share", "jump_share_per_s"),
    found_again: ("most_keys", "search_us", "search_keys"),
    raster_of: ("border_px", "smear_shift"),
    noticed: ("watch_us", "watch_looks", "moved_px", "moved_widths", "moved_most_widths", "moved_share"),
    grown: ("startup_samples", "later_samples", "residual_cells"),
}


def test_every_number_has_a_scene() -> None:
    assert without_scene(RegistrationSettings(), NOTICED_IN.values()) == []


@pytest.mark.slow
def test_twice_or_half_of_any_number_is_noticed() -> None:
    assert unnoticed(RegistrationSettings(), NOTICED_IN, small=5) == []
