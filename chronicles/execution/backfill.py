"""Which chronicles occur in stored columns of events?

Chronicles run level by level, those that look at emitted events after those that emit them. For each plan the
instances are found by joins of whole columns (`joins.py`). Where the conclusion of a plan depends on nothing but
events, all of it happens in columns; the others are concluded one by one, in the order of time
(`ordered_conclusions.py`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from chronicles.chronicle_set import ChronicleSet
from chronicles.compilation.hierarchy import levels
from chronicles.compilation.plan import Plan
from chronicles.events import Event
from chronicles.execution.columns import EventColumns
from chronicles.execution.found import FoundAsFindings, FoundInColumns, FoundOccurrences, FoundOfOne, order_of_results
from chronicles.execution.joins import MOST_ROWS
from chronicles.execution.matches import find_matches, left_open
from chronicles.execution.occurrences import Finding
from chronicles.execution.ordered_conclusions import conclude_in_order
from chronicles.execution.telling import Candidates, Steps

# Places of events among all: between two events of the input there is room for so many emitted ones.
_ROOM = 1 << 31


def recognise_columns(
    chronicles: ChronicleSet, columns: EventColumns, *, until_us: int | None = None, most_rows: int = MOST_ROWS
) -> FoundOccurrences:
    """Recognise chronicles in stored columns; the results are those of a recogniser fed event by event.

    Parameters
    ----------
    chronicles : as given by `chronicles.load`.
    columns : the events.
    until_us : the time up to which the events are complete; the latest event's time if not given.
    most_rows : how many rows a block of time or a table in between may have; bounds the memory used on the way.
    """
    return FoundOccurrences(_Backfill(chronicles, columns, until_us, most_rows).found())


class _Backfill:
    """One run over some columns."""

    def __init__(self, chronicles: ChronicleSet, columns: EventColumns, until_us: int | None, most_rows: int) -> None:
        self._chronicles = chronicles
        self._columns = columns
        self._most_rows = most_rows
        self._heard = frozenset[str]().union(*(_names(plan) for plan in chronicles.plans))
        self._emits = any(self._is_heard(plan) for plan in chronicles.plans)
        self._emitted = 0
        if self._emits:
            spread = {kind: replace(one, sequence=one.sequence * _ROOM) for kind, one in columns.tables.items()}
            self._columns = EventColumns(spread, columns.symbols)
        self._steps = Steps(columns, until_us, _ROOM if self._emits else 1)

    def found(self) -> list[FoundOfOne]:
        """Run all levels."""
        placed = levels(self._chronicles.plans)
        found: list[FoundOfOne] = []
        for level in range(1 + max((one for one, _ in placed.values()), default=-1)):
            ranked = [(rank, one) for rank, one in enumerate(self._chronicles.plans) if placed[one.name][0] == level]
            found += self._level(ranked, max(placed[plan.name][1] for _, plan in ranked))
        return found

    def _level(self, ranked: Sequence[tuple[int, Plan]], delay_us: int) -> list[FoundOfOne]:
        candidates = [self._candidates(rank, plan, delay_us) for rank, plan in ranked]
        alone = [one for one in candidates if self._is_alone(one.matches.plan)]
        found: list[FoundOfOne] = [FoundInColumns(_without_repetitions(one)) for one in alone]
        others = [one for one in candidates if one not in alone]
        if others:
            told = conclude_in_order(others, self._columns, self._chronicles.defaults, delay_us)
            self._add_emitted(told)
            told.sort(key=lambda pair: (pair[0], pair[1].order))
            for one in others:
                mine = [pair for pair in told if pair[1].order[1] == one.rank]
                found.append(FoundAsFindings(one.matches.plan, one.rank, mine))
        return found

    def _candidates(self, rank: int, plan: Plan, delay_us: int) -> Candidates:
        matches = find_matches(plan, self._columns, dict(self._chronicles.defaults), most_rows=self._most_rows)
        return Candidates(rank, matches, delay_us, self._steps).told()

    def _is_alone(self, plan: Plan) -> bool:
        """Say whether nothing is left open about the matches of a plan, and nothing depends on its occurrences."""
        depends = left_open(plan, self._columns).persistences or plan.asserts or plan.selection.kind != "all"
        return not depends and not self._is_heard(plan)

    def _is_heard(self, plan: Plan) -> bool:
        return not plan.produces.isdisjoint(self._heard)

    def _add_emitted(self, told: Sequence[tuple[int, Finding]]) -> None:
        events: list[Event] = []
        sequence: list[int] = []
        for step, finding in told:
            for event in finding.occurrence.emitted:
                if event.name in self._heard:
                    # Behind the event of the step, in the order of conclusion.
                    self._emitted += 1
                    events.append(event)
                    sequence.append(step * _ROOM + self._emitted)
        self._columns = self._columns.with_events(events, np.array(sequence, np.int64))


def _names(plan: Plan) -> frozenset[str]:
    return plan.consumes | {one.attribute for one in plan.persistences}


def _without_repetitions(candidates: Candidates) -> Candidates:
    """Keep the first, in the order of results, of all matches of the same values and events."""
    matches = candidates.matches
    if not matches.plan.is_symmetric or not len(matches):
        return candidates
    order = order_of_results(candidates)
    values = [matches.values(slot) for slot in range(matches.plan.event_slot_count)]
    identity = np.vstack([np.sort(matches.sequence(), axis=0), *values])[:, order]
    by_identity = np.lexsort(identity)
    ordered = identity[:, by_identity]
    is_first = np.append(True, (ordered[:, 1:] != ordered[:, :-1]).any(axis=0))
    # The sort is stable, so the first of equal ones is the first in the order of results.
    return candidates.picked(np.sort(order[by_identity[is_first]]))
