"""How soon would two cars touch: one that follows, both as they go on, or both as they drive towards each other?

The time gap of a follower is the distance from bumper to bumper over its own speed. Only the next car ahead counts: a
driver keeps the distance to that one, and whoever drives in front of it is its business.

Time to collision (Hayward 1972, "Near-miss determination through use of a scale of danger") with both velocities held:
two boxes whose sides are parallel touch from the moment they overlap along both axes. On one road the axes are those of
the road, and nobody is taken to change lanes; elsewhere they are those of one body, and the other body counts as the
box around it. Both bodies have their say, and the later contact counts.

Whether they meet at all is a matter of how far they overlap seen along the way in which they approach: where that is
less than places are known, they may as well miss each other.
"""

import math

import numpy as np

from qsr.measuring.footprints import (
    ACROSS,
    ALONG,
    COS,
    HALF_LENGTH,
    HALF_PATH,
    ROAD,
    SIN,
    SPEED,
    TRAVEL,
    BoolArray,
    FloatArray,
    LongArray,
    shares_road,
)
from qsr.measuring.free_space import FreeSpace
from qsr.relations import FacingSwitch, Switch
from qsr.settings import RelationSettings

# Where no contact is to come: beyond every threshold, but finite, so that crossings can be dated.
_NEVER_S = 10.0
_STILL_MPS = 1e-9
# Slower cars count as so fast, where a distance is divided by the speed.
_SLOWEST_MPS = 0.01
# Far below every threshold: the quantity of a car that is not the next one ahead.
_NOT_NEXT_S = -100.0
# Where two cars do not meet, as above.
_NO_MEETING_S = 100.0


def fill_conflicts(
    values: FloatArray, ends: FloatArray, free: FreeSpace, *, on_one_road: BoolArray, settings: RelationSettings
) -> None:
    """Fill in the rows from `SHORT_TTC` on of `values`.

    Parameters
    ----------
    values : (switches, pairs), as in `qsr.relations.Switch`.
    ends : (13, 2, pairs) columns of the object table: a and b of each pair.
    free : how the two lie to each other.
    on_one_road : (pairs,) whether they are measured along one road.
    settings : thresholds.
    """
    speed_mps = ends[SPEED]
    vx, vy = speed_mps * ends[COS], speed_mps * ends[SIN]
    rate_x, rate_y = vx[::-1] - vx, vy[::-1] - vy
    ttc_s = _contact_in_free_space(ends, free, rate_x, rate_y)
    closing_mps = np.hypot(rate_x[0], rate_y[0])
    travel = ends[TRAVEL]
    along_road = on_one_road & (np.abs(travel).min(axis=0) > math.sqrt(settings.road_alignment))
    values[Switch.IN_COURSE] = _course_overlap_m(ends, free, rate_x[0], rate_y[0])
    if along_road.any():
        rate_of_a, rate_of_b = speed_mps * travel
        rate_mps = rate_of_b - rate_of_a
        forward = _overlap(ends[ALONG, 1] - ends[ALONG, 0], rate_mps, ends[HALF_LENGTH, 0] + ends[HALF_LENGTH, 1])
        half_paths = ends[HALF_PATH, 0] + ends[HALF_PATH, 1]
        across_m = ends[ACROSS, 1] - ends[ACROSS, 0]
        sideways = _overlap(across_m, np.zeros_like(rate_mps), half_paths)
        np.copyto(values[Switch.IN_COURSE], half_paths - np.abs(across_m), where=along_road)
        np.copyto(ttc_s, _first_contact(forward, sideways), where=along_road)
        np.copyto(closing_mps, np.abs(rate_mps), where=along_road)
    # Stopping a motion of v within the distance v * ttc takes v / (2 ttc).
    braking_mps2 = closing_mps / (2.0 * np.maximum(ttc_s, settings.conflict_at_once_s))
    values[Switch.SHORT_TTC] = settings.conflict_ttc_s - ttc_s
    values[Switch.HARD_BRAKING] = braking_mps2 - settings.conflict_braking_mps2


def conflict_noise(values: FloatArray, sigma_m: FloatArray, settings: RelationSettings) -> tuple[float, float]:
    """Say how far the time to contact of a pair, and the braking, may be off by places and speeds that are not exact.

    A filter that knows places better knows speeds better, by the third root: the steady state of a Kalman filter of
    vehicles that change their speed at random (Bar-Shalom et al. 2001, "Estimation with Applications to Tracking and
    Navigation", ch. 6).

    Parameters
    ----------
    values : (switches,) of the pair, from which both are taken.
    sigma_m : (2,) standard deviations of the two places.
    settings : thresholds.

    Returns
    -------
    Standard deviations in seconds and in metres per second squared.
    """
    ttc_s = max(settings.conflict_ttc_s - values[Switch.SHORT_TTC], settings.conflict_at_once_s)
    braking_mps2 = values[Switch.HARD_BRAKING] + settings.conflict_braking_mps2
    closing_mps = max(2.0 * ttc_s * braking_mps2, _SLOWEST_MPS)
    place_m, speed_mps = math.hypot(*sigma_m), settings.speed_noise_mps * math.hypot(*np.cbrt(sigma_m))
    ttc_noise_s = math.hypot(place_m, speed_mps * ttc_s) / closing_mps
    # The braking is half the square of the closing speed over the distance.
    braking_noise = braking_mps2 * math.hypot(2.0 * speed_mps, place_m / ttc_s) / closing_mps
    return ttc_noise_s, braking_noise


