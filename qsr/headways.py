"""How long would a car take to reach the next one in its path, if that one stood?

The time gap is the distance from bumper to bumper over the follower's own speed. Only the next car ahead counts: a
driver keeps the distance to that one, and whoever drives in front of it is its business.
"""

import numpy as np
from numpy.typing import NDArray

from qsr.object_table import HALF_LENGTH, HALF_PATH, SPEED, FloatArray
from qsr.relations import Switch
from qsr.settings import RelationSettings

LongArray = NDArray[np.int64]

# Far below every threshold: the quantity of a car that is not the next one ahead.
_NOT_NEXT_S = -100.0
_STILL_MPS = 0.01


def fill_headways(
    values: FloatArray,
    a: FloatArray,
    b: FloatArray,
    *,
    gap_m: FloatArray,
    lateral_m: FloatArray,
    direction: FloatArray,
    columns: tuple[LongArray, LongArray],
    settings: RelationSettings,
) -> None:
    """Fill in the rows of `values` from `IN_PATH` to `B_AT_SHORT_HEADWAY`.

    Parameters
    ----------
    values : (switches, pairs), as in `qsr.relations.Switch`.
    a, b : columns of the object table: the objects of each pair.
    gap_m, lateral_m, direction : (pairs,) a's centre ahead of b's; sideways between them; above zero if they drive the
        same way.
    columns : of a and of b in the object table, which tell who is who in several pairs.
    settings : thresholds.
    """
    # A difference in speed counts as one in time, at the ratio of the margins: the smaller of the two decides.
    s_per_mps = settings.time_gap_margin_s / settings.moving_margin_mps if settings.moving_margin_mps else 1.0
    half_lengths = a[HALF_LENGTH] + b[HALF_LENGTH]
    in_path = a[HALF_PATH] + b[HALF_PATH] - lateral_m
    values[Switch.IN_PATH] = in_path
    in_one_path = (in_path > 0) & (direction > 0)
    a_behind, b_behind = in_one_path & (gap_m < 0), in_one_path & (gap_m > 0)
    bumper_m = np.abs(gap_m) - half_lengths
    first, second = columns
    nearest_m = np.full(1 + max(first.max(initial=-1), second.max(initial=-1)), np.inf)
    np.minimum.at(nearest_m, first[a_behind], bumper_m[a_behind])
    np.minimum.at(nearest_m, second[b_behind], bumper_m[b_behind])
    for follower, column, behind, follows, is_short in (
        (a, first, a_behind, Switch.A_FOLLOWS_B, Switch.A_AT_SHORT_HEADWAY),
        (b, second, b_behind, Switch.B_FOLLOWS_A, Switch.B_AT_SHORT_HEADWAY),
    ):
        is_next = behind & (bumper_m <= nearest_m[column])
        speed = follower[SPEED]
        gap_s = bumper_m / np.maximum(speed, _STILL_MPS)
        for row, limit_s, least_mps in (
            (follows, settings.following_s, settings.moving_mps),
            (is_short, settings.short_headway_s, settings.short_headway_least_mps),
        ):
            short_s = np.minimum(limit_s - gap_s, (speed - least_mps) * s_per_mps)
            values[row] = np.where(is_next, np.maximum(short_s, _NOT_NEXT_S), _NOT_NEXT_S)
