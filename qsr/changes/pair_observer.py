"""Which relations between two objects have changed since the last frame, and when exactly?

Of each pair (a, b), a is the elder object. Everything is measured once per pair; names and argument orders are
made only for the few values that change.
"""

from collections.abc import Sequence

import numpy as np

from qsr.changes.crossings import RelationChange, SwitchBank, rearranged
from qsr.measuring.footprints import BoolArray, FloatArray, LongArray
from qsr.measuring.pairs import NearPairs
from qsr.relations import PairRelation


class PairObserver:
    """Keep some relations of pairs.

    Parameters
    ----------
    relations : that are given out.
    margins : (switches,) as for `qsr.changes.crossings.SwitchBank`.
    backdate_us : a change is dated back at most this far.
    """

    __slots__ = (
        "_bank",
        "_changed_us",
        "_columns",
        "_conjunctions",
        "_holds",
        "_ids",
        "_names",
        "_relations",
    )

    def __init__(self, relations: Sequence[PairRelation], margins: FloatArray, *, backdate_us: int) -> None:
        self._relations = relations
        # Row, name, and which order of the arguments it is for.
        self._names = [
            (row, name, order)
            for row, relation in enumerate(relations)
            for order, name in enumerate((relation.of_ab, relation.of_ba))
            if name
        ]
        self._conjunctions = _Conjunctions(relations, len(margins))
        self._bank = SwitchBank(margins, backdate_us=backdate_us)
        self._ids: Sequence[str] = ()
        self._columns: LongArray = np.zeros((2, 0), dtype=np.int64)
        self._holds: BoolArray = np.zeros((len(relations), 0), dtype=np.bool_)
        self._changed_us: LongArray = np.zeros((len(relations), 0), dtype=np.int64)

    def update(
        self, t_us: int, *, ids: Sequence[str], pairs: NearPairs, values: FloatArray, observed: BoolArray | None
    ) -> list[RelationChange]:
        """Take one frame and return the changes, in no particular order.

        Parameters
        ----------
        t_us : later than the last frame.
        ids : n names, not to be changed afterwards.
        pairs : which pairs are looked at now.
        values : (switches, pairs) the quantity of every switch of every pair; kept.
        observed : (n,) which objects are seen, None if all are. A pair of which neither is seen counts as not measured:
            its relations stay as they are, whatever the two are predicted to do.
        """
        changes: list[RelationChange] = []
        for column in pairs.ended.tolist():
            changes += self._ended(column, t_us)
        fresh = self._rearrange(pairs, t_us)
        self._ids, self._columns = ids, pairs.columns
        unseen = None
        if observed is not None:
            is_seen = observed.take(pairs.columns)
            unseen = ~(is_seen[0] | is_seen[1])
        turned = self._bank.update(t_us, values, unseen)
        if len(fresh) or turned.any():
            changes += self._decide(t_us, fresh)
        return changes

    def _rearrange(self, pairs: NearPairs, t_us: int) -> LongArray:
        """Carry the state over to the pairs of this frame; return the columns of the new ones."""
        came_from = pairs.came_from
        if came_from is None:
            return np.zeros(0, dtype=np.int64)
        self._bank.keep(came_from)
        self._holds = rearranged(self._holds, came_from)
        self._changed_us = rearranged(self._changed_us, came_from, t_us)
        return np.flatnonzero(came_from < 0)

    def _decide(self, t_us: int, fresh: LongArray) -> list[RelationChange]:
        holds = self._conjunctions.of(self._bank.is_on)
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
        a, b = self._ids[self._columns[0, column]], self._ids[self._columns[1, column]]
        return (a, b), (b, a)


class _Conjunctions:
    """Work out all relations at once: a product with a matrix counts the switches that are as a relation wants them."""

    __slots__ = ("_signs", "_wanted")

    def __init__(self, relations: Sequence[PairRelation], switches: int) -> None:
        self._signs: FloatArray = np.zeros((len(relations), switches))
        for row, relation in enumerate(relations):
            self._signs[row, list(relation.switches)] = 1.0
            self._signs[row, list(relation.but_not)] = -1.0
        self._wanted: FloatArray = np.maximum(self._signs, 0.0).sum(axis=1, keepdims=True)

    def of(self, is_on: BoolArray) -> BoolArray:
        """Tell from the switches, (switches, pairs), which relations hold, (relations, pairs)."""
        return np.asarray(self._signs @ is_on == self._wanted, dtype=np.bool_)
