"""How far along its road, and how far across it, is a point?

Plain projection onto a bent line jumps: at each corner points on the inner side skip a stretch, and points in the
wedge on the outer side all get the corner itself. So the strip beside a segment is cut at the mitres of its corners
instead, as parallel lines are (`gis.polyline.offset`). Across is the distance to the segment's line; along is the
share of the mitred parallel through the point that lies behind it, times the segment's length. Both are continuous as
far out as the mitres do not cross, that is within the radius of the bend.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import shapely
from numpy.typing import NDArray

from gis.polyline import FloatArray, mitres

IntArray = NDArray[np.int32]
IndexArray = NDArray[np.int64]
GeometryArray = NDArray[np.object_]

# Where mitres nearly cross, shares lose their meaning: there the foot of the perpendicular is taken.
_MIN_STRETCH = 0.05


class ReferenceLines:
    """The reference lines of all roads, their segments laid end to end in flat arrays.

    Parameters
    ----------
    lines_m : each (k, 2), no repeated vertices.

    Examples
    --------
    >>> bend = ReferenceLines([np.array([[0.0, 0.0], [10.0, 0.0], [10.0, 10.0]])])
    >>> points_m = np.array([[9.0, 1.0], [11.0, -1.0], [-3.0, 2.0]])
    >>> along_m, across_m, _ = bend.project(points_m, shapely.points(points_m), np.zeros(3, dtype=np.int32))
    >>> along_m.tolist(), across_m.tolist()
    ([10.0, 10.0, -3.0], [1.0, -1.0, 2.0])
    """

    def __init__(self, lines_m: Sequence[FloatArray]) -> None:
        self._lines: GeometryArray = np.array([shapely.LineString(line_m) for line_m in lines_m])
        counts = np.array([len(line_m) - 1 for line_m in lines_m])
        self._last: IndexArray = np.cumsum(counts) - 1
        self._first: IndexArray = self._last - counts + 1
        step_m = np.concatenate([np.diff(line_m, axis=0) for line_m in lines_m])
        self._start_m = np.concatenate([line_m[:-1] for line_m in lines_m])
        self._size_m = np.hypot(step_m[:, 0], step_m[:, 1])
        self._unit = step_m / self._size_m[:, None]
        # How far the mitres at both ends of a segment lean forward, in metres for a metre to the left.
        corner = [mitres(line_m) for line_m in lines_m]
        self._lean_start = (np.concatenate([mitre[:-1] for mitre in corner]) * self._unit).sum(axis=1)
        self._lean_end = (np.concatenate([mitre[1:] for mitre in corner]) * self._unit).sum(axis=1)
        # arctan2 gives -pi for a segment due west with a step of -0.0 north; adding 0.0 makes it 0.0.
        self._tangent_rad = np.arctan2(step_m[:, 1] + 0.0, step_m[:, 0])
        self._chain_m = np.concatenate(([0.0], np.cumsum(self._size_m)))

    def project(
        self, points_m: FloatArray, points: GeometryArray, road: IntArray
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Find the coordinates of points on their roads.

        Parameters
        ----------
        points_m : (n, 2).
        points : (n,), the same as shapely points.
        road : (n,) index of the line each point is measured on.

        Returns
        -------
        (along_m, across_m, tangent_rad), each (n,). The line goes on straight past both ends: along is below 0
        before the start. Across is positive to the left. The tangent is that of the segment.
        """
        first, last = self._first[road], self._last[road]
        chain_m = self._chain_m[first] + shapely.line_locate_point(self._lines[road], points)
        segment = np.clip(np.searchsorted(self._chain_m, chain_m, side="right") - 1, first, last)
        forward_m, across_m, share = self._within(points_m, segment)
        # The nearest segment is ambiguous in the wedge outside a corner; the mitre there tells.
        after = np.clip(segment + (share > 1.0) - (share < 0.0), first, last)
        moved = np.flatnonzero(after != segment)
        if len(moved):
            segment[moved] = after[moved]
            forward_m[moved], across_m[moved], share[moved] = self._within(points_m[moved], segment[moved])
        size_m = self._size_m[segment]
        along_m = self._chain_m[segment] - self._chain_m[first] + np.clip(share, 0.0, 1.0) * size_m
        along_m += np.where(segment == first, np.minimum(forward_m, 0.0), 0.0)
        along_m += np.where(segment == last, np.maximum(forward_m - size_m, 0.0), 0.0)
        return along_m, across_m, self._tangent_rad[segment]

    def _within(self, points_m: FloatArray, segment: IndexArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Give metres forward, metres to the left and the share of the mitred strip that lies behind each point."""
        unit, from_start_m = self._unit[segment], points_m - self._start_m[segment]
        forward_m = (unit * from_start_m).sum(axis=1)
        left_m = unit[:, 0] * from_start_m[:, 1] - unit[:, 1] * from_start_m[:, 0]
        size_m, lean_start = self._size_m[segment], self._lean_start[segment]
        parallel_m = size_m + left_m * (self._lean_end[segment] - lean_start)
        is_sound = parallel_m > _MIN_STRETCH * size_m
        behind_m = np.where(is_sound, forward_m - left_m * lean_start, forward_m)
        return forward_m, left_m, behind_m / np.where(is_sound, parallel_m, size_m)
