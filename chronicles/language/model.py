"""What does a chronicle text say, as a tree?

One class per construct of `chronicle.lark`. Places (`span`) do not take part in comparison, so two texts that say the
same compare equal. Durations are integer microseconds already; names of constants are kept until the check.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal as OneOf

from dyknow.language.places import Span

Comparator = OneOf["<", "<=", "=", ">=", ">"]

UNREAD_US = -1  # stands for a duration that could not be read, which was reported
DEEPEST_DOMAIN = 100  # operations in one another: domains are evaluated, compared and printed recursively


@dataclass(frozen=True, slots=True)
class Variable:
    """A variable `?name`, written without the question mark."""

    name: str
    span: Span = field(compare=False, repr=False)


@dataclass(frozen=True, slots=True)
class Anything:
    """The anonymous `?`: matches every value, and two of them are unrelated."""

    span: Span = field(compare=False, repr=False)


@dataclass(frozen=True, slots=True)
class Literal:
    """A value, or the name of a constant; `quoted` texts are never constants."""

    text: str
    quoted: bool
    span: Span = field(compare=False, repr=False)

    @property
    def is_whole_number(self) -> bool:
        """Whether it is a number without sign and point: as a duration it counts the unit of the text that uses it."""
        return not self.quoted and self.text.isdigit()


Term = Variable | Anything | Literal


@dataclass(frozen=True, slots=True)
class TimePoint:
    """The name of a time point, such as `t1`."""

    name: str
    span: Span = field(compare=False, repr=False)


@dataclass(frozen=True, slots=True)
class Duration:
    """A length of time in microseconds, or the name of a constant that holds one (then `us` is 0)."""

    us: int
    constant: str
    span: Span = field(compare=False, repr=False)

    @property
    def is_read(self) -> bool:
        """Whether it could be read; nothing that rests on another one can be judged."""
        return self.us != UNREAD_US


@dataclass(frozen=True, slots=True)
class Bound:
    """One end of a range of time differences; `duration` None means unbounded ("oo")."""

    negative: bool
    duration: Duration | None
    span: Span = field(compare=False, repr=False)


@dataclass(frozen=True, slots=True)
class TimeExpression:
    """A time point, moved by an offset or not."""

    point: TimePoint
    offset: Bound | None
    span: Span = field(compare=False, repr=False)


@dataclass(frozen=True, slots=True)
class Interval:
    """The half-open interval from `start` (included) to `end` (excluded)."""

    start: TimeExpression
    end: TimeExpression
    span: Span = field(compare=False, repr=False)


@dataclass(frozen=True, slots=True)
class Pattern:
    """What an event must look like: a message, or a change of an attribute from `old` to `new`."""

    name: str
    arguments: tuple[Term, ...]
    change: tuple[Term, Term] | None
    name_span: Span = field(compare=False, repr=False)
    span: Span = field(compare=False, repr=False)


@dataclass(frozen=True, slots=True)
class Fluent:
    """An attribute with arguments and the value it must have: `name[arguments]:value`."""

    name: str
    arguments: tuple[Term, ...]
    value: Term
    name_span: Span = field(compare=False, repr=False)
    span: Span = field(compare=False, repr=False)


@dataclass(frozen=True, slots=True)
class EventStatement:
    """`event(pattern, t)`: a matching event happens at t."""

    pattern: Pattern
    point: TimePoint
    span: Span = field(compare=False, repr=False)


@dataclass(frozen=True, slots=True)
class NoEventStatement:
    """`noevent(pattern, (t1, t2))`: no matching event in [t1, t2)."""

    pattern: Pattern
    interval: Interval
    span: Span = field(compare=False, repr=False)


@dataclass(frozen=True, slots=True)
class OccursStatement:
    """`occurs((n, m), pattern, (t1, t2))`: n to m matching events in [t1, t2); `most` None is unbounded."""

    least: int
    most: int | None
    pattern: Pattern
    interval: Interval
    span: Span = field(compare=False, repr=False)


@dataclass(frozen=True, slots=True)
class HoldStatement:
    """`hold(attribute:value, (t1, t2))`: the attribute is known to have the value throughout [t1, t2)."""

    fluent: Fluent
    interval: Interval
    span: Span = field(compare=False, repr=False)


@dataclass(frozen=True, slots=True)
class AssertStatement:
    """`assert(attribute:value, (t1, t2))`: no evidence against the value in [t1, t2)."""

    fluent: Fluent
    interval: Interval
    span: Span = field(compare=False, repr=False)


@dataclass(frozen=True, slots=True)
class Comparison:
    """`left < right + offset` and its kin."""

    left: TimePoint
    comparator: Comparator
    right: TimePoint
    offset: Bound | None
    span: Span = field(compare=False, repr=False)


@dataclass(frozen=True, slots=True)
class Range:
    """`later - earlier in [low, high]`, or the chain `low <= later - earlier <= high` when `chained`."""

    later: TimePoint
    earlier: TimePoint
    low: Bound
    low_open: bool
    high: Bound
    high_open: bool
    chained: bool
    span: Span = field(compare=False, repr=False)


@dataclass(frozen=True, slots=True)
class Equality:
    """`?x == term` or `?x != term`."""

    variable: Variable
    equal: bool
    term: Term
    span: Span = field(compare=False, repr=False)


@dataclass(frozen=True, slots=True)
class Allowance:
    """`allow ?x == ?y`: lifts the rule that two variables of one sort differ."""

    left: Variable
    right: Variable
    span: Span = field(compare=False, repr=False)


@dataclass(frozen=True, slots=True)
class Membership:
    """`?x in domain`."""

    variable: Variable
    domain: DomainExpression
    span: Span = field(compare=False, repr=False)


@dataclass(frozen=True, slots=True)
class SelectStatement:
    """`select all`, `select first(t1)` or `select non_overlapping`: which occurrences are told."""

    kind: OneOf["all", "first", "non_overlapping"]
    anchor: TimePoint | None
    span: Span = field(compare=False, repr=False)


Statement = (
    EventStatement
    | NoEventStatement
    | OccursStatement
    | HoldStatement
    | AssertStatement
    | Comparison
    | Range
    | Equality
    | Allowance
    | Membership
    | SelectStatement
)


TimeConstraint = Comparison | Range
# What is asked of an interval once all events are there.
Obligation = NoEventStatement | OccursStatement | HoldStatement | AssertStatement


@dataclass(frozen=True, slots=True)
class DomainValues:
    """`{a, b, c}`."""

    values: tuple[Literal, ...]
    span: Span = field(compare=False, repr=False)


@dataclass(frozen=True, slots=True)
class DomainRange:
    """`[low .. high]`, both ends included."""

    low: int
    high: int
    span: Span = field(compare=False, repr=False)


@dataclass(frozen=True, slots=True)
class DomainSymbol:
    """`symbol`: any name."""

    span: Span = field(compare=False, repr=False)


@dataclass(frozen=True, slots=True)
class DomainName:
    """A domain by name."""

    name: str
    span: Span = field(compare=False, repr=False)


@dataclass(frozen=True, slots=True)
class DomainOperation:
    """`left | right` (union) or `left ~ right` (difference); `depth` operations stand in one another at most."""

    left: DomainExpression
    operator: OneOf["|", "~"]
    right: DomainExpression
    span: Span = field(compare=False, repr=False)
    depth: int = field(default=1, compare=False, repr=False)


DomainExpression = DomainValues | DomainRange | DomainSymbol | DomainName | DomainOperation


@dataclass(frozen=True, slots=True)
class Emit:
    """`emit event(pattern, time)`; the short form `emit pattern` has no time and means the end of the occurrence."""

    pattern: Pattern
    time: TimeExpression | None
    span: Span = field(compare=False, repr=False)


@dataclass(frozen=True, slots=True)
class Report:
    """`report "text"`; `?name` inside the text is replaced by the variable's value."""

    text: str
    span: Span = field(compare=False, repr=False)


