"""Which instances of a chronicle lie in stored columns, as rows?

Here are all events of the instances matched, and the obligations tested that can be tested for many instances at a
time: most of `noevent`, `occurs` and `hold`. The others, selections and everything that depends on what came before
are left to `ordered_conclusions.py`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import reduce

import numpy as np

from chronicles.compilation.plan import Anchor, Count, Persistence, Plan
from chronicles.compilation.symbols import UNKNOWN
from chronicles.execution.columns import Codes, EventColumns, Kind, Times
from chronicles.execution.count_columns import CountColumns, is_about_events
from chronicles.execution.hold_columns import HoldColumns, is_about_changes
from chronicles.execution.instances import Instance
from chronicles.execution.joins import complete_rows
from chronicles.execution.row_tests import Mask, Rows, fitting, known_texts, values_at


@dataclass(frozen=True, eq=False, slots=True)
class Matches:
    """Instances of one plan: `rows` (positions, matches) are rows of the tables of `columns`."""

    plan: Plan
    columns: EventColumns
    rows: Rows

    def __len__(self) -> int:
        return len(self.rows[0])

    def picked(self, which: Mask | Rows) -> Matches:
        """Give some of them."""
        return replace(self, rows=self.rows[:, which])

    def times_us(self, anchor: Anchor) -> Times:
        """Give a time of each."""
        table = self.columns.table(self._kind(anchor.position))
        times_us: Times = table.t_us[self.rows[anchor.position]] + anchor.offset_us
        return times_us

    def event_times_us(self) -> Times:
        """Give the times of all events, (positions, matches)."""
        return np.stack([self.times_us(Anchor(index, 0)) for index in range(len(self.plan.positions))])

    def sequence(self) -> Times:
        """Give the places of all events among the stored ones, (positions, matches)."""
        return np.stack([self.columns.table(self._kind(index)).sequence[rows] for index, rows in enumerate(self.rows)])

    def values(self, slot: int) -> Codes:
        """Give the values of a variable, as codes of `known_texts`."""
        for index, position in enumerate(self.plan.positions):
            for field, found in position.test.variables:
                if found == slot:
                    return values_at(self.columns, self._kind(index), field, self.rows[index])
        raise AssertionError(slot)

    def closes_us(self) -> Times:
        """Give the time from which everything about each is known."""
        times = [self.times_us(end) for end in self._ends()]
        closes_us: Times = reduce(np.maximum, times) + self.plan.settling_us
        return closes_us

    @property
    def closes_with_event(self) -> bool:
        """Whether each closes with its last event."""
        return self.plan.settling_us == 0 and all(end.offset_us == 0 for end in self._ends())

    def instances(self) -> list[Instance]:
        """Make instances of them, in the layout of `instances.py`."""
        texts = known_texts(self.columns)
        slots = [self.values(slot).tolist() for slot in range(self.plan.event_slot_count)]
        values = [[texts[code] for code in codes] for codes in slots]
        times = self.event_times_us().tolist()
        events = [self.columns.events_at(self._kind(index), rows) for index, rows in enumerate(self.rows)]
        records = [
            list(zip(*columns, strict=True)) for columns in zip(times, self.sequence().tolist(), events, strict=True)
        ]
        return [[None, *parts] for parts in zip(*times, *values, *records, strict=True)]

    def _ends(self) -> list[Anchor]:
        """List what an instance waits for: its events, and the ends of windows behind them."""
        ends = dict.fromkeys(range(len(self.plan.positions)), 0)
        obligations: list[Count | Persistence] = [*self.plan.counts, *self.plan.persistences]
        for one in obligations:
            ends[one.end.position] = max(ends[one.end.position], one.end.offset_us)
        return [Anchor(position, offset_us) for position, offset_us in ends.items()]

    def _kind(self, position: int) -> Kind:
        test = self.plan.positions[position].test
        return test.name, test.arity, test.is_change


def find_matches(plan: Plan, columns: EventColumns, defaults: Mapping[str, str], *, most_rows: int) -> Matches:
    """Find the instances whose events are all there and that fulfil what can be tested in columns.

    Parameters
    ----------
    plan : of the chronicle.
    columns : all events it looks at.
    defaults : the values of attributes before their first change, where that is not "unknown".
    most_rows : bounds the memory used on the way, see `joins.py`.
    """
    found = [fitting(columns, position.test) for position in plan.positions]
    tests: list[tuple[Count | Persistence, CountColumns | HoldColumns]] = []
    tests += [(one, CountColumns(columns, one)) for one in plan.counts if is_about_events(one, plan.event_slot_count)]
    for hold in plan.persistences:
        if is_about_changes(hold, columns, plan.event_slot_count):
            tests.append((hold, HoldColumns(columns, hold, defaults.get(hold.attribute, UNKNOWN))))
    parts: list[Rows] = []
    for places in complete_rows(plan, found, most_rows=most_rows):
        rows = np.stack([one.rows[place] for one, place in zip(found, places, strict=True)])
        part = Matches(plan, columns, rows)
        values = {slot: part.values(slot) for slot in range(plan.event_slot_count)} if tests else {}
        right: Mask = np.ones(len(part), bool)
        for one, test in tests:
            right &= test.right(values, part.times_us(one.start), part.times_us(one.end))
        parts.append(part.picked(right).rows if tests else rows)
    if len(parts) == 1:
        return Matches(plan, columns, parts[0])
    empty = np.empty((len(plan.positions), 0), np.int64)
    return Matches(plan, columns, np.concatenate([empty, *parts], axis=1))


def left_open(plan: Plan, columns: EventColumns) -> Plan:
    """Give a plan with only those obligations that `find_matches` leaves open."""
    slots = plan.event_slot_count
    counts = tuple([one for one in plan.counts if not is_about_events(one, slots)])
    persistences = tuple([one for one in plan.persistences if not is_about_changes(one, columns, slots)])
    return replace(plan, counts=counts, persistences=persistences)
