"""The bare road, read off pictures with traffic on it."""

import numpy as np
import pytest

from vision.startup import MOST_NOISE, _votes, empty_road, holds_vehicle, median_of, noise_of, strange, usual_colour

ROAD, GREY_CAR, MARKING = 100, 60, 160


def pictures(*cells: list[int]) -> list[np.ndarray]:
    """One list of levels over time for each cell, and fifty bare cells that tell what is usual; chroma is neutral."""
    luma = np.array([*cells, *([[ROAD] * len(cells[0])] * 50)], np.uint8).T
    return [np.stack([row, np.full_like(row, 128), np.full_like(row, 128)]) for row in luma]


def levels(*cells: list[int]) -> list[float]:
    samples = pictures(*cells)
    planes = empty_road(samples, np.ones(samples[0].shape[1], np.bool_))
    return [float(level) for level in planes[0, : len(cells)]]


def test_car_that_stands_most_of_the_time_is_no_road() -> None:
    assert levels([ROAD] * 4 + [GREY_CAR] * 30 + [ROAD] * 6) == [ROAD]


def test_queue_of_different_cars_leaves_the_road_between_them() -> None:
    queue = [200] * 9 + [ROAD] + [40] * 9 + [ROAD] + [70] * 9 + [ROAD] + [180] * 9
    assert levels(queue) == [ROAD]


def test_marking_stays_a_marking_under_dense_traffic() -> None:
    # Every third picture shows a shadow of the level of bare road on it.
    assert levels([MARKING, MARKING, ROAD] * 12 + [MARKING]) == [MARKING]


def test_cells_off_the_road_get_their_median() -> None:
    samples = pictures([ROAD] * 4 + [GREY_CAR] * 30 + [ROAD] * 6)
    is_road = np.ones(samples[0].shape[1], np.bool_)
    is_road[0] = False
    assert empty_road(samples, is_road)[0, 0] == GREY_CAR


def test_votes_agree_with_counting_the_runs() -> None:
    is_same = np.random.default_rng(3).random((40, 200)) < 0.6
    for column, votes in zip(is_same.T, _votes(is_same), strict=True):
        runs = "".join("1" if one else " " for one in column).split()
        assert votes == pytest.approx(sum(np.sqrt(len(run)) for run in runs), abs=1e-3)


def test_median_agrees_with_that_of_the_library() -> None:
    samples = list(np.random.default_rng(4).integers(0, 256, (9, 3, 500)).astype(np.uint8))
    assert median_of(samples).tolist() == np.median(samples, axis=0).tolist()


def test_noise_is_not_that_of_what_stood_in_front() -> None:
    differences = [np.array([[1, 90, 90]], np.uint8)] * 4 + [np.array([[2, 3, 90]], np.uint8)] * 3
    assert noise_of(differences).tolist() == [[1.0, 3.0, MOST_NOISE]]


def test_vehicle_is_told_from_markings_by_its_width() -> None:
    planes = np.full((3, 60 * 40), 128.0, np.float32)
    planes[0] = ROAD
    luma = planes[0].reshape(40, 60)
    road = np.ones(planes.shape[1], np.bool_)
    luma[5:7] = luma[:, 3:5] = MARKING  # a line along the road and one across it
    assert usual_colour(planes, road).tolist() == [ROAD, 128, 128]
    assert not holds_vehicle(strange(planes, road).reshape(40, 60), car_cells=6)
    luma[20:26, 30:45] = GREY_CAR
    assert holds_vehicle(strange(planes, road).reshape(40, 60), car_cells=6)
