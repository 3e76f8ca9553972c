"""Oriented boxes: corners, margins, distances."""

import numpy as np
import pytest

from tests.vision.support import make_boxes
from vision.road.boxes import distance_to_boxes, wrap_angle


def test_corners_turn_with_the_heading() -> None:
    box = make_boxes([(0, 0, np.pi / 2, 4, 2)])
    assert box.corners()[0].tolist() == [[-1, 2], [-1, -2], [1, -2], [1, 2]]


def test_margin_moves_every_side() -> None:
    box = make_boxes([(0, 0, 0, 4, 2)])
    assert np.abs(box.corners(0.5)[0]).tolist() == [[2.5, 1.5]] * 4


def test_distance_is_measured_in_the_axes_of_the_box() -> None:
    box = make_boxes([(10, 0, np.pi / 2, 4, 2)])
    points_m = np.array([[10.0, 3.0], [12.0, 0.0], [10.0, 0.0]])
    assert distance_to_boxes(points_m, box).ravel() == pytest.approx([1.0, 1.0, -1.0])


def test_angles_end_at_plus_pi() -> None:
    assert wrap_angle(np.array([-np.pi, np.pi, 2.5 * np.pi])) == pytest.approx([np.pi, np.pi, np.pi / 2])
