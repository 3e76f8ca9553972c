"""How many events that a `noevent` or an `occurs` counts lie in an interval?"""

from bisect import bisect_left
from operator import ne

from chronicles.compilation.plan import Count
from chronicles.compilation.times.network import UNBOUNDED_US
from chronicles.events import Event, by_time
from chronicles.execution.event_tests import EventMatcher, Values, event_matcher


class CountLog:
    """The events that one statement counts, by the values of its bound variables, in the order of time.

    Variables that are known only in the statement stand for any thing, except those that they must differ from; their
    values are kept with each event.

    Attributes
    ----------
    slots : the slots that the test compares with.
    """

    def __init__(self, count: Count) -> None:
        self.count = count
        self._bound_slots = tuple(slot for _, slot in count.test.variables)
        self._other_slots = tuple(slot for _, slot in count.different)
        self.slots = self._bound_slots + self._other_slots
        fields = [field for field, _ in (*count.test.variables, *count.different)]
        self._matcher: EventMatcher = event_matcher(count.test, fields)
        self._found: dict[Values, tuple[list[Event], list[Values]]] = {}
        self._own: set[Values] = set()  # the keys of those lists that no state shares

    def append(self, event: Event) -> None:
        """Keep an event if it is counted; events come in the order of time."""
        values = self._matcher(event)
        if values is None:
            return
        key, own = values[: len(self._bound_slots)], values[len(self._bound_slots) :]
        if key not in self._own:
            self._own.add(key)
            events, owns = self._found.get(key, ((), ()))
            self._found[key] = list(events), list(owns)
        events, owns = self._found[key]
        events.append(event)
        owns.append(own)

    def fitting(self, values: Values, start_us: int = -UNBOUNDED_US, end_us: int = UNBOUNDED_US) -> list[Event]:
        """Give the events in [start, end) that fit with these values of the slots, in the order of time."""
        events, owns = self._found.get(tuple([values[slot] for slot in self._bound_slots]), ([], []))
        part = slice(bisect_left(events, start_us, key=by_time), bisect_left(events, end_us, key=by_time))
        if not self._other_slots:
            return events[part]
        others = [values[slot] for slot in self._other_slots]
        return [event for event, own in zip(events[part], owns[part], strict=True) if all(map(ne, own, others))]

    def is_right(self, values: Values, start_us: int, end_us: int, *, is_over: bool = True) -> bool:
        """Say whether the number of events in [start, end) is allowed; while it is not over, more may come."""
        number = len(self.fitting(values, start_us, end_us))
        if self.count.most is not None and number > self.count.most:
            return False
        return number >= self.count.least or not is_over

    def forget_before(self, t_us: int) -> int:
        """Drop the events before a time; return how many are left."""
        kept: dict[Values, tuple[list[Event], list[Values]]] = {}
        for key, (events, owns) in self._found.items():
            start = bisect_left(events, t_us, key=by_time)
            if start < len(events):
                kept[key] = (events[start:], owns[start:])
        self._found, self._own = kept, set(kept)
        return sum(len(events) for events, _ in kept.values())

    def state(self) -> dict[Values, tuple[list[Event], list[Values]]]:
        """Give the events kept, as plain data and events."""
        self._own.clear()
        return dict(self._found)

    def restore(self, state: dict[Values, tuple[list[Event], list[Values]]]) -> None:
        """Take up where `state` was given."""
        self._own.clear()
        self._found = dict(state)
