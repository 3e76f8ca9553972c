"""Which cells moved together, and what box do they fill? From a foreground mask to measured groups of cells.

Everything is done on flat arrays of foreground cells, sorted by group, so that the cost follows the number of
foreground cells and no Python loop runs over blobs.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import cv2
import numpy as np
from numpy.typing import NDArray

from vision.detection.settings import DetectionSettings
from vision.objects import BoolArray, FloatArray, IntArray
from vision.road.boxes import Boxes
from vision.road.rectify import RoadCells
from vision.video.frames import ByteArray


@dataclass(frozen=True, slots=True)
class Cells:
    """Foreground cells, sorted by the group they belong to.

    Attributes
    ----------
    points : (p, 2) cell centres on the raster's plane.
    group : (p,) ascending; every number from 0 to `count` - 1 occurs.
    strength : (p,) difference from the background, grey levels.
    at_edge : (p,) True at the edge of the view.
    starts : (count,) row of the first cell of each group.
    key : (count,) the number by which each group was made.
    sizes : (count,) number of cells of each group.
    """

    points: FloatArray
    group: IntArray
    strength: ByteArray
    at_edge: BoolArray
    starts: IntArray
    key: IntArray
    sizes: IntArray = field(init=False)

    def __post_init__(self) -> None:
        """Count the cells."""
        object.__setattr__(self, "sizes", np.bincount(self.group))

    @property
    def count(self) -> int:
        """Number of groups."""
        return len(self.starts)

    def regroup(self, key: IntArray) -> Cells:
        """Sort the cells into other groups.

        Parameters
        ----------
        key : (p,) any integers; equal keys make a group, negative keys are dropped.

        Returns
        -------
        The kept cells; groups in ascending order of their keys.
        """
        order, group, starts = _sorted_groups(key)
        return Cells(
            points=self.points.take(order, axis=0),
            group=group,
            strength=self.strength.take(order),
            at_edge=self.at_edge.take(order),
            starts=starts,
            key=key.take(order.take(starts)),
        )

    def keep(self, which: BoolArray) -> Cells:
        """Keep some of the groups.

        Parameters
        ----------
        which : (count,).

        Returns
        -------
        Those groups, with their keys.
        """
        if which.all():
            return self
        rows = which[self.group]
        sizes = self.sizes[which]
        return Cells(
            points=self.points[rows],
            group=np.repeat(np.arange(len(sizes)), sizes),
            strength=self.strength[rows],
            at_edge=self.at_edge[rows],
            starts=np.cumsum(sizes) - sizes,
            key=self.key[which],
        )


def _sorted_groups(key: IntArray) -> tuple[IntArray, IntArray, IntArray]:
    """Sort rows by key, negative keys left out: rows in order, the group of each, and where the groups start."""
    order = np.argsort(key, kind="stable")
    ordered = key.take(order)
    dropped = int(ordered.searchsorted(0))
    if dropped > 0:
        order, ordered = order[dropped:], ordered[dropped:]
    is_first = np.empty(len(ordered), np.bool_)
    is_first[:1] = True
    np.not_equal(ordered[1:], ordered[:-1], out=is_first[1:])
    return order, is_first.cumsum() - 1, is_first.nonzero()[0]


def find_blobs(raster: RoadCells, mask: ByteArray, difference: ByteArray) -> Cells:
    """Find the connected groups of marked cells.

    Parameters
    ----------
    raster : where the cells lie.
    mask : (rows, columns) non-zero where the foreground is.
    difference : (rows, columns) grey levels.

    Returns
    -------
    One group per 8-connected blob.
    """
    place = np.flatnonzero(mask > 0)
    if len(place) == 0:
        nothing = np.zeros(0, np.intp)
        return Cells(np.zeros((0, 2)), nothing, np.zeros(0, np.uint8), np.zeros(0, np.bool_), nothing, nothing)
    labels = cv2.connectedComponents(mask, connectivity=8, ltype=cv2.CV_32S)[1]
    key = np.asarray(labels, np.int32).take(place).astype(np.intp) - 1
    order, group, starts = _sorted_groups(key)
    place = place.take(order)
    columns = mask.shape[1]
    cells = np.empty((len(place), 2))
    np.divmod(place, columns, out=(cells[:, 1], cells[:, 0]), casting="unsafe")
    return Cells(
        points=raster.grid.to_plane(cells),
        group=group,
        strength=difference.take(place),
        at_edge=raster.view_edge.take(place),
        starts=starts,
        key=key.take(order.take(starts)),
    )


def measure(
    cells: Cells, heading_rad: FloatArray, side: float, settings: DetectionSettings
) -> tuple[Boxes, NDArray[np.int8]]:
    """Box every group in a given direction.

    Parameters
    ----------
    cells : n groups.
    heading_rad : (n,) direction of each box's length.
    side : side of a cell.
    settings : blur.

    Returns
    -------
    Boxes, tight in the given direction, and (n,) +1 where the view edge cuts the front, -1 the rear, 0 where neither.
    """
    cos, sin = np.cos(heading_rad), np.sin(heading_rad)
    cell_cos, cell_sin = cos[cells.group], sin[cells.group]
    east, north = cells.points.T
    along, across = east * cell_cos + north * cell_sin, north * cell_cos - east * cell_sin
    rear, front = np.minimum.reduceat(along, cells.starts), np.maximum.reduceat(along, cells.starts)
    right, left = np.minimum.reduceat(across, cells.starts), np.maximum.reduceat(across, cells.starts)
    middle_along, middle_across = (rear + front) / 2, (right + left) / 2
    centre = np.column_stack(
        [middle_along * cos - middle_across * sin, middle_along * sin + middle_across * cos],
    )
    # A cell reaches half its side past its centre, more in a slanting direction; but cells half covered count as well.
    reach = side * (np.abs(cos) + np.abs(sin) - settings.blur_cells)
    boxes = Boxes(centre, heading_rad, front - rear + reach, left - right + reach)
    return boxes, _cut(cells, along - middle_along[cells.group])


def principal_heading(cells: Cells) -> tuple[FloatArray, FloatArray]:
    """Find the long axis of every group.

    Parameters
    ----------
    cells : n groups.

    Returns
    -------
    (n,) direction in (-pi/2, pi/2] and (n,) elongation, the ratio of the standard deviations along and across it.
    """
    sizes = cells.sizes
    mean = np.add.reduceat(cells.points, cells.starts, axis=0) / sizes[:, None]
    east, north = (cells.points - mean[cells.group]).T
    east_east, north_north, east_north = (
        np.add.reduceat(product, cells.starts) / sizes for product in (east * east, north * north, east * north)
    )
    heading = 0.5 * np.arctan2(2 * east_north, east_east - north_north)
    spread = np.hypot((east_east - north_north) / 2, east_north)
    middle = (east_east + north_north) / 2
    # One row of cells has no width; a twelfth of a squared cell is the variance inside it, any small number does.
    elongation = np.sqrt((middle + spread) / np.maximum(middle - spread, 1e-2))
    return heading, elongation


def _cut(cells: Cells, along: FloatArray) -> NDArray[np.int8]:
    """Find on which end the view edge touches each group."""
    touching = np.add.reduceat(cells.at_edge.astype(np.float64), cells.starts)
    balance = np.add.reduceat(np.where(cells.at_edge, along, 0.0), cells.starts)
    return np.where(touching > 0, np.where(balance >= 0, 1, -1), 0).astype(np.int8)
