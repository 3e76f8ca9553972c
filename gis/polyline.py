"""Where does a line run to the left of another one, and how far along its road, and across it, is a point?

A polyline is a (n, 2) array of vertices in metres, n >= 2, in order along the line.

Plain projection onto a bent line jumps: at each corner points on the inner side skip a stretch, and points in the
wedge on the outer side all get the corner itself. So for a road's reference line the strip beside a segment is cut at
the mitres of its corners instead, as parallel lines are (`offset`). Across is the distance to the segment's line; along
is the share of the mitred parallel through the point that lies behind it, times the segment's length. Both are
continuous as far out as the mitres do not cross, that is within the radius of the bend.
"""

from collections.abc import Sequence

import numpy as np
import shapely
from numpy.typing import ArrayLike, NDArray

from gis.errors import GisError

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int32]
IndexArray = NDArray[np.int64]
GeometryArray = NDArray[np.object_]

# Past this factor a mitred corner would grow a long spike; the same limit as for the lane areas.
MITRE_LIMIT = 5.0
# Where mitres nearly cross, shares lose their meaning: there the foot of the perpendicular is taken.
_MIN_STRETCH = 0.05


def as_polyline(points_m: ArrayLike, *, where: str) -> FloatArray:
    """Check a line and return it as a read-only array.

    Parameters
    ----------
    points_m : (n, 2), n >= 2, x east and y north in metres. Repeated vertices are dropped.
    where : what the line belongs to, for the error message.

    Returns
    -------
    (k, 2) with 2 <= k <= n, no two neighbouring vertices equal.

    Raises
    ------
    GisError
        If the shape is wrong, a number is not finite or fewer than two vertices differ.

    Examples
    --------
    >>> as_polyline([[0, 0], [0, 0], [5, 0]], where="lane 'a'")
    array([[0., 0.],
           [5., 0.]])
    """
    line_m = _as_points(points_m, where)
    keep = np.ones(len(line_m), dtype=np.bool_)
    keep[1:] = np.any(np.diff(line_m, axis=0) != 0.0, axis=1)
    line_m = line_m[keep]
    if len(line_m) < 2:
        raise GisError(f"{where}: expected a line of at least 2 different points, got {line_m.tolist()!r}")
    line_m.flags.writeable = False
    return line_m


def as_ring(points_m: ArrayLike, *, where: str) -> FloatArray:
    """Check the outline of an area and return it, open, as a read-only array.

    Parameters
    ----------
    points_m : (n, 2), n >= 3 different vertices; the first may be repeated at the end.
    where : what the outline belongs to, for the error message.

    Returns
    -------
    (k, 2), k >= 3, without the repeated first vertex.

    Raises
    ------
    GisError
        If the shape is wrong, a number is not finite or fewer than three vertices differ.
    """
    ring_m = as_polyline(points_m, where=where)
    if np.array_equal(ring_m[0], ring_m[-1]):
        ring_m = ring_m[:-1]
    if len(ring_m) < 3:
        raise GisError(f"{where}: expected an outline of at least 3 different points, got {ring_m.tolist()!r}")
    return ring_m


def counter_clockwise(ring_m: FloatArray) -> FloatArray:
    """Turn a ring so that its inside is on the left.

    Parameters
    ----------
    ring_m : (n, 2), open, not crossing itself.

    Returns
    -------
    (n, 2), the same vertices, in reversed order if the ring was clockwise.
    """
    x, y = ring_m.T
    doubled_area = np.dot(x, np.roll(y, -1)) - np.dot(y, np.roll(x, -1))
    return ring_m if doubled_area >= 0 else ring_m[::-1]


def offset(line_m: FloatArray, left_m: float) -> FloatArray:
    """Shift a polyline sideways, corners mitred, so that parallel lines stay parallel.

    Parameters
    ----------
    line_m : (n, 2), no repeated vertices.
    left_m : how far to the left of its own direction; negative to the right.

    Returns
    -------
    (n, 2), one vertex for each vertex of the input. Not checked for loops: where the line bends tighter than
    `left_m`, the result crosses itself.

    Examples
    --------
    >>> offset(np.array([[0.0, 0.0], [10.0, 0.0], [10.0, 10.0]]), 1.0)
    array([[ 0.,  1.],
           [ 9.,  1.],
           [ 9., 10.]])
    """
    return np.asarray(line_m + left_m * mitres(line_m), dtype=np.float64)


