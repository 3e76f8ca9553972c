import numpy as np
import pytest

from tests.vision.support import make_boxes
from tests.vision.test_split import SIDE, fill
from vision.blobs import measure
from vision.boxes import distance_to_boxes
from vision.shadow import MIN_MEASUREMENTS, Sun, measure_shadows, without_shadow

CAR = (0.0, 0.0, 0.3, 4.5, 1.9)
SHADOW_M = np.array([0.7, 1.2])


def test_shadow_of_a_bright_car_is_measured() -> None:
    car = make_boxes([CAR])
    steps = [(SHADOW_M[0] * k, SHADOW_M[1] * k, *CAR[2:]) for k in np.linspace(0, 1, 6)]
    cells = fill(make_boxes(steps))
    is_shadow = distance_to_boxes(cells.points, car)[:, 0] > 0
    boxes = measure(cells, np.array([0.3]), SIDE).boxes
    measured = measure_shadows(cells, is_shadow, boxes, SIDE)
    assert measured[0] == pytest.approx(SHADOW_M, abs=0.5)
    body = without_shadow(boxes, measured)
    assert body.centre_m[0] == pytest.approx([0, 0], abs=0.3)


def test_dark_car_tells_nothing_about_its_shadow() -> None:
    cells = fill(make_boxes([CAR]))
    boxes = measure(cells, np.array([0.3]), SIDE).boxes
    assert np.isnan(measure_shadows(cells, np.ones(len(cells.group), np.bool_), boxes, SIDE)).all()


def test_dark_ends_on_both_sides_are_no_shadow() -> None:
    cells = fill(make_boxes([(0, 0, 0, 4.5, 1.9)]))
    is_dark = np.abs(cells.points[:, 0]) > 1.7
    boxes = measure(cells, np.array([0.0]), SIDE).boxes
    assert measure_shadows(cells, is_dark, boxes, SIDE)[0] == pytest.approx([0, 0], abs=0.01)


def test_sun_is_the_median_of_each_kind_of_vehicle_and_zero_at_first() -> None:
    sun = Sun()
    lengths = np.array([4.5, 12.0])
    assert sun.shadows(lengths).tolist() == [[0, 0], [0, 0]]
    measured = np.tile(SHADOW_M, (MIN_MEASUREMENTS + 2, 1))
    measured[0] = [50.0, 50.0]
    sun.learn(measured, np.full(len(measured), 4.5))
    assert sun.shadows(lengths).tolist() == [SHADOW_M.tolist(), [0, 0]]


def test_a_plausible_vehicle_always_remains() -> None:
    body = without_shadow(make_boxes([(0, 0, 0, 4.5, 2.0)]), np.array([[0.0, 3.0]]))
    assert body.width_m[0] == pytest.approx(1.6)
    assert body.centre_m[0] == pytest.approx([0.0, -0.2])
