"""Why was this occurrence recognised?

The events of the occurrence are found again by its time points and roles; then every statement of the chronicle is read
with them, and told with how much room it had.
"""

from collections import Counter
from collections.abc import Iterable

from chronicles.chronicle_set import ChronicleSet
from chronicles.errors import ChronicleError
from chronicles.events import Event, Occurrence
from chronicles.explanation.case import Case, constraint_readings, fixed_values, open_case, role_values, tightness
from chronicles.explanation.explanations import Explanation, MatchedEvent
from chronicles.explanation.readings.intervals import ANY_COST, NO_COST
from chronicles.explanation.readings.obligations import Readings
from chronicles.explanation.search.assignments import Assignment, AssignmentSearch, Budget, Values

_LARGEST_SEARCH = 1_000_000


def why(chronicles: ChronicleSet, occurrence: Occurrence, events: Iterable[Event]) -> Explanation:
    """Explain an occurrence.

    Parameters
    ----------
    chronicles : the set that it was recognised with.
    occurrence : as recognised, or as read from a log; without `events` they are looked up by time points and roles.
    events : the events that the recogniser saw, in any order; emitted ones are found again, one level deep.

    Raises
    ------
    ChronicleError
        If the set lacks the chronicle or has another version of it, or the events do not contain the occurrence.

    Examples
    --------
    >>> from chronicles.chronicle_set import load
    >>> from chronicles.recogniser import recognise
    >>> stay = load("chronicle stay[?car](t1, t2) { event(enter[?car], t1) event(left[?car], t2) t2 - t1 in [0s, 9s] }")
    >>> events = [Event("enter", ("car1",), 1_000_000), Event("left", ("car1",), 9_500_000)]
    >>> [found] = recognise(stay, events)
    >>> [reading] = why(stay, found, events).constraints
    >>> reading.text, reading.value_us, reading.slack_us
    ('t2 - t1 in [0s, 9s]', 8500000, 500000)
    """
    return _explain(chronicles, occurrence, list(events), depth=1)


def _explain(chronicles: ChronicleSet, occurrence: Occurrence, events: list[Event], *, depth: int) -> Explanation:
    _check_version(chronicles, occurrence)
    case = open_case(chronicles, occurrence.chronicle, events, until_us=occurrence.recognised_us, own=None)
    plan = case.plan
    assignment, readings = _matched(case, occurrence)
    matched = []
    for position, row in zip(plan.positions, assignment.rows, strict=True):
        assert row is not None, "every position of an occurrence has its event"
        emitter = case.emitters.get(row.event) if depth else None
        cause = None if emitter is None else _explain(chronicles, emitter, events, depth=depth - 1)
        matched.append(MatchedEvent(position.label, position.pattern, row.event, cause))
    return Explanation(
        chronicle=plan.name,
        version=plan.version,
        file=case.text.file,
        start_us=occurrence.start_us,
        end_us=occurrence.end_us,
        roles=role_values(plan, readings.values),
        events=tuple(sorted(matched, key=lambda one: (one.event.t_us, one.label))),
        constraints=constraint_readings(plan, case.text, assignment),
        obligations=tuple(sorted(readings.all, key=lambda one: (tightness(one.slack_us), one.line))),
        emitted=occurrence.emitted,
    )


def _check_version(chronicles: ChronicleSet, occurrence: Occurrence) -> None:
    plan = chronicles.plan(occurrence.chronicle)
    if plan.version != occurrence.version:
        where = f"occurrence of {plan.name!r}"
        raise ChronicleError(f"{where}: expected version {plan.version!r} of the text, got {occurrence.version!r}")


def _matched(case: Case, occurrence: Occurrence) -> tuple[Assignment, Readings]:
    """Find which event filled which position, and read the obligations of that instance."""
    fixed = fixed_values(case.plan, occurrence.roles)
    best: tuple[Assignment, Readings] | None = None
    for assignment in _candidates(case, occurrence, fixed):
        limit = ANY_COST if best is None else best[1].cost
        readings = case.reader.best(assignment.times, assignment.values, base=NO_COST, limit=limit)
        if readings is not None:
            best = assignment, readings
    if best is None:
        roles = ", ".join(f"{name}={value}" for name, value in occurrence.roles.items())
        where = f"{occurrence.chronicle}[{roles}] at {occurrence.start_us} us"
        raise ChronicleError(f"{where}: expected the events that it was recognised from, got a list without them")
    return best


def _candidates(case: Case, occurrence: Occurrence, fixed: Values) -> Iterable[Assignment]:
    points = dict(occurrence.sub_events)
    wanted = [points[position.label] for position in case.plan.positions]
    exact_us = [[other - one for other in wanted] for one in wanted]
    window = min(wanted), max(wanted) + 1
    search = AssignmentSearch(case.plan, case.log, fixed, window)
    told = Counter(occurrence.events)
    for assignment in search.assignments(exact_us, range(len(wanted)), Budget(_LARGEST_SEARCH)):
        if list(assignment.times) != wanted:
            continue
        chosen = Counter(row.event for row in assignment.rows if row is not None)
        if not told or chosen == told:
            yield assignment
