"""Where does the interval of an obligation lie in an instance, and what does it cost if it is not met?"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from chronicles.compilation.plan import Anchor
from chronicles.explanation.explanations import ObligationReading, Shift
from chronicles.explanation.search.chronicle_text import ChronicleText

# Statements not met, those among them that no time would mend, and by how much time the others miss.
Cost = tuple[int, int, int]
NO_COST: Cost = (0, 0, 0)
ANY_COST: Cost = (1_000_000, 0, 0)
Times = Sequence[int | None]
Window = tuple[int, int]


@dataclass(frozen=True, slots=True)
class Place:
    """Where a statement stands, and whether both ends of its interval hang on one time point."""

    line: int
    is_one_point: bool

    @classmethod
    def of(cls, statement: str, text: ChronicleText) -> Place:
        """Find a statement by its canonical text."""
        place = text.place_of(statement)
        return cls(text.line_of(place), text.is_about_one_point(place))


def add(left: Cost, right: Cost) -> Cost:
    """Add two costs."""
    return left[0] + right[0], left[1] + right[1], left[2] + right[2]


def cost_of(one: ObligationReading) -> Cost:
    """Give what an obligation adds to the distance."""
    if one.outcome == "met":
        return NO_COST
    return (1, 0, abs(one.shifts[0].by_us)) if one.shifts else (1, 1, 0)


def window_of(start: Anchor, end: Anchor, times: Times) -> Window | None:
    """Give an interval, None if it hangs on a missing event."""
    start_us, end_us = times[start.position], times[end.position]
    if start_us is None or end_us is None:
        return None
    return start_us + start.offset_us, end_us + end.offset_us


def least(slacks: Iterable[int | None]) -> int | None:
    """Give the least slack; None is one without a limit."""
    return min((slack for slack in slacks if slack is not None), default=None)


def smallest_first(shifts: Iterable[Shift]) -> tuple[Shift, ...]:
    """Sort moves by their size."""
    return tuple(sorted(shifts, key=lambda one: (abs(one.by_us), one.side)))