@dataclass(frozen=True, slots=True)
class AssertAction:
    """`assert(attribute:value, time)` as an action."""

    fluent: Fluent
    time: TimeExpression
    span: Span = field(compare=False, repr=False)


Action = Emit | Report | AssertAction


@dataclass(frozen=True, slots=True)
class TimeUnit:
    """`timeunit 1ms`: the unit of bare numbers in the same text; `UNREAD_US` if it is none, which was reported."""

    us: int
    span: Span = field(compare=False, repr=False)


@dataclass(frozen=True, slots=True)
class Constant:
    """`constant name = value`."""

    name: str
    value: Literal | Duration
    name_span: Span = field(compare=False, repr=False)
    span: Span = field(compare=False, repr=False)


@dataclass(frozen=True, slots=True)
class Domain:
    """`domain name = expression`."""

    name: str
    expression: DomainExpression
    name_span: Span = field(compare=False, repr=False)
    span: Span = field(compare=False, repr=False)


@dataclass(frozen=True, slots=True)
class ParameterDomain:
    """`?parameter in domain` inside a declaration."""

    variable: Variable
    domain: DomainExpression
    span: Span = field(compare=False, repr=False)


@dataclass(frozen=True, slots=True)
class Attribute:
    """`attribute name[parameters] { ... }`: something that has a value at every time."""

    name: str
    parameters: tuple[Variable, ...]
    domains: tuple[ParameterDomain, ...]
    value_domain: DomainExpression | None
    default: Literal | None
    name_span: Span = field(compare=False, repr=False)
    span: Span = field(compare=False, repr=False)


