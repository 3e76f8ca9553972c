"""Where is a car that nobody sees? On along its road at constant speed; off the roads, straight on."""

from collections.abc import Sequence

import numpy as np

from anchoring.observations import FloatArray, IntArray, LongArray
from gis.road_network import RoadNetwork


class RoadPaths:
    """The reference lines of all roads, end to end in flat arrays, to turn road coordinates into points.

    Parameters
    ----------
    lines_m : each (k, 2), k >= 2.

    Examples
    --------
    >>> paths = RoadPaths([np.array([[0.0, 0.0], [10.0, 0.0], [10.0, 10.0]])])
    >>> points_m, tangent_rad = paths.points(np.zeros(3, np.int32), np.array([4.0, 14.0, 25.0]), np.full(3, 1.0))
    >>> points_m.T.tolist()                         # past its end a line goes straight on
    [[4.0, 1.0], [9.0, 4.0], [9.0, 15.0]]
    """

    __slots__ = ("_chain_m", "_first", "_last", "_start_m", "_tangent_rad", "_unit")

    def __init__(self, lines_m: Sequence[FloatArray]) -> None:
        counts = np.array([len(line_m) - 1 for line_m in lines_m], dtype=np.int64)
        self._last: LongArray = np.cumsum(counts) - 1
        self._first: LongArray = self._last - counts + 1
        step_m = np.concatenate([np.diff(line_m, axis=0) for line_m in lines_m])
        size_m = np.hypot(step_m[:, 0], step_m[:, 1])
        self._start_m: FloatArray = np.concatenate([line_m[:-1] for line_m in lines_m]).T.copy()
        self._unit: FloatArray = (step_m / size_m[:, None]).T.copy()
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
        (2, n) points and (n,) tangents of the line there.
        """
        first = self._first.take(road)
        chain_m = self._chain_m.take(first) + along_m
        segment = self._chain_m.searchsorted(chain_m, side="right") - 1
        segment = np.minimum(np.maximum(segment, first), self._last.take(road))
        forward_m = chain_m - self._chain_m.take(segment)
        east, north = self._unit.take(segment, axis=1)
        points_m = self._start_m.take(segment, axis=1)
        points_m[0] += forward_m * east
        points_m[0] -= across_m * north
        points_m[1] += forward_m * north
        points_m[1] += across_m * east
        return points_m, self._tangent_rad.take(segment)


def predict(
    state: FloatArray, road: IntArray, elapsed_s: FloatArray, paths: RoadPaths | None, *, lateral_s: float
) -> tuple[FloatArray, FloatArray]:
    """Predict bodies from when they were last seen.

    Parameters
    ----------
    state : (8, n) rows x, y, vx, vy, heading, along, across, tangent, as in `anchoring.linking.bodies`.
    road : (n,) -1 for none.
    elapsed_s : (n,) seconds since then.
    paths : None if there are no roads.
    lateral_s : a change of lane that has begun goes on for about this long.

    Returns
    -------
    (2, n) centres, and (n,) turns: by how much heading and velocity have turned with the road.
    """
    centre_m = state[:2] + state[2:4] * elapsed_s
    turn_rad = np.zeros(len(elapsed_s))
    rows = (road >= 0).nonzero()[0]
    if paths is None or not len(rows):
        return centre_m, turn_rad
    then = state.take(rows, axis=1)
    _, _, vx, vy, _, along_m, across_m, tangent_rad = then
    elapsed_s = elapsed_s.take(rows)
    cos, sin = np.cos(tangent_rad), np.sin(tangent_rad)
    ahead_m = (vx * cos + vy * sin) * elapsed_s
    aside_m = (vy * cos - vx * sin) * lateral_s * -np.expm1(-elapsed_s / lateral_s)
    # Only the difference of two points of the line is used, so a prediction starts exactly where the car was.
    road, count = road.take(rows), len(rows)
    points_m, line_rad = paths.points(
        np.concatenate((road, road)),
        np.concatenate((along_m, along_m + ahead_m)),
        np.concatenate((across_m, across_m + aside_m)),
    )
    centre_m[:, rows] = then[:2] + points_m[:, count:] - points_m[:, :count]
    turn_rad[rows] = line_rad[count:] - line_rad[:count]
    return centre_m, turn_rad
