"""Cells of a raster: places, look-up, painting."""

import numpy as np
import pytest

from vision.errors import VisionError
from vision.road.grid import Grid


def ground_grid() -> Grid:
    return Grid.between(np.array([10.0, 20.0]), np.array([14.0, 22.0]), side=0.5, is_north_up=True)


def test_first_row_is_the_northern_one() -> None:
    grid = ground_grid()
    assert grid.shape == (4, 8)
    assert grid.to_plane(np.array([[0.0, 0.0], [7.0, 3.0]])).tolist() == [[10.25, 21.75], [13.75, 20.25]]


def test_image_rows_go_down() -> None:
    grid = Grid.between(np.full(2, -0.5), np.array([7.5, 3.5]), side=2.0, is_north_up=False)
    assert grid.to_plane(np.array([1.0, 1.0])).tolist() == [2.5, 2.5]


def test_positions_and_cells_are_inverse() -> None:
    grid = ground_grid()
    points = np.random.default_rng(0).uniform(-50, 50, (20, 2))
    assert grid.to_plane(grid.to_cells(points)) == pytest.approx(points)


def test_look_up_takes_the_nearest_cell_and_nothing_outside() -> None:
    grid = ground_grid()
    values = np.zeros(grid.shape, np.bool_)
    values[0, 0] = True
    points = np.array([[10.3, 21.9], [10.8, 21.9], [9.7, 21.9], [10.3, 22.4]])
    assert grid.look_up(values, points).tolist() == [True, False, False, False]


def test_painting_marks_cells_whose_centres_are_inside() -> None:
    square = np.array([[10.6, 20.6], [12.4, 20.6], [12.4, 21.4], [10.6, 21.4]])
    painted = ground_grid().paint([square])
    assert painted[1:3, 1:5].all()
    assert painted[:, 6:].sum() == 0


def test_too_large_a_raster_is_refused() -> None:
    with pytest.raises(VisionError, match="at most 16000000 cells, got"):
        Grid.between(np.zeros(2), np.full(2, 1e5), side=0.5, is_north_up=True)
