"""When would two cars touch if both went on as they do, and how hard would one have to brake to prevent it?

Time to collision (Hayward 1972, "Near-miss determination through use of a scale of danger") with both velocities held:
two boxes whose sides are parallel touch from the moment they overlap along both axes. On one road the axes are those of
the road, and nobody is taken to change lanes; elsewhere they are those of one body, and the other body counts as the
box around it. Both bodies have their say, and the later contact counts.
"""

import math

import numpy as np
from numpy.typing import NDArray

from qsr.object_table import (
    ACROSS,
    ALONG,
    COS,
    HALF_LENGTH,
    HALF_PATH,
    SIN,
    SPEED,
    TRAVEL,
    FloatArray,
    X,
    Y,
)
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
    values: FloatArray, a: FloatArray, b: FloatArray, *, on_one_road: BoolArray, settings: RelationSettings
) -> None:
    """Fill in the rows `SHORT_TTC` and `HARD_BRAKING` of `values`.

    Parameters
    ----------
    values : (switches, pairs), as in `qsr.relations.Switch`.
    a, b : columns of the object table: the objects of each pair.
    on_one_road : (pairs,) whether they are measured along one road.
    settings : thresholds.
    """
    # In one go: for so few pairs the calls cost more than the arithmetic.
    both = _contact_in_frame_of(np.concatenate((a, b), axis=1), np.concatenate((b, a), axis=1))
    ttc_s = both.reshape(2, -1).max(axis=0)
    closing_mps = np.hypot(b[SPEED] * b[COS] - a[SPEED] * a[COS], b[SPEED] * b[SIN] - a[SPEED] * a[SIN])
    along_road = on_one_road & (np.minimum(np.abs(a[TRAVEL]), np.abs(b[TRAVEL])) > math.sqrt(settings.road_alignment))
    if along_road.any():
        rate_mps = b[SPEED] * b[TRAVEL] - a[SPEED] * a[TRAVEL]
        forward = _overlap(b[ALONG] - a[ALONG], rate_mps, a[HALF_LENGTH] + b[HALF_LENGTH])
        sideways = _overlap(b[ACROSS] - a[ACROSS], np.zeros_like(rate_mps), a[HALF_PATH] + b[HALF_PATH])
        np.copyto(ttc_s, _first_contact(forward, sideways), where=along_road)
        np.copyto(closing_mps, np.abs(rate_mps), where=along_road)
    # Stopping a motion of v within the distance v * ttc takes v / (2 ttc).
    braking_mps2 = np.minimum(closing_mps / (2.0 * np.maximum(ttc_s, _AT_ONCE_S)), _HARDEST_MPS2)
    values[Switch.SHORT_TTC] = settings.conflict_ttc_s - ttc_s
    values[Switch.HARD_BRAKING] = braking_mps2 - settings.conflict_braking_mps2


def _contact_in_frame_of(body: FloatArray, other: FloatArray) -> FloatArray:
    """Measure the time to contact with the box around the other body that is parallel to this one."""
    cos, sin = body[COS], body[SIN]
    apart_x, apart_y = other[X] - body[X], other[Y] - body[Y]
    rate_x = other[SPEED] * other[COS] - body[SPEED] * cos
    rate_y = other[SPEED] * other[SIN] - body[SPEED] * sin
    turn_cos = np.abs(cos * other[COS] + sin * other[SIN])
    turn_sin = np.abs(cos * other[SIN] - sin * other[COS])
    length = body[HALF_LENGTH] + other[HALF_LENGTH] * turn_cos + other[HALF_PATH] * turn_sin
    width = body[HALF_PATH] + other[HALF_PATH] * turn_cos + other[HALF_LENGTH] * turn_sin
    forward = _overlap(apart_x * cos + apart_y * sin, rate_x * cos + rate_y * sin, length)
    sideways = _overlap(apart_y * cos - apart_x * sin, rate_y * cos - rate_x * sin, width)
    return _first_contact(forward, sideways)


def _overlap(apart: FloatArray, rate: FloatArray, reach: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Say from when to when two bodies overlap along an axis; negative times are past."""
    speed = np.maximum(np.abs(rate), _STILL_MPS)
    approach = -np.where(rate < 0, -apart, apart)
    return (approach - reach) / speed, (approach + reach) / speed


def _first_contact(one: tuple[FloatArray, FloatArray], other: tuple[FloatArray, FloatArray]) -> FloatArray:
    start, end = np.maximum(one[0], other[0]), np.minimum(one[1], other[1])
    touching: FloatArray = np.where((start < end) & (end > 0), np.clip(start, 0.0, _NEVER_S), _NEVER_S)
    return touching
