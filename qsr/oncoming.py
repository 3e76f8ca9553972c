"""How soon do two cars meet that drive towards each other on one road?"""

import math

import numpy as np

from qsr.object_table import ALONG, HALF_LENGTH, ROAD, SPEED, TRAVEL, FloatArray
from qsr.pairs import PairArray, facing_within
from qsr.relations import FacingSwitch
from qsr.settings import RelationSettings

# Where they do not meet: beyond every threshold, but finite, so that crossings can be dated.
_NEVER_S = 100.0
_STILL_MPS = 0.01


def facing_pairs(table: FloatArray, settings: RelationSettings) -> tuple[PairArray, FloatArray]:
    """List the pairs that drive in opposite directions on one road, near enough to be looked at.

    Returns
    -------
    As from `qsr.pairs.facing_within`.
    """
    travel = table[TRAVEL]
    return facing_within(
        table[ROAD],
        table[ALONG],
        travel=np.where(np.abs(travel) > math.sqrt(settings.road_alignment), travel, 0.0),
        half_length_m=table[HALF_LENGTH],
        reach_m=settings.oncoming_leave_m,
    )


def oncoming_values(a: FloatArray, b: FloatArray, settings: RelationSettings) -> FloatArray:
    """Measure the quantities of `qsr.relations.FacingSwitch`.

    Parameters
    ----------
    a, b : columns of the object table: the objects of each pair, in opposite directions on one road.
    settings : thresholds.

    Returns
    -------
    (1, pairs) seconds, above zero while their bumpers will meet in less than ``oncoming_s``.
    """
    ahead_m = np.where(a[TRAVEL] > 0, b[ALONG] - a[ALONG], a[ALONG] - b[ALONG]) - a[HALF_LENGTH] - b[HALF_LENGTH]
    closing_mps = a[SPEED] * np.abs(a[TRAVEL]) + b[SPEED] * np.abs(b[TRAVEL])
    time_s = np.minimum(ahead_m / np.maximum(closing_mps, _STILL_MPS), _NEVER_S)
    values = np.empty((len(FacingSwitch), a.shape[1]))
    values[FacingSwitch.MEET_SOON] = settings.oncoming_s - np.where(ahead_m > 0, time_s, _NEVER_S)
    return values
