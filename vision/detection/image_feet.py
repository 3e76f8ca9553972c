"""Where does what is seen in the image meet the ground? The lowest cell of every column of a blob, where it is in view.

Below the lowest cell of a vehicle there is road. Where another vehicle's cells follow instead, that one stands nearer
and hides the foot: what looks lowest there is the other one's roof line, and far from the ground.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vision.detection.blobs import Cells
from vision.objects import BoolArray, FloatArray, IntArray, Table
from vision.road.grid import Grid


@dataclass(frozen=True, slots=True, eq=False)
class Feet(Table):
    """The lowest cells of the columns of groups.

    Attributes
    ----------
    group : (f,) ascending.
    column : (f,) of the grid, ascending in each group.
    points : (f, 2) on the image.
    height_px : (f,) from the highest to the lowest cell, both included.
    is_hidden : (f,) True where another group follows below.
    """

    group: IntArray
    column: IntArray
    points: FloatArray
    height_px: FloatArray
    is_hidden: BoolArray


def find_feet(cells: Cells, grid: Grid, below_cells: int) -> Feet:
    """Find the lowest cell of every column of every group.

    Parameters
    ----------
    cells : n groups, on an image grid.
    grid : of the cells.
    below_cells : how many below a column's lowest one are looked at.

    Returns
    -------
    One foot a column and group.

    Examples
    --------
    Two groups in one column of cells, the second right below the first, and one cell of road between them:

    >>> grid = Grid.between(np.zeros(2), np.array([3.0, 6.0]), side=1.0, is_north_up=False)
    >>> points = np.array([[1.5, 0.5], [1.5, 1.5], [2.5, 0.5], [1.5, 3.5], [1.5, 4.5]])
    >>> groups = (np.array([0, 0, 0, 1, 1]), np.array([0, 3]))
    >>> cells = Cells(points, groups[0], np.ones(5, np.uint8), np.zeros(5, bool), groups[1], np.arange(2))
    >>> feet = find_feet(cells, grid, 3)
    >>> feet.column.tolist(), feet.height_px.tolist(), feet.is_hidden.tolist()
    ([1, 2, 1], [2.0, 1.0, 2.0], [True, False, False])
    """
    rows, columns = grid.shape
    place, row = np.rint(grid.to_cells(cells.points)).astype(np.intp).T
    key = cells.group * columns + place
    lowest, highest = np.full(cells.count * columns, -1, np.intp), np.full(cells.count * columns, rows, np.intp)
    np.maximum.at(lowest, key, row)
    np.minimum.at(highest, key, row)
    key = np.flatnonzero(lowest >= 0)
    group, column = np.divmod(key, columns)
    low, high = lowest[key], highest[key]
    owner = np.full((rows + below_cells, columns), -1, np.intp)
    owner[row, place] = cells.group
    below = np.stack([owner[low + step, column] for step in range(1, below_cells + 1)])
    is_hidden = ((below >= 0) & (below != group)).any(axis=0)
    points = grid.to_plane(np.column_stack([column, low]).astype(np.float64))
    return Feet(group, column, points, (low - high + 1) * np.float64(grid.side), is_hidden)
