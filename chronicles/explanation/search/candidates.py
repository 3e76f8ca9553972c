"""Which instances of a chronicle came close, and how close?

Three kinds are searched, each only as far as it can still be among the nearest:

1. all events in time, but an obligation is not met;
2. all events, but one written bound is broken: for each bound the chronicle is compiled with that bound loosened, and
   searched in shells of growing distance from the bound, so that the least break is found first;
3. events missing, one, two, and so on.
"""

from bisect import insort
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from typing import Literal

import numpy as np

from chronicles.chronicle_set import load
from chronicles.compilation.plan import Persistence, Plan
from chronicles.compilation.times.network import minimise
from chronicles.errors import ChronicleError
from chronicles.events import Occurrence
from chronicles.explanation.case import Case, role_values
from chronicles.explanation.readings.intervals import ANY_COST, NO_COST, Cost, add
from chronicles.explanation.readings.obligations import ObligationReader, Readings
from chronicles.explanation.search.assignments import Assignment, AssignmentSearch, Budget, equal_pairs
from chronicles.explanation.search.chronicle_text import End, WrittenConstraint


@dataclass(frozen=True, slots=True)
class LoosenedBound:
    """A bound that may be broken: the plan of `reader` is compiled with this one bound far out."""

    constraint: WrittenConstraint
    end: End
    reader: ObligationReader

    def distance_us(self, nearer_us: int, farther_us: int) -> Sequence[Sequence[int]] | None:
        """Give the minimal network of instances that break the bound by `nearer_us` to `farther_us`.

        Returns
        -------
        None if there can be none.
        """
        plan = self.reader.plan
        points = dict(plan.points)
        later, earlier = points[self.constraint.later], points[self.constraint.earlier]
        if later.position == earlier.position:
            return None
        bound_us, sign = self.constraint.bound_us(self.end), -1 if self.end == "low" else 1
        low_us, high_us = sorted((bound_us + sign * nearer_us, bound_us + sign * farther_us))
        offset_us = earlier.offset_us - later.offset_us
        places, back = (earlier.position, later.position), (later.position, earlier.position)
        matrix = np.array(plan.distance_us, dtype=np.int64)
        matrix[places] = min(matrix[places], high_us + offset_us)
        matrix[back] = min(matrix[back], -low_us - offset_us)
        least = minimise(matrix)
        return None if least is None else least.tolist()

    def broken_by_us(self, assignment: Assignment) -> int:
        """Say by how much an instance breaks the bound."""
        value_us = self.constraint.value_us(self.reader.plan, assignment.times)
        assert value_us is not None, "all events of the instance are there"
        return abs(value_us - self.constraint.bound_us(self.end))


_UNDECIDED: Cost = (1, 1, 0)
_SHELLS = 8
_KEPT_PER_WANTED = 4
_EVENTS_LOOKED_AT = 500_000


Undecided = Literal["open", "not selected"]


@dataclass(frozen=True, slots=True)
class Candidate:
    """An instance that is not recognised: its events, its obligations as read, and what else is wrong with it.

    `reader` is of the plan it was found with: where a bound is `broken`, one in which that bound is looser. `undecided`
    says what keeps it from being recognised besides its statements.
    """

    reader: ObligationReader
    assignment: Assignment
    readings: Readings
    broken: LoosenedBound | None = None
    undecided: Undecided | None = None

    @property
    def cost(self) -> Cost:
        """The distance from success."""
        return self.readings.cost

    @property
    def order(self) -> tuple[Cost, int, tuple[int, ...], tuple[str, ...]]:
        """Nearest first, then with most events; ties by events and values, so that nothing else decides."""
        values = tuple("" if value is None else value for value in self.readings.values)
        return self.cost, -len(self.assignment.numbers), tuple(sorted(self.assignment.numbers)), values


