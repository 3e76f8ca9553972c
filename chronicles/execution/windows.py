"""Which bounds make up the window of an event, when some others are known?"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from chronicles.compilation.plan import Plan

Bounds = tuple[tuple[int, int], ...]


@dataclass(frozen=True, slots=True)
class Window:
    """The time of an event is at least each `time of position + offset` of `lows` and at most each of `highs`."""

    lows: Bounds
    highs: Bounds


def window(plan: Plan, position: int, known: Sequence[int]) -> Window:
    """Give the bounds on a position by known ones, without those that follow from the others.

    Where the bounds by way of another known position add up to the direct one, the direct one follows: the known times
    keep the bounds between each other.
    """
    distance = plan.distance_us
    lows, highs = list(known), list(known)
    for one in known:
        if any(distance[position][via] + distance[via][one] == distance[position][one] for via in lows if via != one):
            lows.remove(one)
        if any(distance[one][via] + distance[via][position] == distance[one][position] for via in highs if via != one):
            highs.remove(one)
    return Window(
        tuple((one, -distance[position][one]) for one in lows), tuple((one, distance[one][position]) for one in highs)
    )


def joined_slots(plan: Plan, position: int, known: Sequence[int]) -> tuple[int, ...]:
    """Give the variables that a position shares with known ones, in the order of its fields."""
    bound = {slot for one in known for _, slot in plan.positions[one].test.variables}
    return tuple(slot for _, slot in plan.positions[position].test.variables if slot in bound)


def fresh_differences(plan: Plan, position: int, known: Sequence[int]) -> tuple[tuple[int, int], ...]:
    """Give the pairs of variables that must differ and are both known only once the position is."""
    bound = {slot for one in known for _, slot in plan.positions[one].test.variables}
    together = bound | {slot for _, slot in plan.positions[position].test.variables}
    return tuple(pair for pair in plan.different if together.issuperset(pair) and not bound.issuperset(pair))


def rivals(plan: Plan, position: int, known: Sequence[int]) -> tuple[int, ...]:
    """Give the known positions that could have taken the very same event."""
    kinds = [(one.test.name, one.test.arity, one.test.is_change) for one in plan.positions]
    return tuple(one for one in known if kinds[one] == kinds[position])
