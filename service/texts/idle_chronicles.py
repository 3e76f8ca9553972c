"""Which chronicles look at events that do not come, and which events come that no chronicle can take?

Such a chronicle finds nothing, and nothing else would say why.
"""

from collections.abc import Collection, Iterable

from chronicles.chronicle_set import ChronicleSet
from chronicles.compilation.names.symbols import UNKNOWN
from chronicles.compilation.plan import Plan
from chronicles.events import Event
from chronicles.execution.unfit_events import Reason, UnfitEvents
from dyknow.language.diagnostics import hinted
from qsr.relations import RANK, RELATIONS

ROAD_RELATIONS = frozenset(one.name for one in RELATIONS if one.frame in ("map", "road"))

_TOLD_AT_MOST = 5

_EXPECTED: dict[Reason, str] = {
    "unknown name": "expected events that the texts declare, not {}",
    "other shape": "expected {} with the arguments and values that the texts have",
    "value outside its domain": "expected values of {} inside their domains",
}


def idle_in_file(where: str, chronicles: ChronicleSet, names: Collection[str]) -> tuple[str, ...]:
    """Say what chronicles look for in a file that has no such events.

    Parameters
    ----------
    where : what messages call the file.
    names : of the events that it has.

    Examples
    --------
    >>> from chronicles.chronicle_set import load
    >>> loud = load("chronicle loud[?c](t1) { event(honk[?c], t1) }")
    >>> idle_in_file("e.csv", loud, ["honks"])
    ("e.csv: expected events 'honk', which chronicle 'loud' looks at, got none; did you mean 'honks'?",)
    >>> idle_in_file("e.csv", loud, ["honk"])
    ()
    """
    given = _given(chronicles).union(names)
    return _shortened(
        f"{where}: expected events {name!r}, which chronicle {plan.name!r} looks at, got none{hinted(name, names)}"
        for plan in chronicles.plans
        for name, is_needed in _looked_at(plan).items()
        if is_needed and name not in given
    )


def unfit_told(
    where: str, chronicles: ChronicleSet, found: Iterable[UnfitEvents], *, is_traffic: bool = False
) -> tuple[str, ...]:
    """Say which events fit nothing, how many, and what the first one was.

    Names that nobody declares are only told where texts declare names at all, and not of DyKnow's own stream, which has
    relations that only monitors look at.

    Examples
    --------
    >>> from chronicles.chronicle_set import load
    >>> from chronicles.execution.unfit_events import UnfitCounter
    >>> loud = load("chronicle loud[?c](t1) { event(honk[?c], t1) }")
    >>> counter = UnfitCounter(loud)
    >>> counter.count(Event("honk", ("a", "b"), 0))
    >>> unfit_told("e.csv", loud, counter.found)
    ("e.csv: expected 'honk' with the arguments and values that the texts have, got 1 event, the first at 0 us:
    honk[a, b]",)
    """
    declared = _given(chronicles).union(one.name for one in chronicles.signatures)
    knows_names = bool(chronicles.signatures) and not is_traffic
    said = (
        f"{where}: {_EXPECTED[one.reason].format(repr(one.name))}, got {_events(one.count)}, "
        f"the first at {one.first.t_us} us: {_shown(one.first)}"
        + (hinted(one.name, declared) if one.reason == "unknown name" else "")
        for one in found
        if knows_names or one.reason != "unknown name"
    )
    return _shortened(said)


def idle_in_stream(where: str, chronicles: ChronicleSet, messages: Collection[str]) -> tuple[str, ...]:
    """Say what chronicles look for that DyKnow's own stream, live or in a log, cannot give them.

    Parameters
    ----------
    where : what messages call the input or the log.
    messages : names of the messages that monitors give.

    Examples
    --------
    >>> from chronicles.chronicle_set import load
    >>> late = load("chronicle late[?c](t1) { event(carful_violated[?c], t1) }")
    >>> idle_in_stream("a.mp4", late, ["careful_violated"])
    ("a.mp4: expected relations and what chronicles or monitors give, got 'carful_violated', which chronicle 'late'
    looks at and nothing gives; did you mean 'careful_violated'?",)
    >>> idle_in_stream("a.mp4", late, ["carful_violated"])
    ()
    """
    given = _given(chronicles).union(RANK, messages)
    return _shortened(
        f"{where}: expected relations and what chronicles or monitors give, got {name!r}, which "
        f"chronicle {plan.name!r} looks at and nothing gives{hinted(name, given)}"
        for plan in chronicles.plans
        for name in _looked_at(plan)
        if name not in given
    )


def idle_without_roads(where: str, chronicles: ChronicleSet) -> tuple[str, ...]:
    """Say which chronicles can find nothing where there are no roads.

    Examples
    --------
    >>> from chronicles.chronicle_set import load
    >>> there = load("chronicle there[?c, ?r](t1) { event(on[?c, ?r]:(false, true), t1) }")
    >>> idle_without_roads("t.csv", there)
    ("t.csv: expected roads for on, got none: chronicle 'there' will find nothing",)
    """
    given = _given(chronicles)
    idle: dict[str, set[str]] = {}
    alive = {name for plan in chronicles.plans for name in plan.produces}
    for _ in chronicles.plans:  # one that looks at what only idle ones give is idle too
        for plan in chronicles.plans:
            needed = {name for name, is_needed in _looked_at(plan).items() if is_needed}
            found = (needed & ROAD_RELATIONS) | ((needed & given) - alive)
            if found:
                idle[plan.name] = found
        alive = {name for plan in chronicles.plans if plan.name not in idle for name in plan.produces}
    if not idle:
        return ()
    relations = ", ".join(sorted(frozenset[str]().union(*idle.values()) & ROAD_RELATIONS))
    names = ", ".join(map(repr, idle))
    chronicle = "chronicle" if len(idle) == 1 else "chronicles"
    return (f"{where}: expected roads for {relations}, got none: {chronicle} {names} will find nothing",)


def _given(chronicles: ChronicleSet) -> frozenset[str]:
    return frozenset[str]().union(*(plan.produces for plan in chronicles.plans))


def _looked_at(plan: Plan) -> dict[str, bool]:
    """Give the names that the statements of a chronicle look at, and whether it can find nothing without one."""
    looked_at = [(position.test.name, True) for position in plan.positions]
    looked_at += [(one.test.name, one.least > 0) for one in plan.counts]
    # A default holds without any event.
    looked_at += [(one.attribute, one.needs_report) for one in plan.persistences if not one.is_reading]
    found: dict[str, bool] = {}
    for name, is_needed in looked_at:
        found[name] = found.get(name, False) or is_needed
    return found


def _events(count: int) -> str:
    return "1 event" if count == 1 else f"{count} events"


def _shown(event: Event) -> str:
    change = "" if event.new is None else f":({event.old or UNKNOWN}, {event.new})"
    return f"{event.name}[{', '.join(event.args)}]{change}"


def _shortened(found: Iterable[str]) -> tuple[str, ...]:
    said = tuple(found)
    more = len(said) - _TOLD_AT_MOST
    return said if more <= 1 else (*said[:_TOLD_AT_MOST], f"and {more} more of this kind")
