"""Which states fail an operator, if these states fail what is inside it? Sets of states, as runs of state numbers.

A formula *fails* at a state if it is false there whatever may still come. Negation stands at tests only (see
`dyknow.mtl.progression.templates`), so what fails at a state follows from what fails inside: all operators are
monotone, and no value but "fails" and "does not fail yet" is needed. Since a window belongs to the state where it is
asked, nothing has to be rewritten when states come: a set is a function of the sets inside it and of the times.

A universal operator fails where a failing state lies in the window; an existential one where the window is over and has
only failing states. Both are a shift of the ends of runs, found by bisection. What is special about states, against an
axis of real time, are windows with no state in them: they fail nothing, or everything (`_without_states`).
"""

from bisect import bisect_left, bisect_right
from dataclasses import dataclass
from typing import TypeAlias

Runs: TypeAlias = "list[tuple[int, int]]"
"""States in order, the first and the last one of each run; between two runs lies at least one other state."""


@dataclass(slots=True)
class Horizon:
    """The states that can still matter, and how far time is known.

    Attributes
    ----------
    times_us : when the states were; runs are of places in this list.
    first : the first state that is asked for.
    last : the last state there is.
    known_us : no state up to this time comes any more.
    widest_us : no two of the states in succession are further apart.
    due_us : as long as every test goes on as in the last state, no earlier state fails anew before this time.
    """

    times_us: list[int]
    first: int
    last: int
    known_us: int
    widest_us: int
    due_us: int

    def wait_until(self, t_us: int) -> None:
        """Something may fail at a time though no test changes."""
        self.due_us = min(self.due_us, t_us)

    def wait_for(self, state: int, end_us: int) -> None:
        """A state may fail when its window is over; it may be the next one to come."""
        self.wait_until((self.times_us[state] if state <= self.last else self.known_us + 1) + end_us)


def everywhere(body: Runs, start_us: int, end_us: int, horizon: Horizon) -> Runs:
    """Give the states with a failing one in their window, ``[start_us, end_us]`` from them on."""
    times_us, first = horizon.times_us, horizon.first
    found: Runs = []
    for begin, end in body:
        before = max(first, bisect_left(times_us, times_us[begin] - end_us, 0, begin))
        _add(found, before, end if start_us == 0 else bisect_right(times_us, times_us[end] - start_us, 0, end) - 1)
    if start_us > 0:
        if body and body[-1][1] == horizon.last:
            horizon.wait_until(horizon.known_us + 1)
        if horizon.widest_us > end_us - start_us:
            return _without(found, _without_states(start_us, end_us, horizon))
    return found


def somewhere(body: Runs, start_us: int, end_us: int, horizon: Horizon) -> Runs:
    """Give the states whose window is over, with failing states only."""
    times_us, first, last, known_us = horizon.times_us, horizon.first, horizon.last, horizon.known_us
    found: Runs = []
    for begin, end in body:
        after = (
            first if begin <= first else max(first, bisect_right(times_us, times_us[begin - 1] - start_us, 0, begin))
        )
        if end < last:
            _add(found, after, bisect_left(times_us, times_us[end + 1] - end_us, 0, end + 1) - 1)
        else:
            over = bisect_right(times_us, known_us - end_us, 0, last + 1)
            _add(found, after, over - 1)
            horizon.wait_for(max(after, over), end_us)
    if start_us > 0:
        # Its window has no state yet: if none comes, it fails.
        horizon.wait_for(bisect_right(times_us, max(times_us[last] - start_us, known_us - end_us), 0, last + 1), end_us)
        if horizon.widest_us > end_us - start_us or known_us > times_us[last]:
            return union(found, _without_states(start_us, end_us, horizon))
    return found


def everywhere_up_to(body: Runs, other: Runs, start_us: int, end_us: int, horizon: Horizon) -> Runs:
    """Give the states with a failing one in their window, before which `other` fails at all states from them on."""
    found = list(body) if start_us == 0 else []
    for begin, end in other:
        reach = [(max(one, begin), min(last, end + 1)) for one, last in body if one <= end + 1 and last >= begin]
        found = union(found, _between(everywhere(reach, start_us, end_us, horizon), begin, end))
    return found


def somewhere_until(body: Runs, other: Runs, start_us: int, end_us: int, horizon: Horizon) -> Runs:
    """Give the states that fail `somewhere`, or from which only failing ones come until `other` fails too."""
    found = somewhere(body, start_us, end_us, horizon)
    times_us, before = horizon.times_us, horizon.first
    for begin, end in other:
        cut = intersection([(begin, end)], body) if start_us == 0 else [(begin, end)]
        inside = next((run for run in body if run[0] <= begin <= run[1]), None)
        after = begin  # the first of the states before `begin` that ask for no state that does not fail
        if inside is not None and inside[0] <= before:
            after = before
        elif inside is not None:
            after = bisect_right(times_us, times_us[inside[0] - 1] - start_us, 0, begin)
        if start_us > 0:
            after = min(after, bisect_right(times_us, times_us[begin] - start_us, 0, begin))
        after = max(after, before)
        found = union(found, union([(after, begin - 1)] if after < begin else [], cut))
        before = end + 1
    return found


def union(one: Runs, other: Runs) -> Runs:
    """Give the states of either set.

    Examples
    --------
    >>> union([(0, 1), (5, 6)], [(2, 2), (8, 9)])
    [(0, 2), (5, 6), (8, 9)]
    """
    if not one or not other:
        return one or other
    found: Runs = []
    for begin, end in sorted(one + other):
        if found and begin <= found[-1][1] + 1:
            found[-1] = (found[-1][0], max(found[-1][1], end))
        else:
            found.append((begin, end))
    return found


def intersection(one: Runs, other: Runs) -> Runs:
    """Give the states of both sets.

    Examples
    --------
    >>> intersection([(0, 4), (6, 9)], [(3, 7)])
    [(3, 4), (6, 7)]
    """
    found: Runs = []
    k = m = 0
    while k < len(one) and m < len(other):
        begin, end = max(one[k][0], other[m][0]), min(one[k][1], other[m][1])
        if begin <= end:
            found.append((begin, end))
        if one[k][1] < other[m][1]:
            k += 1
        else:
            m += 1
    return found


def _add(runs: Runs, begin: int, end: int) -> None:
    """Add a run that neither begins nor ends before the last one does."""
    if begin > end:
        return
    if runs and begin <= runs[-1][1] + 1:
        runs[-1] = (runs[-1][0], end)
    else:
        runs.append((begin, end))


def _between(runs: Runs, begin: int, end: int) -> Runs:
    return intersection(runs, [(begin, end)])


def _without(runs: Runs, others: Runs) -> Runs:
    for begin, end in others:
        runs = _between(runs, 0, begin - 1) + _between(runs, end + 1, runs[-1][1]) if runs else []
    return runs


def _without_states(start_us: int, end_us: int, horizon: Horizon) -> Runs:
    """Give the states whose window is over and has no state, which takes a gap longer than the window."""
    times_us, last = horizon.times_us, horizon.last
    found: Runs = []
    for k in range(horizon.first, last + 1):
        next_us = times_us[k + 1] if k < last else horizon.known_us + 1
        if next_us - times_us[k] > end_us - start_us:
            begin = max(horizon.first, bisect_right(times_us, times_us[k] - start_us, 0, last + 1))
            _add(found, begin, bisect_left(times_us, next_us - end_us, 0, last + 1) - 1)
    return found
