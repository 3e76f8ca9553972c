"""Shadows learned from bright vehicles, and taken off boxes."""

import numpy as np
import pytest

from tests.vision.detection.test_split import SIDE, fill
from tests.vision.support import make_boxes
from vision.detection.blobs import Cells, measure
from vision.detection.settings import DetectionSettings
from vision.detection.shadow import (
    BoolArray,
    FloatArray,
    IntArray,
    Sun,
    measure_shadows,
    without_shadow,
)
from vision.road.boxes import Boxes, distance_to_boxes

SETTINGS = DetectionSettings()
SIZE_M = (4.5, 1.9)
SHADOW_M = np.array([0.7, 1.2])


def car_with_shadow(heading_rad: float) -> tuple[Cells, BoolArray, Boxes]:
    """Cells of a car and its shadow, which of them are shadow, and the box around both."""
    car = make_boxes([(0, 0, heading_rad, *SIZE_M)])
    steps = [(SHADOW_M[0] * k, SHADOW_M[1] * k, heading_rad, *SIZE_M) for k in np.linspace(0, 1, 6)]
    cells = fill(make_boxes(steps))
    return (
        cells,
        distance_to_boxes(cells.points, car)[:, 0] > 0,
        measure(cells, np.array([heading_rad]), SIDE, SETTINGS)[0],
    )


def sun_after(headings: list[float], *, length_m: float = 4.5) -> Sun:
    sun = Sun(SETTINGS)
    for heading_rad in headings * SETTINGS.shadow_measurements:
        cells, is_shadow, boxes = car_with_shadow(heading_rad)
        sun.learn(measure_shadows(cells, is_shadow, boxes, SIDE, SETTINGS), boxes.heading_rad, np.array([length_m]))
    return sun


def unmeasured(count: int) -> tuple[FloatArray, IntArray]:
    return np.zeros((count, 4)), np.zeros(count, np.int64)


def test_borders_of_a_bright_car_are_on_the_sides_of_its_shadow() -> None:
    cells, is_shadow, boxes = car_with_shadow(0.0)
    assert measure_shadows(cells, is_shadow, boxes, SIDE, SETTINGS)[0] == pytest.approx([0.7, 0.0, 1.2, 0.0], abs=0.35)


def test_dark_car_tells_nothing_about_its_shadow() -> None:
    cells, is_shadow, boxes = car_with_shadow(0.0)
    assert np.isnan(measure_shadows(cells, np.ones_like(is_shadow), boxes, SIDE, SETTINGS)).all()


@pytest.mark.parametrize("headings", [[0.0], [0.0, np.pi], [0.5, 2.0, -1.0]], ids=["one way", "both ways", "bends"])
def test_shadows_point_away_from_the_sun_whichever_way_cars_drive(headings: list[float]) -> None:
    sun = sun_after(headings)
    for heading_rad in headings:
        shadow = sun.shadows(np.array([heading_rad]), np.array([4.5]), *unmeasured(1))
        body = without_shadow(car_with_shadow(heading_rad)[2], shadow, SETTINGS)
        assert body.centre_m[0] == pytest.approx([0, 0], abs=0.35)


def test_dark_bonnet_is_not_taken_for_shadow() -> None:
    sun = sun_after([0.0, np.pi])
    borders = np.array([[0.7, 1.9, 1.2, 0.0]])  # dark at the rear, on the sunny side
    shadow = sun.shadows(np.array([0.0]), np.array([4.5]), borders, np.array([800_000]))
    assert shadow[0] == pytest.approx([0.7, 1.2], abs=0.3)


def test_nothing_is_taken_off_until_enough_was_measured() -> None:
    sun = Sun(SETTINGS)
    cells, is_shadow, boxes = car_with_shadow(0.0)
    sun.learn(measure_shadows(cells, is_shadow, boxes, SIDE, SETTINGS), boxes.heading_rad, boxes.length_m)
    assert sun.shadows(np.array([0.0]), np.array([4.5]), *unmeasured(1)).tolist() == [[0, 0]]


def test_long_vehicles_have_longer_shadows() -> None:
    known = sun_after([0.0], length_m=12.0).shadows(np.zeros(2), np.array([4.5, 12.0]), *unmeasured(2))
    guessed = sun_after([0.0]).shadows(np.zeros(2), np.array([4.5, 12.0]), *unmeasured(2))
    assert known[0].tolist() == [0, 0]
    assert known[1] == pytest.approx(SHADOW_M, abs=0.35)
    assert guessed[1] == pytest.approx(1.5 * guessed[0])


def test_a_plausible_vehicle_always_remains() -> None:
    body = without_shadow(make_boxes([(0, 0, 0, 4.5, 2.0)]), np.array([[0.0, 3.0]]), SETTINGS)
    assert body.width_m[0] == pytest.approx(1.6)
    assert body.centre_m[0] == pytest.approx([0.0, -0.2])
