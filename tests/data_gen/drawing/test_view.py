"""What the camera sees."""

import numpy as np
import pytest

from data_gen.drawing.view import camera_over, corners_m
from data_gen.scenario import View
from tests.data_gen.support import states_of

SEEN = camera_over(View(centre_m=(500.0, 0.0), width_m=600.0), (1280, 720))


def test_the_image_covers_the_view() -> None:
    outline_m = SEEN.camera.view_outline(*SEEN.size_px)
    assert outline_m.min(axis=0) == pytest.approx([200.0, -168.75])
    assert outline_m.max(axis=0) == pytest.approx([800.0, 168.75])


def test_a_centre_just_outside_is_not_in_view() -> None:
    assert SEEN.contains(np.array([[200.1, 0.0], [199.9, 0.0], [500.0, 169.0]])).tolist() == [True, False, False]


def test_a_car_with_its_front_in_the_image_touches_it() -> None:
    states = states_of(("in", 198.5, 0.0, 0.0), ("out", 197.0, 0.0, 0.0))
    assert SEEN.touches(states).tolist() == [True, False]
    assert not SEEN.contains(states.centre_m).any()


def test_corners_run_counter_clockwise_from_the_rear_right() -> None:
    corners = corners_m(states_of(("north", 10.0, 20.0, np.pi / 2)))[0]
    assert corners == pytest.approx(np.array([[10.9, 17.75], [10.9, 22.25], [9.1, 22.25], [9.1, 17.75]]))
