"""How are the occurrences of a backfill kept and looked at?

They stay rows of columns: their number is known at once, and `Occurrence` objects are built when somebody looks at
them. What one event completes is put in order only then.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import cached_property

import numpy as np

from chronicles.events import Occurrence
from chronicles.execution.history import AttributeHistory
from chronicles.execution.occurrences import Finding, OccurrenceBuilder
from chronicles.execution.results import Told
from chronicles.execution.stored.columns import Times
from chronicles.execution.stored.fitting import Rows
from chronicles.execution.stored.matches import Matches

_MATCHES_AT_A_TIME = 1 << 12


class FoundOccurrences(Told):
    """All occurrences of chronicles that are told at once, in the order of results.

    Examples
    --------
    >>> from chronicles.chronicle_set import load
    >>> from chronicles.events import Event
    >>> from chronicles.execution.stored.backfill import recognise_columns
    >>> from chronicles.execution.stored.columns import EventColumns
    >>> stay = load("chronicle stay[?car](t1, t2) { "
    ...             "event(enter[?car], t1) event(leave[?car], t2) t2 - t1 in [0s, 9s] }")
    >>> columns = EventColumns.from_events([Event("enter", ("car1",), 3), Event("leave", ("car1",), 8)])
    >>> found = recognise_columns(stay, columns)
    >>> len(found), found[0].end_us
    (1, 8)
    """

    def __init__(self, parts: Sequence[Matches]) -> None:
        self._parts = parts
        self._builders = [OccurrenceBuilder(one.plan, rank) for rank, one in enumerate(parts)]

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
        return [as_stored(findings[place - first].occurrence) for place in places]

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
        past = AttributeHistory((), ())
        found: list[tuple[int, Finding]] = []
        for number, (matches, builder) in enumerate(zip(self._parts, self._builders, strict=True)):
            mine = which == number
            instances = matches.picked(rows[mine]).instances()
            for step, instance in zip(steps[mine].tolist(), instances, strict=True):
                t_us = matches.columns.events[step].t_us
                found.append((step, builder.plain_finding(instance, past, t_us, t_us)))
        found.sort(key=lambda pair: (pair[0], pair[1].order))
        return [finding for _, finding in found]


def as_stored(occurrence: Occurrence) -> Occurrence:
    """Call what rests on hypotheses tentative: stored events do not say what became of them."""
    return replace(occurrence, status="tentative") if occurrence.hypotheses else occurrence
