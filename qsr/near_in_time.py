"""Which cars are so near, at their speed, that a time gap or a conflict between them may matter?

A time gap of 3 s is 15 m in a town and 100 m on a motorway, so a radius in metres alone is too small for the one or
costs too much in the other. Besides the cars within the near radius these are pairs that are *in line*, less than two
lanes apart sideways, and that the faster one's speed would bring together within some seconds: if one follows the
other, or if both drive towards each other.
"""

import math

import numpy as np

from qsr.object_table import ACROSS, COS, HALF_LENGTH, SIN, SPEED, BoolArray, FloatArray, X, Y
from qsr.pairs import PairArray, pairs_within
from qsr.road_relations import is_on_one_road
from qsr.settings import RelationSettings


def near_in_time(table: FloatArray, settings: RelationSettings) -> tuple[PairArray, BoolArray]:
    """List the pairs that may stay, and say which of them may come in.

    Parameters
    ----------
    table : (13, n) as made by `qsr.object_table.object_table`.
    settings : thresholds.

    Returns
    -------
    (pairs, 2) columns of the table, the lower first, in lexicographic order; (pairs,) True for those within the smaller
    limits.
    """
    fastest_mps = float(table[SPEED].max(initial=0.0))
    radius_m = max(settings.leave_radius_m, settings.leave_reach_s * fastest_mps)
    pairs, distance_m = pairs_within(table[X : Y + 1].T, table[HALF_LENGTH], radius_m)
    a, b = table.take(pairs[:, 0], axis=1), table.take(pairs[:, 1], axis=1)
    speed_mps = np.maximum(a[SPEED], b[SPEED])
    # Most pairs are too far apart or near anyway: only the others are asked whether they are in line.
    is_near = distance_m <= settings.enter_radius_m
    asked = np.flatnonzero(~is_near & (distance_m <= settings.leave_reach_s * speed_mps))
    sideways_m = np.full(len(pairs), np.inf)
    sideways_m[asked] = _sideways_m(a[:, asked], b[:, asked], settings)
    stays = np.flatnonzero((distance_m <= settings.leave_radius_m) | (sideways_m <= settings.leave_line_m))
    may_enter = is_near | ((distance_m <= settings.enter_reach_s * speed_mps) & (sideways_m <= settings.enter_line_m))
    return pairs[stays], may_enter[stays]


def _sideways_m(a: FloatArray, b: FloatArray, settings: RelationSettings) -> FloatArray:
    """Measure how far apart the centres are across the road, or across the mean heading; inf if there is none."""
    apart_x, apart_y = a[X] - b[X], a[Y] - b[Y]
    mean_cos, mean_sin = a[COS] + b[COS], a[SIN] + b[SIN]
    alike = a[COS] * b[COS] + a[SIN] * b[SIN] > math.cos(settings.heading_limit_rad)
    size = np.where(alike, np.hypot(mean_cos, mean_sin), 1.0)
    across_heading = np.where(alike, np.abs(apart_y * mean_cos - apart_x * mean_sin) / size, np.inf)
    on_one_road = is_on_one_road(a, b, np.hypot(apart_x, apart_y), settings)
    sideways_m: FloatArray = np.where(on_one_road, np.abs(a[ACROSS] - b[ACROSS]), across_heading)
    return sideways_m
