"""What is an instance, and which instances of one chronicle are under way?

An instance is a plain list, because many are made:
``[deadline_us, time of each position..., value of each slot..., record of each position...]`` with None where nothing
is known. A record is ``(t_us, sequence number, event)``. How instances are found is told in `eager`.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any  # states are plain data

from chronicles.compilation.plan import Plan
from chronicles.execution.eager import EagerExecutor, Instance
from chronicles.execution.held_events import Record

__all__ = ["Instance", "InstanceStore", "Layout", "Record"]


class Layout:
    """Where the parts of an instance stand in its list."""

    __slots__ = ("event_slots", "records", "slots")

    def __init__(self, plan: Plan) -> None:
        self.event_slots = plan.event_slot_count
        self.slots = 1 + len(plan.positions)
        self.records = self.slots + self.event_slots


class InstanceStore:
    """The instances of one chronicle that still expect events: an `EagerExecutor` of one plan.

    Parameters
    ----------
    plan : the chronicle.
    timeouts_from : the share of positions from which on an instance that dies unextended is kept for
        `take_timed_out`; None for never.
    """

    def __init__(self, plan: Plan, timeouts_from: float | None = None) -> None:
        self._executor = EagerExecutor({0: plan}, timeouts_from)

    @property
    def names(self) -> frozenset[str]:
        """Names of the events that instances expect."""
        return self._executor.names

    @property
    def source(self) -> str:
        """The program that was written for the chronicle, as far as events have needed it."""
        return self._executor.source

    def feed(self, record: Record) -> tuple[list[Instance], int]:
        """Let an event extend every instance that expects it; events come in the order of time.

        Returns
        -------
        Instances that now have all their events, and the number of other new instances.
        """
        complete, created = self._executor.feed(record)
        return [instance for _, instances in complete for instance in instances], created

    def sweep(self, now_us: int) -> int:
        """Drop instances past their deadline, a limited number at a time; give the number left."""
        return self._executor.sweep(now_us)

    def waiting(self, now_us: int) -> Iterator[tuple[int, Instance]]:
        """Give the instances that may still get all their events, with the set of positions they have matched."""
        return self._executor.waiting(0, now_us)

    @property
    def timeout_due_us(self) -> int:
        """The first time at which `take_timed_out` may have something to give."""
        return self._executor.timeout_due_us

    def take_timed_out(self) -> list[tuple[int, Instance]]:
        """Give, once, the instances that no event extended before their deadline.

        Returns
        -------
        Those whose deadline is before the latest time of `sweep`, and the positions they have matched, in the order of
        deadlines.
        """
        return self._executor.take_timed_out(0)

    def state(self) -> dict[str, Any]:
        """Give everything the store knows, as plain data."""
        return self._executor.state()

    def restore(self, state: Mapping[str, Any]) -> None:
        """Forget everything and go on from the state of a store with the same plan and `timeouts_from`."""
        self._executor.restore(state)
