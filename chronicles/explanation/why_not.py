"""Why was a chronicle not recognised?

`candidates.py` finds the instances that came closest; here each becomes a `NearMiss` that says what went wrong first,
what else, and which change of one bound would have been enough.
"""

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import Literal

from chronicles.chronicle_set import ChronicleSet, load
from chronicles.errors import ChronicleError
from chronicles.events import Event
from chronicles.explanation.case import Case, constraint_readings, fixed_values, open_case, role_values, tightness
from chronicles.explanation.explanations import (
    BoundChange,
    ConstraintReading,
    CountReading,
    Failure,
    FailureKind,
    HoldReading,
    MatchedEvent,
    MissingEvent,
    NearMiss,
    ObligationReading,
    SameValue,
    WhyNot,
)
from chronicles.explanation.search.assignments import (
    WHOLE_LOG,
    AskedWindow,
    AssignmentSearch,
    WindowedSearch,
    equal_pairs,
)
from chronicles.explanation.search.candidates import Candidate, CandidateSearch
from chronicles.explanation.search.missing_events import MissingEventReader
from chronicles.language import model
from chronicles.language.printer import print_statement
from chronicles.recogniser import recognise

_NO_ROLES: Mapping[str, str] = MappingProxyType({})


def why_not(
    chronicles: ChronicleSet,
    name: str,
    events: Iterable[Event],
    *,
    roles: Mapping[str, str] = _NO_ROLES,
    start_us: int | None = None,
    end_us: int | None = None,
    until_us: int | None = None,
    limit: int = 5,
    floor: float | None = None,
) -> WhyNot:
    """Give the instances of a chronicle that came closest to being recognised.

    Parameters
    ----------
    chronicles : the set that the chronicle belongs to.
    name : of the chronicle.
    events : the events that the recogniser saw, in any order; those emitted by other chronicles are found again.
    roles : values of some roles, to ask about these things only.
    start_us, end_us : asks for the instances that overlap [start_us, end_us); None is open. All events count.
    until_us : the time up to which the events are complete; the latest event's time if not given.
    limit : how many near misses are wanted at most.
    floor : below this confidence an occurrence was not told; that of the chronicle if not given.

    Returns
    -------
    The near misses, the nearest first, and how often the chronicle was recognised in the window with these roles.
    Instances made only of events of such occurrences are left out, and so are those of the same things at the same
    time in other roles.

    Raises
    ------
    ChronicleError
        If there is no such chronicle or role, or the limit is below 1.

    Examples
    --------
    >>> from chronicles.chronicle_set import load
    >>> stay = load("chronicle stay[?car](t1, t2) { event(enter[?car], t1) event(left[?car], t2) t2 - t1 in [0s, 9s] }")
    >>> [miss] = why_not(stay, "stay", [Event("enter", ("a",), 0), Event("left", ("a",), 9_500_000)]).near_misses
    >>> miss.failures[0].kind, miss.short_us, miss.change.after
    ('bound', 500000, 't2 - t1 in [0s, 9500ms]')
    """
    if limit < 1:
        raise ChronicleError(f"why not {name!r}: expected a limit >= 1, got {limit!r}")
    fixed = fixed_values(chronicles.plan(name), roles)
    case = open_case(chronicles, name, events, until_us=until_us, own=fixed)
    asked = AskedWindow(start_us, end_us)
    recognised = [one for one in case.occurrences if all(one.roles[role] == value for role, value in roles.items())]
    assignments = WindowedSearch(case.plan, case.log, fixed, asked)
    search = CandidateSearch(case, assignments, recognised=recognised, wanted=limit)
    nearest = search.nearest()[:limit]
    within = [one for one in recognised if asked.asks_for(event.t_us for event in one.events)]
    least = case.plan.floor if floor is None else floor
    everything = AssignmentSearch(case.plan, case.log, fixed, WHOLE_LOG)
    reader = MissingEventReader(case, chronicles, everything, asked.bounds)
    return WhyNot(
        chronicle=name,
        version=case.plan.version,
        roles=tuple(roles.items()),
        start_us=start_us,
        end_us=end_us,
        recognised=sum(one.confidence >= least for one in within),
        near_misses=tuple(_near_miss(case, one, reader) for one in nearest),
        is_complete=search.is_complete,
        floor=least,
        doubtful=tuple(one.confidence for one in within if one.confidence < least),
    )


