"""How is it found out whether a formula fails? Steps over sets of states, one for each operator and junction in it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial, reduce
from typing import TypeAlias

from dyknow.mtl.formula import Formula, Not
from dyknow.mtl.progression.state_test import StateTest
from dyknow.mtl.progression.states import Verdict
from dyknow.mtl.progression.templates import (
    NEVER_US,
    Following,
    ForEach,
    Joined,
    Operator,
    Template,
    TemplateMaker,
    Test,
    every,
    operands,
)
from dyknow.mtl.structure import horizon_us
from dyknow.mtl.watching import failures
from dyknow.mtl.watching.failures import Horizon, Runs

Step: TypeAlias = "tuple[Callable[..., Runs], tuple[int, ...]]"
"""What works out a set, called with sets that are known by then and a `Horizon`; and where those stand."""


@dataclass(frozen=True, slots=True)
class Side:
    """One verdict of a formula, and where it comes from.

    Attributes
    ----------
    verdict : false if the formula fails, true if its negation does.
    steps : after the sets of the tests, the set of each step; that of the last one decides.
    from_us : None if it decides at the first state; else at any state that is at least so long after it.
    """

    verdict: Verdict
    steps: tuple[Step, ...]
    from_us: int | None


@dataclass(frozen=True, slots=True)
class Plan:
    """What to look at in every state, and what to work out of it.

    Attributes
    ----------
    tests : a state fails one if it is false there.
    horizon_us : how long after a state it is decided what fails there.
    ends : whether all is decided so long after the first state.
    """

    tests: tuple[StateTest, ...]
    sides: tuple[Side, ...]
    horizon_us: int
    ends: bool


def plan_of(formula: Formula, variables: tuple[str, ...]) -> Plan | None:
    """Make the plan of a formula.

    Parameters
    ----------
    variables : those that are free in the formula, in the order in which objects are given for them.

    Returns
    -------
    None where a state may stay undecided for ever (windows without an end, but for an outermost `always` or
    `eventually`), and for `next` and quantifiers that reach beyond a state: such a formula has to be progressed.

    Examples
    --------
    >>> from dyknow.mtl.parser import parse_formula
    >>> plan_of(parse_formula("always (p implies eventually[0s, 10s] not p)"), ()).horizon_us
    10000000
    >>> plan_of(parse_formula("always (p implies eventually not p)"), ()) is None
    True
    """
    maker = TemplateMaker()
    asked = {
        Verdict.FALSE: _asked_of(maker.make(formula, variables)),
        Verdict.TRUE: _asked_of(maker.make(Not(formula), variables)),
    }
    inside = [one for ask in asked.values() if ask is not None for one in every(ask[0])]
    if not all(map(_is_decided, inside)):
        return None
    tests = dict.fromkeys(one for one in inside if isinstance(one, Test))
    places: dict[Template, int] = {test: place for place, test in enumerate(tests)}
    sides = tuple(Side(verdict, _steps_of(ask[0], places), ask[1]) for verdict, ask in asked.items() if ask is not None)
    ends = all(side.from_us is None for side in sides)
    return Plan(tuple(one.holds for one in tests), sides, horizon_us(formula), ends)


def _asked_of(root: Template) -> tuple[Template, int | None] | None:
    """Give what is asked of the first state, or of all from some time on; None for what can fail only at the end."""
    if not (isinstance(root, Operator) and root.end_us == NEVER_US and root.shape.other is None):
        return root, None
    return (root.shape.body, root.start_us) if root.shape.is_universal else None


def _is_decided(one: Template) -> bool:
    """Tell whether some time after a state it is known whether it fails there."""
    return not isinstance(one, Following | ForEach) and not (isinstance(one, Operator) and one.end_us == NEVER_US)


def _steps_of(root: Template, tests: dict[Template, int]) -> tuple[Step, ...]:
    places = dict(tests)
    steps: list[Step] = []

    def place_of(one: Template) -> int:
        """Put the steps of what is inside before those of what is around it, and each once."""
        if one not in places:
            inside = tuple(map(place_of, operands(one)))
            places[one] = len(tests) + len(steps)
            steps.append((_combination(one), inside))
        return places[one]

    last = place_of(root)
    if not steps or last != len(tests) + len(steps) - 1:
        steps.append((_same, (last,)))
    return tuple(steps)


def _combination(one: Template) -> Callable[..., Runs]:
    if isinstance(one, Joined):
        return partial(_joined, failures.union if one.is_conjunction else failures.intersection)
    assert isinstance(one, Operator)
    if one.shape.other is None:
        combine: Callable[..., Runs] = failures.everywhere if one.shape.is_universal else failures.somewhere
    else:
        combine = failures.everywhere_up_to if one.shape.is_universal else failures.somewhere_until
    return partial(combine, start_us=one.start_us, end_us=one.end_us)


def _joined(combine: Callable[[Runs, Runs], Runs], *sets: Runs, horizon: Horizon) -> Runs:
    return reduce(combine, sets)


def _same(states: Runs, *, horizon: Horizon) -> Runs:
    return states
