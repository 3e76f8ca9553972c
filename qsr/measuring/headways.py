"""How long would a car take to reach the next one in its path, if that one stood?

The time gap is the distance from bumper to bumper over the follower's own speed. Only the next car ahead counts: a
driver keeps the distance to that one, and whoever drives in front of it is its business.
"""

import numpy as np
from numpy.typing import NDArray

from qsr.measuring.object_table import HALF_LENGTH, HALF_PATH, SPEED, FloatArray
from qsr.relations import Switch
from qsr.settings import RelationSettings

LongArray = NDArray[np.int64]

# Far below every threshold: the quantity of a car that is not the next one ahead.
_NOT_NEXT_S = -100.0
_STILL_MPS = 0.01


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
    gap_s = bumper_m / np.maximum(speed, _STILL_MPS)
    for row, limit_s, least_mps in (
        (Switch.A_FOLLOWS_B, settings.following_s, settings.moving_mps),
        (Switch.A_AT_SHORT_HEADWAY, settings.short_headway_s, settings.short_headway_least_mps),
    ):
        short_s = np.minimum(limit_s - gap_s, (speed - least_mps) * s_per_mps)
        values[row : row + 2] = np.where(is_next, np.maximum(short_s, _NOT_NEXT_S), _NOT_NEXT_S)
