"""What does a recogniser need to know about a chronicle?

The plan is made once by `compiler.py` and read by every executor. It does not depend on the order in which the text
lists its statements: positions, variables and time points are sorted by what they are.

Positions are the `event` statements, numbered 0, 1, ...; slots are the variables that an instance binds, those bound by
events first (`event_slot_count` of them). Fields of an event are its arguments, then for a change the old and the
new value.
"""

from dataclasses import dataclass
from typing import Literal

from chronicles.compilation.names.domains import ValueSet
from chronicles.compilation.names.symbols import UNKNOWN


@dataclass(frozen=True, slots=True)
class EventTest:
    """When does an event fit a pattern, looking at the event alone?

    `constants` (field, value) must be equal; `filters` (field, allowed values); `equal` and `different` are pairs of
    fields that must (not) have the same value; `variables` (field, slot) say where the values of slots stand.
    """

    name: str
    arity: int
    is_change: bool
    constants: tuple[tuple[int, str], ...] = ()
    filters: tuple[tuple[int, ValueSet], ...] = ()
    equal: tuple[tuple[int, int], ...] = ()
    different: tuple[tuple[int, int], ...] = ()
    variables: tuple[tuple[int, int], ...] = ()


@dataclass(frozen=True, slots=True)
class Anchor:
    """A time in an instance: the time of the event at `position`, plus `offset_us`."""

    position: int
    offset_us: int


@dataclass(frozen=True, slots=True)
class Position:
    """An event that an instance needs; `label` is its time point, `pattern` its text."""

    label: str
    test: EventTest
    pattern: str


@dataclass(frozen=True, slots=True)
class Count:
    """An `occurs` or a `noevent`: `least` to `most` events pass `test` in [start, end); `most` None is unbounded.

    A `noevent` is 0 to 0 events. `different` (field, slot): variables known only here that must differ from a bound
    one.
    """

    test: EventTest
    start: Anchor
    end: Anchor
    different: tuple[tuple[int, int], ...]
    text: str
    least: int = 0
    most: int | None = 0


@dataclass(frozen=True, slots=True)
class Persistence:
    """A `hold` or an `assert`: the attribute has one value throughout [start, end).

    With `is_assumed` (an `assert`) only evidence against the value counts: unknown passes, and so does an empty
    interval. With `is_reading` it passes always: it stands for an `assert` action, which asks the past for a value.

    Arguments: `constants` (argument, value), `bound` (argument, slot already known), `binds` (argument, slot that gets
    its value here), `equal` (argument, argument). The value: `value` a constant or None, `value_slot` a known slot or
    -1, `value_binds` the slot that gets its value here or -1; none of them means any value.
    `needs_report` asks for a change at or before the start, so that a default is no evidence: set where an argument
    is not known from events. `needs_known` rules out "unknown": set where an argument or the value is not known from
    events.
    After binding, `different` (new slot, other slot) and `filters` (new slot, allowed values) must pass.
    `lag_us` bounds how long after its end the instance is concluded.
    """

    attribute: str
    arity: int
    start: Anchor
    end: Anchor
    constants: tuple[tuple[int, str], ...]
    bound: tuple[tuple[int, int], ...]
    binds: tuple[tuple[int, int], ...]
    equal: tuple[tuple[int, int], ...]
    value: str | None
    value_slot: int
    value_binds: int
    needs_report: bool
    needs_known: bool
    different: tuple[tuple[int, int], ...]
    filters: tuple[tuple[int, ValueSet], ...]
    text: str
    is_assumed: bool = False
    is_reading: bool = False
    lag_us: int = 0

    @property
    def rejects_unknown(self) -> bool:
        """Whether it fails as soon as the attribute is unknown anywhere in the interval."""
        is_asking = not (self.is_assumed or self.is_reading)
        return is_asking and (self.needs_known or self.value not in (None, UNKNOWN))

    @property
    def is_complete(self) -> bool:
        """Whether all arguments are known before looking."""
        return len(self.constants) + len(self.bound) == self.arity


