"""Every number of the road's raster matters: twice or half of it changes what is said of a small scene."""

from __future__ import annotations

import cv2
import numpy as np

from tests.turned import unnoticed
from tests.vision.moving_world import ROAD, SIZE, drift
from tests.vision.road.test_view import bridge_view
from tests.vision.support import make_boxes
from vision.camera import facing
from vision.errors import VisionError
from vision.registration.moving_raster import MovingGroundSurface
from vision.road.grid import Grid
from vision.road.parallax import Parallax
from vision.road.rectify import RoadCells
from vision.road.road_colour import RoadColour
from vision.road.scale import estimate_scale
from vision.road.settings import RoadSettings
from vision.road.view import GroundView
from vision.settings import VisionSettings


def footprints(settings: RoadSettings) -> object:
    """Cut the smear of height off boxes that are hardly longer or wider than it, from steep and slanting views."""
    whole, found = VisionSettings(road=settings), []
    for pitch_rad in (0.35, 0.7, 1.2, 1.5):
        view = GroundView(bridge_view(pitch_rad=pitch_rad, height_m=40.0), (640, 360), whole)
        middle_m = view.seen_ground().mean(axis=0)
        for heading_rad in (0.0, 1.57):
            boxes = make_boxes([(*middle_m, heading_rad, 1.0 + 0.7 * i, 1.0 + 0.4 * i) for i in range(8)])
            cut = Parallax(view, whole).footprints(boxes)
            found.append((cut.length_m.tolist(), cut.width_m.tolist()))
    return found


def view_edge(settings: RoadSettings) -> object:
    """Mark the edge of a moving view."""
    whole = VisionSettings(road=settings)
    surface = MovingGroundSurface(facing(drift(0)), [ROAD], image_size_px=SIZE, reach_m=20.0, settings=whole)
    surface.look(facing(drift(0)))
    return int(surface.raster.view_edge.sum())


def usual_colour(settings: RoadSettings) -> object:
    """Tell the colour of a road around each cell that grows brighter to the east, and has little bare road there."""
    rng = np.random.default_rng(0)
    grid = Grid(np.array([0.0, 0.0]), 1.0, (40, 120), is_north_up=True)
    cells = RoadCells(grid, road=np.ones(grid.shape, np.bool_), view_edge=np.zeros(grid.shape, np.bool_))
    levels = 100.0 + 0.3 * np.arange(120) + rng.normal(0, 3, grid.shape)
    is_hidden = rng.random(grid.shape) < np.linspace(0, 1.05, 120)
    seen = np.where(is_hidden, rng.uniform(0, 80, grid.shape), levels)
    planes = np.stack([seen] * 3).reshape(3, -1).astype(np.float32)
    return RoadColour(cells, settings, car_cells=4.0).around(planes).tobytes()


def scale(settings: RoadSettings) -> object:
    """Estimate scales from things of all sizes, contrasts and shapes, in pictures of which there are few."""
    rng, whole, found = np.random.default_rng(1), VisionSettings(road=settings), []
    for count, things in ((12, 6), (12, 1), (7, 2), (4, 6)):
        pictures = []
        for _ in range(count):
            picture = np.clip(100 + rng.normal(0, 2, (160, 320)), 0, 255).astype(np.uint8)
            for x, y in rng.uniform((15, 15), (300, 140), (things, 2)).astype(int).tolist():
                side, level = int(rng.integers(3, 14)), 100 + int(rng.choice((12, 18, 30, 60)))
                if rng.random() < 0.5:
                    cv2.rectangle(picture, (x, y), (x + side, y + side // 2), (level,), -1)
                else:
                    corner = np.array([[x, y], [x, y + side], [x + side, y + side]])
                    cv2.polylines(picture, [corner], False, (level,), 3)
            pictures.append(picture)
        try:
            found.append(estimate_scale(pictures, whole))
        except VisionError as error:
            found.append(str(error))
    return found


def specks(settings: RoadSettings) -> object:
    """Estimate a scale where specks outnumber cars that are about five times as long."""
    pictures = [np.full((160, 320), 100, np.uint8) for _ in range(9)]
    for i, picture in enumerate(pictures):
        for k in range(4):
            cv2.rectangle(picture, (15 + 30 * i, 15 + 30 * k), (22 + 30 * i, 22 + 30 * k), (180,), -1)
        cv2.rectangle(picture, (10 + 30 * i, 130), (49 + 30 * i, 148), (200,), -1)
    return estimate_scale(pictures, VisionSettings(road=settings))


NOTICED_IN = {
    footprints: ("steep_sine", "least_length_m", "least_width_m"),
    view_edge: ("edge_cells",),
    usual_colour: ("plain_levels", "plain_around_widths", "least_plain_widths2"),
    scale: (
        *("scale_difference_levels", "scale_least_pictures", "scale_least_blobs"),
        *("scale_least_area_px", "scale_least_fill", "scale_alike"),
    ),
    specks: ("scale_least_part",),
}


def test_twice_or_half_of_any_number_is_noticed() -> None:
    assert unnoticed(RoadSettings(), NOTICED_IN, small=5) == []
