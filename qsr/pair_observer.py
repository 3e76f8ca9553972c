"""Which relations between two objects have changed since the last frame, and when exactly?

Of each near pair (a, b), a is the elder object. Everything is measured once per pair; names and argument orders are
made only for the few values that change.
"""

from collections.abc import Collection, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from qsr.changes import RelationChange, SwitchBank
from qsr.pairs import NearPairs, NearSet
from qsr.relations import PAIR_RELATIONS, PairRelation
from qsr.road_relations import HALF_LENGTH, X, Y, switch_margins, switch_values
from qsr.settings import RelationSettings

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]
LongArray = NDArray[np.int64]


class PairObserver:
    """Keep the relations of all near pairs.

    Parameters
    ----------
    settings : thresholds.
    names : of the relations to give out; the others are kept, but nothing is said of them.
    """

    __slots__ = ("_bank", "_changed_us", "_first", "_holds", "_ids", "_near", "_relations", "_second", "_settings")

    def __init__(self, settings: RelationSettings, names: Collection[str]) -> None:
        self._settings = settings
        self._near = NearSet(enter_radius_m=settings.enter_radius_m, leave_radius_m=settings.leave_radius_m)
        self._bank = SwitchBank(switch_margins(settings), backdate_us=settings.backdate_us)
        self._relations = tuple(
            replace(
                relation,
                of_ab=relation.of_ab if relation.of_ab in names else "",
                of_ba=relation.of_ba if relation.of_ba in names else "",
            )
            for relation in PAIR_RELATIONS
        )
        self._ids: Sequence[str] = ()
        self._first: LongArray = np.zeros(0, dtype=np.int64)
        self._second: LongArray = self._first
        self._holds: BoolArray = np.zeros((len(PAIR_RELATIONS), 0), dtype=np.bool_)
        self._changed_us: LongArray = np.zeros((len(PAIR_RELATIONS), 0), dtype=np.int64)

    def update(self, t_us: int, *, serials: LongArray, ids: Sequence[str], table: FloatArray) -> list[RelationChange]:
        """Take one frame and return the changes, in no particular order.

        Parameters
        ----------
        t_us : later than the last frame.
        serials : (n,) a number per object, rising, and never used for another object.
        ids : n names, not to be changed afterwards.
        table : (10, n) as made by `qsr.road_relations.object_table`.
        """
        pairs = self._near.update(serials, table[X : Y + 1].T, table[HALF_LENGTH])
        changes: list[RelationChange] = []
        for column in pairs.ended.tolist():
            changes += self._ended(column, t_us)
        fresh = self._rearrange(pairs, t_us)
        self._ids, self._first, self._second = ids, pairs.first, pairs.second
        values = switch_values(table.take(pairs.first, axis=1), table.take(pairs.second, axis=1), self._settings)
        turned = self._bank.update(t_us, values)
        if len(fresh) or turned.any():
            changes += self._decide(t_us, fresh)
        return changes

    def _rearrange(self, pairs: NearPairs, t_us: int) -> LongArray:
        """Carry the state over to the pairs of this frame; return the columns of the new ones."""
        came_from = pairs.came_from
        if came_from is None:
            return np.zeros(0, dtype=np.int64)
        self._bank.keep(came_from)
        if self._holds.shape[1]:
            self._holds = self._holds.take(came_from, axis=1)
            self._changed_us = self._changed_us.take(came_from, axis=1)
        else:
            self._holds = np.zeros((len(PAIR_RELATIONS), len(came_from)), dtype=np.bool_)
            self._changed_us = np.zeros((len(PAIR_RELATIONS), len(came_from)), dtype=np.int64)
        fresh = np.flatnonzero(came_from < 0)
        self._changed_us[:, fresh] = t_us
        return fresh

    def _decide(self, t_us: int, fresh: LongArray) -> list[RelationChange]:
        holds = _conjunctions(self._bank.is_on)
        changed = holds != self._holds
        changed[:, fresh] = False
        self._holds = holds
        changes = []
        for row, column in np.argwhere(changed).tolist():
            relation, new = self._relations[row], bool(holds[row, column])
            # Two values of one relation never share a moment, however far they are dated back.
            at_us = max(self._moment(relation, column, now_true=new), int(self._changed_us[row, column]) + 1)
            self._changed_us[row, column] = at_us
            changes += self._named(relation, column, (at_us, t_us), (not new, new))
        for column in fresh.tolist():
            for relation, new in zip(self._relations, holds[:, column].tolist(), strict=True):
                changes += self._named(relation, column, (t_us, t_us), (None, new))
        return changes

    def _moment(self, relation: PairRelation, column: int, *, now_true: bool) -> int:
        """Find when a conjunction changed: true since its last switch came, false since its first one went."""
        is_on, since_us = self._bank.is_on[:, column], self._bank.since_us[:, column]
        if now_true:
            return int(since_us[[*relation.switches, *relation.but_not]].max())
        gone = [switch for switch in relation.switches if not is_on[switch]]
        gone += [switch for switch in relation.but_not if is_on[switch]]
        return int(since_us[gone].min())

    def _ended(self, column: int, t_us: int) -> list[RelationChange]:
        changes = []
        for relation, old in zip(self._relations, self._holds[:, column].tolist(), strict=True):
            changes += self._named(relation, column, (t_us, t_us), (old, None))
        return changes

    def _named(
        self, relation: PairRelation, column: int, times_us: tuple[int, int], values: tuple[bool | None, bool | None]
    ) -> list[RelationChange]:
        a, b = self._ids[self._first[column]], self._ids[self._second[column]]
        named = ((relation.of_ab, (a, b)), (relation.of_ba, (b, a)))
        return [RelationChange(name, args, *times_us, *values) for name, args in named if name]


def _conjunctions(is_on: BoolArray) -> BoolArray:
    holds = np.empty((len(PAIR_RELATIONS), is_on.shape[1]), dtype=np.bool_)
    for row, relation in enumerate(PAIR_RELATIONS):
        holds[row] = is_on[relation.switches[0]]
        for switch in relation.switches[1:]:
            holds[row] &= is_on[switch]
        for switch in relation.but_not:
            holds[row] &= ~is_on[switch]
    return holds
