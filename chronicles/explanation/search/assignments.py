"""Which choices of events fit some positions of a chronicle, under given bounds on their times?

A depth-first join over indexes by value and time: an event is only looked at where it has the values that the events
chosen before ask for and lies in the window that their times leave. A question about a window of time asks for the
instances that overlap it; all of their events count, also those outside.
"""

from bisect import bisect_left, bisect_right
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

from chronicles.compilation.plan import Plan
from chronicles.compilation.times.network import UNBOUNDED_US
from chronicles.events import Event, by_time
from chronicles.execution.event_tests import event_matcher
from chronicles.explanation.search.event_log import EventLog

Distances = Sequence[Sequence[int]]
Values = tuple[str | None, ...]


@dataclass(frozen=True, slots=True)
class Row:
    """An event that passes the test of a position; `values` are those of the position's variables."""

    t_us: int
    number: int
    values: tuple[str, ...]
    event: Event


@dataclass(frozen=True, slots=True)
class Assignment:
    """An event for each position, None where it is missing, and the values of all slots, None where not known."""

    rows: tuple[Row | None, ...]
    values: Values

    @property
    def times(self) -> tuple[int | None, ...]:
        """Times of the positions."""
        return tuple([None if row is None else row.t_us for row in self.rows])

    @property
    def numbers(self) -> frozenset[int]:
        """Which events were chosen."""
        return frozenset([row.number for row in self.rows if row is not None])


@dataclass(slots=True)
class Budget:
    """How many events a search may still look at; where none are left it had to stop early."""

    left: int


class PositionRows:
    """The events that pass the test of one position, by the values of some of its variables."""

    def __init__(self, plan: Plan, position: int, log: EventLog, window: tuple[int, int]) -> None:
        test = plan.positions[position].test
        self.slots = tuple(slot for _, slot in test.variables)
        matcher = event_matcher(test, [field for field, _ in test.variables])
        self.rows: list[Row] = []
        for number, event in log.within(test.name, *window):
            values = matcher(event)
            if values is not None:
                self.rows.append(Row(event.t_us, number, values, event))
        self._indexes: dict[tuple[int, ...], dict[tuple[str, ...], list[Row]]] = {}

    def having(self, values: Values) -> list[Row]:
        """Give the rows that agree with the known values, in the order of time."""
        places = tuple([place for place, slot in enumerate(self.slots) if values[slot] is not None])
        if not places:
            return self.rows
        index = self._indexes.get(places)
        if index is None:
            index = self._indexes[places] = {}
            for row in self.rows:
                index.setdefault(tuple([row.values[place] for place in places]), []).append(row)
        return index.get(tuple([values[self.slots[place]] or "" for place in places]), [])


class AssignmentSearch:
    """Searches the events of one log for the positions of one plan.

    Parameters
    ----------
    plan : gives positions and slots.
    log : where to look.
    fixed : values of slots that are given.
    window : [start, end) of the times to look at.
    """

    def __init__(self, plan: Plan, log: EventLog, fixed: Values, window: tuple[int, int]) -> None:
        self._plan = plan
        self._fixed = fixed
        self.rows = [PositionRows(plan, position, log, window) for position in range(len(plan.positions))]

    def assignments(
        self, distance_us: Distances, members: Sequence[int], budget: Budget, *, may_equal: bool = False
    ) -> Iterator[Assignment]:
        """Give every choice of different events for the positions in `members`.

        Parameters
        ----------
        distance_us : as in `Plan.distance_us`; must be a minimal network.
        members : the positions to fill.
        budget : how many events may be looked at; the search ends when it is spent.
        may_equal : whether variables of different events may have equal values even if they must differ.
        """
        order = self._order(members)

        def extended(assignment: Assignment, depth: int) -> Iterator[Assignment]:
            """Fill the positions that come from `depth` on."""
            if depth == len(order):
                yield assignment
                return
            position, numbers = order[depth], assignment.numbers
            for row in self._fitting(assignment, position, distance_us):
                if budget.left <= 0:
                    return
                budget.left -= 1
                values = self._with(assignment.values, position, row)
                if row.number in numbers or (not may_equal and equal_pairs(self._plan, values)):
                    continue
                rows = (*assignment.rows[:position], row, *assignment.rows[position + 1 :])
                yield from extended(Assignment(rows, values), depth + 1)

        return extended(Assignment((None,) * len(self.rows), self._fixed), 0)

    def window(self, assignment: Assignment, position: int, distance_us: Distances) -> tuple[int, int] | None:
        """Give the closed window that the chosen events leave for a position, None if there is no chosen event."""
        chosen = [(other, row.t_us) for other, row in enumerate(assignment.rows) if row is not None]
        if not chosen:
            return None
        earliest_us = max([t_us - distance_us[position][other] for other, t_us in chosen])
        latest_us = min([t_us + distance_us[other][position] for other, t_us in chosen])
        return earliest_us, latest_us

    def _order(self, members: Sequence[int]) -> list[int]:
        """Put positions into an order in which each shares as many values as it can with those before."""
        known = {slot for slot, value in enumerate(self._fixed) if value is not None}
        left, order = list(members), list[int]()
        while left:
            best = min(left, key=lambda one: (-len(known & set(self.rows[one].slots)), len(self.rows[one].rows), one))
            left.remove(best)
            order.append(best)
            known |= set(self.rows[best].slots)
        return order

    def _fitting(self, assignment: Assignment, position: int, distance_us: Distances) -> Sequence[Row]:
        rows = self.rows[position].having(assignment.values)
        window = self.window(assignment, position, distance_us)
        return rows if window is None else rows_within(rows, window)

    def _with(self, values: Values, position: int, row: Row) -> Values:
        slots = self.rows[position].slots
        if all(values[slot] is not None for slot in slots):
            return values
        extended = list(values)
        for slot, value in zip(slots, row.values, strict=True):
            extended[slot] = value
        return tuple(extended)


def rows_within(rows: Sequence[Row], window: tuple[int, int]) -> Sequence[Row]:
    """Give the rows, sorted by time, that lie in a closed window."""
    return rows[bisect_left(rows, window[0], key=by_time) : bisect_right(rows, window[1], key=by_time)]


def equal_pairs(plan: Plan, values: Values) -> list[tuple[int, int]]:
    """List the slots that must differ and have equal values."""
    return [(one, two) for one, two in plan.different if values[one] is not None and values[one] == values[two]]


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
