"""What is a formula? The tree that the parser builds, the printer writes and the progressor runs.

Trees are values without places in a text: equal formulas are equal, wherever they were written. What a reader checked
(variables bound, windows in order) is trusted here.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from decimal import Decimal
from enum import Enum
from typing import Literal, TypeAlias

from dyknow.language.places import NOWHERE, Span


@dataclass(frozen=True, slots=True)
class Variable:
    """A variable: `name` without its question mark."""

    name: str


@dataclass(frozen=True, slots=True)
class Object:
    """An object called by its name, such as car7 in ``speed[car7]``."""

    name: str


ANY = "?"
"""The name of the object in ``overtake[?a, ?]`` that may be whichever; only events are asked so."""

Argument: TypeAlias = Variable | Object


@dataclass(frozen=True, slots=True)
class Feature:
    """A property of objects: a truth value where it stands alone, any value where it is compared."""

    name: str
    arguments: tuple[Argument, ...] = ()


@dataclass(frozen=True, slots=True)
class Number:
    """A number as it was written; `unit` is "" for a bare one. `dyknow.mtl.kinds` converts it."""

    amount: Decimal
    unit: str = ""


@dataclass(frozen=True, slots=True)
class Text:
    """A text in quotes."""

    text: str


@dataclass(frozen=True, slots=True)
class Scaled:
    """A feature times a number that is not negative; to subtract, use `Sum`."""

    factor: Decimal
    feature: Feature


@dataclass(frozen=True, slots=True)
class Sum:
    """Two terms added, or the right one taken from the left one."""

    left: Term
    sign: Literal["+", "-"]
    right: Operand


Operand: TypeAlias = Feature | Variable | Number | Text | Scaled
Term: TypeAlias = Operand | Sum
Comparator: TypeAlias = Literal["<", "<=", "=", "!=", ">=", ">"]


@dataclass(frozen=True, slots=True)
class Truth:
    """``true`` or ``false``."""

    value: bool


@dataclass(frozen=True, slots=True)
class Proposition:
    """A feature that is true or false."""

    feature: Feature


@dataclass(frozen=True, slots=True)
class Comparison:
    """Two terms compared in one state."""

    left: Term
    comparator: Comparator
    right: Term


@dataclass(frozen=True, slots=True)
class Not:
    """The body is false."""

    body: Formula


@dataclass(frozen=True, slots=True)
class And:
    """All of two or more parts."""

    parts: tuple[Formula, ...]


@dataclass(frozen=True, slots=True)
class Or:
    """At least one of two or more parts."""

    parts: tuple[Formula, ...]


@dataclass(frozen=True, slots=True)
class Implies:
    """The right one, wherever the left one."""

    left: Formula
    right: Formula


@dataclass(frozen=True, slots=True)
class Iff:
    """Both or neither."""

    left: Formula
    right: Formula


class Quantifier(Enum):
    """Name how many objects of a sort are meant."""

    FORALL = "forall"
    EXISTS = "exists"


@dataclass(frozen=True, slots=True)
class Quantified:
    """The body, for all or for some of the objects that a sort has in the state where the formula is asked."""

    quantifier: Quantifier
    variable: Variable
    sort: str
    body: Formula


@dataclass(frozen=True, slots=True)
class Window:
    """From `start_us` to `end_us` after the state where a formula is asked, both ends in; no end is None."""

    start_us: int = 0
    end_us: int | None = None


ALWAYS_OPEN = Window()


@dataclass(frozen=True, slots=True)
class Always:
    """The body in every state in the window."""

    body: Formula
    window: Window = ALWAYS_OPEN


@dataclass(frozen=True, slots=True)
class Eventually:
    """The body in some state in the window."""

    body: Formula
    window: Window = ALWAYS_OPEN


@dataclass(frozen=True, slots=True)
class Until:
    """The right one in some state in the window, and the left one in every state from now to before that one."""

    left: Formula
    right: Formula
    window: Window = ALWAYS_OPEN


@dataclass(frozen=True, slots=True)
class Next:
    """The body in the next state, which must come."""

    body: Formula


@dataclass(frozen=True, slots=True)
class Tolerate:
    """The body, or its return within `return_us` for at least `stay_us`: for sensors that err now and then."""

    body: Formula
    return_us: int
    stay_us: int

    @property
    def meaning(self) -> Formula:
        """The same without the word: ``body or eventually[0, return] always[0, stay] body``."""
        stays = Always(self.body, Window(0, self.stay_us))
        return Or((self.body, Eventually(stays, Window(0, self.return_us))))


Formula: TypeAlias = (
    Truth
    | Proposition
    | Comparison
    | Not
    | And
    | Or
    | Implies
    | Iff
    | Quantified
    | Always
    | Eventually
    | Until
    | Next
    | Tolerate
)


@dataclass(frozen=True, slots=True)
class Subject:
    """A variable of a monitor: the monitor runs once for each object of the sort."""

    variable: Variable
    sort: str


@dataclass(frozen=True, slots=True)
class Monitor:
    """A formula with a name; with several subjects it is meant for each combination of their objects."""

    name: str
    subjects: tuple[Subject, ...]
    formula: Formula
    span: Span = field(default=NOWHERE, compare=False, repr=False)  # of the name
