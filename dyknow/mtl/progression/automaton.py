"""Which residual follows, without working it out again? A lazy automaton over residuals relative to now.

Where states come at a steady pace, the same residuals come again, seen from the time of the last state. The automaton
remembers for each of them where a valuation of the tests and a time step lead. It grows while it runs, up to a cap:
deadlines at fine steps, or irregular time stamps, have too many residuals, and then plain progression goes on.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TypeAlias

from dyknow.mtl.progression.residual import (
    STARTED_US,
    Expected,
    Guarded,
    Junction,
    Known,
    Residual,
    Waiting,
    is_timeless,
    next_end_us,
    size_of_residual,
)
from dyknow.mtl.progression.state_test import Bound, StateTest
from dyknow.mtl.progression.states import State, Verdict
from dyknow.mtl.progression.table import FormulaTable
from dyknow.mtl.progression.templates import NEVER_US, Following, ForEach, Shape, Template, Test, every

Values: TypeAlias = "bool | tuple[bool | None, ...] | None"
Step: TypeAlias = "tuple[int | None, Values]"

_MOST_TESTS = 12
_MOST_PLACES = 1_000
_MOST_EDGES = 10_000
_MOST_STEPS = 16


@dataclass(frozen=True, slots=True)
class _Window:
    """A waiting shape: start and end from the last state; None for a window that is open, or has no end."""

    shape: Shape
    start_us: int | None
    end_us: int | None


@dataclass(frozen=True, slots=True)
class _Joined:
    is_conjunction: bool
    parts: frozenset[Relative]
    in_order: tuple[Relative, ...] = field(compare=False)  # a set alone would be gone through in another order each run


Relative: TypeAlias = Known | Following | _Window | _Joined
"""A residual with its times counted from the last state, and without the objects that it is about."""


class Place:
    """A state of the automaton: a residual relative to the time of the last state.

    Attributes
    ----------
    edges : the place that follows, by time step (None for the first state) and values of the tests.
    verdict, size, is_timeless : of the residual.
    next_end_us : from the last state to the earliest end of a window; `NEVER_US` or nearly so where none ends.
    """

    __slots__ = ("edges", "is_timeless", "next_end_us", "relative", "size", "verdict")

    def __init__(self, relative: Relative, residual: Residual, t_us: int) -> None:
        self.next_end_us = next_end_us(residual) - t_us
        self.relative = relative
        self.edges: dict[Step, Place] = {}
        self.verdict = verdict_of(residual)
        self.size = size_of_residual(residual)
        self.is_timeless = is_timeless(residual)


class Automaton:
    """Remembers which place follows which; all progressors of one formula share it.

    Parameters
    ----------
    tests : what is looked at in each state.

    Attributes
    ----------
    values : runs the tests in a state.
    start : edges of the first state.
    is_full : whether no edge is added any more.
    """

    __slots__ = ("_edges", "_places", "_steps", "is_full", "start", "values")

    def __init__(self, tests: tuple[StateTest, ...]) -> None:
        self.values: Callable[[State, Bound], Values] = tests[0] if len(tests) == 1 else _all_of(tests)
        self.start: dict[Step, Place] = {}
        self._places: dict[Relative, Place] = {}
        self._steps: set[int | None] = set()
        self._edges = 0
        self.is_full = False

    @property
    def place_count(self) -> int:
        """How many places are known."""
        return len(self._places)

    def add(self, edges: dict[Step, Place], step: Step, residual: Residual, t_us: int) -> Place | None:
        """Remember what followed; None when the automaton is full.

        Parameters
        ----------
        edges : those of the place where the step was taken.
        step : what happened.
        residual : what it left, at `t_us`.
        """
        if self.is_full:
            return None
        self._steps.add(step[0])
        self.is_full = self._edges >= _MOST_EDGES or len(self._steps) > _MOST_STEPS
        if self.is_full:
            return None
        place = self.place_of(residual, t_us)
        if place is not None:
            self._edges += 1
            edges[step] = place
        return place

    def place_of(self, residual: Residual, t_us: int) -> Place | None:
        """Give the place that stands for a residual when the last state was at `t_us`; None when there are too many."""
        relative = _relative(residual, t_us)
        place = self._places.get(relative)
        if place is None and len(self._places) < _MOST_PLACES:
            place = self._places[relative] = Place(relative, residual, t_us)
        return place


def _all_of(tests: tuple[StateTest, ...]) -> Callable[[State, Bound], Values]:
    return lambda state, bound: tuple([test(state, bound) for test in tests])


def automaton_of(template: Template) -> Automaton | None:
    """Make the empty automaton of a formula; None where it looks at too much, or at each member of a sort over time."""
    inside = dict.fromkeys(every(template))
    tests = tuple(one.holds for one in inside if isinstance(one, Test))
    if len(tests) > _MOST_TESTS or any(isinstance(one, ForEach) for one in inside):
        return None
    return Automaton(tests)


def verdict_of(residual: Residual) -> Verdict:
    """Say what is known when this residual is left."""
    if isinstance(residual, Known) and residual.value is not None:
        return Verdict.TRUE if residual.value else Verdict.FALSE
    return Verdict.UNKNOWN


def residual_at(relative: Relative, bound: Bound, t_us: int, table: FormulaTable) -> Residual:
    """Give the residual that a place stands for when the last state was at `t_us`."""
    match relative:
        case _Window(shape, start_us, end_us):
            start = STARTED_US if start_us is None else start_us + t_us
            return table.waiting(shape, bound, start, NEVER_US if end_us is None else end_us + t_us)
        case _Joined(is_conjunction, _, in_order):
            residuals = [residual_at(part, bound, t_us, table) for part in in_order]
            return table.join(residuals, is_conjunction=is_conjunction)
        case Following():
            return table.expected(relative, bound)
        case _:
            return relative


def _relative(residual: Residual, t_us: int) -> Relative:
    match residual:
        case Waiting(shape, _, start_us, end_us):
            start = None if start_us == STARTED_US else start_us - t_us
            end = None if end_us == NEVER_US else end_us - t_us
            return _Window(shape, start, end)
        case Expected(following, _):
            return following
        case Junction(is_conjunction, parts):
            in_order = tuple(_relative(part, t_us) for part in parts)
            return _Joined(is_conjunction, frozenset(in_order), in_order)
        case Known():
            return residual
        case Guarded():
            raise AssertionError(f"expected a formula without sorts over time, got {residual!r}")