@dataclass(frozen=True, slots=True)
class Filling:
    """A value of an instance: the one in `slot`, or `constant` when the slot is -1."""

    slot: int
    constant: str = ""


ReportPart = str | Filling


@dataclass(frozen=True, slots=True)
class Emission:
    """An event that a recognised instance gives; `delay_us` bounds how long after its time it can still be given.

    With `is_assertion` (an `assert` action) it is a change from the value that the attribute has at that time, unless
    it has the new one already; the old value in `change` is then empty.
    """

    name: str
    arguments: tuple[Filling, ...]
    change: tuple[Filling, Filling] | None
    time: Anchor
    delay_us: int
    is_assertion: bool = False


@dataclass(frozen=True, slots=True)
class Selection:
    """Which occurrences of a chronicle are told: all, one for each event at position `anchor`, or disjoint ones.

    Disjoint is meant in time and for each combination of roles. The first in the order of results is taken.
    `reach_us` bounds how long before its conclusion an occurrence can start.
    """

    kind: Literal["all", "first", "non_overlapping"] = "all"
    anchor: int = -1
    reach_us: int = 0


@dataclass(frozen=True, slots=True)
class Plan:
    """One chronicle, ready to be recognised.

    `distance_us[i][j]` bounds the time of position j minus that of position i from above (minimal network); all entries
    are finite. `different` are pairs of event slots that must differ; `points` all time points by name; `start` and
    `end` the exported ones; `roles` the header variables. `is_symmetric` says that one event could fill two positions,
    so two instances can be the same set of events. `tail_us` bounds how long after its first event an instance is
    concluded, `delay_us` how long after its end, `memory_us` how far an obligation then looks back. `settling_us` is
    how long an instance waits after its end: 1 where the order of results matters (a selection, an `assert` action), so
    that simultaneous events are in. What is less sure than `floor` is not told.
    """

    name: str
    version: str
    positions: tuple[Position, ...]
    distance_us: tuple[tuple[int, ...], ...]
    slots: tuple[str, ...]
    event_slot_count: int
    different: tuple[tuple[int, int], ...]
    counts: tuple[Count, ...]
    persistences: tuple[Persistence, ...]
    points: tuple[tuple[str, Anchor], ...]
    start: Anchor | None
    end: Anchor | None
    roles: tuple[tuple[str, Filling], ...]
    emissions: tuple[Emission, ...]
    reports: tuple[tuple[ReportPart, ...], ...]
    is_symmetric: bool
    tail_us: int
    delay_us: int
    memory_us: int
    selection: Selection = Selection()
    settling_us: int = 0
    floor: float = 0.0

    @property
    def tests(self) -> tuple[EventTest, ...]:
        """What events must look like that the chronicle needs or counts."""
        return tuple([one.test for one in self.positions] + [one.test for one in self.counts])

    @property
    def obligations(self) -> tuple[Count | Persistence, ...]:
        """What is asked of intervals once all events are there."""
        return self.counts + self.persistences

    @property
    def consumes(self) -> frozenset[str]:
        """Names of the events and attributes that the statements of the chronicle look at."""
        held = [one.attribute for one in self.persistences if not one.is_reading]
        return frozenset([*held, *(test.name for test in self.tests)])

    @property
    def produces(self) -> frozenset[str]:
        """Names of the events that the chronicle emits, and of the attributes that it sets."""
        return frozenset(emission.name for emission in self.emissions)

    @property
    def asserts(self) -> frozenset[str]:
        """Names of the attributes that the chronicle sets."""
        return frozenset(emission.name for emission in self.emissions if emission.is_assertion)

    @property
    def given(self) -> tuple[tuple[str, tuple[str, ...], int], ...]:
        """What an occurrence gives: its messages, or an event of its own name; each with its arguments and delay."""
        messages = [(one.name, one.arguments, one.delay_us) for one in self.emissions if one.change is None]
        own = (self.name, tuple(filling for _, filling in self.roles), self.delay_us)
        return tuple(
            (name, tuple(one.constant or f"?{self.slots[one.slot]}" for one in arguments), delay_us)
            for name, arguments, delay_us in messages or [own]
        )
