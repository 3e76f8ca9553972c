"""The usual colour of a road: in windows as everywhere, and against a slow count around each cell."""

import numpy as np
import pytest

from vision.road.grid import Grid
from vision.road.rectify import RoadCells
from vision.road.road_colour import RoadColour
from vision.road.settings import RoadSettings

CAR_CELLS = 2.0


def test_usual_colour_in_a_window_is_the_mean_of_the_plain_road_around() -> None:
    rng = np.random.default_rng(0)
    grid = Grid(np.array([0.0, 0.0]), 1.0, (30, 50), is_north_up=True)
    road = rng.random(grid.shape) < 0.9
    road[:, 30:40] = False
    cells = RoadCells(grid, road=road, view_edge=np.zeros(grid.shape, np.bool_))
    settings = RoadSettings()
    colour = RoadColour(cells, settings, car_cells=CAR_CELLS)
    planes = rng.choice([90.0, 100.0, 104.4, 180.0], (3, cells.packed_size), p=[0.1, 0.4, 0.3, 0.2]).astype(np.float32)
    usual, everywhere = colour.usual(planes), colour.around(planes)
    levels = cells.window(planes, cells.whole)
    is_packed = cells.window(np.ones(cells.packed_size, np.bool_), cells.whole)
    is_plain = road & (np.abs(levels - usual[:, None, None]).max(axis=0) <= settings.plain_levels)
    reach = round(settings.plain_around_widths * CAR_CELLS / 2)
    for _ in range(60):
        top, left = int(rng.integers(0, 28)), int(rng.integers(0, 48))
        window = slice(top, int(rng.integers(top + 1, 31))), slice(left, int(rng.integers(left + 1, 51)))
        found = colour.around_in(planes, window, usual)
        known = is_packed[window]
        assert np.array_equal(found[:, known], cells.window(everywhere, window)[:, known])
        # Away from the border of the raster nothing is mirrored.
        row, column = window[0].start, window[1].start
        if reach <= row < 30 - reach and reach <= column < 50 - reach:
            near = slice(row - reach, row + reach + 1), slice(column - reach, column + reach + 1)
            enough = is_plain[near].sum() >= settings.least_plain_widths2 * CAR_CELLS**2
            mean = np.rint(levels[:, *near])[:, is_plain[near]].mean(axis=1) if enough else usual
            assert found[:, 0, 0] == pytest.approx(mean, rel=1e-5)
