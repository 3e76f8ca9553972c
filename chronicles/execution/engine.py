"""Which chronicles occur in a stream of events that are all meant to stay?

The engine keeps the clock and the watermark, gives events to the stages that look at them, and passes emitted events on
to later stages. It knows nothing of late events or of events taken back: `recogniser.py` sees to those.
"""

from collections import Counter
from collections.abc import Sequence
from heapq import heappush
from typing import Any  # states are plain nested data

from chronicles.chronicle_set import ChronicleSet
from chronicles.compilation.hierarchy import levels
from chronicles.compilation.times.network import UNBOUNDED_US
from chronicles.events import Event, Occurrence, PartialInstance
from chronicles.execution.limits import USUAL, Limits
from chronicles.execution.live.eager import Completed, EagerExecutor
from chronicles.execution.stage import Stage
from chronicles.execution.told.occurrences import Finding
from chronicles.execution.told.results import Results, Unbuilt

BEFORE_ALL_US = -UNBOUNDED_US


class Engine:
    """Recognises the chronicles of a set in events that come before the watermark passes them.

    Parameters
    ----------
    chronicles, lateness_us : as for a recogniser.
    stored : all events that will ever come, in the order of time; the instances of chronicles that look at no emitted
        events are then given to `conclude`. None: they come one by one, to `observe`.
    limits : what each chronicle may cost.

    Attributes
    ----------
    clock_us : the latest time told.
    watermark_us : the clock minus the lateness; nothing before it may come any more.
    due_us : the least watermark at which there is something to do.
    """

    def __init__(
        self,
        chronicles: ChronicleSet,
        lateness_us: int,
        stored: Sequence[Event] | None = None,
        *,
        limits: Limits = USUAL,
    ) -> None:
        self.clock_us = BEFORE_ALL_US
        self.watermark_us = BEFORE_ALL_US
        self.lateness_us = lateness_us
        self.due_us = UNBOUNDED_US
        self._sequence = 0
        self._stages = _stages(chronicles, limits, is_stored=stored is not None)
        self._stages_of: dict[str, list[Stage]] = {}
        # Without lateness, and emitted events to wait for, nothing can come before an event: it needs no buffer.
        self._direct = self._stages[0] if len(self._stages) == 1 and lateness_us == 0 else None
        if stored is not None and self._stages:
            self._stages[0].remember(stored)
        for stage in self._stages[0 if stored is None else 1 :]:
            for name in stage.names:
                self._stages_of.setdefault(name, []).append(stage)

    @property
    def left_out(self) -> Counter[str]:
        """How many instances were beyond the limits, by chronicle."""
        return sum((stage.left_out for stage in self._stages), Counter())

    @property
    def names(self) -> frozenset[str]:
        """Names of the events that must be given; others only tell the time."""
        return frozenset(self._stages_of)

    def observe(self, event: Event) -> Sequence[Occurrence]:
        """Take an event that is not before the watermark, and let time advance to it."""
        t_us = event.t_us
        if t_us > self.clock_us:
            self.clock_us = t_us
            self.watermark_us = t_us - self.lateness_us
        if event.name in self._stages_of:
            if self._direct is not None:
                return self._take(self._direct, event)
            self._push(event)
        return _told(*self._step()) if self.due_us <= self.watermark_us else []

    def conclude(self, event: Event, complete: Completed) -> Sequence[Occurrence]:
        """Take the stored event that comes next, with the instances that it completes."""
        self._let_pass(event.t_us)
        if event.name in self._stages_of:
            self._push(event)
        findings, unbuilt = self._step() if self.due_us <= self.watermark_us else ([], [])
        if complete:
            first = self._stages[0]
            first.expect(complete, event.t_us, self.clock_us)
            self.due_us = min(self.due_us, first.due_us)
            found, at_once = self._step() if self.due_us <= self.watermark_us else ([], first.take_unbuilt())
            findings, unbuilt = findings + found, unbuilt + at_once
        return _told(findings, unbuilt)

    def advance(self, t_us: int) -> Sequence[Occurrence]:
        """Let time pass; an earlier time than the latest told changes nothing."""
        self._let_pass(t_us)
        return _told(*self._step()) if self.due_us <= self.watermark_us else []

    def partial_instances(self) -> list[PartialInstance]:
        """List what is under way, sorted by chronicle, matched events and roles."""
        found = [one for stage in self._stages for one in stage.partial_instances(self.watermark_us)]
        return sorted(found, key=lambda one: (one.chronicle, one.matched, sorted(one.roles.items())))

    def _let_pass(self, t_us: int) -> None:
        if t_us > self.clock_us:
            self.clock_us = t_us
            self.watermark_us = t_us - self.lateness_us

    def _push(self, event: Event) -> None:
        self._sequence += 1
        record = (event.t_us, self._sequence, event)
        for stage in self._stages_of[event.name]:
            heappush(stage.buffer, record)
            self.due_us = min(self.due_us, event.t_us + stage.delay_us)

    def _take(self, stage: Stage, event: Event) -> Sequence[Occurrence]:
        self._sequence += 1
        findings = stage.take((event.t_us, self._sequence, event))
        self.due_us = stage.due_us
        return _told(findings, stage.take_unbuilt())

    def _step(self) -> tuple[list[Finding], list[Unbuilt]]:
        findings: list[Finding] = []
        unbuilt: list[Unbuilt] = []
        for stage in self._stages:
            found = stage.run(self.watermark_us, self.clock_us)
            findings += found
            unbuilt += stage.take_unbuilt()
            for finding in found:
                for event in finding.occurrence.emitted:
                    if event.name in self._stages_of:
                        self._push(event)
        self.due_us = min([stage.due_us for stage in self._stages], default=UNBOUNDED_US)
        return findings, unbuilt

    # ---- checkpoints

    def state(self) -> Any:  # Any: plain nested data
        """Give everything the engine remembers, as plain data, events and fluents, which stays as it is."""
        return {
            "clock_us": self.clock_us,
            "watermark_us": self.watermark_us,
            "sequence": self._sequence,
            "stages": [stage.state() for stage in self._stages],
        }

    def restore(self, state: Any) -> None:  # Any: see `state`
        """Take up where `state` was given, by an engine of the same chronicles."""
        self.clock_us = state["clock_us"]
        self.watermark_us = state["watermark_us"]
        self._sequence = state["sequence"]
        for stage, kept in zip(self._stages, state["stages"], strict=True):
            stage.restore(kept)
        self.due_us = min([stage.due_us for stage in self._stages], default=UNBOUNDED_US)


def _told(findings: list[Finding], unbuilt: list[Unbuilt]) -> Sequence[Occurrence]:
    return Results(findings, unbuilt) if findings or unbuilt else []


def _stages(chronicles: ChronicleSet, limits: Limits, *, is_stored: bool) -> list[Stage]:
    placed = levels(chronicles.plans)
    stages = []
    for level in range(1 + max((one for one, _ in placed.values()), default=-1)):
        plans = {rank: plan for rank, plan in enumerate(chronicles.plans) if placed[plan.name][0] == level}
        delay_us = max(placed[plan.name][1] for plan in plans.values())
        executor = EagerExecutor({} if is_stored and level == 0 else plans, limits)
        stages.append(Stage(plans, delay_us=delay_us, defaults=chronicles.defaults, executor=executor))
    return stages
