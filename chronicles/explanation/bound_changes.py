"""Which smallest change of one bound would have made a near miss match?

Candidates for the change come from how the instance was read; each is written into the text and recognised with the
events that decide the instance, so what is told was seen to work.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Literal

from chronicles.chronicle_set import load
from chronicles.errors import ChronicleError
from chronicles.events import Event
from chronicles.explanation.candidates import Candidate
from chronicles.explanation.case import Case, role_values
from chronicles.explanation.explanations import BoundChange, CountReading, ObligationReading
from chronicles.explanation.obligation_readings import ObligationReader
from chronicles.language import model
from chronicles.language.printer import print_statement
from chronicles.recogniser import recognise


@dataclass(frozen=True, slots=True)
class _Edit:
    place: int
    statement: model.Statement
    size: int
    unit: Literal["us", "events"] = "us"


def smallest_change(case: Case, candidate: Candidate) -> BoundChange | None:
    """Find the smallest change of one bound with which a candidate is recognised, None if there is none."""
    if candidate.cost[0] != 1 or candidate.undecided is not None:
        return None
    text = case.text
    for edit in _edits(case, candidate):
        if _is_recognised(case, candidate, text.with_statement(edit.place, edit.statement)):
            before = print_statement(text.chronicle.statements[edit.place])
            after = print_statement(edit.statement)
            return BoundChange(text.line_of(edit.place), before, after, edit.size, edit.unit)
    return None


def _edits(case: Case, candidate: Candidate) -> Iterator[_Edit]:
    """Give the changes worth a try: time before numbers of events, the smallest first."""
    text, broken = case.text, candidate.broken
    if broken is not None:
        one = broken.constraint
        by_us = -broken.by_us if broken.end == "low" else broken.by_us
        yield _Edit(one.place, text.with_bound(one, broken.end, one.bound_us(broken.end) + by_us), broken.by_us)
        return
    for reading in candidate.readings.all:
        if reading.outcome == "met":
            continue
        place = text.place_of(reading.text)
        for shift in reading.shifts:
            moved = text.with_shift(place, is_start=shift.side == "start", by_us=shift.by_us)
            yield _Edit(place, moved, abs(shift.by_us))
        yield from _count_edits(place, reading, text.chronicle.statements[place])


def _count_edits(place: int, reading: ObligationReading, statement: model.Statement) -> Iterator[_Edit]:
    if not isinstance(reading, CountReading) or not isinstance(statement, model.OccursStatement):
        return
    count = len(reading.counted)
    if count < reading.least:
        yield _Edit(place, replace(statement, least=count), reading.least - count, unit="events")
    if reading.most is not None and count > reading.most:
        yield _Edit(place, replace(statement, most=count), count - reading.most, unit="events")


def _is_recognised(case: Case, candidate: Candidate, changed: str) -> bool:
    try:
        chronicles = load(changed)
    except ChronicleError:
        return False  # the changed bound makes no chronicle, such as an interval that is always empty
    wanted = Counter(row.event for row in candidate.assignment.rows if row is not None)
    found = recognise(chronicles, _evidence(case, candidate), until_us=case.until_us)
    roles = {role.name: role.value for role in role_values(case.plan, candidate.readings.values)}
    return any(Counter(one.events) == wanted and one.roles == roles for one in found)


def _evidence(case: Case, candidate: Candidate) -> list[Event]:
    """Give the events that decide the instance: all there are where one occurrence can rule out another."""
    if case.plan.selection.kind != "all":
        chosen = case.log.events
    else:
        chosen = [row.event for row in candidate.assignment.rows if row is not None]
        chosen += ObligationReader(case.plan, case.text, case.log).evidence(candidate.readings.values)
    return list({id(event): event for event in chosen if event.t_us <= case.until_us}.values())
