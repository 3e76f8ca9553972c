"""Where was a car while nobody saw it? On the way between the two places, at speeds that fit both ends.

Along their road where both are on one, along the lanes where the map says how they lead there, and else on a smooth
curve. Speeds are those of cubic Hermite splines, held within what keeps a car from driving back on its way. Over a
short time they rest on the speeds at both ends: there noise alone makes a way that a standing car has not driven.
"""

import math
from collections.abc import Callable, Iterator

import numpy as np

from anchoring.linking.bodies import LOST, NOW, START, Bodies
from anchoring.linking.frame import RoadMap
from anchoring.linking.ways import Looks
from anchoring.observations import Cars, FloatArray, LongArray
from anchoring.settings import AnchoringSettings
from gis.roads.lane_graph import Route

# Centres (2, k), headings and speeds (k,) at k times.
Path = tuple[FloatArray, FloatArray, FloatArray]

# A cubic stays monotone if no end is faster than so many times the mean (Fritsch and Carlson 1980).
_MOST_OF_MEAN = 3.0
# Full braking is rare: so many standard deviations of how speeds change.
_BRAKING_SIGMAS = 3.0


def fill(
    cars: Cars,
    bodies: Bodies,
    returned: LongArray,
    moments_us: LongArray,
    *,
    roads: RoadMap,
    settings: AnchoringSettings,
) -> Iterator[Cars]:
    """Find where cars were at the moments while nobody saw them, oldest first.

    Parameters
    ----------
    cars, bodies : of now.
    returned : columns of the bodies of those that are seen again.
    moments_us : of which is told.
    roads : the ways.
    settings : how fast speeds change.
    """
    body, moment = (moments_us > bodies.states_us[LOST, returned][:, None]).nonzero()
    if not len(body):
        return
    # From when each was seen last to when its vision object was seen first, and from then to now.
    lost_us, began_us, now_us = bodies.states_us[[[LOST], [START], [NOW]], returned]
    has_both = (lost_us < began_us) & (began_us < now_us)
    columns, t_us = returned.repeat(2), moments_us[moment]
    until = np.stack((np.where(has_both, START, NOW), np.full(len(returned), NOW)), axis=1).ravel()
    end, start = bodies.looks(columns, np.tile((LOST, START), len(returned))), bodies.looks(columns, until)
    span = 2 * body + (has_both[body] & (t_us >= began_us[body]))
    sigma_m = bodies.sigma_m[columns]
    centre, heading_rad, speed_mps = hidden_path(
        end, start, span, t_us, sigma_m=sigma_m, roads=roads, settings=settings
    )
    centre_m, velocity_mps = centre.T, np.stack([np.cos(heading_rad), np.sin(heading_rad)], axis=1) * speed_mps[:, None]
    row_of = {car: row for row, car in enumerate(cars.ids)}
    rows = np.array([row_of[bodies.chains[column].car_id] for column in returned])[body]
    for moment_us in np.unique(t_us).tolist():
        now = (t_us == moment_us).nonzero()[0]
        yield cars.earlier(
            rows[now].tolist(),
            moment_us,
            centre_m[now],
            velocity_mps[now],
            heading_rad[now],
            locate=roads.locate,
            linked=False,
        )


def hidden_path(
    end: Looks,
    start: Looks,
    span: LongArray,
    t_us: LongArray,
    *,
    sigma_m: FloatArray,
    roads: RoadMap,
    settings: AnchoringSettings,
) -> Path:
    """Find where cars were between two times at which they were seen.

    Parameters
    ----------
    end, start : s spans: a car as it was seen before, and as it was seen next.
    span, t_us : (k,) rising row of these, and a time within it.
    sigma_m : (s,) standard deviation of each coordinate of the places; nan where nobody says.
    roads : the ways between them.
    settings : how fast speeds change.

    Returns
    -------
    Centres (2, k), headings and speeds (k,).
    """
    path = np.empty((2, len(t_us))), np.empty(len(t_us)), np.empty(len(t_us))
    span_s = np.asarray((start.t_us - end.t_us)[span] * 1e-6, np.float64)
    share = (t_us - end.t_us[span]) * 1e-6 / span_s

    def draw(way: Callable[..., Path], which: LongArray | slice, *where: object) -> None:
        rows = span[which]
        if not len(rows):
            return
        part = way(end.take(rows), start.take(rows), share[which], span_s[which], *where)
        for whole, piece in zip(path, part, strict=True):
            whole[..., which] = piece

    on_road = ((end.road >= 0) & (end.road == start.road))[span]
    in_the_open = ~on_road
    for row in np.unique(span[in_the_open]).tolist():
        route = roads.routes.route(end.take(np.array([row])), start.take(np.array([row])))
        if route is not None:
            along = slice(*span.searchsorted([row, row + 1]).tolist())
            draw(_along_lanes, along, route)
            in_the_open[along] = False
    draw(_along_road, on_road.nonzero()[0], roads)
    draw(_in_the_open, in_the_open.nonzero()[0])
    centre, heading_rad, driven_mps = path
    trust = _trust(span_s, sigma_m[span], settings)
    steady_mps = end.speed_mps[span] * (1 - share) + start.speed_mps[span] * share
    return centre, heading_rad, trust * driven_mps + (1 - trust) * steady_mps


