"""When would two cars touch if both went on as they do, and how hard would one have to brake to prevent it?

Time to collision (Hayward 1972, "Near-miss determination through use of a scale of danger") with both velocities held:
two boxes whose sides are parallel touch from the moment they overlap along both axes. On one road the axes are those of
the road, and nobody is taken to change lanes; elsewhere they are those of one body, and the other body counts as the
box around it. Both bodies have their say, and the later contact counts.
"""

import math

import numpy as np
from numpy.typing import NDArray

from qsr.measuring.free_space import FreeSpace
from qsr.measuring.object_table import ACROSS, ALONG, COS, HALF_LENGTH, HALF_PATH, SIN, SPEED, TRAVEL, FloatArray
from qsr.relations import Switch
from qsr.settings import RelationSettings

BoolArray = NDArray[np.bool_]

# Where no contact is to come: beyond every threshold, but finite, so that crossings can be dated.
_NEVER_S = 10.0
# Nearer contacts are not told apart, so that the braking stays finite.
_AT_ONCE_S = 0.1
_HARDEST_MPS2 = 30.0
_STILL_MPS = 1e-9


def fill_conflicts(
    values: FloatArray, ends: FloatArray, free: FreeSpace, *, on_one_road: BoolArray, settings: RelationSettings
) -> None:
    """Fill in the rows `SHORT_TTC` and `HARD_BRAKING` of `values`.

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
    if along_road.any():
        rate_of_a, rate_of_b = speed_mps * travel
        rate_mps = rate_of_b - rate_of_a
        forward = _overlap(ends[ALONG, 1] - ends[ALONG, 0], rate_mps, ends[HALF_LENGTH, 0] + ends[HALF_LENGTH, 1])
        half_paths = ends[HALF_PATH, 0] + ends[HALF_PATH, 1]
        sideways = _overlap(ends[ACROSS, 1] - ends[ACROSS, 0], np.zeros_like(rate_mps), half_paths)
        np.copyto(ttc_s, _first_contact(forward, sideways), where=along_road)
        np.copyto(closing_mps, np.abs(rate_mps), where=along_road)
    # Stopping a motion of v within the distance v * ttc takes v / (2 ttc).
    braking_mps2 = np.minimum(closing_mps / (2.0 * np.maximum(ttc_s, _AT_ONCE_S)), _HARDEST_MPS2)
    values[Switch.SHORT_TTC] = settings.conflict_ttc_s - ttc_s
    values[Switch.HARD_BRAKING] = braking_mps2 - settings.conflict_braking_mps2


def _contact_in_free_space(ends: FloatArray, free: FreeSpace, rate_x: FloatArray, rate_y: FloatArray) -> FloatArray:
    """Measure the time to contact; the rates, (2, pairs), are those of the other body, from this one's."""
    cos, sin = ends[COS], ends[SIN]
    reach_forward, reach_aside = free.reach(ends, HALF_PATH)
    forward = _overlap(free.ahead, rate_x * cos + rate_y * sin, reach_forward)
    sideways = _overlap(free.left, rate_y * cos - rate_x * sin, reach_aside)
    contact_s: FloatArray = _first_contact(forward, sideways).max(axis=0)
    return contact_s


def _overlap(apart: FloatArray, rate: FloatArray, reach: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Say from when to when two bodies overlap along an axis; negative times are past."""
    speed = np.maximum(np.abs(rate), _STILL_MPS)
    approach = np.where(rate < 0, apart, -apart)
    return (approach - reach) / speed, (approach + reach) / speed


def _first_contact(one: tuple[FloatArray, FloatArray], other: tuple[FloatArray, FloatArray]) -> FloatArray:
    start, end = np.maximum(one[0], other[0]), np.minimum(one[1], other[1])
    touching: FloatArray = np.where((start < end) & (end > 0), np.minimum(np.maximum(start, 0.0), _NEVER_S), _NEVER_S)
    return touching
