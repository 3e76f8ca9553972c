"""What does an explanation consist of?

Plain values: `why` gives an `Explanation`, `why_not` a `WhyNot` with `NearMiss`es. All three tell the same things of an
instance: its events, how far it was from each bound of each time constraint, and what was seen where the chronicle
asks for an absence, a number of events or a value. Slack is how far something may still move before it breaks;
negative slack is how far it is broken. Times are microseconds.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from chronicles.compilation.names.symbols import UNKNOWN
from chronicles.events import Event

Outcome = Literal["met", "failed", "open", "not asked"]
ObligationKind = Literal["noevent", "occurs", "hold", "assert"]
Side = Literal["start", "end"]
FailureKind = Literal[
    "missing event", "other value", "same value", "bound", "noevent", "occurs", "hold", "assert", "open", "not selected"
]


@dataclass(frozen=True, slots=True)
class MatchedEvent:
    """An event of an instance: its time point, the pattern it fits, and who emitted it if a chronicle did."""

    label: str
    pattern: str
    event: Event
    emitted_by: Explanation | None = None


@dataclass(frozen=True, slots=True)
class Mismatch:
    """A field of an event ("argument 2", "old value") that has another value than it should."""

    field: str
    wanted: str
    got: str


@dataclass(frozen=True, slots=True)
class MissingEvent:
    """An event that an instance lacks.

    Attributes
    ----------
    label, pattern : its time point and its pattern with the values known so far.
    earliest_us, latest_us : when it should have come (closed); None if no event is matched that bounds it.
    outside : the nearest event with the right values that came too early or too late, None if there is none.
    outside_us : by how much: negative is too early.
    other : the event inside the window with the fewest wrong values, None if there is none.
    mismatches : its wrong values; empty where it only breaks the rule that variables differ.
    emitters : chronicles that emit such events.
    """

    label: str
    pattern: str
    earliest_us: int | None
    latest_us: int | None
    outside: Event | None
    outside_us: int
    other: Event | None
    mismatches: tuple[Mismatch, ...]
    emitters: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class ConstraintReading:
    """A time constraint of the text and what `later - earlier` was.

    `text` is the statement in the canonical text (`ChronicleSet.texts`), `line` its line in the text that was loaded.
    Bounds are closed, None is unbounded.
    """

    text: str
    line: int
    later: str
    earlier: str
    value_us: int
    low_us: int | None
    high_us: int | None

    @property
    def slack_low_us(self) -> int | None:
        """How far the value is above the lower bound; None without one."""
        return None if self.low_us is None else self.value_us - self.low_us

    @property
    def slack_high_us(self) -> int | None:
        """How far the value is below the upper bound; None without one."""
        return None if self.high_us is None else self.high_us - self.value_us

    @property
    def slack_us(self) -> int | None:
        """How far the value is from the nearer bound; None if both are open."""
        slacks = [slack for slack in (self.slack_low_us, self.slack_high_us) if slack is not None]
        return min(slacks, default=None)

    @property
    def is_met(self) -> bool:
        """Whether the value is within the bounds."""
        return self.slack_us is None or self.slack_us >= 0


@dataclass(frozen=True, slots=True)
class ValueSpan:
    """A value that a fluent had from `start_us` (None: from the beginning) to `end_us` (None: to the end of the log).

    `change` is the event that set it, None before the first.
    """

    value: str
    start_us: int | None
    end_us: int | None
    change: Event | None


@dataclass(frozen=True, slots=True)
class Shift:
    """Moving one end of an interval by `by_us` would satisfy the statement."""

    side: Side
    by_us: int


@dataclass(frozen=True, slots=True, kw_only=True)
class IntervalReading:
    """What was seen where a chronicle asks for an absence, a number of events or a value.

    Attributes
    ----------
    kind, text, line : the statement, as in `ConstraintReading`.
    outcome : "open" if the log ends before the interval does, "not asked" if a missing event leaves the interval or the
        arguments unknown.
    start_us, end_us : the interval, half-open; None if not asked.
    slack_us : how far one end could move with the same outcome; None is without a limit.
    shifts : smallest changes of one end that would satisfy it, smallest first; empty if met or none does.
    """

    kind: ObligationKind
    text: str
    line: int
    outcome: Outcome = "not asked"
    start_us: int | None = None
    end_us: int | None = None
    slack_us: int | None = None
    shifts: tuple[Shift, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class HoldReading(IntervalReading):
    """A `hold` or `assert` and what was seen.

    Attributes
    ----------
    subject : the attribute with the values of its arguments, "?" where none was found.
    wanted : the value it should have; None for any one value.
    spans : the values it had in the interval, in the order of time.
    alternatives : what held throughout the interval with other values of the variables that the hold itself binds.
    """

    subject: str = ""
    wanted: str | None = None
    spans: tuple[ValueSpan, ...] = ()
    alternatives: tuple[str, ...] = ()

    @property
    def contrary(self) -> tuple[ValueSpan, ...]:
        """What was seen that should not have been; what is unknown does not speak against an `assert`."""
        allowed = (self.wanted, UNKNOWN) if self.kind == "assert" else (self.wanted,)
        return tuple(span for span in self.spans if span.value not in allowed)


@dataclass(frozen=True, slots=True, kw_only=True)
class CountReading(IntervalReading):
    """A `noevent` or `occurs` and what was seen.

    `counted` are the events inside the interval that fit, `before` and `after` the nearest ones outside it; `least` to
    `most` (None: any number) should be inside.
    """

    least: int
    most: int | None
    counted: tuple[Event, ...] = ()
    before: Event | None = None
    after: Event | None = None


ObligationReading = HoldReading | CountReading


@dataclass(frozen=True, slots=True)
class RoleValue:
    """A variable's value, and the statement that gave it; `value` is "" while it has none."""

    name: str
    value: str
    source: str


