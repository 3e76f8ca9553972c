"""Height smeared over the road, and taken off again."""

import numpy as np
import pytest

from tests.vision.road.test_view import SIZE, bridge_view
from tests.vision.support import make_boxes, top_view
from vision.road.parallax import Parallax
from vision.road.view import GroundView
from vision.settings import VisionSettings


def parallax_of(height_m: float, pitch_rad: float) -> Parallax:
    matrix = bridge_view(height_m=height_m, pitch_rad=pitch_rad)
    return Parallax(GroundView(matrix, SIZE, VisionSettings()), VisionSettings())


def test_camera_straight_above_changes_nothing() -> None:
    boxes = make_boxes([(20, 20, 0.3, 4.5, 1.8)])
    parallax = Parallax(GroundView(top_view(SIZE), SIZE, VisionSettings()), VisionSettings())
    assert parallax.footprints(boxes) is boxes
    assert parallax.appearances(boxes) is boxes


@pytest.mark.parametrize("heading_rad", [0.0, np.pi / 2, 1.0])
def test_footprints_undo_appearances(heading_rad: float) -> None:
    parallax = parallax_of(40.0, 0.7)
    footprints = make_boxes([(3.0, 55.0, heading_rad, 4.5, 1.8)])
    seen = parallax.appearances(footprints)
    assert seen.length_m[0] * seen.width_m[0] > 1.2 * 4.5 * 1.8
    back = parallax.footprints(seen)
    assert back.centre_m[0] == pytest.approx([3.0, 55.0], abs=0.2)
    assert back.length_m[0] == pytest.approx(4.5, abs=0.2)


def test_usual_car_is_assumed_where_height_hides_the_length() -> None:
    seen = make_boxes([(0.0, 80.0, np.pi / 2, 16.0, 1.9)])
    footprint = parallax_of(12.0, 0.2).footprints(seen)
    assert footprint.length_m[0] == pytest.approx(4.5)
    # The end towards the camera stays where it is.
    assert footprint.centre_m[0, 1] - 4.5 / 2 == pytest.approx(80.0 - 8.0)
