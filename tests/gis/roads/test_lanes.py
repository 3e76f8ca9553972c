"""Roads out of lanes, and their reference lines."""

from __future__ import annotations

import numpy as np
import pytest

from gis.errors import GisError
from gis.roads.lanes import Lane, border_gap, roads_of
from tests.gis.support import straight_lane


def lane_at(y_m: float, direction: int, name: str) -> Lane:
    return straight_lane(name, y_m=y_m, direction=direction, road="r")


def test_the_reference_line_of_a_one_way_road_is_its_left_border() -> None:
    (road,) = roads_of([lane_at(0.0, 1, "right"), lane_at(3.5, 1, "left")])
    assert road.reference_line_m.tolist() == [[0.0, 5.25], [100.0, 5.25]]
    assert road.lanes == ("right", "left")


def test_the_reference_line_of_a_two_way_road_is_the_shared_border() -> None:
    lanes = [lane_at(-5.25, 1, "a"), lane_at(-1.75, 1, "b"), lane_at(1.75, -1, "c"), lane_at(5.25, -1, "d")]
    assert roads_of(lanes)[0].reference_line_m.tolist() == [[0.0, 0.0], [100.0, 0.0]]


def test_where_traffic_keeps_left_the_reference_line_is_still_the_shared_border() -> None:
    lanes = [lane_at(1.75, 1, "a"), lane_at(-1.75, -1, "b")]
    assert roads_of(lanes)[0].reference_line_m.tolist() == [[0.0, 0.0], [100.0, 0.0]]


def test_a_gap_between_the_directions_is_shared_evenly() -> None:
    lanes = [lane_at(-2.25, 1, "a"), lane_at(2.25, -1, "b")]
    assert border_gap(lanes[:1], lanes[1:]) == pytest.approx(1.0)
    assert roads_of(lanes)[0].reference_line_m.tolist() == [[0.0, 0.0], [100.0, 0.0]]


def test_one_strip_driven_in_both_directions_has_its_middle_as_reference_line() -> None:
    lanes = [lane_at(0.0, 1, "a"), lane_at(0.0, -1, "b")]
    assert roads_of(lanes)[0].reference_line_m.tolist() == [[0.0, 0.0], [100.0, 0.0]]


def test_a_road_with_only_lanes_against_it_runs_against_them() -> None:
    (road,) = roads_of([lane_at(0.0, -1, "a")])
    assert road.reference_line_m.tolist() == [[0.0, -1.75], [100.0, -1.75]]


@pytest.mark.parametrize(
    ("direction", "width_m", "speed_mps", "message"),
    [
        (0, 3.5, 20.0, "direction must be +1 or -1, got 0"),
        (1, 0.0, 20.0, "width_m must be > 0 metres, got 0.0"),
        (1, np.inf, 20.0, "width_m must be > 0 metres, got inf"),
        (1, 3.5, -1.0, "speed_limit_mps must be > 0 m/s, got -1.0"),
        (1, 3.5, np.nan, "speed_limit_mps must be > 0 m/s, got nan"),
    ],
    ids=["direction", "no width", "endless width", "negative speed", "no speed"],
)
def test_a_lane_out_of_range_is_an_error(direction: int, width_m: float, speed_mps: float, message: str) -> None:
    with pytest.raises(GisError) as caught:
        Lane("a", "a", 0, "a", direction, np.array([[0.0, 0.0], [1.0, 0.0]]), width_m, speed_mps)
    assert str(caught.value) == f"lane 'a': {message}"
