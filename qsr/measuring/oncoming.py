"""How soon do two cars meet that drive towards each other on one road?"""

import math

import numpy as np

from qsr.measuring.object_table import ALONG, HALF_LENGTH, ROAD, SPEED, TRAVEL, FloatArray
from qsr.measuring.pairs import PairArray, facing_within
from qsr.relations import FacingSwitch
from qsr.settings import RelationSettings

# Where they do not meet: beyond every threshold, but finite, so that crossings can be dated.
_NEVER_S = 100.0
_STILL_MPS = 0.01


def facing_pairs(table: FloatArray, settings: RelationSettings) -> tuple[PairArray, FloatArray]:
    """List the pairs that drive in opposite directions on one road, near enough to be looked at.

    Returns
    -------
    As from `qsr.measuring.pairs.facing_within`.
    """
    travel = table[TRAVEL]
    return facing_within(
        table[ROAD],
        table[ALONG],
        travel=np.where(np.abs(travel) > math.sqrt(settings.road_alignment), travel, 0.0),
        half_length_m=table[HALF_LENGTH],
        reach_m=settings.oncoming_leave_m,
    )


def oncoming_values(ends: FloatArray, settings: RelationSettings) -> FloatArray:
    """Measure the quantities of `qsr.relations.FacingSwitch`.

    Parameters
    ----------
    ends : (13, 2, pairs) columns of the object table: a and b of each pair, in opposite directions on one road.
    settings : thresholds.

    Returns
    -------
    (1, pairs) seconds, above zero while their bumpers will meet in less than ``oncoming_s``.
    """
    along, half_length, travel = ends[ALONG], ends[HALF_LENGTH], ends[TRAVEL]
    ahead_m = np.where(travel[0] > 0, along[1] - along[0], along[0] - along[1]) - half_length[0] - half_length[1]
    speed_of_a, speed_of_b = ends[SPEED] * np.abs(travel)
    time_s = np.minimum(ahead_m / np.maximum(speed_of_a + speed_of_b, _STILL_MPS), _NEVER_S)
    values = np.empty((len(FacingSwitch), ends.shape[2]))
    values[FacingSwitch.MEET_SOON] = settings.oncoming_s - np.where(ahead_m > 0, time_s, _NEVER_S)
    return values
