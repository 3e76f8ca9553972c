"""Which partial instances died because an event did not come in time, without ever having been extended?

The answer does not depend on when anybody looks: an instance is listed once the time is past its deadline, in the
order of deadlines, unless an event extended it before.
"""

from __future__ import annotations

from collections.abc import Sequence
from heapq import heapify, heappop, heappush
from typing import Any  # rows, and states made of plain data

from chronicles.compilation.network import UNBOUNDED_US
from chronicles.execution.eager_rows import Row

Sequences = tuple[int, ...]


class TimedOutLog:
    """Watches the partial instances that have matched at least `least` positions."""

    def __init__(self, least: int) -> None:
        self._least = least
        self._watched: list[tuple[int, Sequences, int, Row]] = []
        self._extended: set[tuple[int, Sequences]] = set()

    @property
    def due_us(self) -> int:
        """The first time at which something may be listed."""
        return self._watched[0][0] + 1 if self._watched else UNBOUNDED_US

    def watch(self, mask: int, row: Row, deadline_us: int) -> None:
        """Watch a new partial instance."""
        if mask.bit_count() >= self._least:
            heappush(self._watched, (deadline_us, sequences(row, mask), mask, row))

    def note_extended(self, mask: int, numbers: Sequences) -> None:
        """Take down that an instance in state `mask` was extended, given the sequence numbers of its events."""
        if mask.bit_count() >= max(self._least, 1):
            self._extended.add((mask, numbers))

    def take(self, now_us: int) -> list[tuple[int, int, Row]]:
        """Give, once, the instances that no event extended and whose deadline, told first, is before `now_us`."""
        taken = []
        while self._watched and self._watched[0][0] < now_us:
            deadline_us, numbers, mask, row = heappop(self._watched)
            if (mask, numbers) in self._extended:
                self._extended.remove((mask, numbers))
            else:
                taken.append((deadline_us, mask, row))
        return taken

    def state(self) -> tuple[list[Any], list[Any]]:
        """Give what is watched, as plain data."""
        return sorted(self._watched), sorted(self._extended)

    def restore(self, state: tuple[Sequence[Any], Sequence[Any]]) -> None:
        """Go on from a state."""
        self._watched, self._extended = list(state[0]), set(state[1])
        heapify(self._watched)


def sequences(row: Row, mask: int) -> Sequences:
    """Give the sequence numbers of the events in a row, in the order of positions."""
    held = row[1 : 2 * mask.bit_count() : 2]
    return tuple(one if isinstance(one, int) else one[0] for one in held)
