"""Which chronicles occur in stored columns of events?

The instances of a chronicle are found by joins of whole columns (`joins.py`). Where that is all there is to a set of
chronicles, its occurrences stay columns until somebody looks at them. Otherwise the engine of the recogniser takes the
events one by one, and the joined instances stand in for those that it would have found: what concludes, selects, emits
and orders is the same code.
"""

from bisect import bisect_left
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from functools import cached_property, partial
from heapq import merge
from itertools import groupby
from operator import itemgetter

import numpy as np

from chronicles.chronicle_set import ChronicleSet
from chronicles.compilation.hierarchy import levels
from chronicles.compilation.plan import Plan
from chronicles.events import Event, Occurrence, by_time
from chronicles.execution.engine import Engine
from chronicles.execution.instances import Instance
from chronicles.execution.limits import USUAL, Limits
from chronicles.execution.live.eager import Completed
from chronicles.execution.obligations.history import AttributeHistory
from chronicles.execution.stored.columns import EventColumns, Rows, Times
from chronicles.execution.stored.joins import MOST_ROWS
from chronicles.execution.stored.matches import Matches, find_matches
from chronicles.execution.told.occurrences import Finding, OccurrenceBuilder
from chronicles.execution.told.results import Told, is_told_at_once

_MATCHES_AT_A_TIME = 1 << 12


def recognise_columns(
    chronicles: ChronicleSet,
    columns: EventColumns,
    *,
    until_us: int | None = None,
    most_rows: int = MOST_ROWS,
    limits: Limits = USUAL,
) -> Sequence[Occurrence]:
    """Recognise chronicles in stored columns; the results are those of a recogniser fed event by event.

    Parameters
    ----------
    chronicles : as given by `chronicles.load`.
    columns : the events.
    until_us : the time up to which the events are complete; the latest event's time if not given.
    most_rows : how many rows a block of time or a table in between may have; bounds the memory used on the way.
    limits : what each chronicle may cost.

    Raises
    ------
    TooManyMatches
        If one event completes more than the limits allow: what is left out then is known only event by event.
    """
    find = partial(find_matches, columns=columns, most_rows=most_rows, most_matches=limits.most_matches)
    if all(is_told_at_once(plan) for plan in chronicles.plans):
        return FoundOccurrences([find(plan) for plan in chronicles.plans])

    engine = Engine(chronicles, 0, columns.events, limits=limits)
    found: list[Occurrence] = []
    for step, complete in _completed(chronicles, columns, find, engine.names):
        found += _let_pass(engine, columns.events, step)
        found += engine.conclude(columns.events[step], complete)
    found += _let_pass(engine, columns.events, len(columns))
    if until_us is not None:
        found += engine.advance(until_us)
    return [_as_stored(one) for one in found]


def _completed(
    chronicles: ChronicleSet, columns: EventColumns, find: Callable[[Plan], Matches], names: frozenset[str]
) -> Iterator[tuple[int, Completed]]:
    """Give the places of events that complete joined instances, each with those, and of events with these names."""
    placed = levels(chronicles.plans)
    plans = [(number, plan) for number, plan in enumerate(chronicles.plans) if placed[plan.name][0] == 0]
    joined = [_joined(number, find(plan)) for number, plan in plans]
    named = [(step, -1, None) for step, event in enumerate(columns.events) if event.name in names] if names else []
    for step, parts in groupby(merge(named, *joined, key=itemgetter(0, 1)), key=itemgetter(0)):
        yield step, [(number, [instance]) for _, number, instance in parts if instance is not None]


def _let_pass(engine: Engine, events: Sequence[Event], stop: int) -> list[Occurrence]:
    """Let the times of the events before place `stop` pass; only those matter by which something is due."""
    found: list[Occurrence] = []
    while stop and engine.due_us <= events[stop - 1].t_us:
        step = bisect_left(events, engine.due_us, hi=stop, key=by_time)
        found += engine.advance(events[step].t_us)
    return found


def _joined(number: int, matches: Matches) -> Iterator[tuple[int, int, Instance]]:
    """Give instances in the order of their last events, each with its place and the number of its chronicle."""
    steps = matches.steps()
    order = np.argsort(steps, kind="stable")
    for start in range(0, len(order), _MATCHES_AT_A_TIME):
        part = order[start : start + _MATCHES_AT_A_TIME]
        for step, instance in zip(steps[part].tolist(), matches.picked(part).instances(), strict=True):
            yield step, number, instance


class FoundOccurrences(Told):
    """All occurrences of chronicles that are told at once, in the order of results.

    Examples
    --------
    >>> from chronicles.chronicle_set import load
    >>> stay = load("chronicle stay[?car](t1, t2) { "
    ...             "event(enter[?car], t1) event(leave[?car], t2) t2 - t1 in [0s, 9s] }")
    >>> columns = EventColumns.from_events([Event("enter", ("car1",), 3), Event("leave", ("car1",), 8)])
    >>> found = recognise_columns(stay, columns)
    >>> len(found), found[0].end_us
    (1, 8)
    """

    def __init__(self, parts: Sequence[Matches]) -> None:
        self._parts = parts
        self._builders = [OccurrenceBuilder(one.plan, rank, AttributeHistory((), ())) for rank, one in enumerate(parts)]

    def __len__(self) -> int:
        return sum(map(len, self._parts))

    def __iter__(self) -> Iterator[Occurrence]:
        start = 0
        while start < len(self):
            stop = self._whole_steps(start, min(start + _MATCHES_AT_A_TIME, len(self)))[1]
            yield from self.built(slice(start, stop))
            start = stop

    def built(self, part: slice) -> Sequence[Occurrence]:
        """Build some of them, and what is told in the same steps."""
        places = range(len(self))[part]
        if not places:
            return []
        first, last = self._whole_steps(min(places), max(places) + 1)
        findings = self._findings(first, last)
        return [_as_stored(findings[place - first].occurrence) for place in places]

    @cached_property
    def _order(self) -> tuple[Times, Rows, Rows]:
        """For each place in the order of steps: its step, its chronicle, and its row there."""
        empty = np.empty(0, np.int64)
        steps = np.concatenate([empty, *(one.steps() for one in self._parts)])
        which = np.repeat(np.arange(len(self._parts)), [len(one) for one in self._parts])
        rows = np.concatenate([empty, *(np.arange(len(one)) for one in self._parts)])
        order = np.argsort(steps, kind="stable")
        return steps[order], which[order], rows[order]

    def _whole_steps(self, first: int, last: int) -> tuple[int, int]:
        """Widen a stretch of places until it has all of its steps."""
        steps, _, _ = self._order
        return int(np.searchsorted(steps, steps[first])), int(np.searchsorted(steps, steps[last - 1], "right"))

    def _findings(self, first: int, last: int) -> list[Finding]:
        steps, which, rows = (one[first:last] for one in self._order)
        found: list[tuple[int, Finding]] = []
        for number, (matches, builder) in enumerate(zip(self._parts, self._builders, strict=True)):
            mine = which == number
            instances = matches.picked(rows[mine]).instances()
            for step, instance in zip(steps[mine].tolist(), instances, strict=True):
                t_us = matches.columns.events[step].t_us
                found.append((step, builder.plain_finding(instance, t_us, t_us)))
        found.sort(key=lambda pair: (pair[0], pair[1].order))
        return [finding for _, finding in found]


def _as_stored(occurrence: Occurrence) -> Occurrence:
    """Call what rests on hypotheses tentative: stored events do not say what became of them."""
    return replace(occurrence, status="tentative") if occurrence.hypotheses else occurrence
