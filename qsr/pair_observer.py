"""Which relations between two objects have changed since the last frame, and when exactly?

Of each pair (a, b), a is the elder object. Everything is measured once per pair; names and argument orders are
made only for the few values that change.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from qsr.changes import RelationChange, SwitchBank
from qsr.object_table import OBSERVED
from qsr.pair_kinds import PairKind
from qsr.pairs import NearPairs
from qsr.relations import PairRelation

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]
LongArray = NDArray[np.int64]


class PairObserver:
    """Keep the relations of all pairs of one kind.

    Parameters
    ----------
    kind : which pairs, what is measured of them, and which relations are given out.
    backdate_us : a change is dated back at most this far.
    """

    __slots__ = ("_bank", "_changed_us", "_first", "_holds", "_ids", "_kind", "_names", "_relations", "_second")

    def __init__(self, kind: PairKind, *, backdate_us: int) -> None:
        self._kind = kind
        self._relations = kind.relations
        # Row, name, and which order of the arguments it is for.
        self._names = [
            (row, name, order)
            for row, relation in enumerate(kind.relations)
            for order, name in enumerate((relation.of_ab, relation.of_ba))
            if name
        ]
        self._bank = SwitchBank(kind.margins, backdate_us=backdate_us)
        self._ids: Sequence[str] = ()
        self._first: LongArray = np.zeros(0, dtype=np.int64)
        self._second: LongArray = self._first
        self._holds: BoolArray = np.zeros((len(self._relations), 0), dtype=np.bool_)
        self._changed_us: LongArray = np.zeros((len(self._relations), 0), dtype=np.int64)

    def update(self, t_us: int, *, serials: LongArray, ids: Sequence[str], table: FloatArray) -> list[RelationChange]:
        """Take one frame and return the changes, in no particular order.

        Parameters
        ----------
        t_us : later than the last frame.
        serials : (n,) a number per object, rising, and never used for another object.
        ids : n names, not to be changed afterwards.
        table : (13, n) as made by `qsr.object_table.object_table`. A pair of which neither object is seen is not
            measured: its relations stay as they are, whatever the two are predicted to do.
        """
        pairs = self._kind.look(serials, table)
        changes: list[RelationChange] = []
        for column in pairs.ended.tolist():
            changes += self._ended(column, t_us)
        fresh = self._rearrange(pairs, t_us)
        self._ids, self._first, self._second = ids, pairs.first, pairs.second
        observed = table[OBSERVED] > 0
        unseen = None if observed.all() else ~(observed[pairs.first] | observed[pairs.second])
        turned = self._bank.update(t_us, self._kind.measure(table, pairs), unseen)
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
            self._holds = np.zeros((len(self._relations), len(came_from)), dtype=np.bool_)
            self._changed_us = np.zeros((len(self._relations), len(came_from)), dtype=np.int64)
        fresh = np.flatnonzero(came_from < 0)
        self._changed_us[:, fresh] = t_us
        return fresh

    def _decide(self, t_us: int, fresh: LongArray) -> list[RelationChange]:
        holds = _conjunctions(self._relations, self._bank.is_on)
        changed = holds != self._holds
        changed[:, fresh] = False
        self._holds = holds
        changes = []
        for row, column in np.argwhere(changed).tolist():
            relation, new = self._relations[row], bool(holds[row, column])
            # Two values of one relation never share a moment, however far they are dated back.
            at_us = max(self._moment(relation, column, now_true=new), int(self._changed_us[row, column]) + 1)
            self._changed_us[row, column] = at_us
            pair, converse = self._arguments(column)
            if relation.of_ab:
                changes.append(RelationChange(relation.of_ab, pair, at_us, t_us, not new, new))
            if relation.of_ba:
                changes.append(RelationChange(relation.of_ba, converse, at_us, t_us, not new, new))
        for column in fresh.tolist():
            args, values = self._arguments(column), holds[:, column].tolist()
            changes += [
                RelationChange(name, args[order], t_us, t_us, None, values[row]) for row, name, order in self._names
            ]
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
        args, values = self._arguments(column), self._holds[:, column].tolist()
        return [RelationChange(name, args[order], t_us, t_us, values[row], None) for row, name, order in self._names]

    def _arguments(self, column: int) -> tuple[tuple[str, str], tuple[str, str]]:
        a, b = self._ids[self._first[column]], self._ids[self._second[column]]
        return (a, b), (b, a)


def _conjunctions(relations: Sequence[PairRelation], is_on: BoolArray) -> BoolArray:
    holds = np.empty((len(relations), is_on.shape[1]), dtype=np.bool_)
    for row, relation in enumerate(relations):
        holds[row] = is_on[relation.switches[0]]
        for switch in relation.switches[1:]:
            holds[row] &= is_on[switch]
        for switch in relation.but_not:
            holds[row] &= ~is_on[switch]
    return holds
