"""How do the chronicles of one level run together, behind the watermark?

Chronicles that look at events emitted by others run in a later stage, which lags behind the watermark by as long as
such an event can still be emitted. So every stage sees all its events in the order of time, and the result does not
depend on how the input is cut into steps.
"""

from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from heapq import heappop, heappush
from typing import Any  # states are plain nested data

from chronicles.compilation.plan import Plan
from chronicles.compilation.times.network import UNBOUNDED_US
from chronicles.events import Event, PartialInstance
from chronicles.execution.instances import Instance, Record
from chronicles.execution.live.eager import Completed, EagerExecutor
from chronicles.execution.obligations.conclusions import Conclusions
from chronicles.execution.obligations.history import AttributeHistory
from chronicles.execution.told.occurrences import Finding, OccurrenceBuilder, expecting_instance, pending_instance
from chronicles.execution.told.results import Unbuilt, is_told_at_once

_FIRST_SWEEP = 1024


class Stage:
    """Chronicles that run together, behind the watermark by `delay_us`; invariant: `buffer` is a heap.

    `plans` are keyed by their place in the set, which decides the order of results that become certain together.
    """

    def __init__(
        self, plans: Mapping[int, Plan], *, delay_us: int, defaults: Iterable[tuple[str, str]], executor: EagerExecutor
    ) -> None:
        self._memories = _memories(plans.values())
        self.delay_us = delay_us
        self.buffer: list[Record] = []
        self._history = AttributeHistory(self._memories, defaults)
        self._matchers = {rank: _Matcher(plan, rank, self._history) for rank, plan in plans.items()}
        self._executor = executor
        self._listeners: dict[str, list[Callable[[Event], None]]] = {name: [] for name in executor.names}
        self._pending: list[tuple[int, int, int, Instance]] = []
        self._pending_count = 0
        self._unbuilt: list[Unbuilt] = []
        self._grown = 0
        self._next_sweep = _FIRST_SWEEP
        for name in self._memories:
            self._listeners.setdefault(name, []).append(self._history.append)
        for matcher in self._matchers.values():
            for name in matcher.conclusions.names:
                self._listeners.setdefault(name, []).append(matcher.conclusions.append)

    @property
    def left_out(self) -> Counter[str]:
        """How many instances were beyond the limits, by chronicle."""
        return self._executor.left_out

    @property
    def names(self) -> frozenset[str]:
        """Names of the events that the stage looks at."""
        return frozenset(self._listeners)

    @property
    def due_us(self) -> int:
        """The least watermark at which there is something to do."""
        first = self.buffer[0][0] if self.buffer else UNBOUNDED_US
        if self._pending:
            first = min(first, self._pending[0][0])
        return first + self.delay_us

    def run(self, watermark_us: int, clock_us: int) -> list[Finding]:
        """Do everything that is certain at the watermark; what is told at once waits for `take_unbuilt`."""
        now_us = watermark_us - self.delay_us
        buffer, pending = self.buffer, self._pending
        findings: list[Finding] = []
        while buffer and buffer[0][0] <= now_us:
            record = heappop(buffer)
            if pending and pending[0][0] <= record[0]:
                findings += self._conclude(record[0], clock_us)
            self._feed(record, clock_us)
        if pending and pending[0][0] <= now_us:
            findings += self._conclude(now_us, clock_us)
        if self._grown >= self._next_sweep:
            self._sweep(now_us)
        return findings

    def take(self, record: Record) -> list[Finding]:
        """Do everything that is certain with an event before which nothing can come: `run` without a buffer."""
        now_us = record[0]
        pending = self._pending
        findings = self._conclude(now_us, now_us) if pending and pending[0][0] <= now_us else []
        self._feed(record, now_us)
        if pending and pending[0][0] <= now_us:
            findings += self._conclude(now_us, now_us)
        if self._grown >= self._next_sweep:
            self._sweep(now_us)
        return findings

    def remember(self, events: Sequence[Event]) -> None:
        """Take what is to be looked back at from all events that will ever come, in the order of time."""
        self._history.fill(events)
        for matcher in self._matchers.values():
            names = matcher.conclusions.names
            for event in events if names else ():
                if event.name in names:
                    matcher.conclusions.append(event)

    def expect(self, complete: Completed, t_us: int, clock_us: int) -> None:
        """Take instances whose last event is at `t_us`; all that closed before is concluded."""
        for number, instances in complete:
            matcher = self._matchers[number]
            if matcher.is_told_at_once:
                # They close with this event, and nothing earlier can come any more.
                self._unbuilt.append(Unbuilt(matcher.builder, instances, t_us + self.delay_us, clock_us))
                continue
            for instance in instances:
                self._pending_count += 1
                closes_us = matcher.conclusions.closes_us(instance)
                heappush(self._pending, (closes_us, self._pending_count, number, instance))

    def take_unbuilt(self) -> list[Unbuilt]:
        """Give what was told at once since the last call."""
        taken, self._unbuilt = self._unbuilt, []
        return taken

    def partial_instances(self, watermark_us: int) -> Iterator[PartialInstance]:
        """Give what is under way, in no special order."""
        now_us = watermark_us - self.delay_us
        for number, matcher in self._matchers.items():
            for mask, instance in self._executor.waiting(number, now_us):
                if not matcher.conclusions.is_doomed(instance, mask, now_us):
                    yield expecting_instance(matcher.plan, instance, mask, now_us)
        for closes_us, _, number, instance in self._pending:
            matcher = self._matchers[number]
            full = (1 << len(matcher.plan.positions)) - 1
            if not matcher.conclusions.is_doomed(instance, full, now_us):
                yield pending_instance(matcher.plan, instance, closes_us)

    def _feed(self, record: Record, clock_us: int) -> None:
        event = record[2]
        for listen in self._listeners[event.name]:
            listen(event)
        self._grown += 1
        if event.name not in self._executor.names:
            return
        complete, created = self._executor.feed(record)
        self._grown += created
        if complete:
            self.expect(complete, record[0], clock_us)

    def _conclude(self, now_us: int, clock_us: int) -> list[Finding]:
        """Conclude the instances that close by `now_us`; among those of one time the order is by what they are."""
        findings: list[Finding] = []
        pending = self._pending
        while pending and pending[0][0] <= now_us:
            closes_us = pending[0][0]
            batch: list[Finding] = []
            while pending and pending[0][0] == closes_us:
                _, _, number, instance = heappop(pending)
                matcher = self._matchers[number]
                for way in matcher.conclusions.solutions(instance):
                    batch.append(matcher.builder.finding(instance, way, closes_us + self.delay_us, clock_us))
            batch.sort(key=lambda finding: finding.order)
            findings += [one for one in batch if one.builder.is_new(one)]
        return findings

    def _sweep(self, now_us: int) -> None:
        """Forget what can no longer matter; done each time as much was added as was left the time before."""
        left = self._executor.sweep(now_us)
        for name, (memory_us, unknown_us) in self._memories.items():
            left += self._history.forget_before(name, now_us - memory_us, now_us - unknown_us)
        for matcher in self._matchers.values():
            left += matcher.conclusions.forget_before(now_us - matcher.plan.memory_us)
            matcher.builder.forget_before(now_us)
        self._grown = 0
        self._next_sweep = max(_FIRST_SWEEP, left)

    # ---- checkpoints

    def state(self) -> Any:  # Any: plain nested data
        """Give everything the stage remembers, as plain data and events."""
        return {
            "buffer": list(self.buffer),
            "pending": list(self._pending),
            "pending_count": self._pending_count,
            "history": self._history.state(),
            "executor": self._executor.state(),
            "matchers": [[one.conclusions.state(), one.builder.state()] for one in self._matchers.values()],
        }

    def restore(self, state: Any) -> None:  # Any: see `state`
        """Forget everything and take up where `state` was given."""
        self.buffer[:] = state["buffer"]
        self._pending[:] = state["pending"]
        self._pending_count = state["pending_count"]
        self._history.restore(state["history"])
        self._executor.restore(state["executor"])
        for matcher, (conclusions, builder) in zip(self._matchers.values(), state["matchers"], strict=True):
            matcher.conclusions.restore(conclusions)
            matcher.builder.restore(builder)


def _memories(plans: Iterable[Plan]) -> dict[str, tuple[int, int]]:
    """Say how far back each attribute is looked at, and how far if it has been unknown ever since.

    Where every hold needs a known value up to its end, what became unknown before the ends that are still to be looked
    at fails as if nothing had been known before. So what left the view is forgotten long before the longest hold.
    """
    memories: dict[str, tuple[int, int]] = {}
    for plan in plans:
        for one in plan.persistences:
            known_us, unknown_us = memories.get(one.attribute, (0, 0))
            after_us = one.lag_us if one.rejects_unknown else plan.memory_us
            memories[one.attribute] = max(known_us, plan.memory_us), max(unknown_us, after_us)
    return memories


class _Matcher:
    """The parts that work for one chronicle."""

    def __init__(self, plan: Plan, rank: int, history: AttributeHistory) -> None:
        self.plan = plan
        self.is_told_at_once = is_told_at_once(plan)
        self.conclusions = Conclusions(plan, history)
        self.builder = OccurrenceBuilder(plan, rank, history)
