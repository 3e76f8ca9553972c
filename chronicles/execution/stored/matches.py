"""Which instances of a chronicle lie in stored columns, as rows?"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from chronicles.compilation.plan import Plan
from chronicles.execution.instances import Instance
from chronicles.execution.stored.columns import Codes, EventColumns, EventTable, Rows, Times, fitting, kind_of
from chronicles.execution.stored.joins import complete_rows


@dataclass(frozen=True, eq=False, slots=True)
class Matches:
    """Instances of one plan: `rows` (positions, matches) are rows of the tables of `columns`."""

    plan: Plan
    columns: EventColumns
    rows: Rows

    def __len__(self) -> int:
        return len(self.rows[0])

    def picked(self, which: Rows | slice) -> Matches:
        """Give some of them."""
        return replace(self, rows=self.rows[:, which])

    def steps(self) -> Times:
        """Give the places of their last events among all events."""
        steps: Times = self._sequence().max(axis=0)
        return steps

    def instances(self) -> list[Instance]:
        """Make instances of them, in the layout of `instances.py`."""
        texts = self.columns.texts
        slots = [self._values(slot).tolist() for slot in range(self.plan.event_slot_count)]
        values = [[texts[code] for code in codes] for codes in slots]
        events = self.columns.events
        places = self._sequence().tolist()
        records = [[(events[place].t_us, place, events[place]) for place in column] for column in places]
        times = [[record[0] for record in column] for column in records]
        return [[None, *parts] for parts in zip(*times, *values, *records, strict=True)]

    def _sequence(self) -> Times:
        """Give the places of all events, (positions, matches)."""
        return np.stack([self._table(index).sequence[rows] for index, rows in enumerate(self.rows)])

    def _values(self, slot: int) -> Codes:
        """Give the values of a variable, as codes."""
        for index, position in enumerate(self.plan.positions):
            for field, found in position.test.variables:
                if found == slot:
                    codes: Codes = self._table(index).codes[self.rows[index], field]
                    return codes
        raise AssertionError(slot)

    def _table(self, position: int) -> EventTable:
        return self.columns.table(kind_of(self.plan.positions[position].test))


class TooManyMatches(Exception):  # noqa: N818 - no error: the recogniser knows what to leave out
    """One event completes more instances than the limits allow."""


def find_matches(plan: Plan, columns: EventColumns, *, most_rows: int, most_matches: int) -> Matches:
    """Find the instances whose events are all there.

    Parameters
    ----------
    plan : of the chronicle.
    columns : all events it looks at.
    most_rows : bounds the memory used on the way, see `joins.py`.
    most_matches : how many of them one event may complete.

    Raises
    ------
    TooManyMatches
        If one event completes more.
    """
    found = [fitting(columns, position.test) for position in plan.positions]
    parts: list[Rows] = []
    completed = np.zeros(len(columns), np.int64)
    for places in complete_rows(plan, found, most_rows=most_rows):
        parts.append(np.stack([one.rows[place] for one, place in zip(found, places, strict=True)]))
        steps = Matches(plan, columns, parts[-1]).steps()
        np.add.at(completed, steps, 1)
        if completed[steps].max(initial=0) > most_matches:
            raise TooManyMatches
    if len(parts) == 1:
        return Matches(plan, columns, parts[0])
    empty = np.empty((len(plan.positions), 0), np.int64)
    return Matches(plan, columns, np.concatenate([empty, *parts], axis=1))
