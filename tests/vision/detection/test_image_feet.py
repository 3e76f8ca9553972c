"""The lowest cell of a column of a blob is a foot, unless another vehicle follows below it."""

import numpy as np
import pytest

from vision.detection.blobs import Cells
from vision.detection.image_feet import find_feet
from vision.detection.settings import DetectionSettings
from vision.road.grid import Grid

SHAPE = (12, 15)

BELOW_CELLS = DetectionSettings().below_cells


def some_cells(seed: int, *, side: float) -> tuple[Cells, Grid]:
    rng = np.random.default_rng(seed)
    grid = Grid.between(np.zeros(2), np.array([SHAPE[1], SHAPE[0]]) * side, side=side, is_north_up=False)
    row, column = np.nonzero(rng.random(SHAPE) < 0.4)
    points = grid.to_plane(np.column_stack([column, row]).astype(np.float64))
    everything = Cells(
        points,
        np.zeros(len(row), np.intp),
        np.ones(len(row), np.uint8),
        np.zeros(len(row), np.bool_),
        np.zeros(1, np.intp),
        np.zeros(1, np.intp),
    )
    return everything.regroup(rng.integers(0, 4, len(row))), grid


@pytest.mark.parametrize("seed", range(8))
def test_feet_are_those_of_a_walk_over_all_columns(seed: int) -> None:
    side = 1.0 + seed % 2
    cells, grid = some_cells(seed, side=side)
    places = np.rint(grid.to_cells(cells.points)).astype(int).tolist()
    owner = {tuple(place): int(group) for place, group in zip(places, cells.group, strict=True)}
    expected = []
    for group in range(cells.count):
        for column in range(SHAPE[1]):
            rows = [row for row in range(SHAPE[0]) if owner.get((column, row)) == group]
            if rows:
                below = [owner.get((column, max(rows) + step), group) for step in range(1, BELOW_CELLS + 1)]
                height_px = (max(rows) - min(rows) + 1) * side
                expected.append((group, column, max(rows), height_px, any(one != group for one in below)))
    feet = find_feet(cells, grid, BELOW_CELLS)
    lowest = np.rint(grid.to_cells(feet.points)).astype(int)[:, 1]
    found = zip(
        feet.group.tolist(),
        feet.column.tolist(),
        lowest.tolist(),
        feet.height_px.tolist(),
        feet.is_hidden.tolist(),
        strict=True,
    )
    assert list(found) == expected
    assert {one[4] for one in expected} == {True, False}


def test_no_cells_have_no_feet() -> None:
    cells, grid = some_cells(1, side=1.0)
    assert len(find_feet(cells.keep(np.zeros(cells.count, np.bool_)), grid, BELOW_CELLS).column) == 0
