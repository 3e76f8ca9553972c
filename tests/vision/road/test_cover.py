"""Few rectangles that hold all marked cells."""

import numpy as np
import pytest

from vision.road.cover import cover


@pytest.mark.parametrize("seed", range(5))
def test_rectangles_hold_all_marked_cells_and_do_not_overlap(seed: int) -> None:
    rng = np.random.default_rng(seed)
    cells = np.zeros((400, 500), np.bool_)
    for _ in range(6):
        row, column = rng.integers(0, 390), rng.integers(0, 490)
        cells[row : row + rng.integers(2, 200), column : column + rng.integers(2, 200)] = True
    covered = np.zeros(cells.shape, np.int64)
    for rectangle in cover(cells):
        covered[rectangle.slices] += 1
    assert covered.max() == 1
    assert np.all(covered[cells] == 1)


def test_work_follows_the_road_and_not_its_bounding_box() -> None:
    row, column = np.indices((1000, 1000))
    diagonal = np.abs(row - column) < 8
    assert sum(rectangle.size for rectangle in cover(diagonal)) < 0.15 * diagonal.size


def test_nothing_marked_needs_no_rectangle() -> None:
    assert cover(np.zeros((50, 50), np.bool_)) == []