@dataclass(frozen=True, slots=True, kw_only=True)
class ExplainedInstance:
    """What is told of an instance, whether it was recognised or not.

    `file` is the name of the text that was loaded, in which the lines of statements count.
    """

    chronicle: str
    version: str
    file: str
    roles: tuple[RoleValue, ...]
    events: tuple[MatchedEvent, ...]
    constraints: tuple[ConstraintReading, ...]
    obligations: tuple[ObligationReading, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class Explanation(ExplainedInstance):
    """Why an occurrence was recognised.

    `constraints` and `obligations` are sorted by slack, the tightest first; `events` by time. Implied time constraints
    are left out: their slack is the sum of the slacks of written ones, so they are never tighter.
    """

    start_us: int
    end_us: int
    emitted: tuple[Event, ...]


@dataclass(frozen=True, slots=True)
class SameValue:
    """Two variables that must differ and were given one value."""

    one: str
    other: str
    value: str


@dataclass(frozen=True, slots=True)
class Failure:
    """Something that kept an instance from being recognised, and when.

    `because` is what whoever made the events knows of why they were not others; "" for nothing.
    """

    kind: FailureKind
    t_us: int | None
    subject: MissingEvent | SameValue | ConstraintReading | ObligationReading | None
    because: str = ""


@dataclass(frozen=True, slots=True)
class BoundChange:
    """A change of one bound with which the near miss is recognised; this was tried, not only calculated.

    `before` and `after` are the statement as it is and as it would have to be, `line` as in `ConstraintReading`; `size`
    counts microseconds, or events where `unit` is "events".
    """

    line: int
    before: str
    after: str
    size: int
    unit: Literal["us", "events"]


@dataclass(frozen=True, slots=True, kw_only=True)
class NearMiss(ExplainedInstance):
    """An instance that came close.

    `unmet_count` statements are not met (events that are missing, bounds, obligations failed, open or not asked);
    `short_us` is by how much time altogether, None if no time would mend it. Both in this order make the distance.
    `failures` are sorted by time, so the first one is what went wrong first.
    """

    unmet_count: int
    short_us: int | None
    failures: tuple[Failure, ...]
    missing: tuple[MissingEvent, ...]
    change: BoundChange | None


@dataclass(frozen=True, slots=True)
class WhyNot:
    """Near misses of a chronicle, the nearest first.

    `roles`, `start_us` and `end_us` repeat the question; `recognised` counts the occurrences that fit it and are told;
    `doubtful` lists the confidences of those that are not told, since they are below the `floor`; `is_complete` is
    false if the search was cut short, so that there may be nearer ones.
    """

    chronicle: str
    version: str
    roles: tuple[tuple[str, str], ...]
    start_us: int | None
    end_us: int | None
    recognised: int
    near_misses: tuple[NearMiss, ...]
    is_complete: bool
    floor: float = 0.0
    doubtful: tuple[float, ...] = ()