def _trust(span_s: FloatArray, sigma_m: FloatArray, settings: AnchoringSettings) -> FloatArray:
    """Say what share (k,) of what places tell of the speed is not their noise.

    Parameters
    ----------
    span_s : (k,) how far apart in time two places are.
    sigma_m : (k,) standard deviation of each coordinate of both; nan where nobody says.
    """
    # By how much the way may differ from the one at steadily changing speed: a Brownian bridge of accelerations.
    driven_m2 = (settings.acceleration_mps2 / _BRAKING_SIGMAS) ** 2 * span_s**3 / 12
    return driven_m2 / (driven_m2 + 2 * np.nan_to_num(sigma_m) ** 2)


def _along_lanes(end: Looks, start: Looks, share: FloatArray, span_s: FloatArray, route: Route) -> Path:
    length_m = float(np.hypot(*np.diff(route.line_m, axis=0).T).sum())
    driven_m, speed_mps = _hermite(np.full(len(share), length_m), end.speed_mps, start.speed_mps, share, span_s)
    shares = driven_m / max(length_m, 1e-9)
    points_m, heading_rad = route.points(np.concatenate((shares, [0.0, 1.0])))
    # Cars drive beside the middle of their lanes.
    off_m = np.stack((end.centre_m[0], start.centre_m[0])) - points_m[-2:]
    points_m = points_m[:-2] + off_m[0] + shares[:, None] * (off_m[1] - off_m[0])
    return points_m.T, heading_rad[:-2], speed_mps


def _along_road(end: Looks, start: Looks, share: FloatArray, span_s: FloatArray, roads: RoadMap) -> Path:
    end_mps, start_mps = (
        one.velocity_mps[:, 0] * np.cos(one.tangent_rad) + one.velocity_mps[:, 1] * np.sin(one.tangent_rad)
        for one in (end, start)
    )
    driven_m, speed_mps = _hermite(start.along_m - end.along_m, end_mps, start_mps, share, span_s)
    still = np.zeros(len(share))
    aside_m, _ = _hermite(start.across_m - end.across_m, still, still, share, span_s)
    points_m, line_rad = roads.points(end.road, end.along_m + driven_m, end.across_m + aside_m)
    return points_m, line_rad + math.pi * (end.sense < 0.0), np.abs(speed_mps)


def _in_the_open(end: Looks, start: Looks, share: FloatArray, span_s: FloatArray) -> Path:
    apart_m = (start.centre_m - end.centre_m).T
    most_mps = _MOST_OF_MEAN * np.hypot(*apart_m) / span_s
    end_mps, start_mps = (
        one.velocity_mps.T * np.minimum(1.0, most_mps / np.maximum(one.speed_mps, 1e-9)) for one in (end, start)
    )
    way_m, pace_mps = _cubic(apart_m, end_mps, start_mps, share, span_s)
    turn_rad = np.remainder(start.heading_rad - end.heading_rad + math.pi, 2 * math.pi) - math.pi
    return end.centre_m.T + way_m, end.heading_rad + share * turn_rad, np.hypot(*pace_mps)


def _hermite(
    length_m: FloatArray, end_mps: FloatArray, start_mps: FloatArray, share: FloatArray, span_s: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Drive lengths without ever driving back: metres and speeds at shares of the time."""
    most_mps = _MOST_OF_MEAN * length_m / span_s
    low, high = np.minimum(most_mps, 0.0), np.maximum(most_mps, 0.0)
    return _cubic(length_m, np.clip(end_mps, low, high), np.clip(start_mps, low, high), share, span_s)


def _cubic(
    length_m: FloatArray, end_mps: FloatArray, start_mps: FloatArray, share: FloatArray, span_s: FloatArray
) -> tuple[FloatArray, FloatArray]:
    u = share
    way_m = length_m * u * u * (3 - 2 * u) + span_s * u * (1 - u) * (end_mps * (1 - u) - start_mps * u)
    pace_mps = 6 * length_m / span_s * u * (1 - u) + end_mps * (1 - u) * (1 - 3 * u) + start_mps * u * (3 * u - 2)
    return way_m, pace_mps
