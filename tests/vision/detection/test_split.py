"""Merged blobs divided by predicted boxes, fragments joined."""

import numpy as np
import pytest

from tests.vision.support import make_boxes
from vision.detection.blobs import Cells
from vision.detection.settings import DetectionSettings
from vision.detection.split import Ownership, assign_cells
from vision.detection.surfaces.surface import Appearances
from vision.road.boxes import Boxes

SIDE = 0.45


def fill(*blobs: Boxes) -> Cells:
    """One blob of cells per set of boxes: all cell centres inside any of them."""
    axis = np.arange(-40, 41) * SIDE
    centres = np.stack(np.meshgrid(axis, axis), axis=-1).reshape(-1, 2)
    points, key = [], []
    for number, boxes in enumerate(blobs):
        inside = np.zeros(len(centres), np.bool_)
        for centre, heading, length, width in zip(
            boxes.centre_m, boxes.heading_rad, boxes.length_m, boxes.width_m, strict=True
        ):
            turned = (centres - centre) @ np.array(
                [[np.cos(heading), -np.sin(heading)], [np.sin(heading), np.cos(heading)]]
            )
            inside |= np.all(np.abs(turned) <= np.array([length, width]) / 2, axis=1)
        points.append(centres[inside])
        key.append(np.full(int(inside.sum()), number))
    flat = np.concatenate(points)
    count = len(flat)
    raw = Cells(
        flat, np.zeros(count, np.intp), np.full(count, 99, np.uint8), np.zeros(count, np.bool_), np.zeros(1, np.intp),
        np.zeros(1, np.intp),
    )  # fmt: skip
    return raw.regroup(np.concatenate(key))


def assign(cells: Cells, predicted: Boxes, bodies: Boxes | None = None, *, is_sized: bool = False) -> Ownership:
    seen = Appearances(predicted, np.ones(len(predicted)))
    sized = np.full(len(predicted), is_sized)
    return assign_cells(cells, seen, lambda: bodies or predicted, sized, side=SIDE, settings=DetectionSettings())


@pytest.mark.parametrize("seed", range(6))
def test_cells_of_a_merged_blob_go_to_the_nearest_predicted_box(seed: int) -> None:
    rng = np.random.default_rng(seed)
    gap = rng.uniform(2.4, 3.2)
    rows = [(rng.uniform(-1, 1), gap * i, rng.uniform(-0.05, 0.05), 4.5, 1.9) for i in range(3)]
    cars = make_boxes(rows)
    blob = make_boxes([*rows, (0, gap, 0, 3, 3 * gap)])  # the last one glues them together
    cells = fill(blob)
    owner = assign(cells, cars).owner
    for point, got in zip(cells.points, owner, strict=True):
        distances = []
        for centre, heading, length, width in zip(
            cars.centre_m, cars.heading_rad, cars.length_m, cars.width_m, strict=True
        ):
            east, north = point - centre
            along = abs(east * np.cos(heading) + north * np.sin(heading)) - length / 2
            across = abs(north * np.cos(heading) - east * np.sin(heading)) - width / 2
            distances.append(max(along, across))
        inside = [i for i, d in enumerate(distances) if d < 0]
        assert got == (inside[0] if inside else got)
        assert distances[got] <= min(distances) + 0.02


def test_two_cars_side_by_side_are_divided() -> None:
    cars = make_boxes([(0, 0, 0, 4.5, 1.9), (0.6, 2.2, 0, 4.5, 1.9)])
    result = assign(fill(cars), cars)
    assert set(result.owner) == {0, 1}
    assert result.is_divided.all()


def test_cars_apart_keep_their_blobs_whole() -> None:
    cars = make_boxes([(0, 0, 0, 4.5, 1.9), (9, 0, 0, 4.5, 1.9)])
    result = assign(fill(cars.select(np.array([0])), cars.select(np.array([1]))), cars)
    assert result.owner.tolist() == sorted(result.owner.tolist())
    assert not result.is_divided.any()


def test_phantom_on_a_car_does_not_halve_it() -> None:
    car = make_boxes([(0.1, 0.1, 0, 4.5, 1.9)])
    with_phantom = make_boxes([(0.1, 0.1, 0, 4.5, 1.9), (1.2, 0.3, 0, 4.0, 1.9)])
    result = assign(fill(car), with_phantom)
    assert set(result.owner) == {0}
    assert not result.is_divided.any()


def test_fragments_in_one_box_become_one_object() -> None:
    car = make_boxes([(0, 0, 0, 4.5, 1.9)])
    bonnet, rear = make_boxes([(1.5, 0, 0, 1.3, 1.9)]), make_boxes([(-1.5, 0, 0, 1.3, 1.9)])
    assert set(assign(fill(bonnet, rear), car).owner) == {0}


def test_another_car_close_by_is_not_taken_for_a_fragment() -> None:
    cars = make_boxes([(0, 0, 0, 4.5, 1.9), (4.9, 0, 0, 4.5, 1.9)])
    cells = fill(cars.select(np.array([0])), cars.select(np.array([1])))
    owner = assign(cells, cars.select(np.array([0]))).owner
    assert set(owner[cells.group == 0]) == {0}
    assert set(owner[cells.group == 1]) == {-1}


def test_stranger_touching_a_known_car_is_left_over() -> None:
    cars = make_boxes([(0, 0, 0, 4.5, 1.9), (1.0, 2.4, 0, 4.5, 1.9)])
    cells = fill(make_boxes([*[(0, 0, 0, 4.5, 1.9), (1.0, 2.4, 0, 4.5, 1.9)], (0.5, 1.2, 0, 2, 2)]))
    result = assign(cells, cars.select(np.array([0])), is_sized=True)
    assert result.is_divided.tolist() == [True]
    left_over = cells.points[result.is_rest]
    assert left_over[:, 1].mean() == pytest.approx(2.4, abs=0.3)


def test_car_in_the_shadow_of_a_truck_keeps_its_cells() -> None:
    truck_and_shadow = make_boxes([(0, 1.5, 0, 11, 5.5), (1, 2.6, 0, 4.5, 1.9)])
    bodies = make_boxes([(0, 0, 0, 11, 2.5), (1, 2.6, 0, 4.5, 1.9)])
    cells = fill(truck_and_shadow)
    owner = assign(cells, truck_and_shadow, bodies).owner
    in_car = np.all(np.abs(cells.points - [1, 2.6]) <= [2.2, 0.9], axis=1)
    assert set(owner[in_car]) == {1}
    assert np.mean(owner[np.abs(cells.points[:, 1]) < 1.2] == 0) == 1.0


def test_nothing_predicted_owns_nothing() -> None:
    assert set(assign(fill(make_boxes([(0, 0, 0, 4, 2)])), Boxes.none()).owner) == {-1}
