"""What does a chronicle text say, as a tree?

One class per construct of `chronicle.lark`. Places (`span`) do not take part in comparison, so two texts that say the
same compare equal. Durations are integer microseconds already; names of constants are kept until the check.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal as OneOf
from typing import TypeVar

from dyknow.language.places import Span

Comparator = OneOf["<", "<=", "=", ">=", ">"]

UNREAD_US = -1  # stands for a duration that could not be read, which was reported
DEEPEST_DOMAIN = 100  # operations in one another: domains are evaluated, compared and printed recursively


@dataclass(frozen=True, slots=True)
class Node:
    """A construct, and where it stands."""

    span: Span = field(compare=False, repr=False, kw_only=True)


@dataclass(frozen=True, slots=True)
class Named(Node):
    """A construct with a name, and where the name stands."""

    name: str
    name_span: Span = field(compare=False, repr=False, kw_only=True)


@dataclass(frozen=True, slots=True)
class Variable(Node):
    """A variable `?name`, written without the question mark."""

    name: str


class Anything(Node):
    """The anonymous `?`: matches every value, and two of them are unrelated."""


@dataclass(frozen=True, slots=True)
class Literal(Node):
    """A value, or the name of a constant; `quoted` texts are never constants."""

    text: str
    quoted: bool

    @property
    def is_whole_number(self) -> bool:
        """Whether it is a number without sign and point: as a duration it counts the unit of the text that uses it."""
        return not self.quoted and self.text.isdigit()


Term = Variable | Anything | Literal


@dataclass(frozen=True, slots=True)
class TimePoint(Node):
    """The name of a time point, such as `t1`."""

    name: str


@dataclass(frozen=True, slots=True)
class Duration(Node):
    """A length of time in microseconds, or the name of a constant that holds one (then `us` is 0)."""

    us: int
    constant: str

    @property
    def is_read(self) -> bool:
        """Whether it could be read; nothing that rests on another one can be judged."""
        return self.us != UNREAD_US


@dataclass(frozen=True, slots=True)
class Bound(Node):
    """One end of a range of time differences; `duration` None means unbounded ("oo")."""

    negative: bool
    duration: Duration | None


@dataclass(frozen=True, slots=True)
class TimeExpression(Node):
    """A time point, moved by an offset or not."""

    point: TimePoint
    offset: Bound | None


@dataclass(frozen=True, slots=True)
class Interval(Node):
    """The half-open interval from `start` (included) to `end` (excluded)."""

    start: TimeExpression
    end: TimeExpression


@dataclass(frozen=True, slots=True)
class Pattern(Named):
    """What an event or an attribute must look like.

    A message has no `values`, an attribute the one that it must have, a change the old and the new one:
    `name[arguments]`, `name[arguments]:value`, `name[arguments]:(old, new)`.
    """

    arguments: tuple[Term, ...]
    values: tuple[Term, ...] = ()

    @property
    def terms(self) -> tuple[Term, ...]:
        """Arguments and values in one row."""
        return self.arguments + self.values


@dataclass(frozen=True, slots=True)
class EventStatement(Node):
    """`event(pattern, t)`: a matching event happens at t."""

    pattern: Pattern
    point: TimePoint


@dataclass(frozen=True, slots=True)
class Obligation(Node):
    """What is asked of an interval once all events are there."""

    pattern: Pattern
    interval: Interval


@dataclass(frozen=True, slots=True)
class CountStatement(Obligation):
    """How many matching events there are in an interval; `most` None is unbounded."""

    least: int = 0
    most: int | None = 0


class OccursStatement(CountStatement):
    """`occurs((n, m), pattern, (t1, t2))`: n to m matching events in [t1, t2)."""


class NoEventStatement(CountStatement):
    """`noevent(pattern, (t1, t2))`: no matching event in [t1, t2)."""


class HoldStatement(Obligation):
    """`hold(attribute:value, (t1, t2))`: the attribute is known to have the value throughout [t1, t2)."""


class AssertStatement(Obligation):
    """`assert(attribute:value, (t1, t2))`: no evidence against the value in [t1, t2)."""


@dataclass(frozen=True, slots=True)
class Comparison(Node):
    """`left < right + offset` and its kin."""

    left: TimePoint
    comparator: Comparator
    right: TimePoint
    offset: Bound | None


@dataclass(frozen=True, slots=True)
class Range(Node):
    """`later - earlier in [low, high]`, or the chain `low <= later - earlier <= high` when `chained`."""

    later: TimePoint
    earlier: TimePoint
    low: Bound
    low_open: bool
    high: Bound
    high_open: bool
    chained: bool


@dataclass(frozen=True, slots=True)
class Equality(Node):
    """`?x == term` or `?x != term`."""

    variable: Variable
    equal: bool
    term: Term


@dataclass(frozen=True, slots=True)
class Allowance(Node):
    """`allow ?x == ?y`: lifts the rule that two variables of one sort differ."""

    left: Variable
    right: Variable


@dataclass(frozen=True, slots=True)
class Membership(Node):
    """`?x in domain`, in a chronicle or for a parameter of a declaration."""

    variable: Variable
    domain: DomainExpression


@dataclass(frozen=True, slots=True)
class SelectStatement(Node):
    """`select all`, `select first(t1)` or `select non_overlapping`: which occurrences are told."""

    kind: OneOf["all", "first", "non_overlapping"]
    anchor: TimePoint | None


@dataclass(frozen=True, slots=True)
class ConfidenceStatement(Node):
    """`confidence >= 0.8`: what is less sure is not told."""

    least: float


TimeConstraint = Comparison | Range
Told = SelectStatement | ConfidenceStatement
Statement = EventStatement | Obligation | TimeConstraint | Equality | Allowance | Membership | Told


@dataclass(frozen=True, slots=True)
class DomainValues(Node):
    """`{a, b, c}`."""

    values: tuple[Literal, ...]


@dataclass(frozen=True, slots=True)
class DomainRange(Node):
    """`[low .. high]`, both ends included."""

    low: int
    high: int


class DomainSymbol(Node):
    """`symbol`: any name."""


@dataclass(frozen=True, slots=True)
class DomainName(Node):
    """A domain by name."""

    name: str


@dataclass(frozen=True, slots=True)
class DomainOperation(Node):
    """`left | right` (union) or `left ~ right` (difference); `depth` operations stand in one another at most."""

    left: DomainExpression
    operator: OneOf["|", "~"]
    right: DomainExpression
    depth: int = field(default=1, compare=False, repr=False)


DomainExpression = DomainValues | DomainRange | DomainSymbol | DomainName | DomainOperation


@dataclass(frozen=True, slots=True)
class Emit(Node):
    """`emit event(pattern, time)`; the short form `emit pattern` has no time and means the end of the occurrence."""

    pattern: Pattern
    time: TimeExpression | None


@dataclass(frozen=True, slots=True)
class Report(Node):
    """`report "text"`; `?name` inside the text is replaced by the variable's value."""

    text: str


