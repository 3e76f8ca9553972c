"""What is left of a formula after some states? A tree of obligations with absolute deadlines.

A residual is what the rest of the sequence must satisfy, from the next state on. Since deadlines are absolute, an
obligation that still waits is the same object in state after state. Residuals are made by a `FormulaTable`, which keeps
equal ones the same object, and they never change.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeAlias

from dyknow.mtl.progression.state_test import Bound
from dyknow.mtl.progression.states import State
from dyknow.mtl.progression.templates import NEVER_US, Following, Shape, size_of

STARTED_US = -NEVER_US
"""Start of a window that is already open: windows that differ only in the past are the same obligation."""


@dataclass(frozen=True, slots=True, eq=False)
class Known:
    """Nothing is left to wait for: True, False, or None for what will never be known."""

    value: bool | None


TRUE, FALSE, UNKNOWN = Known(True), Known(False), Known(None)


@dataclass(frozen=True, slots=True, eq=False)
class Waiting:
    """A shape in a window of absolute time, about the objects bound to its variables; both ends are in."""

    shape: Shape
    bound: Bound
    start_us: int
    end_us: int


@dataclass(frozen=True, slots=True, eq=False)
class Expected:
    """A template to be asked in the next state."""

    following: Following
    bound: Bound


@dataclass(frozen=True, slots=True, eq=False)
class Guarded:
    """What is left about one member of a sort, as long as it stays one."""

    sort: str
    member: str
    inner: Residual


@dataclass(frozen=True, slots=True, eq=False)
class Junction:
    """All of the parts, or at least one; never directly inside a junction of its own kind."""

    is_conjunction: bool
    parts: tuple[Residual, ...]


Residual: TypeAlias = Known | Waiting | Expected | Guarded | Junction


def every_residual(residual: Residual) -> list[Residual]:
    """Give a residual and all inside it, outer ones first."""
    found = [residual]
    for one in found:  # grows meanwhile
        if type(one) is Junction:
            found += one.parts
        elif type(one) is Guarded:
            found.append(one.inner)
    return found


def windows_in(residual: Residual) -> list[Waiting]:
    """Give the windows of a residual."""
    return [one for one in every_residual(residual) if type(one) is Waiting]


def size_of_residual(residual: Residual) -> int:
    """Count the nodes of a residual as a tree, the bodies of its operators included."""
    match residual:
        case Waiting(shape):
            return 1 + size_of(shape.body) + (size_of(shape.other) if shape.other is not None else 0)
        case Expected(following):
            return size_of(following)
        case Guarded(inner=inner):
            return 1 + size_of_residual(inner)
        case Junction(parts=parts):
            return 1 + sum(map(size_of_residual, parts))
        case _:
            return 1


def is_timeless(residual: Residual) -> bool:
    """Tell whether no deadline and no start is set in a residual, so that it waits for states and not for time."""
    for one in every_residual(residual):
        if type(one) is Expected or (type(one) is Waiting and (one.start_us != STARTED_US or one.end_us != NEVER_US)):
            return False
    return True


def next_end_us(residual: Residual) -> int:
    """Give the earliest end of a window in a residual; `NEVER_US` where no window has one."""
    return min([one.end_us for one in windows_in(residual)], default=NEVER_US)


Implied: TypeAlias = dict["tuple[Residual, Residual]", bool]
"""What was found out about pairs of which one is a junction: inside each other they meet again and again."""


def implies(one: Residual, other: Residual, known: Implied) -> bool:
    """Tell whether `other` is at least as true as `one`, whatever comes; False where the form does not show it.

    Windows of one shape about the same objects are compared by inclusion: what holds everywhere in a window holds
    everywhere in a part of it, and what holds somewhere in a part holds somewhere in the whole.

    Parameters
    ----------
    known : remembers what is found out.
    """
    if one is other or one is FALSE or other is TRUE:
        return True
    if isinstance(one, Junction) or isinstance(other, Junction):
        pair = (one, other)
        found = known.get(pair)
        if found is None:
            found = known[pair] = _implies_with_junction(one, other, known)
        return found
    if isinstance(one, Waiting) and isinstance(other, Waiting):
        if one.shape is not other.shape or one.bound != other.bound:
            return False
        wide, narrow = (one, other) if one.shape.is_universal else (other, one)
        return wide.start_us <= narrow.start_us and narrow.end_us <= wide.end_us
    if isinstance(one, Guarded) and isinstance(other, Guarded):
        return one.member == other.member and one.sort == other.sort and implies(one.inner, other.inner, known)
    return False


def _implies_with_junction(one: Residual, other: Residual, known: Implied) -> bool:
    if isinstance(one, Junction) and not one.is_conjunction:
        return all(implies(part, other, known) for part in one.parts)
    if isinstance(other, Junction) and other.is_conjunction:
        return all(implies(one, part, known) for part in other.parts)
    if isinstance(one, Junction) and any(implies(part, other, known) for part in one.parts):
        return True
    return isinstance(other, Junction) and any(implies(one, part, known) for part in other.parts)


class Moment:
    """One state at one time.

    Attributes
    ----------
    memo : residuals of what was asked or progressed in this state.
    """

    __slots__ = ("_members", "memo", "state", "t_us")

    def __init__(self, t_us: int, state: State) -> None:
        self.t_us = t_us
        self.state = state
        self.memo: dict[object, Residual] = {}
        self._members: dict[str, frozenset[str]] | None = None  # made when needed: most formulas name no sort

    def has_member(self, sort: str, member: str) -> bool:
        """Tell whether an object is a member of a sort in this state."""
        if self._members is None:
            self._members = {}
        if sort not in self._members:
            self._members[sort] = frozenset(self.state.members(sort))
        return member in self._members[sort]