def mitres(line_m: FloatArray) -> FloatArray:
    """Give the direction in which each vertex of a line moves when the line is shifted to the left.

    Parameters
    ----------
    line_m : (n, 2), no repeated vertices.

    Returns
    -------
    (n, 2), for a shift of one metre: the left normal at both ends, longer than 1 at a corner, `MITRE_LIMIT` at most.
    """
    step_m = np.diff(line_m, axis=0)
    unit = step_m / np.hypot(step_m[:, 0], step_m[:, 1])[:, None]
    normal = np.column_stack((-unit[:, 1], unit[:, 0]))
    before, after = np.vstack((normal[:1], normal)), np.vstack((normal, normal[-1:]))
    # The mitre of two unit normals a and b is (a + b) / (1 + a.b): it has length 1 / cos(half the turn).
    stretch = np.maximum(1.0 + np.sum(before * after, axis=1), 2.0 / MITRE_LIMIT**2)
    return np.asarray((before + after) / stretch[:, None], dtype=np.float64)


def across(line_m: FloatArray, points_m: FloatArray) -> FloatArray:
    """Measure how far points lie to the left of a directed line.

    Parameters
    ----------
    line_m : (k, 2), no repeated vertices; it goes on straight past both ends.
    points_m : (n, 2).

    Returns
    -------
    (n,) metres to the nearest point of the line, negative to the right.

    Examples
    --------
    >>> across(np.array([[0.0, 0.0], [10.0, 0.0]]), np.array([[3.0, 2.0], [-5.0, -1.0]])).tolist()
    [2.0, -1.0]
    """
    step_m = np.diff(line_m, axis=0)
    size_m = np.hypot(step_m[:, 0], step_m[:, 1])
    unit = step_m / size_m[:, None]
    from_start_m = points_m[:, None, :] - line_m[None, :-1, :]
    forward_m = np.einsum("nkc,kc->nk", from_start_m, unit)
    left_m = unit[:, 0] * from_start_m[..., 1] - unit[:, 1] * from_start_m[..., 0]
    low_m, high_m = np.zeros_like(size_m), size_m.copy()
    low_m[0], high_m[-1] = -np.inf, np.inf
    distance_m = np.hypot(forward_m - np.clip(forward_m, low_m, high_m), left_m)
    row, nearest = np.arange(len(points_m)), distance_m.argmin(axis=1)
    return np.asarray(np.copysign(distance_m[row, nearest], left_m[row, nearest]), dtype=np.float64)


def _as_points(points_m: ArrayLike, where: str) -> FloatArray:
    try:
        array = np.array(points_m, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise GisError(f"{where}: expected points as [[x, y], ...] in metres, got {points_m!r}") from error
    if array.ndim != 2 or array.shape[1] != 2 or len(array) == 0:
        raise GisError(f"{where}: expected points of shape (n, 2), got shape {array.shape!r}")
    if not np.isfinite(array).all():
        raise GisError(f"{where}: expected finite coordinates, got {array[~np.isfinite(array).all(axis=1)].tolist()!r}")
    return array


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
    >>> there_m, tangent_rad = bend.points(np.zeros(3, np.int32), np.array([4.0, 14.0, 25.0]), np.full(3, 1.0))
    >>> there_m.T.tolist()                         # past its end a line goes straight on
    [[4.0, 1.0], [9.0, 4.0], [9.0, 15.0]]
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
        segment = np.minimum(np.maximum(self._chain_m.searchsorted(chain_m, side="right") - 1, first), last)
        forward_m, across_m, share = self._within(points_m, segment)
        # The nearest segment is ambiguous in the wedge outside a corner; the mitre there tells.
        after = np.minimum(np.maximum(segment + (share > 1.0) - (share < 0.0), first), last)
        moved = (after != segment).nonzero()[0]
        if len(moved):
            segment[moved] = after[moved]
            forward_m[moved], across_m[moved], share[moved] = self._within(points_m[moved], segment[moved])
        size_m = self._size_m[segment]
        along_m = self._chain_m[segment] - self._chain_m[first] + np.minimum(np.maximum(share, 0.0), 1.0) * size_m
        along_m += np.where(segment == first, np.minimum(forward_m, 0.0), 0.0)
        along_m += np.where(segment == last, np.maximum(forward_m - size_m, 0.0), 0.0)
        return along_m, across_m, self._tangent_rad[segment]

    def points(self, road: IntArray, along_m: FloatArray, across_m: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Find the points at road coordinates; on a bend across is taken from the segment, not between the mitres.

        Parameters
        ----------
        road : (n,) index of the line, >= 0. along_m, across_m : (n,).

        Returns
        -------
        (2, n) points and (n,) tangents of the line there.
        """
        first = self._first.take(road)
        chain_m = self._chain_m.take(first) + along_m
        segment = self._chain_m.searchsorted(chain_m, side="right") - 1
        segment = np.minimum(np.maximum(segment, first), self._last.take(road))
        forward_m = chain_m - self._chain_m.take(segment)
        east, north = self._unit.take(segment, axis=0).T
        points_m = self._start_m.take(segment, axis=0).T
        points_m[0] += forward_m * east
        points_m[0] -= across_m * north
        points_m[1] += forward_m * north
        points_m[1] += across_m * east
        return points_m, self._tangent_rad.take(segment)

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
