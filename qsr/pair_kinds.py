"""Which pairs are looked at, and what is measured of them?

Cars that are near each other, cars that are near in time (at their speed), and cars that drive towards each other. A
pair of which neither car is seen in a frame does not come in with that frame.
"""

from collections.abc import Collection, Sequence
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from qsr.near_in_time import near_in_time
from qsr.object_table import HALF_LENGTH, OBSERVED, BoolArray, FloatArray, X, Y
from qsr.oncoming import facing_pairs, oncoming_values
from qsr.pairs import NearPairs, NearSet, pairs_within
from qsr.relations import (
    FACING_RELATIONS,
    NEAR_IN_TIME_RELATIONS,
    NEAR_RELATIONS,
    PairRelation,
    Switch,
    asked_for,
)
from qsr.road_relations import switch_margins, switch_values
from qsr.settings import RelationSettings

LongArray = NDArray[np.int64]


class PairKind(Protocol):
    """Describe a kind of pairs.

    Attributes
    ----------
    relations : that are given out.
    margins : (switches,) as for `qsr.changes.SwitchBank`.
    """

    relations: tuple[PairRelation, ...]
    margins: FloatArray

    def look(self, serials: LongArray, table: FloatArray) -> NearPairs:
        """Find the pairs of one frame among the objects of an object table."""
        ...

    def measure(self, table: FloatArray, pairs: NearPairs) -> FloatArray:
        """Measure the quantity of every switch of every pair, (switches, pairs)."""
        ...


class NearCars:
    """Look at cars that are near each other in the plane, measured by as many switches as the names ask for."""

    def __init__(self, settings: RelationSettings, names: Collection[str]) -> None:
        self.relations = asked_for(NEAR_RELATIONS, names)
        self.margins = switch_margins(settings)[: _rows_used(self.relations)]
        self._settings = settings
        self._near = NearSet()

    def look(self, serials: LongArray, table: FloatArray) -> NearPairs:
        """Find the pairs, as in `PairKind`."""
        settings = self._settings
        pairs, distance_m = pairs_within(table[X : Y + 1].T, table[HALF_LENGTH], settings.leave_radius_m)
        is_near = distance_m <= settings.enter_radius_m
        return self._near.update(serials, pairs, is_near & is_either_seen(table, pairs))

    def measure(self, table: FloatArray, pairs: NearPairs) -> FloatArray:
        """Measure the pairs, as in `PairKind`."""
        return switch_values(table, (pairs.first, pairs.second), self._settings, rows=len(self.margins))


class NearInTimeCars:
    """Look at cars whose time gap or conflict may matter, from further away the faster they are."""

    def __init__(self, settings: RelationSettings, names: Collection[str]) -> None:
        self.relations = asked_for(NEAR_IN_TIME_RELATIONS, names)
        self.margins = switch_margins(settings)[: _rows_used(self.relations)]
        self._settings = settings
        self._near = NearSet()

    def look(self, serials: LongArray, table: FloatArray) -> NearPairs:
        """Find the pairs, as in `PairKind`."""
        pairs, is_near = near_in_time(table, self._settings)
        return self._near.update(serials, pairs, is_near & is_either_seen(table, pairs))

    def measure(self, table: FloatArray, pairs: NearPairs) -> FloatArray:
        """Measure the pairs, as in `PairKind`."""
        return switch_values(table, (pairs.first, pairs.second), self._settings, rows=len(self.margins))


class FacingCars:
    """Look at cars that drive in opposite directions on one road, from further away."""

    def __init__(self, settings: RelationSettings, names: Collection[str]) -> None:
        self.relations = asked_for(FACING_RELATIONS, names)
        self.margins = np.array([settings.oncoming_margin_s])
        self._settings = settings
        self._near = NearSet()

    def look(self, serials: LongArray, table: FloatArray) -> NearPairs:
        """Find the pairs, as in `PairKind`."""
        pairs, distance_m = facing_pairs(table, self._settings)
        is_near = distance_m <= self._settings.oncoming_enter_m
        return self._near.update(serials, pairs, is_near & is_either_seen(table, pairs))

    def measure(self, table: FloatArray, pairs: NearPairs) -> FloatArray:
        """Measure the pairs, as in `PairKind`."""
        return oncoming_values(table.take(pairs.first, axis=1), table.take(pairs.second, axis=1), self._settings)


def is_either_seen(table: FloatArray, pairs: LongArray) -> BoolArray:
    """Tell of which pairs, (pairs, 2), at least one object was seen in this frame.

    Examples
    --------
    >>> table = np.zeros((13, 3))
    >>> table[OBSERVED] = 1.0, 0.0, 0.0
    >>> is_either_seen(table, np.array([[0, 1], [1, 2]])).tolist()
    [True, False]
    """
    observed = table[OBSERVED] > 0
    return np.asarray(observed[pairs[:, 0]] | observed[pairs[:, 1]], dtype=np.bool_)


def _rows_used(relations: Sequence[PairRelation]) -> int:
    """Count the switches up to the last one that some relation needs."""
    used = [switch for relation in relations for switch in (*relation.switches, *relation.but_not)]
    return 1 + max(used, default=Switch.PAST_REAR)
