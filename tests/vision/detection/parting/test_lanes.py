"""Lanes on the raster: whose cell, which way, and what fills two of them."""

from collections.abc import Callable

import numpy as np
import pytest

from tests.vision.support import make_boxes
from vision.detection.blobs import Cells, find_blobs
from vision.detection.parting.lanes import LaneField, LaneStrip, borders_of
from vision.detection.settings import DetectionSettings
from vision.road.boxes import Boxes
from vision.road.grid import Grid
from vision.road.rectify import RoadCells

GRID = Grid.between(np.array([0.0, 0.0]), np.array([60.0, 12.0]), side=0.3, is_north_up=True)
EAST = LaneStrip(np.array([[0.0, 4.0], [60.0, 4.0]]), 3.3)
ALSO_EAST = LaneStrip(np.array([[0.0, 7.3], [60.0, 7.3]]), 3.3)
WEST = LaneStrip(np.array([[60.0, 10.6], [0.0, 10.6]]), 3.3)
SETTINGS = DetectionSettings()
FIELD = LaneField(GRID, [EAST, ALSO_EAST, WEST], SETTINGS)
LIT = 0


def blobs(boxes: Boxes) -> Cells:
    """The groups of cells that boxes cover."""
    nowhere = np.zeros(GRID.shape, np.bool_)
    raster = RoadCells(GRID, road=~nowhere, view_edge=nowhere)
    mask = GRID.paint(boxes.corners())
    return find_blobs(raster, mask, 100 * mask)


def light_of(level: int) -> Callable[[np.ndarray], np.ndarray]:
    """The same light everywhere."""
    return lambda points: np.full(len(points), level, np.uint8)


def test_places_have_the_lane_and_direction_of_the_strip_that_they_are_in() -> None:
    points = np.array([[10.0, 4.0], [10.0, 7.0], [10.0, 10.6], [10.0, 0.5]])
    lane, heading_rad = FIELD.lanes_at(points)
    assert lane.tolist() == [1, 2, 3, 0]
    assert np.cos(heading_rad[:3]) == pytest.approx([1, 1, -1], abs=1e-6)


def test_lanes_that_cross_leave_nothing_known() -> None:
    north = LaneStrip(np.array([[30.0, 0.0], [30.0, 12.0]]), 3.3)
    lane, _ = LaneField(GRID, [EAST, north], SETTINGS).lanes_at(np.array([[30.0, 4.0], [30.0, 8.0], [10.0, 4.0]]))
    assert lane.tolist() == [0, 2, 1]


def test_two_cars_side_by_side_in_one_blob_are_parted() -> None:
    pair = blobs(make_boxes([(20, 4, 0, 4.5, 1.8), (21, 7.3, 0, 4.5, 1.8), (20.5, 5.6, 0, 3, 2.0)]))
    assert pair.count == 1
    parts = FIELD.parts(pair, light_of(LIT))
    assert set(parts.tolist()) == {1, 2}
    assert set(parts[pair.points[:, 1] < 4.8].tolist()) == {1}
    assert set(parts[pair.points[:, 1] > 6.6].tolist()) == {2}


def test_group_known_to_be_one_vehicle_is_not_looked_into() -> None:
    rows = [(20, 4, 0, 4.5, 1.8), (21, 7.3, 0, 4.5, 1.8), (20.5, 5.6, 0, 3, 2.0)]
    pairs = blobs(make_boxes([*rows, *((x + 20, *rest) for x, *rest in rows)]))
    assert pairs.count == 2
    parts = FIELD.parts(pairs, light_of(LIT), np.array([True, False]))
    assert np.array_equal(parts > 0, pairs.group == 1)


@pytest.mark.parametrize(
    "rows",
    [
        pytest.param([(20, 4, 0, 4.5, 1.8)], id="one car"),
        pytest.param([(20, 5.6, 0, 4.5, 1.8)], id="one car that changes lanes"),
        pytest.param([(20, 4.5, 0, 4.5, 3.0)], id="one car with its shadow"),
    ],
)
def test_one_vehicle_is_not_parted(rows: list[tuple[float, float, float, float, float]]) -> None:
    assert not FIELD.parts(blobs(make_boxes(rows)), light_of(LIT)).any()


def test_evenly_dark_lane_beside_a_vehicle_is_its_shadow() -> None:
    van = blobs(make_boxes([(20, 4, 0, 6, 2.0), (20, 6.5, 0, 6, 3.4)]))

    def light(points: np.ndarray) -> np.ndarray:
        return np.where(points[:, 1] > 5.0, 45, LIT).astype(np.uint8)

    assert FIELD.parts(van, light_of(LIT)).any()
    assert not FIELD.parts(van, light).any()


def test_truck_whose_shadow_fills_the_next_lane_is_one_vehicle_and_two_trucks_are_not() -> None:
    both = blobs(make_boxes([(20, 5.5, 0, 12.0, 5.0)]))

    def light(points: np.ndarray) -> np.ndarray:
        return np.where(points[:, 1] > 5.5, 55, LIT).astype(np.uint8)

    assert not FIELD.parts(both, light).any()
    assert set(FIELD.parts(both, light_of(LIT)).tolist()) == {1, 2}


def test_borders_are_where_lanes_end_and_not_where_vehicles_drive() -> None:
    north = LaneStrip(np.array([[30.0, 0.0], [30.0, 12.0]]), 3.3)
    borders = borders_of([north], GRID, SETTINGS)[20]
    middle_m = GRID.first[0] + GRID.side * np.arange(len(borders))
    assert not borders[np.abs(middle_m - 30.0) < 0.9].any()
    assert borders[np.abs(np.abs(middle_m - 30.0) - 1.65) < 0.25].all()
    assert not borders[np.abs(middle_m - 30.0) > 2.6].any()


def test_groups_take_the_direction_of_the_lane_that_holds_most_of_them() -> None:
    cells = blobs(make_boxes([(20, 4, 0, 4.5, 1.8), (40, 10.6, 0, 4.5, 1.8), (50, 0.7, 0, 4.5, 1.2)]))
    heading_rad, is_known = FIELD.headings(cells)
    by_place = np.argsort([cells.points[cells.group == group][:, 0].mean() for group in range(3)])
    assert is_known[by_place].tolist() == [True, True, False]
    assert np.cos(heading_rad[by_place][:2]) == pytest.approx([1, -1], abs=1e-6)
