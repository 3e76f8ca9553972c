"""Which instances of a chronicle were under way at a time, what did they wait for, and what became of those before?"""

from collections.abc import Iterable
from operator import attrgetter
from typing import Literal

from msgspec import Struct

from chronicles.chronicle_set import ChronicleSet
from chronicles.events import Event, ExpectedEvent, Occurrence, PartialInstance
from chronicles.recogniser import Recogniser
from service.records.events import SubEvent

State = Literal["awaited", "recognised", "timed out", "failed"]


class AwaitedInstance(Struct, frozen=True):
    """An instance that was under way.

    Attributes
    ----------
    state : as of the time that was asked for; `failed` came before its time was over.
    roles : as far as they were known.
    matched : what had come.
    expected : what was missing, in what window each; empty if only the end of an absence or a value was.
    latest_us : when it ends at the latest.
    """

    state: State
    roles: dict[str, str]
    matched: list[SubEvent]
    expected: tuple[ExpectedEvent, ...]
    latest_us: int


class AwaitedList(Struct, frozen=True):
    """What a run waited for at a time, and what ended since another one; `count` of them, some of which are `items`."""

    run: str
    chronicle: str
    since_us: int
    at_us: int
    count: int
    items: list[AwaitedInstance]


def awaited_instances(
    chronicles: ChronicleSet, name: str, events: Iterable[Event], *, since_us: int, at_us: int
) -> list[AwaitedInstance]:
    """Find the instances of a chronicle under way at `at_us`, and those under way from `since_us` on that ended.

    Parameters
    ----------
    events : in any order; later ones are not looked at.

    Returns
    -------
    Those awaited first; then those that had come furthest, and would have ended first.
    """
    involved, found = chronicles.feeding({name}), list[Occurrence]()
    recogniser = Recogniser(involved)
    # Others only decide what has all its events. What other chronicles emit may come with any event.
    fitting = {one.test.name for one in chronicles.plan(name).positions}

    def look() -> dict[object, PartialInstance]:
        under_way = [one for one in recogniser.partial_instances() if one.chronicle == name]
        return {(one.matched, tuple(sorted(one.roles.items()))): one for one in under_way}

    ordered = sorted(events, key=attrgetter("t_us"))
    for event in (one for one in ordered if one.t_us < since_us):
        found += recogniser.observe(event)
    found += recogniser.advance(since_us)
    seen = look()
    for event in (one for one in ordered if since_us <= one.t_us <= at_us):
        found += recogniser.observe(event)
        if event.name in fitting or len(involved.plans) > 1:
            seen |= look()
    found += recogniser.advance(at_us)
    now = look()
    occurred = [one for one in found if one.chronicle == name]
    all_seen = seen | now
    states = {key: "awaited" if key in now else _ended(one, occurred, at_us) for key, one in all_seen.items()}
    told = [_told(states[key], one) for key, one in all_seen.items()]
    return sorted(told, key=lambda one: (one.state != "awaited", -len(one.matched), one.latest_us))


def _ended(one: PartialInstance, occurred: Iterable[Occurrence], at_us: int) -> State:
    for other in occurred:
        if {*one.matched} <= {*other.sub_events} and one.roles.items() <= dict(other.roles).items():
            return "recognised"
    return "timed out" if one.latest_us <= at_us else "failed"


def _told(state: State, one: PartialInstance) -> AwaitedInstance:
    matched = [SubEvent(*part) for part in one.matched]
    return AwaitedInstance(state, one.roles, matched, one.expected, one.latest_us)
