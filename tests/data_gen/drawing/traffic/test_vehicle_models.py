"""Every vehicle fits into its true length and width, and reaches its class's height."""

from typing import get_args

import numpy as np
import pytest
import shapely

from data_gen.drawing.traffic.vehicle_models import VehicleLooks, height_m, vehicle_parts
from data_gen.scenario import VehicleClass
from tests.cases import for_each

SIZES_M: dict[VehicleClass, tuple[float, float]] = {
    "car": (4.5, 1.8),
    "van": (5.8, 2.0),
    "truck": (10.0, 2.5),
    "bus": (12.0, 2.55),
    "motorcycle": (2.2, 0.8),
}


@for_each("vehicle_class", get_args(VehicleClass))
@for_each("appearance", range(12))
def test_the_parts_fill_the_body_and_stay_within_it(vehicle_class: VehicleClass, appearance: int) -> None:
    length_m, width_m = SIZES_M[vehicle_class]
    parts = vehicle_parts(VehicleLooks(vehicle_class, length_m, width_m, appearance))
    outlines = [shapely.Polygon(outline_m) for part in parts for outline_m in (part.base_m, part.top_m)]
    assert all(outline.is_valid and outline.exterior.is_ccw for outline in outlines)
    whole = shapely.union_all(outlines)
    assert whole.bounds == pytest.approx((-length_m / 2, -width_m / 2, length_m / 2, width_m / 2), abs=0.01)
    assert max(part.top_height_m for part in parts) == height_m(vehicle_class)
    assert all(0 <= part.base_height_m <= part.top_height_m for part in parts)


def test_cars_differ_in_colour_and_some_are_as_grey_as_the_road() -> None:
    looks = [VehicleLooks("car", 4.5, 1.8, appearance) for appearance in range(300)]
    greys = np.array([np.mean(vehicle_parts(item)[0].top) for item in looks])
    assert np.percentile(greys, 5) < 60
    assert np.percentile(greys, 95) > 200
    assert 0.04 < np.mean(np.abs(greys - 106) < 14) < 0.3