def _contact_in_free_space(ends: FloatArray, free: FreeSpace, rate_x: FloatArray, rate_y: FloatArray) -> FloatArray:
    """Measure the time to contact; the rates, (2, pairs), are those of the other body, from this one's."""
    cos, sin = ends[COS], ends[SIN]
    reach_forward, reach_aside = free.reach(ends, HALF_PATH)
    forward = _overlap(free.ahead, rate_x * cos + rate_y * sin, reach_forward)
    sideways = _overlap(free.left, rate_y * cos - rate_x * sin, reach_aside)
    contact_s: FloatArray = _first_contact(forward, sideways).max(axis=0)
    return contact_s


def _course_overlap_m(ends: FloatArray, free: FreeSpace, rate_x: FloatArray, rate_y: FloatArray) -> FloatArray:
    """Measure how far two bodies, (pairs,), overlap across the way in which b approaches a; below zero they miss."""
    speed = np.maximum(np.hypot(rate_x, rate_y), _STILL_MPS)
    across_x, across_y = -rate_y / speed, rate_x / speed
    cos, sin = ends[COS], ends[SIN]
    ahead, aside = np.abs(cos * across_x + sin * across_y), np.abs(cos * across_y - sin * across_x)
    reach = ends[HALF_LENGTH] * ahead + ends[HALF_PATH] * aside
    overlap_m: FloatArray = reach[0] + reach[1] - np.abs(free.x[0] * across_x + free.y[0] * across_y)
    return overlap_m


def _overlap(apart: FloatArray, rate: FloatArray, reach: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Say from when to when two bodies overlap along an axis; negative times are past."""
    speed = np.maximum(np.abs(rate), _STILL_MPS)
    approach = np.where(rate < 0, apart, -apart)
    return (approach - reach) / speed, (approach + reach) / speed


def _first_contact(one: tuple[FloatArray, FloatArray], other: tuple[FloatArray, FloatArray]) -> FloatArray:
    start, end = np.maximum(one[0], other[0]), np.minimum(one[1], other[1])
    touching: FloatArray = np.where((start < end) & (end > 0), np.minimum(np.maximum(start, 0.0), _NEVER_S), _NEVER_S)
    return touching


def fill_headways(
    values: FloatArray,
    ends: FloatArray,
    *,
    gap_m: FloatArray,
    lateral_m: FloatArray,
    direction: FloatArray,
    columns: LongArray,
    settings: RelationSettings,
) -> None:
    """Fill in the rows of `values` from `IN_PATH` to `B_AT_SHORT_HEADWAY`.

    Parameters
    ----------
    values : (switches, pairs), as in `qsr.relations.Switch`.
    ends : (13, 2, pairs) columns of the object table: a and b of each pair.
    gap_m, lateral_m, direction : (pairs,) a's centre ahead of b's; sideways between them; above zero if they drive the
        same way.
    columns : (2, pairs) of a and of b in the object table, which tell who is who in several pairs.
    settings : thresholds.
    """
    # A difference in speed counts as one in time, at the ratio of the margins: the smaller of the two decides.
    s_per_mps = settings.time_gap_margin_s / settings.moving_margin_mps if settings.moving_margin_mps else 1.0
    half_length, half_path, speed = ends[HALF_LENGTH], ends[HALF_PATH], ends[SPEED]
    in_path = half_path[0] + half_path[1] - lateral_m
    values[Switch.IN_PATH] = in_path
    in_one_path = (in_path > 0) & (direction > 0)
    # From here on row 0 is about a as the follower, row 1 about b.
    is_behind = np.array((in_one_path & (gap_m < 0), in_one_path & (gap_m > 0)))
    bumper_m = np.abs(gap_m) - (half_length[0] + half_length[1])
    nearest_m = np.full(1 + columns.max(initial=-1), np.inf)
    np.minimum.at(nearest_m, columns, np.where(is_behind, bumper_m, np.inf))
    is_next = is_behind & (bumper_m <= nearest_m.take(columns))
    gap_s = bumper_m / np.maximum(speed, _SLOWEST_MPS)
    for row, limit_s, least_mps in (
        (Switch.A_FOLLOWS_B, settings.following_s, settings.moving_mps),
        (Switch.A_AT_SHORT_HEADWAY, settings.short_headway_s, settings.short_headway_least_mps),
    ):
        short_s = np.minimum(limit_s - gap_s, (speed - least_mps) * s_per_mps)
        values[row : row + 2] = np.where(is_next, np.maximum(short_s, _NOT_NEXT_S), _NOT_NEXT_S)


def oncoming_values(ends: FloatArray, settings: RelationSettings, route_m: FloatArray | None) -> FloatArray:
    """Measure the quantities of `qsr.relations.FacingSwitch`.

    Parameters
    ----------
    ends : (13, 2, pairs) columns of the object table: a and b of each pair, that drive towards each other.
    settings : thresholds.
    route_m : (pairs,) as from `Routes.facing_m`, for those that are not on one road; None if all are.

    Returns
    -------
    (1, pairs) seconds, above zero while their bumpers will meet in less than ``oncoming_s``.
    """
    along, travel, speed_mps = ends[ALONG], ends[TRAVEL], ends[SPEED]
    ahead_m = np.where(travel[0] > 0, along[1] - along[0], along[0] - along[1])
    closing_mps = (speed_mps * np.abs(travel)).sum(axis=0)
    if route_m is not None:
        on_route = ~shares_road(ends[ROAD])
        np.copyto(ahead_m, route_m, where=on_route)
        np.copyto(closing_mps, speed_mps.sum(axis=0), where=on_route)
    ahead_m -= ends[HALF_LENGTH].sum(axis=0)
    time_s = np.minimum(ahead_m / np.maximum(closing_mps, _SLOWEST_MPS), _NO_MEETING_S)
    values = np.empty((len(FacingSwitch), ends.shape[2]))
    values[FacingSwitch.MEET_SOON] = settings.oncoming_s - np.where(ahead_m > 0, time_s, _NO_MEETING_S)
    return values