@dataclass(frozen=True, slots=True)
class AssertAction(Node):
    """`assert(attribute:value, time)` as an action."""

    pattern: Pattern
    time: TimeExpression


Action = Emit | Report | AssertAction


@dataclass(frozen=True, slots=True)
class TimeUnit(Node):
    """`timeunit 1ms`: the unit of bare numbers in the same text; `UNREAD_US` if it is none, which was reported."""

    us: int


@dataclass(frozen=True, slots=True)
class Constant(Named):
    """`constant name = value`."""

    value: Literal | Duration


@dataclass(frozen=True, slots=True)
class Domain(Named):
    """`domain name = expression`."""

    expression: DomainExpression


@dataclass(frozen=True, slots=True)
class Attribute(Named):
    """`attribute name[parameters] { ... }`: something that has a value at every time."""

    parameters: tuple[Variable, ...]
    domains: tuple[Membership, ...]
    value_domain: DomainExpression | None
    default: Literal | None


@dataclass(frozen=True, slots=True)
class Message(Named):
    """`message name[parameters] { ... }`: something that happens at one time and has no value."""

    parameters: tuple[Variable, ...]
    domains: tuple[Membership, ...]


_Kind = TypeVar("_Kind", bound=Node)


@dataclass(frozen=True, slots=True)
class Chronicle(Named):
    """`chronicle name[parameters](points) { statements when recognised { actions } }`."""

    parameters: tuple[Variable, ...]
    points: tuple[TimePoint, ...]
    statements: tuple[Statement, ...]
    actions: tuple[Action, ...]

    def of(self, kind: type[_Kind]) -> list[_Kind]:
        """List its statements of one kind."""
        return [one for one in self.statements if isinstance(one, kind)]

    @property
    def looked_at(self) -> tuple[Pattern, ...]:
        """The events and attributes that its statements look at."""
        return tuple(one.pattern for one in self.statements if isinstance(one, EventStatement | Obligation))

    @property
    def given(self) -> tuple[Pattern, ...]:
        """The events that its actions emit, and the attributes that they set."""
        return tuple(one.pattern for one in self.actions if not isinstance(one, Report))


@dataclass(frozen=True, slots=True)
class ExampleEvent(Node):
    """`1s name[a, b]:(old, new)`: an event of an example's stream; its pattern has no variables."""

    t_us: int
    pattern: Pattern


@dataclass(frozen=True, slots=True)
class Role(Node):
    """`name=value` of an expected occurrence."""

    name: str
    value: Literal


@dataclass(frozen=True, slots=True)
class ExpectedOccurrence(Node):
    """`expect chronicle[role=value] start..end`."""

    chronicle: str
    fillings: tuple[Role, ...]
    start_us: int
    end_us: int
    name_span: Span = field(compare=False, repr=False)

    @property
    def roles(self) -> tuple[tuple[str, str], ...]:
        """Names and texts of the roles, as written."""
        return tuple((role.name, role.value.text) for role in self.fillings)


@dataclass(frozen=True, slots=True)
class Example(Node):
    """`example "title" { ... }`: a stream, and all occurrences that the loaded chronicles must find in it.

    `until_us` is how far time goes on after the events; None: as far as the last of them.
    """

    title: str
    events: tuple[ExampleEvent, ...]
    until_us: int | None
    expected: tuple[ExpectedOccurrence, ...]


Declaration = TimeUnit | Constant | Domain | Attribute | Message | Chronicle | Example


@dataclass(frozen=True, slots=True)
class ChronicleFile:
    """One text: its name and its declarations in order."""

    name: str = field(compare=False)
    declarations: tuple[Declaration, ...]