@dataclass(frozen=True, slots=True)
class Message:
    """`message name[parameters] { ... }`: something that happens at one time and has no value."""

    name: str
    parameters: tuple[Variable, ...]
    domains: tuple[ParameterDomain, ...]
    name_span: Span = field(compare=False, repr=False)
    span: Span = field(compare=False, repr=False)


@dataclass(frozen=True, slots=True)
class Chronicle:
    """`chronicle name[parameters](points) { statements when recognised { actions } }`."""

    name: str
    parameters: tuple[Variable, ...]
    points: tuple[TimePoint, ...]
    statements: tuple[Statement, ...]
    actions: tuple[Action, ...]
    name_span: Span = field(compare=False, repr=False)
    span: Span = field(compare=False, repr=False)


@dataclass(frozen=True, slots=True)
class ExampleEvent:
    """`1s name[a, b]:(old, new)`: an event of an example's stream; its pattern has no variables."""

    t_us: int
    pattern: Pattern
    span: Span = field(compare=False, repr=False)

    @property
    def name(self) -> str:
        """Name of the message or of the attribute."""
        return self.pattern.name

    @property
    def arguments(self) -> tuple[str, ...]:
        """Texts of the arguments."""
        return _texts(self.pattern.arguments)

    @property
    def change(self) -> tuple[str, str] | None:
        """Texts of the old and the new value; None for a message."""
        if self.pattern.change is None:
            return None
        old, new = _texts(self.pattern.change)
        return old, new


@dataclass(frozen=True, slots=True)
class Role:
    """`name=value` of an expected occurrence."""

    name: str
    value: Literal
    span: Span = field(compare=False, repr=False)


@dataclass(frozen=True, slots=True)
class ExpectedOccurrence:
    """`expect chronicle[role=value] start..end`."""

    chronicle: str
    fillings: tuple[Role, ...]
    start_us: int
    end_us: int
    name_span: Span = field(compare=False, repr=False)
    span: Span = field(compare=False, repr=False)

    @property
    def roles(self) -> tuple[tuple[str, str], ...]:
        """Names and texts of the roles, as written."""
        return tuple((role.name, role.value.text) for role in self.fillings)


@dataclass(frozen=True, slots=True)
class Example:
    """`example "title" { ... }`: a stream, and all occurrences that the loaded chronicles must find in it.

    `until_us` is how far time goes on after the events; None: as far as the last of them.
    """

    title: str
    events: tuple[ExampleEvent, ...]
    until_us: int | None
    expected: tuple[ExpectedOccurrence, ...]
    span: Span = field(compare=False, repr=False)


def _texts(terms: tuple[Term, ...]) -> tuple[str, ...]:
    return tuple(term.text for term in terms if isinstance(term, Literal))


Declaration = TimeUnit | Constant | Domain | Attribute | Message | Chronicle | Example


@dataclass(frozen=True, slots=True)
class ChronicleFile:
    """One text: its name and its declarations in order."""

    name: str = field(compare=False)
    declarations: tuple[Declaration, ...]
