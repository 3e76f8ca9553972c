"""Which pairs are looked at, and what has changed between them?

Cars that are near each other, cars that are near in time (at their speed), and cars that drive towards each other. A
pair of which neither car is seen in a frame does not come in with that frame.
"""

from collections.abc import Collection, Sequence
from dataclasses import dataclass

import numpy as np

from qsr.changes.crossings import RelationChange
from qsr.changes.pair_observer import PairObserver
from qsr.measuring.conflicts import oncoming_values
from qsr.measuring.footprints import HALF_LENGTH, BoolArray, FloatArray, LongArray, X, Y
from qsr.measuring.pairs import NearPairs, NearSet, facing_pairs, near_in_time, pairs_within
from qsr.measuring.road_relations import switch_margins, switch_values
from qsr.measuring.routes import Routes
from qsr.relations import (
    FACING_RELATIONS,
    NEAR_IN_TIME_RELATIONS,
    NEAR_RELATIONS,
    PairRelation,
    Switch,
    asked_for,
)
from qsr.settings import RelationSettings


@dataclass(frozen=True, slots=True)
class ObjectsNow:
    """Hold the objects of one frame, in order of their first appearance.

    Attributes
    ----------
    t_us : time of the frame.
    ids : n names.
    serials : (n,) a number per object, rising, and never used for another object.
    table : (13, n) as made by `qsr.measuring.footprints.object_table`.
    observed : (n,) which objects are seen in this frame; None if all are.
    routes : the ways between them; None where the map says nothing of them.
    """

    t_us: int
    ids: Sequence[str]
    serials: LongArray
    table: FloatArray
    observed: BoolArray | None
    routes: Routes | None = None

    def may_enter(self, pairs: LongArray, is_near: BoolArray) -> BoolArray:
        """Tell which of the near pairs, (2, pairs), may come in with this frame.

        Examples
        --------
        >>> now = ObjectsNow(0, "abc", np.arange(3), np.zeros((13, 3)), np.array([True, False, False]))
        >>> now.may_enter(np.array([[0, 1], [1, 2]]), np.array([True, True])).tolist()
        [True, False]
        """
        return is_near if self.observed is None else is_near & self.observed.take(pairs).any(axis=0)


class NearCars:
    """Look at cars that are near each other in the plane, and at cars whose time gap or conflict may matter.

    The latter are looked at from further away the faster they are. Whoever is near in the plane counts as near in time
    as well, so those near in time are found and measured, by as many switches as the names ask for, and the others are
    picked out of them.
    """

    def __init__(self, settings: RelationSettings, names: Collection[str]) -> None:
        near, in_time = asked_for(NEAR_RELATIONS, names), asked_for(NEAR_IN_TIME_RELATIONS, names)
        self._settings = settings
        self._near_rows, self._rows = _rows_used(near), _rows_used((*near, *in_time))
        margins = switch_margins(settings)
        self._near = _Kept(near, margins[: self._near_rows], settings) if near else None
        self._in_time = _Kept(in_time, margins[: self._rows], settings) if in_time else None

    def update(self, now: ObjectsNow) -> list[RelationChange]:
        """Take one frame and return the changes, in no particular order."""
        if self._in_time is None:
            return [] if self._near is None else self._update_near(self._near, now)
        settings = self._settings
        pairs, distance_m, is_near = near_in_time(now.table, settings)
        in_time = self._in_time.find(now, pairs, is_near)
        values = switch_values(now.table, in_time.columns, settings, rows=self._rows, routes=now.routes)
        changes = self._in_time.update(now, in_time, values)
        if self._near is not None:
            rows = (distance_m <= settings.leave_radius_m).nonzero()[0]
            is_near = distance_m.take(rows) <= settings.enter_radius_m
            near = self._near.find(now, pairs.take(rows, axis=1), is_near)
            among = in_time.keys.searchsorted(near.keys)
            changes += self._near.update(now, near, values[: self._near_rows].take(among, axis=1))
        return changes

    def _update_near(self, kept: "_Kept", now: ObjectsNow) -> list[RelationChange]:
        settings, table = self._settings, now.table
        pairs, distance_m = pairs_within(table[X : Y + 1].T, table[HALF_LENGTH], settings.leave_radius_m)
        near = kept.find(now, pairs, distance_m <= settings.enter_radius_m)
        values = switch_values(table, near.columns, settings, rows=self._near_rows, routes=now.routes)
        return kept.update(now, near, values)


class FacingCars:
    """Look at cars that drive in opposite directions on one road, from further away."""

    def __init__(self, settings: RelationSettings, names: Collection[str]) -> None:
        relations = asked_for(FACING_RELATIONS, names)
        self._settings = settings
        self._kept = _Kept(relations, np.array([settings.oncoming_margin_s]), settings) if relations else None

    def update(self, now: ObjectsNow) -> list[RelationChange]:
        """Take one frame and return the changes, in no particular order."""
        if self._kept is None:
            return []
        pairs, distance_m = facing_pairs(now.table, self._settings)
        facing = self._kept.find(now, pairs, distance_m <= self._settings.oncoming_enter_m)
        return self._kept.update(now, facing, oncoming_values(now.table.take(facing.columns, axis=1), self._settings))


class _Kept:
    """Keep the pairs of one kind, and their relations."""

    __slots__ = ("_near", "_relations")

    def __init__(self, relations: Sequence[PairRelation], margins: FloatArray, settings: RelationSettings) -> None:
        self._near = NearSet()
        self._relations = PairObserver(relations, margins, backdate_us=settings.backdate_us)

    def find(self, now: ObjectsNow, pairs: LongArray, is_near: BoolArray) -> NearPairs:
        return self._near.update(now.serials, pairs, now.may_enter(pairs, is_near))

    def update(self, now: ObjectsNow, pairs: NearPairs, values: FloatArray) -> list[RelationChange]:
        return self._relations.update(now.t_us, ids=now.ids, pairs=pairs, values=values, observed=now.observed)


def _rows_used(relations: Sequence[PairRelation]) -> int:
    """Count the switches up to the last one that some relation needs."""
    used = [switch for relation in relations for switch in (*relation.switches, *relation.but_not)]
    return 1 + max(used, default=Switch.PAST_REAR)
