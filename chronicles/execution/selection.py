"""Which of a chronicle's occurrences are told, where its text does not ask for all?

`first` tells one for each event at the anchor; `non_overlapping` tells, for each combination of roles, occurrences that
have no time in common. Both take what comes first in the order of results. An occurrence lasts from its start up to,
without, its end, so one may start where another ends; one whose start is its end counts as that one microsecond.
"""

from __future__ import annotations

from typing import Any  # states are plain nested data

from chronicles.compilation.plan import Plan
from chronicles.events import Occurrence

_Cast = tuple[str, ...]


class Selector:
    """Selects among the occurrences of one chronicle; invariant: the selected ones that may still matter are kept."""

    def __init__(self, plan: Plan) -> None:
        self._selection = plan.selection
        self._tail_us = plan.tail_us
        self._anchors: dict[int, int] = {}  # number of the event at the anchor: how long it can come up again
        self._intervals: dict[_Cast, list[tuple[int, int]]] = {}

    def is_selected(self, occurrence: Occurrence, *, anchor: int, certain_us: int) -> bool:
        """Say whether an occurrence is told, and remember it; they come in the order of results.

        Parameters
        ----------
        occurrence : with its start, end and roles.
        anchor : the number of the event at the anchor of the selection.
        certain_us : the time at which it became certain.
        """
        if self._selection.kind == "all":
            return True
        if self._selection.kind == "first":
            is_first = anchor not in self._anchors
            if is_first:
                self._anchors[anchor] = certain_us + self._tail_us
            return is_first
        told = self._intervals.setdefault(tuple(occurrence.roles.values()), [])
        start_us, end_us = _extent(occurrence)
        is_disjoint = all(end_us <= other_start_us or other_end_us <= start_us for other_start_us, other_end_us in told)
        if is_disjoint:
            told.append((start_us, end_us))
        return is_disjoint

    def forget_before(self, now_us: int) -> None:
        """Drop what no occurrence that is concluded from now on can meet."""
        self._anchors = {anchor: last_us for anchor, last_us in self._anchors.items() if last_us >= now_us}
        earliest_us = now_us - self._selection.reach_us
        kept = {
            cast: [(start_us, end_us) for start_us, end_us in told if end_us > earliest_us]
            for cast, told in self._intervals.items()
        }
        self._intervals = {cast: told for cast, told in kept.items() if told}

    def state(self) -> list[Any]:
        """Give what is kept, as plain data."""
        return [list(self._anchors.items()), [[list(cast), list(told)] for cast, told in self._intervals.items()]]

    def restore(self, state: list[Any]) -> None:
        """Take up where `state` was given, for the same chronicle."""
        anchors, intervals = state
        self._anchors = dict(anchors)
        self._intervals = {tuple(cast): [(start, end) for start, end in told] for cast, told in intervals}


def _extent(occurrence: Occurrence) -> tuple[int, int]:
    return occurrence.start_us, max(occurrence.end_us, occurrence.start_us + 1)