def _near_miss(case: Case, candidate: Candidate, reader: MissingEventReader) -> NearMiss:
    plan, assignment, values = case.plan, candidate.assignment, candidate.readings.values
    readings = candidate.reader.with_alternatives(candidate.readings, assignment.times)
    candidate = replace(candidate, readings=readings)
    pairs = [(row, position) for row, position in zip(assignment.rows, plan.positions, strict=True) if row is not None]
    events = [MatchedEvent(position.label, position.pattern, row.event) for row, position in pairs]
    missing = reader.read(assignment, values)
    constraints = constraint_readings(candidate.reader.plan, case.text, assignment)
    unmet_count, unmendable_count, short_us = candidate.cost
    return NearMiss(
        chronicle=plan.name,
        version=plan.version,
        file=case.text.file,
        roles=role_values(plan, values),
        unmet_count=unmet_count,
        short_us=None if unmendable_count else short_us,
        failures=_failures(case, candidate, missing, constraints),
        events=tuple(sorted(events, key=lambda one: (one.event.t_us, one.label))),
        missing=missing,
        constraints=constraints,
        obligations=tuple(sorted(candidate.readings.all, key=lambda one: (tightness(one.slack_us), one.line))),
        change=_smallest_change(case, candidate),
    )


def _failures(
    case: Case, candidate: Candidate, missing: Sequence[MissingEvent], constraints: Sequence[ConstraintReading]
) -> tuple[Failure, ...]:
    """List what went wrong, in the order of time."""
    found = [Failure(_kind_of_missing(one, case.log.until_us), one.latest_us, one) for one in missing]
    for one, two in equal_pairs(case.plan, candidate.readings.values):
        value = candidate.readings.values[one] or ""
        found.append(Failure("same value", None, SameValue(case.plan.slots[one], case.plan.slots[two], value)))
    found += [Failure("bound", _time_of(one, candidate), one) for one in constraints if not one.is_met]
    for reading in candidate.readings.all:
        if reading.outcome in ("failed", "open"):
            kind: FailureKind = "open" if reading.outcome == "open" else reading.kind
            found.append(Failure(kind, _time_broken(reading), reading))
    if candidate.undecided is not None:
        found.append(Failure(candidate.undecided, None, None))
    return tuple(sorted(found, key=lambda one: (one.t_us is None, one.t_us or 0)))


def _kind_of_missing(one: MissingEvent, until_us: int) -> FailureKind:
    if one.other is not None:
        return "other value" if one.mismatches else "same value"
    return "open" if one.latest_us is not None and one.latest_us > until_us else "missing event"


def _time_of(one: ConstraintReading, candidate: Candidate) -> int:
    """Give the time of the later of the two points, at which the bound was broken at the latest."""
    points, times = dict(candidate.reader.plan.points), candidate.assignment.times
    anchors = [points[label] for label in (one.later, one.earlier)]
    return max([(times[anchor.position] or 0) + anchor.offset_us for anchor in anchors])


def _time_broken(reading: HoldReading | CountReading) -> int | None:
    if reading.start_us is None or reading.end_us is None or reading.outcome == "open":
        return reading.end_us
    if isinstance(reading, CountReading):
        too_many = reading.most is not None and len(reading.counted) > reading.most
        return reading.counted[reading.most or 0].t_us if too_many else reading.end_us
    since_us = [span.start_us for span in reading.contrary[:1] if span.start_us is not None]
    return max([reading.start_us, *since_us])


@dataclass(frozen=True, slots=True)
class _Edit:
    place: int
    statement: model.Statement
    size: int
    unit: Literal["us", "events"] = "us"


def _smallest_change(case: Case, candidate: Candidate) -> BoundChange | None:
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
        one, size_us = broken.constraint, broken.broken_by_us(candidate.assignment)
        bound_us = one.bound_us(broken.end) + (-size_us if broken.end == "low" else size_us)
        yield _Edit(one.place, text.with_bound(one, broken.end, bound_us), size_us)
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
        chosen += case.reader.evidence(candidate.readings.values)
    return list({id(event): event for event in chosen if event.t_us <= case.until_us}.values())
