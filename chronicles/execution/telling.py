"""At which step, and at what time, would a recogniser that is fed event by event tell a match?

A backfill sees everything at once, but its results are those of a recogniser that takes a step for each event of the
input, in the order of time, and a last one if time goes on afterwards. A match is told at the first step at which all
its events are there and time has reached the end of its last window. None of this is worked out before it is needed.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from chronicles.execution.columns import EventColumns, Times
from chronicles.execution.matches import Matches
from chronicles.execution.row_tests import Mask, Rows


@dataclass(frozen=True, eq=False, slots=True)
class Steps:
    """The steps of a recogniser: one for each event of `columns`, and one at `until_us` if that is later.

    `room` is how many places in the sequence of events each event of the input takes, so that emitted ones find theirs
    behind it.
    """

    columns: EventColumns
    until_us: int | None
    room: int

    def of(self, sequence: Times) -> Times:
        """Give the step at which the event at a place in the sequence is there."""
        return sequence // self.room

    def reaching(self, t_us: Times) -> Times:
        """Give the first step at which a time is reached, one behind the last event if none is."""
        return np.searchsorted(self.columns.times_us, t_us)

    def times_us(self, steps: Times) -> Times:
        """Give the times of steps; those that never come have any."""
        last_us = 0 if self.until_us is None else self.until_us
        return np.append(self.columns.times_us, last_us)[steps]

    def come(self, steps: Times, certain_us: Times) -> Mask:
        """Say which steps come and reach a time."""
        come: Mask = steps < len(self.columns)
        return come if self.until_us is None else come | (certain_us <= self.until_us)


@dataclass(frozen=True, eq=False)
class Candidates:
    """Matches of one plan, the place of the chronicle in its set, and how long after its end a match is certain."""

    rank: int
    matches: Matches
    delay_us: int
    steps: Steps

    @cached_property
    def certain_us(self) -> Times:
        """When each becomes certain."""
        return self.matches.closes_us() + self.delay_us

    @cached_property
    def step(self) -> Times:
        """The step at which each is told."""
        there = self.steps.of(self.matches.sequence().max(axis=0))
        return np.maximum(there, self.steps.reaching(self.certain_us))

    @cached_property
    def clock_us(self) -> Times:
        """The time of that step."""
        return self.steps.times_us(self.step)

    def picked(self, which: Mask | Rows) -> Candidates:
        """Give some of them."""
        return Candidates(self.rank, self.matches.picked(which), self.delay_us, self.steps)

    def told(self) -> Candidates:
        """Give those that are told: the input goes on until they are certain."""
        if self.steps.room == 1 and self.matches.closes_with_event:
            return self  # nothing is emitted, so each is certain with an event of the input
        come = self.steps.come(self.step, self.certain_us)
        return self if come.all() else self.picked(come)
