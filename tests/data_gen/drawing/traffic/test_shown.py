"""Shares are counted on pixels, boxes are those of the bodies, and what stands in front hides."""

import math

import numpy as np
import pytest

from data_gen.drawing.cameras import CameraPath
from data_gen.drawing.ground.standing import Standing
from data_gen.drawing.overlay import Overlay
from data_gen.drawing.sun import Sun
from data_gen.drawing.traffic.shown import Shown, ShownCounter
from data_gen.drawing.traffic.solid_painter import SolidPainter
from data_gen.drawing.view import CameraView
from data_gen.simulation.states import VehicleStates
from gis.cameras.camera_pose import CameraPose, CameraTrack
from tests.data_gen.support import states_of

SIZE_PX = (640, 360)
NO_SUN = Sun(shadow_rad=0.0, shadow_slope=1.0, phases_rad=(0.0, 0.0), is_hidden=True)
POSE = CameraPose(0.0, 0.0, 6.0, 0.0, math.radians(-8), 0.0, 900.0)
VIEW = CameraView(POSE.camera(*SIZE_PX), SIZE_PX, POSE)


def look(states: VehicleStates, standing: Standing | None = None) -> Shown:
    t_us = np.array([0])
    path = CameraPath("mast", (VIEW,), CameraTrack(t_us, (POSE,)), np.zeros((1, 2)), (0, -50, 200, 50), 0.02)
    overlay = Overlay((), pixel_m=0.1, sun=NO_SUN, rng=np.random.default_rng(1))
    return ShownCounter(path, overlay, standing).look(states, VIEW)


def wall(away_m: float) -> Standing:
    """Let something grey stand before the left half of the picture."""
    bgra = np.zeros((SIZE_PX[1], SIZE_PX[0], 4), dtype=np.uint8)
    distance_m = np.full(bgra.shape[:2], np.inf, dtype=np.float32)
    bgra[:, : SIZE_PX[0] // 2] = (90, 90, 90, 255)
    distance_m[:, : SIZE_PX[0] // 2] = away_m
    return Standing(bgra, distance_m)


def test_a_lone_vehicle_shows_whole() -> None:
    shown = look(states_of(("a", 40.0, 0.0, 0.0)))
    assert shown.rows.tolist() == [0]
    assert shown.share.tolist() == [1.0]


def test_the_nearer_of_two_in_a_column_hides_the_other_in_part() -> None:
    shown = look(states_of(("far", 47.0, 0.0, 0.0), ("near", 40.0, 0.0, 0.0)))
    assert shown.share[1] == 1.0
    assert 0.1 < shown.share[0] < 0.9


def test_the_share_is_what_is_left_of_the_drawn_pixels() -> None:
    apart = states_of(("far", 47.0, 0.8, 0.0)), states_of(("near", 40.0, 0.0, 0.0))
    far, near = (drawn(states) for states in apart)
    both = look(states_of(("far", 47.0, 0.8, 0.0), ("near", 40.0, 0.0, 0.0)))
    assert both.share[0] == pytest.approx((far & ~near).sum() / far.sum(), abs=0.04)


def drawn(states: VehicleStates) -> np.ndarray:
    """Find the pixels of a body: where it does not matter how bright the ground is."""
    pictures = []
    for ground in (0, 255):
        canvas = np.full((SIZE_PX[1], SIZE_PX[0], 3), ground, dtype=np.uint8)
        SolidPainter(SIZE_PX, NO_SUN, detailed=True).draw(canvas, states, VIEW)
        pictures.append(canvas[:, :, 0].astype(np.int64))
    return np.asarray(np.abs(pictures[1] - pictures[0]) < 60)


def test_the_box_holds_the_drawn_pixels_closely() -> None:
    states = states_of(("a", 40.0, 3.0, 0.6))
    left, top, right, bottom = look(states).box_px[0]
    rows, columns = np.nonzero(drawn(states))
    assert left == pytest.approx(columns.min() - 0.5, abs=1.5)
    assert right == pytest.approx(columns.max() + 0.5, abs=1.5)
    assert top == pytest.approx(rows.min() - 0.5, abs=1.5)
    # Under the body its own dark counts as drawn.
    assert bottom == pytest.approx(rows.max() + 0.5, abs=4)


def test_a_box_ends_at_the_border_of_the_image() -> None:
    shown = look(states_of(("a", 25.0, 8.4, 0.0)))
    assert shown.box_px[0, 0] == -0.5
    assert shown.box_px[0, 2] < 200


@pytest.mark.parametrize(("away_m", "share"), [(20.0, 0.5), (60.0, 1.0)])
def test_what_stands_hides_only_what_is_behind_it(away_m: float, share: float) -> None:
    states = states_of(("a", 40.0, 0.0, 0.0))
    assert look(states, wall(away_m)).share[0] == pytest.approx(share, abs=0.06)
    canvas = np.zeros((SIZE_PX[1], SIZE_PX[0], 3), dtype=np.uint8)
    canvas[:, : SIZE_PX[0] // 2] = 90
    before = canvas.copy()
    SolidPainter(SIZE_PX, NO_SUN, detailed=True, standing=wall(away_m)).draw(canvas, states, VIEW)
    is_same = (canvas == before)[:, : SIZE_PX[0] // 2 - 1].all()
    assert is_same == (share < 1)
