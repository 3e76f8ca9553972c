"""What does a KPL text say? Its statements as plain values.

Two models are equal when they say the same in the same order; the places in the text, kept for messages, do not count.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from enum import Enum

from dyknow.language.places import NOWHERE, Span
from dyknow.policies.policy import Approximation, Order
from dyknow.streams.mediation import MediationKind


@dataclass(frozen=True, slots=True)
class Name:
    """Hold one name and where it stands."""

    text: str
    span: Span = field(default=NOWHERE, compare=False, repr=False)

    def __str__(self) -> str:
        return self.text


@dataclass(frozen=True, slots=True)
class NamedType:
    """Name a type: a basic one or a sort."""

    name: Name

    def __str__(self) -> str:
        return self.name.text


@dataclass(frozen=True, slots=True)
class TupleType:
    """Describe tuples of a fixed length."""

    parts: tuple[Type, ...]

    def __str__(self) -> str:
        return f"<{', '.join(map(str, self.parts))}>"


@dataclass(frozen=True, slots=True)
class SetType:
    """Describe sets whose elements are of one type."""

    element: Type

    def __str__(self) -> str:
        return f"set({self.element})"


@dataclass(frozen=True, slots=True)
class CollectedType:
    """Describe values that come with the label of the stream they were taken from."""

    value: Type

    def __str__(self) -> str:
        return f"collected({self.value})"


Type = NamedType | TupleType | SetType | CollectedType


class ConstraintKind(Enum):
    """Name the forms of constraints by their words; each belongs to one `family`."""

    ANY_UPDATE = "any update"
    ANY_CHANGE = "any change"
    SAMPLE_EVERY = "sample every"
    NO_APPROXIMATION = "no approximation"
    MOST_RECENT = "use most recent"
    LINEAR = "linear interpolation"
    MAX_DELAY = "max delay"
    FROM = "from"
    TO = "to"
    OLDEST = "oldest"
    ANY_ORDER = "any order"
    MONOTONE_ORDER = "monotone order"
    STRICT_ORDER = "strict order"

    @property
    def family(self) -> str:
        """Return what the constraint speaks of; a policy has at most one constraint of each family."""
        return _FAMILIES.get(self.value, self.value)


_FAMILIES = {
    **dict.fromkeys(("any update", "any change", "sample every"), "cause"),
    **dict.fromkeys((one.value for one in Approximation), "approximation"),
    **dict.fromkeys((one.value for one in Order), "order"),
}


@dataclass(frozen=True, slots=True)
class Constraint:
    """State one thing that a reader wants of a stream.

    Attributes
    ----------
    us : the duration or time of the forms that have one; None stands for `now` after `from`, and for `oo` after `to`
        and `max delay`.
    """

    kind: ConstraintKind
    us: int | None = None
    span: Span = field(default=NOWHERE, compare=False, repr=False)


@dataclass(frozen=True, slots=True)
class Label:
    """Name the stream of a process: a name, or a feature of objects such as `on_road[car1]`."""

    name: Name
    arguments: tuple[Name, ...] = ()
    span: Span = field(default=NOWHERE, compare=False, repr=False)

    def __str__(self) -> str:
        return f"{self.name}[{', '.join(map(str, self.arguments))}]" if self.arguments else self.name.text


@dataclass(frozen=True, slots=True)
class Term:
    """Read the stream of a process under constraints; those not written take their defaults."""

    label: Label
    constraints: tuple[Constraint, ...] = ()


@dataclass(frozen=True, slots=True)
class SortDeclaration:
    """Name a type, or with None a kind of values that only the host knows."""

    name: Name
    type: Type | None


@dataclass(frozen=True, slots=True)
class ObjectDeclaration:
    """Name the objects of a sort."""

    sort: Name
    names: tuple[Name, ...]


@dataclass(frozen=True, slots=True)
class FeatureDeclaration:
    """Name a property of objects or a relation between them, with the type of its value."""

    type: Type
    name: Name
    sorts: tuple[Name, ...]


@dataclass(frozen=True, slots=True)
class SourceDeclaration:
    """Name a source of the host and the type of its samples."""

    type: Type
    name: Name


@dataclass(frozen=True, slots=True)
class UnitDeclaration:
    """Name a computational unit of the host, the type of its output and those of its inputs."""

    type: Type
    name: Name
    inputs: tuple[Type, ...]


@dataclass(frozen=True, slots=True)
class ConfigurationDeclaration:
    """Name code of the host that creates and removes processes, and the type of its input."""

    name: Name
    input: Type


@dataclass(frozen=True, slots=True)
class GeneratorDeclaration:
    """Create a process: `function` names a source if there are no inputs, a unit otherwise."""

    label: Label
    function: Name
    inputs: tuple[Term, ...]


@dataclass(frozen=True, slots=True)
class MediationDeclaration:
    """Create a process that passes on the streams whose labels a control stream names.

    Attributes
    ----------
    type : what the streams carry that are passed on.
    constraints : under which each of them is read.
    control : the stream of sets of labels, read as it is.
    """

    label: Label
    kind: MediationKind
    type: Type
    constraints: tuple[Constraint, ...]
    control: Term

    @property
    def inputs(self) -> tuple[Term, ...]:
        """Return what the text says that the process reads: the control stream."""
        return (self.control,)

    @property
    def output(self) -> Type:
        """Return what the stream of the process carries."""
        return self.type if self.kind is MediationKind.SELECTION else CollectedType(self.type)


@dataclass(frozen=True, slots=True)
class ConfigureDeclaration:
    """Create a process that runs a configuration of the host; its label has no values."""

    label: Label
    function: Name
    input: Term

    @property
    def inputs(self) -> tuple[Term, ...]:
        """Return the one stream that the process reads."""
        return (self.input,)


@dataclass(frozen=True, slots=True)
class StreamDeclaration:
    """Name a stream that the host reads."""

    name: Name
    term: Term


Producer = GeneratorDeclaration | MediationDeclaration  # processes with values
Process = Producer | ConfigureDeclaration
Statement = (
    SortDeclaration
    | ObjectDeclaration
    | FeatureDeclaration
    | SourceDeclaration
    | UnitDeclaration
    | ConfigurationDeclaration
    | Process
    | StreamDeclaration
)


@dataclass(frozen=True, slots=True)
class Specification:
    """Hold the statements of one text in their order."""

    statements: tuple[Statement, ...]


def terms_of(specification: Specification) -> Iterator[Term]:
    """Give every place where the stream of a declared label is read, in the order of the text."""
    for statement in specification.statements:
        if isinstance(statement, Process):
            yield from statement.inputs
        elif isinstance(statement, StreamDeclaration):
            yield statement.term


def policies_of(specification: Specification) -> Iterator[tuple[Constraint, ...]]:
    """Give the constraints of every policy, those under which mediations read included, in the order of the text."""
    for statement in specification.statements:
        if isinstance(statement, MediationDeclaration):
            yield statement.constraints
        elif isinstance(statement, Process):
            yield from (term.constraints for term in statement.inputs)
        elif isinstance(statement, StreamDeclaration):
            yield statement.term.constraints
