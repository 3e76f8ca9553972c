"""How many events that a `noevent` or an `occurs` counts lie in an interval?"""

from __future__ import annotations

from bisect import bisect_left
from operator import ne
from typing import Any  # states are plain nested data

from chronicles.compilation.plan import Count
from chronicles.events import Event
from chronicles.execution.event_tests import EventMatcher, Values, event_matcher


class CountLog:
    """The events that one statement counts, by the values of its bound variables, in the order of time.

    Variables that are known only in the statement stand for any thing, except those that they must differ from; their
    values are kept with each event.
    """

    def __init__(self, count: Count) -> None:
        bound = count.test.variables
        self.count = count
        self._bound_slots = tuple(slot for _, slot in bound)
        self._other_slots = tuple(slot for _, slot in count.different)
        fields = [field for field, _ in bound] + [field for field, _ in count.different]
        self._matcher: EventMatcher = event_matcher(count.test, fields)
        self._found: dict[Values, tuple[list[int], list[Values]]] = {}

    def append(self, event: Event) -> None:
        """Keep an event if it is counted; events come in the order of time."""
        values = self._matcher(event)
        if values is None:
            return
        key, own = values[: len(self._bound_slots)], values[len(self._bound_slots) :]
        times, owns = self._found.setdefault(key, ([], []))
        times.append(event.t_us)
        owns.append(own)

    def is_right(self, values: Values, start_us: int, end_us: int, *, is_over: bool = True) -> bool:
        """Say whether the number of events in [start, end) is allowed; while it is not over, more may come."""
        number = self._number(values, start_us, end_us)
        if self.count.most is not None and number > self.count.most:
            return False
        return number >= self.count.least or not is_over

    def knows(self, known: frozenset[int]) -> bool:
        """Say whether the slots that the test compares with are among the known ones."""
        return known.issuperset(self._bound_slots) and known.issuperset(self._other_slots)

    def forget_before(self, t_us: int) -> int:
        """Drop the events before a time; return how many are left."""
        kept: dict[Values, tuple[list[int], list[Values]]] = {}
        for key, (times, owns) in self._found.items():
            start = bisect_left(times, t_us)
            if start < len(times):
                kept[key] = (times[start:], owns[start:])
        self._found = kept
        return sum(len(times) for times, _ in kept.values())

    def state(self) -> list[Any]:
        """Give the events kept, as plain data."""
        return [[list(key), list(times), list(owns)] for key, (times, owns) in self._found.items()]

    def restore(self, state: list[Any]) -> None:
        """Take up where `state` was given."""
        self._found = {tuple(key): (list(times), [tuple(own) for own in owns]) for key, times, owns in state}

    def _number(self, values: Values, start_us: int, end_us: int) -> int:
        times, owns = self._found.get(tuple([values[slot] for slot in self._bound_slots]), ((), ()))
        first, last = bisect_left(times, start_us), bisect_left(times, end_us)
        if not self._other_slots:
            return max(0, last - first)
        others = [values[slot] for slot in self._other_slots]
        return sum(all(map(ne, own, others)) for own in owns[first:last])
