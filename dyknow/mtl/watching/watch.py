"""What do the states so far say about a formula? The same as progression says, at a cost that depends on what changes.

Progression keeps what is left of a formula, and that grows where windows lie inside each other and values flicker: one
obligation for each of many states. A watch keeps when the tests of the formula changed, and works out from that, with
a few bisections for each operator, which states fail. It does so only if a test has changed, or when a window ends
that could make a difference; otherwise a state costs the tests.
"""

from __future__ import annotations

from bisect import bisect_right
from itertools import pairwise

from dyknow.mtl.progression.state_test import Bound
from dyknow.mtl.progression.states import State, Verdict
from dyknow.mtl.progression.templates import NEVER_US
from dyknow.mtl.watching.failures import Horizon, Runs
from dyknow.mtl.watching.plan import Plan, Side

_KEPT_IN_VAIN = 64


class Watching:
    """Makes the watches of one formula, which see the same states.

    Parameters
    ----------
    plan : of the formula.

    Examples
    --------
    >>> from dyknow.mtl.parser import parse_formula
    >>> from dyknow.mtl.progression.states import DictState
    >>> from dyknow.mtl.watching.plan import plan_of
    >>> text = "always (stopped[?c] implies eventually[0s, 1s] not stopped[?c])"
    >>> watch = Watching(plan_of(parse_formula(text, variables=["c"]), ("c",))).watch(("car7",))
    >>> stopped = DictState({("stopped", ("car7",)): True})
    >>> [watch.progress(t_us, stopped).value for t_us in range(0, 2_000_000, 500_000)]
    ['unknown', 'unknown', 'false', 'false']
    """

    def __init__(self, plan: Plan) -> None:
        self.plan = plan
        self.times_us: list[int] = []  # of the states that can still matter, and a few before them
        self.number = -1  # of the last state
        self.t_us = -NEVER_US  # of the last state
        self.decided_us = -NEVER_US  # in the state before the last one, all was decided up to this time
        self.widest_us = 0

    def watch(self, bound: Bound) -> Watch:
        """Begin to watch, with the next state, the formula about some objects."""
        return Watch(self, bound)

    def take(self, t_us: int) -> None:
        """Count a state; whichever watch sees it first does so."""
        self.decided_us = self.t_us - self.plan.horizon_us
        if self.times_us:
            self.widest_us = max(self.widest_us, t_us - self.t_us)
        self.times_us.append(t_us)
        self.t_us, self.number = t_us, self.number + 1
        old = bisect_right(self.times_us, self.decided_us) - 1
        if old > _KEPT_IN_VAIN + len(self.times_us) // 2:
            del self.times_us[:old]
            self.widest_us = max((after - before for before, after in pairwise(self.times_us)), default=0)


class Watch:
    """Watches a formula about some objects from the first state that it sees.

    Attributes
    ----------
    is_final : whether no state can change the verdict; an unknown one can be final where values were missing.
    """

    __slots__ = ("_bound", "_changes", "_due_us", "_number", "_since", "_since_us", "_values", "_watching", "is_final")

    def __init__(self, watching: Watching, bound: Bound) -> None:
        self._watching = watching
        self._bound = bound
        self._values: tuple[bool | None, ...] | None = None
        self._changes: list[list[int]] = [[] for _ in watching.plan.tests]  # from failing to not failing, and back
        self._number = self._since = -1
        self._since_us = 0
        self._due_us = NEVER_US
        self.is_final = False

    def progress(self, t_us: int, state: State) -> Verdict:
        """Take the next state and say what is known.

        Parameters
        ----------
        t_us : later than that of the state before, and than what was promised.
        """
        watching, bound = self._watching, self._bound
        if t_us != watching.t_us:
            watching.take(t_us)
        self._number = watching.number
        values = tuple([test(state, bound) for test in watching.plan.tests])
        if values == self._values and t_us < self._due_us:
            return Verdict.UNKNOWN
        self._note(values)
        return self._look(t_us)

    def advance(self, t_us: int) -> Verdict:
        """Let time pass: no state comes before `t_us`, so windows that end before it are over."""
        if self._since < 0 or t_us <= self._due_us or self.is_final:
            return Verdict.UNKNOWN
        return self._look(t_us - 1)

    def _note(self, values: tuple[bool | None, ...]) -> None:
        if self._values is None:
            self._since, self._since_us = self._number, self._watching.t_us
        self._values = values
        for changes, value in zip(self._changes, values, strict=True):
            if (value is False) != len(changes) % 2:
                changes.append(self._number)

    def _look(self, known_us: int) -> Verdict:
        """Work out what fails."""
        watching, plan = self._watching, self._watching.plan
        times_us, dropped = watching.times_us, watching.number + 1 - len(watching.times_us)
        last = self._number - dropped
        if last < len(times_us) - 1:
            times_us = times_us[: last + 1]  # others have seen one more
        first = max(self._since - dropped, bisect_right(times_us, watching.decided_us))
        if first > last:  # after a gap
            self._due_us = known_us + 1
            return Verdict.UNKNOWN
        horizon = Horizon(times_us, first, last, known_us, watching.widest_us, NEVER_US)
        tests = [self._failing(changes, first + dropped, dropped) for changes in self._changes]
        for side in plan.sides:
            if self._fails(side, tests, self._since - dropped, horizon):
                return side.verdict
        self._due_us = horizon.due_us
        if plan.ends:
            self.is_final = known_us >= self._since_us + plan.horizon_us
            self._due_us = min(self._due_us, self._since_us + plan.horizon_us)
        return Verdict.UNKNOWN

    def _failing(self, changes: list[int], first: int, dropped: int) -> Runs:
        """Give the states that fail a test, and forget those before the first that matters."""
        while len(changes) > 1 and changes[1] <= first:
            del changes[:2]
        ends = [*changes, self._number + 1] if len(changes) % 2 else changes
        return [
            (max(begin, first) - dropped, end - 1 - dropped) for begin, end in zip(ends[::2], ends[1::2], strict=True)
        ]

    def _fails(self, side: Side, tests: list[Runs], since: int, horizon: Horizon) -> bool:
        sets = list(tests)
        for combine, inside in side.steps:
            sets.append(combine(*[sets[place] for place in inside], horizon=horizon))
        failing = sets[-1]
        if side.from_us is None:
            return bool(failing) and failing[0][0] <= since
        if not failing:
            return False
        counts_us = self._since_us + side.from_us
        horizon.wait_until(counts_us)
        return horizon.times_us[failing[-1][1]] >= counts_us
