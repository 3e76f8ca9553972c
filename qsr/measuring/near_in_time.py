"""Which cars are so near, at their speed, that a time gap or a conflict between them may matter?

A time gap of 3 s is 15 m in a town and 100 m on a motorway, so a radius in metres alone is too small for the one or
costs too much in the other. Besides the cars within the near radius these are pairs that are *in line*, less than two
lanes apart sideways, and that the faster one's speed would bring together within some seconds: if one follows the
other, or if both drive towards each other.
"""

import math

import numpy as np

from qsr.measuring.object_table import ACROSS, COS, HALF_LENGTH, SIN, SPEED, BoolArray, FloatArray, X, Y
from qsr.measuring.pairs import PairArray, pairs_within
from qsr.measuring.road_relations import is_on_one_road
from qsr.settings import RelationSettings


def near_in_time(table: FloatArray, settings: RelationSettings) -> tuple[PairArray, FloatArray, BoolArray]:
    """List the pairs that may stay, and say which of them may come in.

    Parameters
    ----------
    table : (13, n) as made by `qsr.measuring.object_table.object_table`.
    settings : thresholds.

    Returns
    -------
    (2, pairs) columns of the table, the lower in the first row, in lexicographic order; (pairs,) distances as from
    `qsr.measuring.pairs.pairs_within`; (pairs,) True for those within the smaller limits.
    """
    speed_mps = table[SPEED]
    radius_m = max(settings.leave_radius_m, settings.leave_reach_s * float(speed_mps.max(initial=0.0)))
    pairs, distance_m = pairs_within(table[X : Y + 1].T, table[HALF_LENGTH], radius_m)
    may_enter = distance_m <= settings.enter_radius_m
    stays = distance_m <= settings.leave_radius_m
    # Most pairs are too far apart or near anyway: only the others are asked whether they are in line.
    faster_mps = speed_mps.take(pairs).max(axis=0)
    asked = (~may_enter & (distance_m <= settings.leave_reach_s * faster_mps)).nonzero()[0]
    if len(asked):
        sideways_m = _sideways_m(table.take(pairs.take(asked, axis=1), axis=1), settings)
        stays[asked] |= sideways_m <= settings.leave_line_m
        is_soon = distance_m.take(asked) <= settings.enter_reach_s * faster_mps.take(asked)
        may_enter[asked] = is_soon & (sideways_m <= settings.enter_line_m)
    kept = stays.nonzero()[0]
    return pairs.take(kept, axis=1), distance_m.take(kept), may_enter.take(kept)


def _sideways_m(ends: FloatArray, settings: RelationSettings) -> FloatArray:
    """Measure how far apart the centres are across the road, or across the mean heading; inf if there is none."""
    a, b = ends[:, 0], ends[:, 1]
    apart_x, apart_y = a[X] - b[X], a[Y] - b[Y]
    mean_cos, mean_sin = a[COS] + b[COS], a[SIN] + b[SIN]
    alike = a[COS] * b[COS] + a[SIN] * b[SIN] > math.cos(settings.heading_limit_rad)
    size = np.where(alike, np.hypot(mean_cos, mean_sin), 1.0)
    across_heading = np.where(alike, np.abs(apart_y * mean_cos - apart_x * mean_sin) / size, np.inf)
    on_one_road = is_on_one_road(ends, np.hypot(apart_x, apart_y), settings)
    sideways_m: FloatArray = np.where(on_one_road, np.abs(a[ACROSS] - b[ACROSS]), across_heading)
    return sideways_m
