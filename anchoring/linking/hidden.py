"""Where was a car while nobody saw it? On the way between the two places, at speeds that fit both ends.

Along their road where both are on one, along the lanes where the map says how they lead there, and else on a smooth
curve. Speeds are those of cubic Hermite splines, held within what keeps a car from driving back on its way.
"""

import math
from collections.abc import Iterator, Mapping
from itertools import pairwise

import numpy as np

from anchoring.linking.frame import RoadMap
from anchoring.linking.ways import Looks
from anchoring.observations import Cars, FloatArray, LongArray

# Centres (2, k), headings and speeds (k,) at k times.
Path = tuple[FloatArray, FloatArray, FloatArray]

# A cubic stays monotone if no end is faster than so many times the mean (Fritsch and Carlson 1980).
_MOST_OF_MEAN = 3.0


def hidden_path(knots: Looks, t_us: LongArray, roads: RoadMap) -> Path:
    """Find where a car was between the times at which it was seen.

    Parameters
    ----------
    knots : the car when it was seen, in order of time.
    t_us : (k,) rising, from the first of these times to the last.
    roads : the ways between them.

    Returns
    -------
    Centres (2, k), headings and speeds (k,).
    """
    parts = [
        _between(knots.take(np.array([end])), knots.take(np.array([start])), t_us[first:last], roads)
        for end, start, first, last in _spans(knots.t_us, t_us)
    ]
    centre_m, heading_rad, speed_mps = zip(*parts, strict=True)
    return np.concatenate(centre_m, axis=1), np.concatenate(heading_rad), np.concatenate(speed_mps)


def _spans(knots_us: LongArray, t_us: LongArray) -> list[tuple[int, int, int, int]]:
    """List the places of neighbouring knots, and from where to where the times between them stand."""
    borders = [0, *t_us.searchsorted(knots_us[1:-1]).tolist(), len(t_us)]
    return [(k, k + 1, first, last) for k, (first, last) in enumerate(pairwise(borders))]


def _between(end: Looks, start: Looks, t_us: LongArray, roads: RoadMap) -> Path:
    """Find the way from one knot to the next, (1,) each."""
    span_s = float(start.t_us[0] - end.t_us[0]) * 1e-6
    share = (t_us - end.t_us[0]) * 1e-6 / span_s
    if end.road[0] >= 0 and end.road[0] == start.road[0]:
        return _along_road(end, start, share, span_s, roads)
    route = roads.route(end, start)
    if route is None:
        return _in_the_open(end, start, share, span_s)
    length_m = float(np.hypot(*np.diff(route.line_m, axis=0).T).sum())
    driven_m, speed_mps = _hermite(length_m, float(end.speed_mps[0]), float(start.speed_mps[0]), share, span_s)
    shares = driven_m / max(length_m, 1e-9)
    points_m, heading_rad = route.points(np.concatenate((shares, [0.0, 1.0])))
    # Cars drive beside the middle of their lanes.
    off_m = np.concatenate((end.centre_m, start.centre_m)) - points_m[-2:]
    points_m = points_m[:-2] + off_m[0] + shares[:, None] * (off_m[1] - off_m[0])
    return points_m.T, heading_rad[:-2], speed_mps


def _along_road(end: Looks, start: Looks, share: FloatArray, span_s: float, roads: RoadMap) -> Path:
    pace_mps = [
        float(one.velocity_mps[0] @ (math.cos(one.tangent_rad[0]), math.sin(one.tangent_rad[0])))
        for one in (end, start)
    ]
    length_m = float(start.along_m[0] - end.along_m[0])
    driven_m, speed_mps = _hermite(length_m, pace_mps[0], pace_mps[1], share, span_s)
    aside_m, _ = _hermite(float(start.across_m[0] - end.across_m[0]), 0.0, 0.0, share, span_s)
    points_m, line_rad = roads.points(int(end.road[0]), end.along_m[0] + driven_m, end.across_m[0] + aside_m)
    is_against = math.cos(end.heading_rad[0] - end.tangent_rad[0]) < 0.0
    return points_m, line_rad + math.pi * is_against, np.abs(speed_mps)


def _in_the_open(end: Looks, start: Looks, share: FloatArray, span_s: float) -> Path:
    apart_m = start.centre_m[0] - end.centre_m[0]
    most_mps = _MOST_OF_MEAN * math.hypot(*apart_m) / span_s
    ends_mps = [one.velocity_mps[0] * min(1.0, most_mps / max(float(one.speed_mps[0]), 1e-9)) for one in (end, start)]
    axes = [_cubic(apart_m[axis], ends_mps[0][axis], ends_mps[1][axis], share, span_s) for axis in (0, 1)]
    centre_m = np.stack([end.centre_m[0, axis] + axes[axis][0] for axis in (0, 1)])
    turn_rad = math.remainder(float(start.heading_rad[0] - end.heading_rad[0]), 2 * math.pi)
    return centre_m, end.heading_rad[0] + share * turn_rad, np.hypot(axes[0][1], axes[1][1])


def _hermite(
    length_m: float, end_mps: float, start_mps: float, share: FloatArray, span_s: float
) -> tuple[FloatArray, FloatArray]:
    """Drive a length without ever driving back: metres and speeds at shares of the time."""
    low, high = sorted((0.0, _MOST_OF_MEAN * length_m / span_s))
    return _cubic(length_m, min(max(end_mps, low), high), min(max(start_mps, low), high), share, span_s)


def _cubic(
    length_m: float, end_mps: float, start_mps: float, share: FloatArray, span_s: float
) -> tuple[FloatArray, FloatArray]:
    u = share
    way_m = length_m * u * u * (3 - 2 * u) + span_s * u * (1 - u) * (end_mps * (1 - u) - start_mps * u)
    pace_mps = 6 * length_m / span_s * u * (1 - u) + end_mps * (1 - u) * (1 - 3 * u) + start_mps * u * (3 * u - 2)
    return way_m, pace_mps


def earlier_cars(cars: Cars, paths: Mapping[int, tuple[LongArray, Path]], roads: RoadMap) -> Iterator[Cars]:
    """Lay out where some cars were, time by time.

    Parameters
    ----------
    cars : of now. paths : by the row of the car, times and where it was at each.
    """
    row = np.concatenate([np.full(len(times_us), row) for row, (times_us, _) in paths.items()])
    t_us = np.concatenate([times_us for times_us, _ in paths.values()])
    centre_m = np.concatenate([path[0] for _, path in paths.values()], axis=1).T
    heading_rad, speed_mps = (np.concatenate([path[k] for _, path in paths.values()]) for k in (1, 2))
    velocity_mps = np.stack([speed_mps * np.cos(heading_rad), speed_mps * np.sin(heading_rad)], axis=1)
    for moment_us in np.unique(t_us).tolist():
        now = (t_us == moment_us).nonzero()[0]
        yield cars.earlier(
            row[now].tolist(),
            moment_us,
            centre_m[now],
            velocity_mps[now],
            heading_rad[now],
            positions=roads.locate(centre_m[now]),
            linked=False,
        )
