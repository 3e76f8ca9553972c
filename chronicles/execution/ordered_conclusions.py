"""What becomes of matches whose conclusion depends on what came before them?

`hold`s look at attribute histories, a selection at the occurrences told before, an `assert` action at the value an
attribute had, and emitted events at the order of results. Such matches are concluded one by one, in the order in which
the recogniser concludes them and by the same code, while histories and logs are filled in the order of time.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from heapq import merge
from itertools import groupby
from operator import itemgetter

import numpy as np

from chronicles.compilation.plan import Plan
from chronicles.events import Event
from chronicles.execution.columns import EventColumns
from chronicles.execution.conclusions import Conclusions
from chronicles.execution.history import AttributeHistory
from chronicles.execution.instances import Instance
from chronicles.execution.matches import left_open
from chronicles.execution.occurrences import Finding, OccurrenceBuilder
from chronicles.execution.telling import Candidates

_FED_BETWEEN_SWEEPS = 1 << 16
_MATCHES_AT_A_TIME = 1 << 14

# Numbers that say what is concluded together: when it closes, and the last event if that came then, otherwise -1.
_Batch = tuple[int, int]


def conclude_in_order(
    candidates: Sequence[Candidates], columns: EventColumns, defaults: Iterable[tuple[str, str]], delay_us: int
) -> list[tuple[int, Finding]]:
    """Conclude the matches of chronicles that run together.

    Parameters
    ----------
    candidates : one for each plan of a level.
    columns : all events that the chronicles look at.
    defaults : the values of attributes before their first change.
    delay_us : how long after its end a match becomes certain.

    Returns
    -------
    What is told, in the order in which it is concluded, with its step.
    """
    plans = [left_open(one.matches.plan, columns) for one in candidates]
    watched = {one.attribute for plan in plans for one in plan.persistences}
    history = AttributeHistory(watched, defaults)
    concluders = [_Concluder(one, plan, history) for one, plan in zip(candidates, plans, strict=True)]
    past = _Past(history, watched, concluders, columns)
    told: list[tuple[int, Finding]] = []
    queue = merge(*(one.queue(delay_us) for one in concluders), key=itemgetter(0))
    for (closes_us, _), batch in groupby(queue, key=itemgetter(0)):
        past.advance(closes_us)
        found = [(due.step, finding) for _, due in batch for finding in due.findings()]
        found.sort(key=lambda pair: pair[1].order)
        for step, finding in found:
            if finding.builder.is_new(finding):
                told.append((step, finding))
                past.take_back(finding.occurrence.emitted)
    return told


@dataclass(frozen=True, eq=False, slots=True)
class _Due:
    """A match that is to be concluded."""

    concluder: _Concluder
    instance: Instance
    certain_us: int
    clock_us: int
    step: int

    def findings(self) -> Iterator[Finding]:
        """Give what it is concluded to."""
        for solution in self.concluder.conclusions.solutions(self.instance):
            yield self.concluder.builder.finding(self.instance, solution, self.certain_us, self.clock_us)


class _Concluder:
    """Concludes the matches of one plan; `plan` holds the obligations that are still open."""

    def __init__(self, candidates: Candidates, plan: Plan, history: AttributeHistory) -> None:
        self.plan = plan
        self.conclusions = Conclusions(plan, history)
        self.builder = OccurrenceBuilder(candidates.matches.plan, candidates.rank)
        self._candidates = candidates

    def queue(self, delay_us: int) -> Iterator[tuple[_Batch, _Due]]:
        """Give the matches in the order of conclusion."""
        one = self._candidates
        closes_us = one.certain_us - delay_us
        # What closes with an event is concluded before the next event, even a simultaneous one.
        is_last = one.matches.event_times_us() == closes_us
        last = np.where(is_last, one.matches.sequence(), -1).max(axis=0)
        order = np.lexsort((last, closes_us))
        for start in range(0, len(order), _MATCHES_AT_A_TIME):
            part = order[start : start + _MATCHES_AT_A_TIME]
            numbers = [column[part].tolist() for column in (closes_us, last, one.certain_us, one.clock_us, one.step)]
            for instance, *due, certain_us, clock_us, step in zip(
                one.matches.picked(part).instances(), *numbers, strict=True
            ):
                yield (due[0], due[1]), _Due(self, instance, certain_us, clock_us, step)


class _Past:
    """Fills the history and the logs in the order of time."""

    def __init__(
        self, history: AttributeHistory, watched: set[str], concluders: Sequence[_Concluder], columns: EventColumns
    ) -> None:
        self._history = history
        self._watched = watched
        self._concluders = concluders
        self._memory_us = max(one.plan.memory_us for one in concluders)
        self._fed = 0
        names = watched.union(*(one.conclusions.names for one in concluders))
        self._events = columns.of(names).events()
        self._next = next(self._events, None)

    def advance(self, t_us: int) -> None:
        """Add everything before a time."""
        while self._next is not None and self._next.t_us < t_us:
            self._add(self._next)
            self._next = next(self._events, None)
        if self._fed >= _FED_BETWEEN_SWEEPS:
            self._fed = 0
            for name in self._watched:
                self._history.forget_before(name, t_us - self._memory_us)
            for one in self._concluders:
                one.conclusions.forget_before(t_us - self._memory_us)
                one.builder.forget_before(t_us)

    def take_back(self, emitted: Iterable[Event]) -> None:
        """Let the history meet the changes that it was told to make, as they come back to it as events."""
        for event in emitted:
            if event.name in self._watched:
                self._history.append(event)

    def _add(self, event: Event) -> None:
        self._fed += 1
        if event.name in self._watched:
            self._history.append(event)
        for one in self._concluders:
            if event.name in one.conclusions.names:
                one.conclusions.append(event)
