"""How are the occurrences of a backfill kept and looked at?

Most stay rows of columns: their number is known at once, their times and roles are arrays, and `Occurrence` objects are
built when somebody looks at them. Their order is worked out when it is first needed.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import cached_property
from typing import overload

import numpy as np

from chronicles.compilation.plan import Anchor, Plan
from chronicles.errors import ChronicleError
from chronicles.events import Occurrence
from chronicles.execution.columns import Codes, Times
from chronicles.execution.conclusions import Solution
from chronicles.execution.history import AttributeHistory
from chronicles.execution.matches import Matches
from chronicles.execution.occurrences import Finding, OccurrenceBuilder
from chronicles.execution.row_tests import Rows, known_texts
from chronicles.execution.telling import Candidates

_OCCURRENCES_AT_A_TIME = 1 << 12


class FoundOfOne(ABC, Sequence[Occurrence]):
    """The occurrences of one chronicle, in the order of results."""

    def __init__(self, plan: Plan, rank: int) -> None:
        self.plan = plan
        self.rank = rank

    @abstractmethod
    def times_us(self, label: str) -> Times:
        """Give the time of a time point in each occurrence."""

    @abstractmethod
    def roles(self, name: str) -> list[str]:
        """Give the value of a role in each occurrence."""

    @abstractmethod
    def when_told(self) -> tuple[Rows, Times]:
        """Give for each occurrence the step of the recogniser that tells it, and when it becomes certain."""

    @overload
    def __getitem__(self, index: int) -> Occurrence: ...

    @overload
    def __getitem__(self, index: slice) -> Sequence[Occurrence]: ...

    def __getitem__(self, index: int | slice) -> Occurrence | Sequence[Occurrence]:
        places = range(len(self))[index]
        return self.at(places) if isinstance(places, range) else self.at([places])[0]

    @abstractmethod
    def at(self, places: Sequence[int]) -> list[Occurrence]:
        """Give the occurrences at some places."""

    def __iter__(self) -> Iterator[Occurrence]:
        for start in range(0, len(self), _OCCURRENCES_AT_A_TIME):
            yield from self[start : start + _OCCURRENCES_AT_A_TIME]


class FoundInColumns(FoundOfOne):
    """Occurrences that are rows of columns."""

    def __init__(self, candidates: Candidates) -> None:
        super().__init__(candidates.matches.plan, candidates.rank)
        self.candidates = candidates

    def __len__(self) -> int:
        return len(self.candidates.matches)

    def times_us(self, label: str) -> Times:
        """Give the time of a time point in each occurrence."""
        return self.candidates.matches.times_us(_anchor(self.plan, label))[self.order]

    def roles(self, name: str) -> list[str]:
        """Give the value of a role in each occurrence."""
        filling = dict(self.plan.roles).get(name)
        if filling is None:
            raise _unknown(self.plan, "role", name)
        if filling.slot < 0:
            return [filling.constant] * len(self)
        texts = known_texts(self.candidates.matches.columns)
        return [texts[code] for code in self.candidates.matches.values(filling.slot)[self.order].tolist()]

    def when_told(self) -> tuple[Rows, Times]:
        """Give the step that tells each occurrence, and when it becomes certain."""
        return self.candidates.step[self.order], self.candidates.certain_us[self.order]

    def at(self, places: Sequence[int]) -> list[Occurrence]:
        """Give the occurrences at some places."""
        chosen = self.order[np.asarray(places, np.int64)]
        one = self.candidates
        builder, past = OccurrenceBuilder(self.plan, one.rank), AttributeHistory((), ())
        first = 1 + len(self.plan.positions)
        slots = slice(first, first + self.plan.event_slot_count)
        times = zip(one.certain_us[chosen].tolist(), one.clock_us[chosen].tolist(), strict=True)
        instances = one.matches.picked(chosen).instances()
        return [
            _with_status(builder.finding(instance, Solution(tuple(instance[slots]), (), past), *when).occurrence)
            for instance, when in zip(instances, times, strict=True)
        ]

    @cached_property
    def order(self) -> Rows:
        """The candidates in the order of results."""
        return order_of_results(self.candidates)


class FoundAsFindings(FoundOfOne):
    """Occurrences that were concluded one by one, given with their steps in the order of results."""

    def __init__(self, plan: Plan, rank: int, findings: Sequence[tuple[int, Finding]]) -> None:
        super().__init__(plan, rank)
        self.findings = findings

    def __len__(self) -> int:
        return len(self.findings)

    def times_us(self, label: str) -> Times:
        """Give the time of a time point in each occurrence."""
        _anchor(self.plan, label)
        times = [dict(finding.occurrence.sub_events)[label] for _, finding in self.findings]
        return np.array(times, np.int64)

    def roles(self, name: str) -> list[str]:
        """Give the value of a role in each occurrence."""
        if name not in dict(self.plan.roles):
            raise _unknown(self.plan, "role", name)
        return [finding.occurrence.roles[name] for _, finding in self.findings]

    def when_told(self) -> tuple[Rows, Times]:
        """Give the step that tells each occurrence, and when it becomes certain."""
        told = [(step, finding.order[0]) for step, finding in self.findings]
        step, certain_us = np.array(told, np.int64).reshape(-1, 2).T
        return step, certain_us

    def at(self, places: Sequence[int]) -> list[Occurrence]:
        """Give the occurrences at some places."""
        return [_with_status(self.findings[place][1].occurrence) for place in places]


class FoundOccurrences(Sequence[Occurrence]):
    """All occurrences that a backfill found, in the order of results.

    Their number is known; the objects are built when they are looked at. Equal to any sequence of equal occurrences.

    Examples
    --------
    >>> from chronicles.chronicle_set import load
    >>> from chronicles.events import Event
    >>> from chronicles.execution.backfill import recognise_columns
    >>> from chronicles.execution.columns import EventColumns
    >>> stay = load("chronicle stay[?car](t1, t2) { "
    ...             "event(enter[?car], t1) event(leave[?car], t2) t2 - t1 in [0s, 9s] }")
    >>> columns = EventColumns.from_events([Event("enter", ("car1",), 3), Event("leave", ("car1",), 8)])
    >>> found = recognise_columns(stay, columns)
    >>> len(found), found.of("stay").times_us("t2"), found.of("stay").roles("car"), found[0].end_us
    (1, array([8]), ['car1'], 8)
    """

    def __init__(self, parts: Sequence[FoundOfOne]) -> None:
        self._parts = sorted(parts, key=lambda one: one.rank)

    def __len__(self) -> int:
        return sum(map(len, self._parts))

    @overload
    def __getitem__(self, index: int) -> Occurrence: ...

    @overload
    def __getitem__(self, index: slice) -> Sequence[Occurrence]: ...

    def __getitem__(self, index: int | slice) -> Occurrence | Sequence[Occurrence]:
        which, places = self._order
        if not isinstance(index, slice):
            return self._parts[int(which[index])][int(places[index])]
        return self._at(which[index], places[index])

    def __iter__(self) -> Iterator[Occurrence]:
        which, places = self._order
        for start in range(0, len(self), _OCCURRENCES_AT_A_TIME):
            part = slice(start, start + _OCCURRENCES_AT_A_TIME)
            yield from self._at(which[part], places[part])

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Sequence):
            return NotImplemented
        return len(self) == len(other) and all(one == two for one, two in zip(self, other, strict=True))

    __hash__ = None  # type: ignore[assignment]  # like a list

    def __repr__(self) -> str:
        numbers = ", ".join(f"{one.plan.name}: {len(one)}" for one in self._parts)
        return f"<{type(self).__name__} {numbers}>"

    def of(self, chronicle: str) -> FoundOfOne:
        """Give the occurrences of one chronicle, also as columns.

        Raises
        ------
        ChronicleError
            If there is no such chronicle.
        """
        for one in self._parts:
            if one.plan.name == chronicle:
                return one
        names = [one.plan.name for one in self._parts]
        raise ChronicleError(f"occurrences: expected one of the chronicles {names}, got {chronicle!r}")

    @cached_property
    def _order(self) -> tuple[Rows, Rows]:
        """For each occurrence its part and the place there."""
        which = np.repeat(np.arange(len(self._parts)), [len(one) for one in self._parts])
        places = np.concatenate([np.empty(0, np.int64), *(np.arange(len(one)) for one in self._parts)])
        if len(self._parts) > 1:
            told = [one.when_told() for one in self._parts]
            step, certain_us = (np.concatenate(one) for one in zip(*told, strict=True))
            order = np.lexsort((places, which, certain_us, step))
            which, places = which[order], places[order]
        return which, places

    def _at(self, which: Rows, places: Rows) -> list[Occurrence]:
        found: list[Occurrence | None] = [None] * len(which)
        for part in np.unique(which).tolist():
            mine = np.flatnonzero(which == part)
            for index, one in zip(mine.tolist(), self._parts[part].at(places[mine].tolist()), strict=True):
                found[index] = one
        return [one for one in found if one is not None]


def order_of_results(candidates: Candidates) -> Rows:
    """Sort matches as results: by step, time of certainty, values, time points and the places of their events."""
    step = candidates.step
    order = np.argsort(step, kind="stable")
    tied = np.zeros(len(order), bool)
    same = step[order[1:]] == step[order[:-1]]
    tied[1:] |= same
    tied[:-1] |= same
    if tied.any():
        some = order[tied]
        keys = [step[some], candidates.certain_us[some], *_keys(candidates.matches.picked(some))]
        # Most keys are the same for all; lexsort wants the most important one last.
        changing = [key for key in keys if (key != key[0]).any()]
        if changing:
            order[tied] = some[np.lexsort(changing[::-1])]
    return order


def _keys(matches: Matches) -> Iterator[Rows | Codes]:
    """Give the columns by which matches of one step are sorted, the most important first."""
    texts = known_texts(matches.columns)
    if matches.plan.event_slot_count:
        rank_of = np.empty(len(texts), np.int64)
        rank_of[sorted(range(len(texts)), key=texts.__getitem__)] = np.arange(len(texts))
        for slot in range(matches.plan.event_slot_count):
            yield rank_of[matches.values(slot)]
    points = sorted(matches.plan.points)
    times = np.stack([matches.times_us(anchor) for _, anchor in points])
    names = np.argsort(times, axis=0, kind="stable")
    for name, t_us in zip(names, np.take_along_axis(times, names, axis=0), strict=True):
        yield name
        yield t_us
    sequence = matches.sequence()
    by_time = np.lexsort((sequence, matches.event_times_us()), axis=0)
    yield from np.take_along_axis(sequence, by_time, axis=0)


def _with_status(occurrence: Occurrence) -> Occurrence:
    """Call what rests on hypotheses tentative: stored events do not say what became of them."""
    return replace(occurrence, status="tentative") if occurrence.hypotheses else occurrence


def _anchor(plan: Plan, label: str) -> Anchor:
    anchor = dict(plan.points).get(label)
    if anchor is None:
        raise _unknown(plan, "time point", label)
    return anchor


def _unknown(plan: Plan, what: str, name: str) -> ChronicleError:
    known = [one for one, _ in (plan.roles if what == "role" else plan.points)]
    return ChronicleError(f"occurrences of {plan.name!r}: expected a {what} among {known}, got {name!r}")
