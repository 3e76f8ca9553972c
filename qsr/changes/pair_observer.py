"""Which relations between two objects have changed since the last frame, and when exactly?

Of each pair (a, b), a is the elder object. Everything is measured once per pair; names and argument orders are
made only for the few values that change.
"""

import math
from collections.abc import Callable, Mapping, Sequence

import numpy as np

from qsr.changes.crossings import RelationChange, SwitchBank, rearranged
from qsr.changes.looks import NEVER_US, Doubt, Gone, Look
from qsr.measuring.footprints import BoolArray, FloatArray, IntArray, LongArray
from qsr.measuring.pairs import NearPairs
from qsr.relations import PairRelation, switches_of


class PairObserver:
    """Keep some relations of pairs.

    Parameters
    ----------
    relations : that are given out.
    margins : (switches,) as for `qsr.changes.crossings.SwitchBank`.
    noise : gives the standard deviations of the quantities of a pair, (switches,), from these quantities and those of
        the two places, (2,).
    backdate_us : a change is dated back at most this far.
    """

    def __init__(
        self,
        relations: Sequence[PairRelation],
        margins: FloatArray,
        *,
        noise: Callable[[FloatArray, FloatArray], FloatArray],
        backdate_us: int,
    ) -> None:
        self._relations = relations
        self._noise = noise
        self._sigma_m: FloatArray = np.zeros(0)
        # Row, name, and which order of the arguments it is for.
        self._names = [
            (row, name, order)
            for row, relation in enumerate(relations)
            for order, name in enumerate((relation.of_ab, relation.of_ba))
            if name
        ]
        self._conjunctions = _Conjunctions(relations, len(margins))
        self._used = sorted(switches_of(relations))
        self._bank = SwitchBank(margins, backdate_us=backdate_us)
        self._ids: Sequence[str] = ()
        self._columns: LongArray = np.zeros((2, 0), dtype=np.int64)
        self._holds: BoolArray = np.zeros((len(relations), 0), dtype=np.bool_)
        self._changed_us: LongArray = np.zeros((len(relations), 0), dtype=np.int64)
        self._is_told: BoolArray = np.zeros(0, dtype=np.bool_)  # unknown, for the time being

    def sides(self, values: FloatArray) -> IntArray:
        """Say where the quantities of the switches that count are; see `SwitchBank.sides`."""
        return self._bank.sides(values)[self._used]

    def update(
        self, look: Look, pairs: NearPairs, columns: LongArray, *, values: FloatArray, held: BoolArray | None
    ) -> list[RelationChange]:
        """Take one frame, later than the last one, and return the changes, in no particular order.

        Parameters
        ----------
        look : at the frame.
        pairs : which pairs there are now.
        columns : (2, pairs) of their objects.
        values : (switches, pairs) the quantity of every switch of every pair; kept.
        held : (pairs,) True where nothing was measured, whatever the values: the relations stay as they are. None if
            all were measured.
        """
        t_us, changes = look.t_us, list[RelationChange]()
        for column in pairs.ended.tolist():
            changes += self._ended(column, t_us, look.gone)
        fresh = self._rearrange(pairs, t_us)
        self._ids, self._columns, self._sigma_m = look.ids, columns, look.sigma_m
        turned = self._bank.update(t_us, values, held)
        if len(fresh) or turned.any():
            changes += self._decide(t_us, fresh)
        return changes

    def doubt(self, t_us: int, doubt: Doubt) -> list[RelationChange]:
        """Tell once of every pair that nothing is known of it, since the first of the two is not seen.

        What is kept of the pair stays: if what happened is known later, its relations go on from what they were, as if
        this had not been told.
        """
        since_us = doubt.since_us.take(self._columns).min(axis=0)
        is_told = self._is_told & ~doubt.has_returned.take(self._columns).any(axis=0)
        self._is_told = since_us < NEVER_US
        changes = []
        for column in (self._is_told & ~is_told).nonzero()[0].tolist():
            absent = tuple(self._ids[k] for k in self._columns[:, column].tolist() if doubt.is_hidden[k])
            changes += self._unknown(column, int(since_us[column]), t_us, absent)
        return changes

    def _rearrange(self, pairs: NearPairs, t_us: int) -> LongArray:
        """Carry the state over to the pairs of this frame; return the columns of the new ones."""
        came_from = pairs.came_from
        if came_from is None:
            return np.zeros(0, dtype=np.int64)
        self._bank.keep(came_from)
        self._holds = rearranged(self._holds, came_from)
        self._is_told = rearranged(self._is_told, came_from)
        self._changed_us = rearranged(self._changed_us, came_from, t_us)
        return np.flatnonzero(came_from < 0)

    def _decide(self, t_us: int, fresh: LongArray) -> list[RelationChange]:
        holds = self._conjunctions.of(self._bank.is_on)
        changed = holds != self._holds
        changed[:, fresh] = False
        self._holds = holds
        changes = []
        knows_noise = bool((self._sigma_m > 0).any())
        for row, column in np.argwhere(changed).tolist():
            relation, new = self._relations[row], bool(holds[row, column])
            # Two values of one relation never share a moment, however far they are dated back.
            at_us = max(self._moment(relation, column, now_true=new), int(self._changed_us[row, column]) + 1)
            self._changed_us[row, column] = at_us
            confidence = self._confidence(relation, column, now_true=new) if knows_noise else 1.0
            pair, converse = self._arguments(column)
            if relation.of_ab:
                changes.append(RelationChange(relation.of_ab, pair, at_us, t_us, not new, new, (), confidence))
            if relation.of_ba:
                changes.append(RelationChange(relation.of_ba, converse, at_us, t_us, not new, new, (), confidence))
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

    def _confidence(self, relation: PairRelation, column: int, *, now_true: bool) -> float:
        """Say how probable it is that noise did not make a change: all switches are right, or one that is off is."""
        sigma_m = self._sigma_m[self._columns[:, column]]
        if not np.hypot(*sigma_m) > 0:  # not known, or exact
            return 1.0
        values, is_on = self._bank.values(column), self._bank.is_on[:, column]
        clear = values / np.maximum(self._noise(values, sigma_m), 1e-9)
        right = [clear[one] for one in relation.switches if is_on[one] == now_true]
        right += [-clear[one] for one in relation.but_not if is_on[one] != now_true]
        if not now_true:
            right = [-one for one in right]
        sigmas = float(min(right) if now_true else max(right))
        return 0.5 * math.erfc(-sigmas / math.sqrt(2.0))

    def _ended(self, column: int, t_us: int, gone: Mapping[str, Gone]) -> list[RelationChange]:
        """Tell unknown what concerns objects that are gone, or too far apart."""
        lost = {one: gone[one] for one in self._arguments(column)[0] if one in gone}
        if any(one.is_told for one in lost.values()):
            return []
        since_us = min((one.since_us for one in lost.values()), default=t_us)
        return self._unknown(column, since_us, t_us)

    def _unknown(self, column: int, since_us: int, t_us: int, absent: tuple[str, ...] = ()) -> list[RelationChange]:
        args, values = self._arguments(column), self._holds[:, column].tolist()
        return [
            RelationChange(name, args[order], since_us, t_us, values[row], None, absent)
            for row, name, order in self._names
        ]

    def _arguments(self, column: int) -> tuple[tuple[str, str], tuple[str, str]]:
        a, b = self._ids[self._columns[0, column]], self._ids[self._columns[1, column]]
        return (a, b), (b, a)


class _Conjunctions:
    """Work out all relations at once: a product with a matrix counts the switches that are as a relation wants them."""

    def __init__(self, relations: Sequence[PairRelation], switches: int) -> None:
        self._signs: FloatArray = np.zeros((len(relations), switches))
        for row, relation in enumerate(relations):
            self._signs[row, list(relation.switches)] = 1.0
            self._signs[row, list(relation.but_not)] = -1.0
        self._wanted: FloatArray = np.maximum(self._signs, 0.0).sum(axis=1, keepdims=True)

    def of(self, is_on: BoolArray) -> BoolArray:
        """Tell from the switches, (switches, pairs), which relations hold, (relations, pairs)."""
        return np.asarray(self._signs @ is_on == self._wanted, dtype=np.bool_)
