"""Every number that rooms of vision share matters: twice or half of it changes what is told of a scene made for it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from tests.turned import unnoticed
from tests.vision.road.test_rectify import ground_surface
from tests.vision.road.test_view import SIZE, bridge_view
from tests.vision.support import FloatArray, make_boxes, top_view
from tests.vision.test_adapter import published
from tests.vision.test_detection_camera import ROAD, SIZE_PX, VIEW, Seer
from tests.vision.tracking.test_tracker import STEP_US, detect, everywhere
from vision.camera import box_camera, thermal_settings
from vision.networks.box_detector import Instant
from vision.networks.stored_detections import StoredInstant
from vision.road.parallax import Parallax
from vision.road.view import GroundView
from vision.settings import VisionSettings
from vision.tracking.tracker import Tracker


def narrow_road(settings: VisionSettings) -> object:
    """Look at a road from near above: how large are its cells, and how wide is what is watched of it?"""
    size_px = (200, 120)
    road = np.array([[0.0, 4.0], [20.0, 4.0], [20.0, 8.0], [0.0, 8.0]])
    raster = ground_surface(top_view(size_px, 0.1), [road], size_px, settings).raster
    return raster.grid.side, raster.grid.side * int(raster.road.any(axis=1).sum())


def distance(settings: VisionSettings) -> object:
    """Look along a road, in colour and by its warmth: how far does the view reach?"""
    views = [GroundView(bridge_view(), SIZE, one) for one in (settings, thermal_settings(settings))]
    along = np.column_stack([np.zeros(400), np.arange(400.0)])
    return [int(view.sees(along).sum()) for view in views]


def hidden_by_its_height(settings: VisionSettings) -> object:
    """Look at cars from low above the road, along it and across: how long and wide are they?"""
    view = GroundView(bridge_view(height_m=12.0, pitch_rad=0.2), SIZE, settings)
    seen = make_boxes(
        [(0.0, 80.0, np.pi / 2, 16.0, 1.9), (0.0, 80.0, 0.0, 5.0, 12.0), (0.0, 30.0, np.pi / 2, 8.0, 1.9)]
    )
    found = Parallax(view, settings).footprints(seen)
    return np.column_stack([found.length_m, found.width_m]).round(1).tolist()


def half_in_view(settings: VisionSettings) -> object:
    """See the front of a car that comes into view: how long and wide is it told to be?"""
    tracker = Tracker(settings, everywhere)
    for k in range(30):
        tracker.predict(k * STEP_US)
        told = tracker.update(detect([(0.5 * k, 0.0, 0.0, 1.2, 0.8)], cut=[-1]))
    return told.length_m.tolist(), told.width_m.tolist()


class Listener:
    """A camera above the road that keeps the outlines it was told."""

    def __init__(self) -> None:
        self.outlines_m: list[FloatArray] = []

    refusal = "told to be lost"

    def locate(self, instant: Instant, vehicles_m: Sequence[FloatArray]) -> FloatArray:
        self.outlines_m += vehicles_m
        return VIEW


def outlines(settings: VisionSettings) -> object:
    """Watch a car from a moving camera: what is its registration told to leave out?"""
    listener = Listener()
    camera = box_camera(
        Seer(lambda t_s: [(20 + 12 * t_s, 38.0, 0.0, 4.5, 1.8)]), [ROAD], SIZE_PX, motion=listener, settings=settings
    )
    for k in range(3):
        list(camera.observe(StoredInstant(k, k * STEP_US)))
    return [np.ptp(one, axis=0).round(1).tolist() for one in listener.outlines_m]


def short_losses(settings: VisionSettings) -> object:
    """Lose the view for 0.2 s and 0.4 s: is it told?"""
    return published([*range(5, 10), *range(20, 30)], 40, settings)


# Which scene notices which number.
NOTICED_IN = {
    narrow_road: ("car_width_m", "car_width_cells", "road_margin_m"),
    distance: ("max_metres_per_pixel", "thermal_metres_per_pixel"),
    hidden_by_its_height: ("usual_length_m", "usual_width_m", "usual_height_m"),
    half_in_view: ("usual_length_m", "usual_width_m"),
    outlines: ("outline_margin_m",),
    short_losses: ("bridged_us",),
}


def test_twice_or_half_of_any_number_is_noticed() -> None:
    assert unnoticed(VisionSettings(), NOTICED_IN, small=5) == []
