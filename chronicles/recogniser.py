"""Which chronicles occur in a stream of events?

`Recogniser` takes events as they come, up to `lateness_us` out of order. Its watermark is the latest time it was told,
by an event or by `advance`, minus the lateness: an event before the watermark is late and only counted, and everything
before the watermark is known, so absences up to it can be concluded. Nothing here reads a clock.

Chronicles that look at events emitted by others run in a later stage, which sees all its events in the order of time
because it waits until no such event can still be emitted.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from heapq import heappop, heappush

from chronicles.chronicle_set import ChronicleSet
from chronicles.compilation.hierarchy import levels
from chronicles.compilation.network import UNBOUNDED_US
from chronicles.compilation.plan import Plan
from chronicles.errors import ChronicleError
from chronicles.events import Event, Occurrence, PartialInstance
from chronicles.execution.conclusions import Conclusions
from chronicles.execution.history import AttributeHistory
from chronicles.execution.instances import Instance, InstanceStore, Record
from chronicles.execution.occurrences import Finding, OccurrenceBuilder, PartialBuilder

_BEFORE_ALL_US = -UNBOUNDED_US
_FIRST_SWEEP = 1024


class Recogniser:
    """Recognises the chronicles of a set, event by event.

    Parameters
    ----------
    chronicles : as given by `chronicles.load`.
    lateness_us : how much earlier than the latest time told an event may be.

    Attributes
    ----------
    late_count : number of events that came before the watermark and were left out.

    Raises
    ------
    ChronicleError
        If the lateness is negative.

    Examples
    --------
    >>> from chronicles.chronicle_set import load
    >>> stay = "chronicle stay[?car](t1, t2) { event(enter[?car], t1) event(leave[?car], t2) t2 - t1 in [0s, 9s] }"
    >>> recogniser = Recogniser(load(stay))
    >>> recogniser.observe(Event("enter", ("car1",), 1_000_000))
    []
    >>> [found] = recogniser.observe(Event("leave", ("car1",), 3_000_000))
    >>> found.chronicle, found.roles, found.start_us, found.end_us
    ('stay', {'car': 'car1'}, 1000000, 3000000)
    """

    def __init__(self, chronicles: ChronicleSet, lateness_us: int = 0) -> None:
        if lateness_us < 0:
            raise ChronicleError(f"recogniser: expected a lateness >= 0 us, got {lateness_us!r}")
        self.late_count = 0
        self._lateness_us = lateness_us
        self._clock_us = _BEFORE_ALL_US
        self._watermark_us = _BEFORE_ALL_US
        self._due_us = UNBOUNDED_US
        self._sequence = 0
        self._stages = _stages(chronicles)
        self._stages_of: dict[str, list[_Stage]] = {}
        for stage in self._stages:
            for name in stage.names:
                self._stages_of.setdefault(name, []).append(stage)

    def observe(self, event: Event) -> list[Occurrence]:
        """Take an event, and let time advance to it.

        Returns
        -------
        What is recognised now, sorted by the time it became certain, then by the chronicle's place in the set, values
        and times.
        """
        t_us = event.t_us
        if t_us < self._watermark_us:
            self.late_count += 1
            return []
        if t_us > self._clock_us:
            self._clock_us = t_us
            self._watermark_us = t_us - self._lateness_us
        if event.name in self._stages_of:
            self._push(event)
        return self._run() if self._due_us <= self._watermark_us else []

    def advance(self, t_us: int) -> list[Occurrence]:
        """Let time pass up to `t_us` without an event; an earlier time than the latest told changes nothing.

        Returns
        -------
        What is recognised now, in the order of `observe`.
        """
        if t_us > self._clock_us:
            self._clock_us = t_us
            self._watermark_us = t_us - self._lateness_us
        return self._run() if self._due_us <= self._watermark_us else []

    def partial_instances(self) -> tuple[PartialInstance, ...]:
        """List the instances that may still be recognised, with the windows of what they expect.

        Events that still wait for the watermark are not looked at.
        """
        found = [one for stage in self._stages for one in stage.partial_instances(self._watermark_us)]
        return tuple(sorted(found, key=lambda one: (one.chronicle, one.matched, sorted(one.roles.items()))))

    def _push(self, event: Event) -> None:
        self._sequence += 1
        record = (event.t_us, self._sequence, event)
        for stage in self._stages_of[event.name]:
            heappush(stage.buffer, record)
            self._due_us = min(self._due_us, event.t_us + stage.delay_us)

    def _run(self) -> list[Occurrence]:
        findings: list[Finding] = []
        for stage in self._stages:
            found = stage.run(self._watermark_us, self._clock_us)
            findings += found
            for finding in found:
                for event in finding.occurrence.emitted:
                    if event.name in self._stages_of:
                        self._push(event)
        self._due_us = min([stage.due_us for stage in self._stages], default=UNBOUNDED_US)
        if len(findings) > 1:
            findings.sort(key=lambda finding: finding.order)
        return [finding.occurrence for finding in findings]


class _Stage:
    """Chronicles that run together, behind the watermark by `delay_us`; invariant: `buffer` is a heap.

    `plans` are keyed by their place in the set, which decides the order of results that become certain together.
    """

    def __init__(self, plans: Mapping[int, Plan], delay_us: int, defaults: Iterable[tuple[str, str]]) -> None:
        watched = {one.attribute for plan in plans.values() for one in plan.persistences}
        self.delay_us = delay_us
        self.buffer: list[Record] = []
        self._history = AttributeHistory(watched, defaults)
        self._memory_us = max(plan.memory_us for plan in plans.values())
        self._matchers = [_Matcher(plan, rank, self._history) for rank, plan in plans.items()]
        self._readers: dict[str, _Readers] = {}
        self._pending: list[tuple[int, int, _Matcher, Instance]] = []
        self._pending_count = 0
        self._grown = 0
        self._next_sweep = _FIRST_SWEEP
        for name in watched:
            self._readers.setdefault(name, _Readers()).histories.append(self._history)
        for matcher in self._matchers:
            for name in matcher.conclusions.names:
                self._readers.setdefault(name, _Readers()).logs.append(matcher.conclusions)
            for name in matcher.store.names:
                self._readers.setdefault(name, _Readers()).matchers.append(matcher)

    @property
    def names(self) -> frozenset[str]:
        """Names of the events that the stage looks at."""
        return frozenset(self._readers)

    @property
    def due_us(self) -> int:
        """The least watermark at which there is something to do."""
        first = self.buffer[0][0] if self.buffer else UNBOUNDED_US
        if self._pending:
            first = min(first, self._pending[0][0])
        return first + self.delay_us

    def run(self, watermark_us: int, clock_us: int) -> list[Finding]:
        """Do everything that is certain at the watermark."""
        now_us = watermark_us - self.delay_us
        buffer, pending = self.buffer, self._pending
        findings: list[Finding] = []
        while buffer and buffer[0][0] <= now_us:
            record = heappop(buffer)
            if pending and pending[0][0] <= record[0]:
                findings += self._conclude(record[0], clock_us)
            self._feed(record)
        if pending and pending[0][0] <= now_us:
            findings += self._conclude(now_us, clock_us)
        if self._grown >= self._next_sweep:
            self._sweep(now_us)
        return findings

    def partial_instances(self, watermark_us: int) -> Iterable[PartialInstance]:
        """Give what is under way, in no special order."""
        now_us = watermark_us - self.delay_us
        for matcher in self._matchers:
            for mask, instance in matcher.store.waiting(now_us):
                if not matcher.conclusions.is_doomed(instance, mask, now_us):
                    yield matcher.partials.expecting(instance, mask, now_us)
        for closes_us, _, matcher, instance in self._pending:
            full = (1 << len(matcher.plan.positions)) - 1
            if not matcher.conclusions.is_doomed(instance, full, now_us):
                yield matcher.partials.pending(instance, closes_us)

    def _feed(self, record: Record) -> None:
        event = record[2]
        readers = self._readers[event.name]
        for history in readers.histories:
            history.append(event)
        for conclusions in readers.logs:
            conclusions.append(event)
        for matcher in readers.matchers:
            complete, created = matcher.store.feed(record)
            self._grown += created
            for instance in complete:
                self._pending_count += 1
                closes_us = matcher.conclusions.closes_us(instance)
                heappush(self._pending, (closes_us, self._pending_count, matcher, instance))
        self._grown += 1

    def _conclude(self, now_us: int, clock_us: int) -> list[Finding]:
        """Conclude the instances that close by `now_us`; among those of one time the order is by what they are."""
        findings: list[Finding] = []
        pending = self._pending
        while pending and pending[0][0] <= now_us:
            closes_us = pending[0][0]
            batch: list[Finding] = []
            while pending and pending[0][0] == closes_us:
                _, _, matcher, instance = heappop(pending)
                certain_us = closes_us + self.delay_us
                for values in matcher.conclusions.solutions(instance):
                    batch.append(matcher.builder.finding(instance, values, certain_us, clock_us))
            batch.sort(key=lambda finding: finding.order)
            findings += [one for one in batch if one.builder.is_new(one)]
        return findings

    def _sweep(self, now_us: int) -> None:
        """Forget what can no longer matter; done each time as much was added as was left the time before."""
        oldest_us = now_us - self._memory_us
        left = self._history.forget_before(oldest_us)
        for matcher in self._matchers:
            left += matcher.store.sweep(now_us) + matcher.conclusions.forget_before(oldest_us)
            matcher.builder.forget_before(now_us)
        self._grown = 0
        self._next_sweep = max(_FIRST_SWEEP, left)


class _Readers:
    """Who looks at the events of one name."""

    __slots__ = ("histories", "logs", "matchers")

    def __init__(self) -> None:
        self.histories: list[AttributeHistory] = []
        self.logs: list[Conclusions] = []
        self.matchers: list[_Matcher] = []


class _Matcher:
    """The parts that work for one chronicle."""

    __slots__ = ("builder", "conclusions", "partials", "plan", "store")

    def __init__(self, plan: Plan, rank: int, history: AttributeHistory) -> None:
        self.plan = plan
        self.store = InstanceStore(plan)
        self.conclusions = Conclusions(plan, history)
        self.builder = OccurrenceBuilder(plan, rank)
        self.partials = PartialBuilder(plan)


def _stages(chronicles: ChronicleSet) -> list[_Stage]:
    placed = levels(chronicles.plans)
    stages = []
    for level in range(1 + max((one for one, _ in placed.values()), default=-1)):
        plans = {rank: plan for rank, plan in enumerate(chronicles.plans) if placed[plan.name][0] == level}
        delay_us = max(placed[plan.name][1] for plan in plans.values())
        stages.append(_Stage(plans, delay_us, chronicles.defaults))
    return stages


def recognise(
    chronicles: ChronicleSet, events: Iterable[Event], *, until_us: int | None = None, executor: str = "eager"
) -> list[Occurrence]:
    """Recognise chronicles in events that are all at hand.

    Parameters
    ----------
    chronicles : as given by `chronicles.load`.
    events : in any order.
    until_us : the time up to which the events are complete; the latest event's time if not given. An absence that ends
        later stays open: nobody saw it come true.
    executor : "eager" is the only one so far.

    Raises
    ------
    ChronicleError
        If there is no such executor.

    Examples
    --------
    >>> from chronicles.chronicle_set import load
    >>> alone = load("chronicle alone[?car](t1) { event(enter[?car], t1) noevent(enter[?], (t1 + 1us, t1 + 5s)) }")
    >>> events = [Event("enter", ("car1",), 0), Event("enter", ("car2",), 3_000_000)]
    >>> [found.roles for found in recognise(alone, events)]
    []
    >>> [found.roles for found in recognise(alone, events, until_us=8_000_000)]
    [{'car': 'car2'}]
    """
    if executor != "eager":
        raise ChronicleError(f"recognise: expected the executor 'eager', got {executor!r}")
    recogniser = Recogniser(chronicles)
    ordered = sorted(events, key=lambda event: event.t_us)
    found = [occurrence for event in ordered for occurrence in recogniser.observe(event)]
    if until_us is not None:
        found += recogniser.advance(until_us)
    return found
