"""Which instances of one chronicle are complete, found backwards from their last event?

The eager store (`instances.py`) extends partial instances with every event. Where frequent events come before a rare
one, nearly all of that work is wasted. The lazy store only keeps the fitting events in time-sorted buffers; when an
event comes that can be the last of an instance, it looks back for the others, beginning with the one that is rarest in
its window at that moment (Dousson and Le Maigat 2007, *Chronicle recognition improvement using temporal focusing and
hierarchization*). We depart from them in that no instance exists before it is complete: the buffers are the only state,
and partial instances are computed when somebody asks.
"""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import replace
from operator import itemgetter
from typing import Any

from chronicles.compilation.plan import EventTest, Plan
from chronicles.execution.backward_search import (
    Buffer,
    Instances,
    Row,
    Search,
    buffers_of,
    compiled,
    focus_source,
    last_positions,
    search_source,
)
from chronicles.execution.event_tests import Values, event_matcher
from chronicles.execution.instances import Instance, InstanceStore, Record


class LazyStore:
    """The events that instances of one chronicle may still need; same interface as `InstanceStore`."""

    def __init__(self, plan: Plan) -> None:
        self._plan = plan
        self._sources: dict[EventTest, _Source] = {}
        self._source_of = [self._source(index) for index in range(len(plan.positions))]
        self._sources_at: dict[str, list[_Source]] = {}
        for test, source in self._sources.items():
            self._sources_at.setdefault(test.name, []).append(source)
        last = last_positions(plan)
        for index, source in enumerate(self._source_of):
            if index in last:
                source.searches.append(self._focus(index))
            if last != (index,):
                source.keep_for(max(plan.distance_us[index]))

    @property
    def names(self) -> frozenset[str]:
        """Names of the events that instances expect."""
        return frozenset(self._sources_at)

    def feed(self, record: Record) -> tuple[Sequence[Instance], int]:
        """Keep an event, and find the instances that it completes; events come in the order of time.

        Returns
        -------
        Instances that now have all their events, and 0: nothing else is created.
        """
        event = record[2]
        fitting = []
        parts = []
        for source in self._sources_at[event.name]:
            values = source.matcher(event)
            if values is not None:
                fitting.append((source, values))
                for search in source.searches:
                    found = search(record, values)
                    if found:
                        parts.append(found)
        # Only now may the event be found: one event fills at most one position of an instance.
        for source, values in fitting:
            if source.is_kept:
                source.append(record, values)
        return Instances(parts) if parts else (), 0

    def sweep(self, now_us: int) -> int:
        """Drop the events that no instance can need any more; give the number left."""
        return sum(source.forget_before(now_us) for source in self._sources.values())

    def waiting(self, now_us: int) -> Iterator[tuple[int, Instance]]:
        """Give the instances that may still get all their events, with the set of positions they have matched."""
        return self.eager().waiting(now_us)

    def eager(self) -> InstanceStore:
        """Make an eager store that has seen the same events, to tell partial instances or to go on with."""
        store = InstanceStore(self._plan)
        for record in self.state():
            store.feed(record)
        return store

    def state(self) -> list[Record]:
        """Give the kept events in the order in which they were fed, for `restore`."""
        found = {row[0][1]: row[0] for source in self._sources.values() for row in source.rows}
        return sorted(found.values(), key=itemgetter(0, 1))

    def restore(self, state: Iterable[Record]) -> None:
        """Take over the events of another store for the same plan; this one is new."""
        for record in state:
            for source in self._sources_at[record[2].name]:
                values = source.matcher(record[2])
                if values is not None and source.is_kept:
                    source.append(record, values)

    def _source(self, index: int) -> _Source:
        """Give the events of a position; positions whose tests differ only in the names of variables share them."""
        test = self._plan.positions[index].test
        fields = tuple((field, place) for place, (field, _) in enumerate(test.variables))
        return self._sources.setdefault(replace(test, variables=fields), _Source(test))

    def _focus(self, last: int) -> Search:
        plan = self._plan
        others = [one for one in range(len(plan.positions)) if one != last]
        if not others:
            alone: Search = compiled(search_source(plan, last, ()), "search", {})
            return alone
        names: dict[str, Any] = {}  # Any: buffers, see `backward_search.Lookup`
        for one in others:
            names |= buffers_of(plan, last, [one], self._buffers)
        names |= {"bisect_left": bisect_left, "bisect_right": bisect_right, "choose": self._chooser(last, others)}
        focus: Search = compiled(focus_source(plan, last), "focus", names)
        return focus

    def _chooser(self, last: int, others: list[int]) -> Callable[[tuple[int, ...]], Search]:
        """Make the function that picks a search by the numbers of events in the windows of the other positions."""
        made: dict[tuple[int, ...], Search] = {}

        def choose(counts: tuple[int, ...]) -> Search:
            """Give the search that begins where the fewest events are."""
            # Powers of two are near enough, and keep the number of different orders small.
            sizes = zip(map(int.bit_length, counts), others, strict=True)
            order = tuple([one for _, one in sorted(sizes)])
            search = made.get(order)
            if search is None:
                names = buffers_of(self._plan, last, order, self._buffers)
                names |= {"bisect_left": bisect_left, "bisect_right": bisect_right}
                search = made[order] = compiled(search_source(self._plan, last, order), "search", names)
            return search

        return choose

    def _buffers(self, position: int, places: tuple[int, ...]) -> Any:  # Any: see `backward_search.Lookup`
        source = self._source_of[position]
        return source.index_by(places) if places else (source.times, source.rows)