class Ranking:
    """The nearest candidates; `limit` is the cost from which on nothing is wanted any more."""

    def __init__(self, wanted: int) -> None:
        self._kept = wanted * _KEPT_PER_WANTED
        self._found: list[Candidate] = []

    @property
    def limit(self) -> Cost:
        """What a candidate must cost less than to get in."""
        return self._found[-1].cost if len(self._found) >= self._kept else ANY_COST

    def insert(self, candidate: Candidate) -> None:
        """Take a candidate in, and drop the last if there are too many."""
        insort(self._found, candidate, key=lambda one: one.order)
        del self._found[self._kept :]

    def nearest(self) -> list[Candidate]:
        """Give the candidates, without those whose events are only a part of a nearer one's."""
        kept: list[Candidate] = []
        for one in self._found:
            if not any(one.assignment.numbers <= other.assignment.numbers for other in kept):
                kept.append(one)
        return kept


class CandidateSearch:
    """Searches one case.

    Parameters
    ----------
    case : chronicle and events.
    assignments : finds the choices of events to look at.
    recognised : what was recognised; nothing made of its events alone is told, nor the same things at the same time in
        each other's roles.
    wanted : how many candidates are wanted at least.

    Attributes
    ----------
    is_complete : false once a search was cut short.
    """

    def __init__(
        self, case: Case, assignments: AssignmentSearch, *, recognised: Sequence[Occurrence], wanted: int
    ) -> None:
        self._case = case
        self._assignments = assignments
        self._ranking = Ranking(wanted)
        used = {event for one in recognised for event in one.events}
        self._used = frozenset(number for number, event in enumerate(case.log.events) if event in used)
        self._recognised = recognised
        self.is_complete = True

    def nearest(self) -> list[Candidate]:
        """Search everything; give the nearest first."""
        for step in (self._whole, self._with_broken_bound, self._with_missing_events):
            budget = Budget(_EVENTS_LOOKED_AT)
            step(budget)
            self.is_complete = self.is_complete and budget.left > 0
        return self._ranking.nearest()

    # ---- all events in time

    def _whole(self, budget: Budget) -> None:
        plan, everything = self._case.plan, range(len(self._case.plan.positions))
        for assignment in self._assignments.assignments(plan.distance_us, everything, budget):
            self._try(assignment, base=NO_COST)
        # Pairs that stand in one event are already tested with that event.
        if all(any({*pair} <= set(rows.slots) for rows in self._assignments.rows) for pair in plan.different):
            return
        for assignment in self._assignments.assignments(plan.distance_us, everything, budget, may_equal=True):
            if count := len(equal_pairs(plan, assignment.values)):
                self._try(assignment, base=(count, count, 0))

    # ---- one bound broken

    def _with_broken_bound(self, budget: Budget) -> None:
        bounds = list(self._bounds())
        nearer_us = 0
        for farther_us in self._shells():
            if self._ranking.limit <= (1, 0, nearer_us):
                return
            for one in bounds:
                self._in_shell(budget, one, (nearer_us + 1, farther_us))
            nearer_us = farther_us

    def _in_shell(self, budget: Budget, one: LoosenedBound, shell_us: tuple[int, int]) -> None:
        distance_us = one.distance_us(*shell_us)
        if distance_us is None:
            return
        for assignment in self._assignments.assignments(distance_us, range(len(one.reader.plan.positions)), budget):
            self._try(assignment, base=(1, 0, one.broken_by_us(assignment)), broken=one)

    def _bounds(self) -> Iterator[LoosenedBound]:
        """Compile the chronicle with each bound far out; where that makes no chronicle, the bound is left alone."""
        plan, text, log = self._case.plan, self._case.text, self._case.log
        reach_us = self._shells()[-1]
        for constraint in text.constraints:
            for end in constraint.ends:
                changed = text.with_statement(constraint.place, text.loosened(constraint, end, reach_us))
                try:
                    loosened = load(changed).plan(plan.name)
                except ChronicleError:
                    continue  # a free time point hangs on this bound: loosened, nothing would fix the point
                yield LoosenedBound(constraint, end, ObligationReader(loosened, text, log))

    def _shells(self) -> list[int]:
        """Give the outer distances of the shells; the last one reaches over the whole log."""
        events = self._case.log.events
        span_us = events[-1].t_us - events[0].t_us if events else 0
        bounds_us = [one.bound_us(end) for one in self._case.text.constraints for end in one.ends]
        reach_us = span_us + sum(map(abs, bounds_us)) + 1
        return sorted({max(1, reach_us >> 2 * step) for step in range(_SHELLS)})

    # ---- events missing

    def _with_missing_events(self, budget: Budget) -> None:
        plan = self._case.plan
        places = range(len(plan.positions))
        for missing_count in range(1, len(places) + 1):
            for missing in combinations(places, missing_count):
                # What hangs on a missing event cannot be asked, so it is known beforehand what this costs at least.
                base = (missing_count, missing_count, 0)
                hanging = sum(_hangs_on(one, missing) for one in self._obligations())
                if add(base, (hanging, hanging, 0)) >= self._ranking.limit:
                    continue
                members = [place for place in places if place not in missing]
                for assignment in self._assignments.assignments(plan.distance_us, members, budget):
                    self._try(assignment, base=base)

    def _obligations(self) -> list[tuple[int, int]]:
        asked = [one for one in self._case.plan.obligations if not (isinstance(one, Persistence) and one.is_reading)]
        return [(one.start.position, one.end.position) for one in asked]

    # ---- what is common to all

    def _try(self, assignment: Assignment, *, base: Cost, broken: LoosenedBound | None = None) -> None:
        """Take an instance into the ranking, unless other events or values make a nearer one of it."""
        reader = self._case.reader if broken is None else broken.reader
        if self._used and assignment.numbers <= self._used:
            return
        undecided: Undecided | None = "open" if self._is_open(reader.plan, assignment) else None
        base = add(base, _UNDECIDED) if undecided else base
        readings = reader.best(assignment.times, assignment.values, base=base, limit=self._ranking.limit)
        if readings is None or self._is_exchanged(assignment, readings):
            return
        if readings.cost == NO_COST:
            assert reader.plan.selection.kind != "all", "what is whole and concluded was recognised"
            readings, undecided = replace(readings, cost=_UNDECIDED), "not selected"
        self._ranking.insert(Candidate(reader, assignment, readings, broken, undecided))

    def _is_exchanged(self, assignment: Assignment, readings: Readings) -> bool:
        """Say whether things that were recognised stand in each other's roles, at a time at which they were."""
        times = [t_us for t_us in assignment.times if t_us is not None]
        values = {one.name: one.value for one in role_values(self._case.plan, readings.values) if one.value}
        return any(
            min(times) <= one.end_us and one.start_us <= max(times) and is_exchange(values, one.roles)
            for one in self._recognised
            if times
        )

    def _is_open(self, plan: Plan, assignment: Assignment) -> bool:
        """Say whether the log ends before a whole instance is concluded, apart from what its obligations wait for."""
        times = [t_us for t_us in assignment.times if t_us is not None]
        if len(times) < len(plan.positions):
            return False
        ends = [one.end for one in plan.persistences if one.is_reading]
        return max([*times, *(times[end.position] + end.offset_us for end in ends)]) > self._case.log.until_us


def is_exchange(values: Mapping[str, str], recognised: Mapping[str, str]) -> bool:
    """Say whether the values of roles, as far as they are known, are recognised ones in another order.

    Examples
    --------
    >>> recognised = {"overtaker": "car7", "overtaken": "car3", "road": "main"}
    >>> is_exchange({"overtaker": "car3", "overtaken": "car7", "road": "main"}, recognised)
    True
    >>> is_exchange({"overtaker": "car3", "overtaken": "car9", "road": "main"}, recognised)
    False
    """
    moved = [value for role, value in values.items() if recognised[role] != value]
    return len(moved) > 1 and Counter(values.values()) <= Counter(recognised.values())


def _hangs_on(window: tuple[int, int], missing: Sequence[int]) -> bool:
    return window[0] in missing or window[1] in missing
