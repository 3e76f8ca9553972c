"""Which events of a stored list are there, by name and by value, and which values did fluents have when?

`EventLog` orders the events once; indexes are made when first asked for.
"""

from bisect import bisect_left, bisect_right
from collections.abc import Iterable
from itertools import groupby

from chronicles.compilation.names.symbols import UNKNOWN
from chronicles.compilation.plan import Count, EventTest
from chronicles.events import Event, by_time
from chronicles.execution.obligations.count_log import CountLog
from chronicles.execution.obligations.history import value_after
from chronicles.explanation.explanations import ValueSpan

Args = tuple[str, ...]
Texts = tuple[str, ...]


class Timeline:
    """The values of one fluent; `reported_us` is the time of its first change, None if it never was reported."""

    def __init__(self, changes: Iterable[Event], initial: str) -> None:
        self.reported_us: int | None = None
        self._starts: list[int] = []
        self._spans: list[ValueSpan] = [ValueSpan(initial, None, None, None)]
        for t_us, group in groupby(changes, key=by_time):
            self._add(t_us, list(group))

    def _add(self, t_us: int, changes: list[Event]) -> None:
        if self.reported_us is None:
            self.reported_us = t_us
        last = self._spans[-1]
        value = value_after(last.value, [(one.old or UNKNOWN, one.new or UNKNOWN) for one in changes])
        if value == last.value:
            return
        setter = next((one for one in changes if one.new == value), changes[-1])
        self._spans[-1] = ValueSpan(last.value, last.start_us, t_us, last.change)
        self._spans.append(ValueSpan(value, t_us, None, setter))
        self._starts.append(t_us)

    def spans(self, start_us: int, end_us: int) -> tuple[ValueSpan, ...]:
        """Give the values in [start, end) in the order of time, each as long as it lasted."""
        first = bisect_right(self._starts, start_us)
        last = bisect_left(self._starts, end_us)
        return tuple(self._spans[first : max(first, last) + 1])


class EventLog:
    """Events in the order of time.

    Attributes
    ----------
    events : all of them; the number of an event is its place here.
    until_us : the time up to which they are complete.
    """

    def __init__(self, events: Iterable[Event], defaults: Iterable[tuple[str, str]], until_us: int) -> None:
        self.events = sorted(events, key=by_time)
        self.until_us = until_us
        self._initial = dict(defaults)
        self._numbered: dict[str, list[tuple[int, Event]]] = {}
        for number, event in enumerate(self.events):
            self._numbered.setdefault(event.name, []).append((number, event))
        self._counted: dict[tuple[EventTest, tuple[tuple[int, int], ...]], CountLog] = {}
        self._changes: dict[str, dict[Args, list[Event]]] = {}
        self._timelines: dict[tuple[str, Args], Timeline] = {}
        self._fluents: dict[tuple[str, tuple[int, ...]], dict[Texts, list[Args]]] = {}

    def named(self, name: str) -> list[Event]:
        """Give all events of a name."""
        return [event for _, event in self._numbered.get(name, [])]

    def within(self, name: str, start_us: int, end_us: int) -> list[tuple[int, Event]]:
        """Give the events of a name with a time in [start, end), each with its number."""
        found = self._numbered.get(name, [])
        return found[bisect_left(found, start_us, key=_time_us) : bisect_left(found, end_us, key=_time_us)]

    def counted(self, count: Count) -> CountLog:
        """Give the events that a `noevent` or `occurs` counts."""
        key = count.test, count.different
        if key not in self._counted:
            self._counted[key] = CountLog(count)
            for event in self.named(count.test.name):
                self._counted[key].append(event)
        return self._counted[key]

    def changes(self, name: str, args: Args) -> list[Event]:
        """Give all changes of one fluent."""
        return self._changes_of(name).get(args, [])

    def timeline(self, name: str, args: Args) -> Timeline:
        """Give the values of one fluent."""
        if (name, args) not in self._timelines:
            self._timelines[name, args] = Timeline(self.changes(name, args), self._initial.get(name, UNKNOWN))
        return self._timelines[name, args]

    def fluents(self, name: str, known: dict[int, str], arity: int) -> list[Args]:
        """List the arguments of all reported fluents that have the known values at their places."""
        places = tuple(sorted(known))
        index = self._fluents.get((name, places))
        if index is None:
            index = self._fluents[name, places] = {}
            for args in self._changes_of(name):
                if len(args) == arity:
                    index.setdefault(tuple(args[place] for place in places), []).append(args)
        return index.get(tuple(known[place] for place in places), [])

    def _changes_of(self, name: str) -> dict[Args, list[Event]]:
        if name not in self._changes:
            found = self._changes[name] = {}
            for event in self.named(name):
                if event.new is not None:
                    found.setdefault(event.args, []).append(event)
        return self._changes[name]


def _time_us(numbered: tuple[int, Event]) -> int:
    return numbered[1].t_us


def fields_of(event: Event, test: EventTest) -> Texts | None:
    """Give the fields of an event of the right name and shape: arguments, then old and new value; None for others."""
    if len(event.args) != test.arity or (event.new is not None) != test.is_change:
        return None
    return (*event.args, event.old or UNKNOWN, event.new or UNKNOWN) if test.is_change else event.args
