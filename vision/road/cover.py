"""Which few rectangles hold all marked cells of a raster? Work then follows the road and not its bounding box."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vision.objects import BoolArray

TILE_CELLS = 32
# Joining two rectangles may waste this many cells: one more OpenCV call costs about as much.
JOIN_WASTE_CELLS = 8_192


@dataclass(frozen=True, slots=True)
class Rectangle:
    """Cells of a raster: rows `[top, bottom)`, columns `[left, right)`."""

    top: int
    bottom: int
    left: int
    right: int

    @property
    def size(self) -> int:
        """Number of cells."""
        return (self.bottom - self.top) * (self.right - self.left)

    @property
    def slices(self) -> tuple[slice, slice]:
        """Index of the cells in a (rows, columns) array."""
        return slice(self.top, self.bottom), slice(self.left, self.right)

    def joined(self, other: Rectangle) -> Rectangle:
        """Bound two rectangles by one."""
        return Rectangle(
            min(self.top, other.top),
            max(self.bottom, other.bottom),
            min(self.left, other.left),
            max(self.right, other.right),
        )

    def meets(self, other: Rectangle) -> bool:
        """Tell whether two rectangles share a cell."""
        return (
            self.top < other.bottom and other.top < self.bottom and self.left < other.right and other.left < self.right
        )


def cover(cells: BoolArray) -> list[Rectangle]:
    """Cover the marked cells by a few rectangles that do not overlap.

    Parameters
    ----------
    cells : (rows, columns).

    Returns
    -------
    Rectangles, north-western first; none when no cell is marked.

    Examples
    --------
    >>> marked = np.zeros((400, 400), np.bool_)
    >>> marked[3:5, 10:390] = marked[10:390, 3:5] = True
    >>> cover(marked)
    [Rectangle(top=3, bottom=32, left=3, right=390), Rectangle(top=32, bottom=390, left=3, right=5)]
    """
    rectangles = [_shrink(rectangle, cells) for rectangle in _tile_runs(cells)]
    while (pair := _cheapest_join(rectangles)) is not None:
        joined = rectangles[pair[0]].joined(rectangles[pair[1]])
        rectangles = [r for i, r in enumerate(rectangles) if i not in pair]
        rectangles.append(joined)
    return sorted(rectangles, key=lambda r: (r.top, r.left))


def _tile_runs(cells: BoolArray) -> list[Rectangle]:
    """Find the runs of neighbouring tiles that hold a marked cell, tile row by tile row."""
    rows, columns = cells.shape
    runs = []
    for top in range(0, rows, TILE_CELLS):
        bottom = min(top + TILE_CELLS, rows)
        starts = np.arange(0, columns, TILE_CELLS)
        is_used = np.logical_or.reduceat(cells[top:bottom].any(axis=0), starts)
        edges = np.flatnonzero(np.diff(np.concatenate([[False], is_used, [False]]).astype(np.int8)))
        for first, last in edges.reshape(-1, 2):
            runs.append(Rectangle(top, bottom, int(first) * TILE_CELLS, min(int(last) * TILE_CELLS, columns)))
    return runs


def _shrink(rectangle: Rectangle, cells: BoolArray) -> Rectangle:
    inside = cells[rectangle.slices]
    rows, columns = np.flatnonzero(inside.any(axis=1)), np.flatnonzero(inside.any(axis=0))
    return Rectangle(
        rectangle.top + int(rows[0]),
        rectangle.top + int(rows[-1]) + 1,
        rectangle.left + int(columns[0]),
        rectangle.left + int(columns[-1]) + 1,
    )


def _cheapest_join(rectangles: list[Rectangle]) -> tuple[int, int] | None:
    """Find the two rectangles whose common bound wastes least, if that is little and covers no third one."""
    best, best_waste = None, JOIN_WASTE_CELLS
    for i, first in enumerate(rectangles):
        for j in range(i):
            joined = first.joined(rectangles[j])
            waste = joined.size - first.size - rectangles[j].size
            if waste < best_waste and not any(
                joined.meets(other) for k, other in enumerate(rectangles) if k not in (i, j)
            ):
                best, best_waste = (j, i), waste
    return best
