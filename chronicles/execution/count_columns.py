"""How many events that a `noevent` or an `occurs` counts lie in each of many intervals, in stored columns?"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import combinations

import numpy as np

from chronicles.compilation.plan import Count
from chronicles.execution.columns import Codes, EventColumns, Times
from chronicles.execution.row_index import RowIndex, is_too_long
from chronicles.execution.row_tests import Fitting, Mask, Rows, fitting


def is_about_events(count: Count, event_slots: int) -> bool:
    """Say whether the events to count depend on no variable that only a `hold` gives a value."""
    slots = [slot for _, slot in (*count.test.variables, *count.different)]
    return all(slot < event_slots for slot in slots)


class CountColumns:
    """The events that one statement counts."""

    def __init__(self, columns: EventColumns, count: Count) -> None:
        self._count = count
        self._bound = count.test.variables
        fields = [field for field, _ in (*self._bound, *count.different)]
        test = replace(count.test, variables=tuple((field, place) for place, field in enumerate(fields)))
        self._found = fitting(columns, test)

    def right(self, values: Mapping[int, Codes], start_us: Times, end_us: Times) -> Mask:
        """Say for each interval [start, end) whether the number of events in it is allowed.

        Parameters
        ----------
        values : by slot the values of variables, one for each interval.
        start_us, end_us : the intervals; an empty one has no events.
        """
        slots = [slot for _, slot in (*self._bound, *self._count.different)]
        numbers = self._numbers([values[slot] for slot in slots], start_us, end_us)
        right = numbers >= self._count.least
        return right if self._count.most is None else right & (numbers <= self._count.most)

    def _numbers(self, values: Sequence[Codes], start_us: Times, end_us: Times) -> Rows:
        if not len(start_us):
            return np.zeros(0, np.int64)
        span_us = int(end_us.max() - start_us.min())
        part = slice(*np.searchsorted(self._found.times_us, (start_us.min(), end_us.max())).tolist())
        found = self._found.cut(part)
        if part.start >= part.stop:
            return np.zeros(len(start_us), np.int64)
        if is_too_long(len(found.rows), span_us) and len(start_us) > 1:
            numbers = np.empty(len(start_us), np.int64)
            for half in np.array_split(np.argsort(start_us, kind="stable"), 2):
                numbers[half] = self._numbers([one[half] for one in values], start_us[half], end_us[half])
            return numbers
        return self._numbers_in(found, values, start_us, end_us)

    def _numbers_in(self, found: Fitting, values: Sequence[Codes], start_us: Times, end_us: Times) -> Rows:
        """Count by inclusion and exclusion: all, without those equal in one thing, but again those equal in two."""
        bound = range(len(self._bound))
        numbers = np.zeros(len(start_us), np.int64)
        different = range(len(bound), len(values))
        for size in range(len(different) + 1):
            for equal in combinations(different, size):
                index = RowIndex(found.times_us, [found.slots[place] for place in (*bound, *equal)])
                partners = index.partners([values[place] for place in (*bound, *equal)], start_us, end_us - 1)
                numbers += partners.counts if size % 2 == 0 else -partners.counts
        return numbers
