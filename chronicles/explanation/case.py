"""What is looked at when one chronicle is explained in one list of events?

Events that other chronicles emit are not in a stored log: they are found by recognising those chronicles again.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace

from chronicles.chronicle_set import ChronicleSet
from chronicles.compilation.hierarchy import levels
from chronicles.compilation.plan import Plan
from chronicles.errors import ChronicleError
from chronicles.events import Event, Occurrence
from chronicles.explanation.explanations import ConstraintReading, RoleValue
from chronicles.explanation.readings.obligations import ObligationReader
from chronicles.explanation.search.assignments import Assignment, Values
from chronicles.explanation.search.chronicle_text import ChronicleText
from chronicles.explanation.search.event_log import EventLog
from chronicles.recogniser import recognise


@dataclass(frozen=True, slots=True)
class Case:
    """One chronicle and the events that it looks at.

    `reader` reads its obligations in the log. `emitters` gives the occurrence that emitted an event; `occurrences` are
    those of the chronicle itself. Events, emitted ones included, are known up to `until_us`; an instance that ends by
    `log.until_us` is concluded by then.
    """

    plan: Plan
    text: ChronicleText
    log: EventLog
    reader: ObligationReader
    emitters: Mapping[Event, Occurrence]
    occurrences: tuple[Occurrence, ...]
    until_us: int


def open_case(
    chronicles: ChronicleSet, name: str, events: Iterable[Event], *, until_us: int | None, own: Values | None
) -> Case:
    """Gather what a chronicle looks at, the events emitted by other chronicles included.

    Parameters
    ----------
    chronicles, name : the chronicle.
    events : in any order.
    until_us : the time up to which they are complete; the latest event's time if not given or earlier.
    own : the occurrences of the chronicle itself with these values are wanted too; None: they are not.
    """
    given = list(events)
    plan = chronicles.plan(name)
    involved = _involved(chronicles, plan)
    end_us = max([event.t_us for event in given], default=0)
    end_us = end_us if until_us is None else max(end_us, until_us)
    emitting = tuple(one for one in involved.plans if one is not plan)
    sought = replace(involved, plans=emitting) if own is None else involved
    looked_at = given if own is None else _deciding(involved, plan, given, own)
    found = list(recognise(sought, looked_at, until_us=end_us)) if sought.plans else []
    others = [one for one in found if one.chronicle != name]
    emitters = {event: one for one in others for event in one.emitted}
    emitted = [event for one in others for event in one.emitted]
    consumed = plan.consumes
    known_us = end_us - levels(involved.plans)[name][1]
    seen = [event for event in (*given, *emitted) if event.name in consumed]
    log = EventLog(seen, chronicles.defaults, known_us - plan.settling_us)
    occurrences = tuple(one for one in found if one.chronicle == name)
    text = ChronicleText(chronicles, name)
    return Case(plan, text, log, ObligationReader(plan, text, log), emitters, occurrences, known_us)


def looked_at(chronicles: ChronicleSet, name: str) -> frozenset[str]:
    """Name the events that a chronicle looks at, and those whose emitted events it rests on.

    Examples
    --------
    >>> from chronicles import library
    >>> sorted(looked_at(library.load_library(), "pass"))
    ['ahead', 'behind', 'beside', 'moving']
    """
    return frozenset().union(*(plan.consumes for plan in _involved(chronicles, chronicles.plan(name)).plans))


def reach_us(chronicles: ChronicleSet, name: str) -> int:
    """Bound how far from its own times an instance, with those whose emitted events it rests on, looks at anything."""
    return sum(one.tail_us + one.memory_us for one in _involved(chronicles, chronicles.plan(name)).plans)


def is_about_roles(chronicles: ChronicleSet, name: str) -> bool:
    """Tell whether all that a chronicle, or one that it rests on, counts or wants to last is about one of its roles.

    Examples
    --------
    >>> from chronicles.chronicle_set import load
    >>> alone = load("chronicle alone[?car](t1) { event(enter[?car], t1) noevent(enter[?], (t1 + 1us, t1 + 5s)) }")
    >>> once = load("chronicle once[?car](t1) { event(enter[?car], t1) noevent(enter[?car], (t1 + 1us, t1 + 5s)) }")
    >>> is_about_roles(alone, "alone"), is_about_roles(once, "once")
    (False, True)
    """
    for plan in _involved(chronicles, chronicles.plan(name)).plans:
        roles = {filling.slot for _, filling in plan.roles}
        bound = [one.test.variables for one in plan.counts] + [one.bound for one in plan.persistences]
        if any(roles.isdisjoint(slot for _, slot in one) for one in bound):
            return False
    return True


def fixed_values(plan: Plan, roles: Mapping[str, str]) -> Values:
    """Give the slots that the values of some roles fix.

    Raises
    ------
    ChronicleError
        If there is no such role, or it cannot have that value, or two that must differ are given one value.
    """
    fillings = dict(plan.roles)
    values: list[str | None] = [None] * len(plan.slots)
    for role, value in roles.items():
        if role not in fillings:
            raise ChronicleError(f"roles of {plan.name!r}: expected names out of {list(fillings)}, got {role!r}")
        filling = fillings[role]
        taken = values[filling.slot] if filling.slot >= 0 else filling.constant
        if taken is not None and taken != value:
            raise ChronicleError(f"role {role!r} of {plan.name!r}: expected {taken!r}, got {value!r}")
        if filling.slot >= 0:
            values[filling.slot] = value
    pairs = {*plan.different, *(pair for one in plan.persistences for pair in one.different)}
    for one, two in sorted(pairs):
        if values[one] is not None and values[one] == values[two]:
            names = f"{plan.slots[one]!r} and {plan.slots[two]!r}"
            raise ChronicleError(f"roles of {plan.name!r}: expected {names} to differ, got {values[one]!r} for both")
    return tuple(values)


def role_values(plan: Plan, values: Values) -> tuple[RoleValue, ...]:
    """Give the roles with their values, and the statements that gave them."""
    return tuple(
        RoleValue(name, filling.constant, "the text")
        if filling.slot < 0
        else RoleValue(name, values[filling.slot] or "", _source(plan, filling.slot))
        for name, filling in plan.roles
    )


def constraint_readings(plan: Plan, text: ChronicleText, assignment: Assignment) -> tuple[ConstraintReading, ...]:
    """Read every written time constraint of which both points are known, the tightest first."""
    found = []
    for one in text.constraints:
        value_us = one.value_us(plan, assignment.times)
        if value_us is not None:
            bounds = one.low_us, one.high_us
            found.append(ConstraintReading(one.text, one.line, one.later, one.earlier, value_us, *bounds))
    return tuple(sorted(found, key=lambda one: (tightness(one.slack_us), one.line)))


def tightness(slack_us: int | None) -> tuple[bool, int]:
    """Order slacks: the smallest first, none at all last."""
    return slack_us is None, slack_us or 0


def _involved(chronicles: ChronicleSet, plan: Plan) -> ChronicleSet:
    """Give the set of a chronicle and of those whose emitted events it rests on."""
    kept, wanted = [plan], set(plan.consumes)
    # Emitters stand before those who look at their events, so one way back through the list is enough.
    for one in reversed(chronicles.plans[: chronicles.plans.index(plan)]):
        if one.produces & wanted:
            kept.append(one)
            wanted |= one.consumes
    return replace(chronicles, plans=tuple(reversed(kept)))


def _deciding(involved: ChronicleSet, plan: Plan, events: list[Event], fixed: Values) -> list[Event]:
    """Leave out events that cannot matter for occurrences with these values, where that is known."""
    if len(involved.plans) > 1 or plan.selection.kind != "all":
        return events
    places = [(test.name, [pair for pair in test.variables if pair[0] < test.arity]) for test in plan.tests]
    places += [(one.attribute, [*one.bound, *one.binds]) for one in plan.persistences]
    wanted: dict[str, list[list[tuple[int, str]]]] = {}
    for name, pairs in places:
        known = [(place, value) for place, slot in pairs if (value := fixed[slot]) is not None]
        wanted.setdefault(name, []).append(known)
    free = {name for name, some in wanted.items() if [] in some}
    return [one for one in events if one.name in free or any(_has(one, known) for known in wanted.get(one.name, ()))]


def _has(event: Event, known: Iterable[tuple[int, str]]) -> bool:
    return all(place < len(event.args) and event.args[place] == value for place, value in known)


def _source(plan: Plan, slot: int) -> str:
    for position in plan.positions:
        if any(other == slot for _, other in position.test.variables):
            return f"event({position.pattern}, {position.label})"
    binding = [one for one in plan.persistences if any(other == slot for _, other in one.binds)]
    binding += [one for one in plan.persistences if one.value_binds == slot]
    return binding[0].text
