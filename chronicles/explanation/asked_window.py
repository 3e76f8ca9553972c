"""Which instances does a time window ask for?

Those that overlap it; all of their events count, also those outside.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

from chronicles.compilation.network import UNBOUNDED_US
from chronicles.compilation.plan import Plan
from chronicles.explanation.assignments import Assignment, AssignmentSearch, Budget, Distances, Values
from chronicles.explanation.event_log import EventLog

WHOLE_LOG = -UNBOUNDED_US, UNBOUNDED_US

# An instance with a broken bound is longer than the chronicle allows; within a window it is looked for up to so much.
_STRETCH = 2


@dataclass(frozen=True, slots=True)
class AskedWindow:
    """A window [start, end) of time; None is open."""

    start_us: int | None
    end_us: int | None

    @property
    def bounds(self) -> tuple[int, int]:
        """The two ends, far out where they are open."""
        first, last = WHOLE_LOG
        return first if self.start_us is None else self.start_us, last if self.end_us is None else self.end_us

    def asks_for(self, times: Iterable[int | None]) -> bool:
        """Say whether what reaches over these times overlaps the window; nothing at all does.

        Examples
        --------
        >>> window = AskedWindow(10, 20)
        >>> window.asks_for([5, None, 10]), window.asks_for([5, 30]), window.asks_for([20]), window.asks_for([None])
        (True, True, False, True)
        """
        known = [t_us for t_us in times if t_us is not None]
        start_us, end_us = self.bounds
        return not known or (min(known) < end_us and max(known) >= start_us)


class WindowedSearch(AssignmentSearch):
    """Searches the choices of events that a window asks for.

    Parameters
    ----------
    plan, log, fixed : as for `AssignmentSearch`.
    asked : the window; unless it is open at both ends, instances up to twice as long as the chronicle allows are found.
    """

    def __init__(self, plan: Plan, log: EventLog, fixed: Values, asked: AskedWindow) -> None:
        start_us, end_us = asked.bounds
        self._asked = asked
        self._longest_us = _STRETCH * max(max(row) for row in plan.distance_us)
        super().__init__(plan, log, fixed, (start_us - self._longest_us, end_us + self._longest_us))

    def assignments(
        self, distance_us: Distances, members: Sequence[int], budget: Budget, *, may_equal: bool = False
    ) -> Iterator[Assignment]:
        """Give every choice of different events, as `AssignmentSearch` does, that the window asks for."""
        found = super().assignments(distance_us, members, budget, may_equal=may_equal)
        return found if self._asked == AskedWindow(None, None) else filter(self._is_asked_for, found)

    def _is_asked_for(self, assignment: Assignment) -> bool:
        times = [t_us for t_us in assignment.times if t_us is not None]
        return self._asked.asks_for(times) and (not times or max(times) - min(times) <= self._longest_us)