class _Source:
    """The kept events that pass one test, in the order of time, and again by the values of some variables.

    The lists are changed in place only: compiled searches hold on to them.
    """

    __slots__ = ("_horizon_us", "_indexes", "is_kept", "matcher", "rows", "searches", "times")

    def __init__(self, test: EventTest) -> None:
        self.matcher = event_matcher(test, [field for field, _ in test.variables])
        self.times: list[int] = []
        self.rows: list[Row] = []
        self.searches: list[Search] = []
        self.is_kept = False  # set where a search can need the events
        self._horizon_us = 0
        self._indexes: dict[tuple[int, ...], _Index] = {}

    def keep_for(self, horizon_us: int) -> None:
        """Keep events at least as long as this."""
        self.is_kept = True
        self._horizon_us = max(self._horizon_us, horizon_us)

    def append(self, record: Record, values: Values) -> None:
        """Keep an event that passed the test."""
        t_us, row = record[0], (record, values)
        self.times.append(t_us)
        self.rows.append(row)
        for index in self._indexes.values():
            index.append(t_us, row)

    def index_by(self, places: tuple[int, ...]) -> dict[Any, Buffer]:  # Any: one value, or a tuple of values
        """Give the events by the values at some places; from now on they are kept up."""
        index = self._indexes.get(places)
        if index is None:
            index = self._indexes[places] = _Index(places)
            for row in self.rows:
                index.append(row[0][0], row)
        return index.buffers

    def forget_before(self, now_us: int) -> int:
        """Drop events older than the horizon; give the number left."""
        oldest_us = now_us - self._horizon_us
        _trim((self.times, self.rows), oldest_us)
        for index in self._indexes.values():
            index.forget_before(oldest_us)
        return len(self.rows)


class _Index:
    """Events by the values at some places."""

    __slots__ = ("_key", "buffers")

    def __init__(self, places: tuple[int, ...]) -> None:
        self._key: Callable[[Values], Any] = itemgetter(*places)  # Any: one value, or a tuple of values
        self.buffers: dict[Any, Buffer] = {}

    def append(self, t_us: int, row: Row) -> None:
        """Add an event at or after the latest one."""
        key = self._key(row[1])
        buffer = self.buffers.get(key)
        if buffer is None:
            buffer = self.buffers[key] = ([], [])
        buffer[0].append(t_us)
        buffer[1].append(row)

    def forget_before(self, oldest_us: int) -> None:
        """Drop the events before a time."""
        gone = [key for key, buffer in self.buffers.items() if not _trim(buffer, oldest_us)]
        for key in gone:
            del self.buffers[key]


def _trim(buffer: Buffer, oldest_us: int) -> int:
    """Drop the rows before a time; give the number left."""
    times, rows = buffer
    start = bisect_left(times, oldest_us)
    if start:
        del times[:start]
        del rows[:start]
    return len(times)
