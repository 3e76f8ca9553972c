"""Which pairs are looked at, and what is measured of them? Near cars, and cars that drive towards each other."""

from collections.abc import Collection
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from qsr.object_table import HALF_LENGTH, FloatArray, X, Y
from qsr.oncoming import facing_pairs, oncoming_values
from qsr.pairs import NearPairs, NearSet, pairs_within
from qsr.relations import FACING_RELATIONS, NEAR_RELATIONS, PairRelation, Switch, asked_for
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
        used = [switch for relation in self.relations for switch in (*relation.switches, *relation.but_not)]
        self.margins = switch_margins(settings)[: 1 + max(used, default=Switch.PAST_REAR)]
        self._settings = settings
        self._near = NearSet(enter_radius_m=settings.enter_radius_m)

    def look(self, serials: LongArray, table: FloatArray) -> NearPairs:
        """Find the pairs, as in `PairKind`."""
        found = pairs_within(table[X : Y + 1].T, table[HALF_LENGTH], self._settings.leave_radius_m)
        return self._near.update(serials, *found)

    def measure(self, table: FloatArray, pairs: NearPairs) -> FloatArray:
        """Measure the pairs, as in `PairKind`."""
        return switch_values(table, (pairs.first, pairs.second), self._settings, rows=len(self.margins))


class FacingCars:
    """Look at cars that drive in opposite directions on one road, from further away."""

    def __init__(self, settings: RelationSettings, names: Collection[str]) -> None:
        self.relations = asked_for(FACING_RELATIONS, names)
        self.margins = np.array([settings.oncoming_margin_s])
        self._settings = settings
        self._near = NearSet(enter_radius_m=settings.oncoming_enter_m)

    def look(self, serials: LongArray, table: FloatArray) -> NearPairs:
        """Find the pairs, as in `PairKind`."""
        return self._near.update(serials, *facing_pairs(table, self._settings))

    def measure(self, table: FloatArray, pairs: NearPairs) -> FloatArray:
        """Measure the pairs, as in `PairKind`."""
        return oncoming_values(table.take(pairs.first, axis=1), table.take(pairs.second, axis=1), self._settings)
