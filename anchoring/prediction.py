"""Where is a car that nobody sees? On along its road at constant speed; off the roads, straight on."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from gis.road_network import RoadNetwork

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int32]
IndexArray = NDArray[np.int64]

# A change of lane that has begun goes on for about this long.
_LATERAL_S = 0.5


class RoadPaths:
    """The reference lines of all roads, end to end in flat arrays, to turn road coordinates into points.

    Parameters
    ----------
    lines_m : each (k, 2), k >= 2.

    Examples
    --------
    >>> paths = RoadPaths([np.array([[0.0, 0.0], [10.0, 0.0], [10.0, 10.0]])])
    >>> points_m, tangent_rad = paths.points(np.zeros(3, np.int32), np.array([4.0, 14.0, 25.0]), np.full(3, 1.0))
    >>> points_m.tolist()                           # past its end a line goes straight on
    [[4.0, 1.0], [9.0, 4.0], [9.0, 15.0]]
    """

    __slots__ = ("_chain_m", "_first", "_last", "_start_m", "_tangent_rad", "_unit")

    def __init__(self, lines_m: Sequence[FloatArray]) -> None:
        counts = np.array([len(line_m) - 1 for line_m in lines_m], dtype=np.int64)
        self._last: IndexArray = np.cumsum(counts) - 1
        self._first: IndexArray = self._last - counts + 1
        step_m = np.concatenate([np.diff(line_m, axis=0) for line_m in lines_m])
        size_m = np.hypot(step_m[:, 0], step_m[:, 1])
        self._start_m = np.concatenate([line_m[:-1] for line_m in lines_m])
        self._unit: FloatArray = step_m / size_m[:, None]
        self._tangent_rad: FloatArray = np.arctan2(step_m[:, 1], step_m[:, 0])
        self._chain_m: FloatArray = np.concatenate(([0.0], np.cumsum(size_m)))

    @classmethod
    def of_network(cls, network: RoadNetwork) -> "RoadPaths":
        """Take the reference lines of a network's roads."""
        return cls([road.reference_line_m for road in network.roads])

    def points(self, road: IntArray, along_m: FloatArray, across_m: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Find the points at road coordinates.

        Parameters
        ----------
        road : (n,) index of the road, >= 0. along_m, across_m : (n,).

        Returns
        -------
        (n, 2) points and (n,) tangents of the line there.
        """
        first, last = self._first[road], self._last[road]
        chain_m = self._chain_m[first] + along_m
        segment = np.clip(np.searchsorted(self._chain_m, chain_m, side="right") - 1, first, last)
        forward_m = (chain_m - self._chain_m[segment])[:, None]
        unit = self._unit[segment]
        left = np.stack([-unit[:, 1], unit[:, 0]], axis=1)
        points_m = self._start_m[segment] + forward_m * unit + across_m[:, None] * left
        return points_m, self._tangent_rad[segment]


def predict(
    state: FloatArray, road: IntArray, elapsed_s: FloatArray, paths: RoadPaths | None
) -> tuple[FloatArray, FloatArray]:
    """Predict bodies from when they were last seen.

    Parameters
    ----------
    state : (8, n) rows x, y, vx, vy, heading, along, across, tangent, as in `anchoring.bodies`.
    road : (n,) -1 for none.
    elapsed_s : (n,) seconds since then.
    paths : None if there are no roads.

    Returns
    -------
    (n, 2) centres, and (n,) turns: by how much heading and velocity have turned with the road.
    """
    x, y, vx, vy, _, along_m, across_m, tangent_rad = state
    centre_m = np.stack([x + vx * elapsed_s, y + vy * elapsed_s], axis=1)
    turn_rad = np.zeros(len(x))
    rows = np.flatnonzero(road >= 0)
    if paths is None or not len(rows):
        return centre_m, turn_rad
    road, along_m, across_m, elapsed_s = road[rows], along_m[rows], across_m[rows], elapsed_s[rows]
    cos, sin = np.cos(tangent_rad[rows]), np.sin(tangent_rad[rows])
    ahead_m = (vx[rows] * cos + vy[rows] * sin) * elapsed_s
    aside_m = (vy[rows] * cos - vx[rows] * sin) * _LATERAL_S * -np.expm1(-elapsed_s / _LATERAL_S)
    # Only the difference of two points of the line is used, so a prediction starts exactly where the car was.
    then_m, then_rad = paths.points(road, along_m, across_m)
    now_m, now_rad = paths.points(road, along_m + ahead_m, across_m + aside_m)
    centre_m[rows] = state[:2, rows].T + now_m - then_m
    turn_rad[rows] = now_rad - then_rad
    return centre_m, turn_rad
