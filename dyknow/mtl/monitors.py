"""Which objects violate, or satisfy, the monitors of a text, and when is that certain?

Every monitor runs once for each combination of the objects of its sorts: an *instance* begins with the first state that
has all of them, and ends with the first that has not. What is told is certain whatever may come. So ``always ...`` can
only be violated: that it held to the end is no event, and neither is what was still open when an object left. But what
was due before that state is decided: no other state lies in between.

After a violation a new instance begins with the next state. As long as that one fails as well, it is the same
violation, told once; it is over when an instance has come through the longest time in which the formula can fail, and
through the time of calm.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from itertools import product
from typing import Literal

from dyknow.mtl.formula import Monitor
from dyknow.mtl.printer import print_monitors
from dyknow.mtl.progression.progressor import Progressor
from dyknow.mtl.progression.shared_work import SharedWork
from dyknow.mtl.progression.states import State, StateError, Verdict
from dyknow.mtl.structure import horizon_us
from dyknow.mtl.watching.plan import plan_of
from dyknow.mtl.watching.watch import Watch, Watching

Outcome = Literal["violated", "satisfied"]
Objects = tuple[str, ...]

_VERSION_LENGTH = 12


@dataclass(frozen=True, slots=True)
class MonitorEvent:
    """Say that some objects violated or satisfied a monitor.

    Attributes
    ----------
    monitor, version : name of the monitor, and a digest of its text.
    roles : (variable, object), in the order of the monitor.
    since_us : the first state of the instance that came to this verdict.
    t_us : the state, or the time told, at which the verdict was certain.
    """

    monitor: str
    version: str
    outcome: Outcome
    roles: tuple[tuple[str, str], ...]
    since_us: int
    t_us: int

    @property
    def name(self) -> str:
        """Name the kind of event, such as ``careful_violated``."""
        return f"{self.monitor}_{self.outcome}"

    @property
    def objects(self) -> Objects:
        """Give the objects alone."""
        return tuple(one for _, one in self.roles)


@dataclass(frozen=True, slots=True)
class MonitorReport:
    """Count what became of a monitor.

    Attributes
    ----------
    running : instances that are still open.
    violated, satisfied : events told.
    undecided : instances that ended, or can come to no verdict any more, without one.
    """

    monitor: str
    running: int
    violated: int
    satisfied: int
    undecided: int


def version_of(monitor: Monitor) -> str:
    """Digest the text of a monitor; layout and comments do not count.

    Examples
    --------
    >>> from dyknow.mtl.parser import parse_monitors
    >>> one, other = parse_monitors("monitor a: always green"), parse_monitors("monitor  a: (always green) # all day")
    >>> version_of(one[0]) == version_of(other[0])
    True
    """
    return hashlib.sha256(print_monitors([monitor]).encode()).hexdigest()[:_VERSION_LENGTH]


class Monitors:
    """Run monitors over one state after another.

    Parameters
    ----------
    definitions : monitors with different names.
    calm_us : a violation is over when at least this much time has passed without another one of the same objects.

    Examples
    --------
    >>> from dyknow.mtl.parser import parse_monitors
    >>> from dyknow.mtl.progression.states import DictState
    >>> monitors = Monitors(parse_monitors("monitor careful per Car: always speed[?car] < 50 km/h"))
    >>> for t_s, speed_mps in enumerate([12.0, 15.0, 16.0, 13.0, 15.0]):
    ...     state = DictState({("speed", ("car7",)): speed_mps}, {"Car": ["car7"]})
    ...     for event in monitors.update(t_s * 1_000_000, state):
    ...         print(event.name, dict(event.roles), event.since_us, event.t_us)
    careful_violated {'car': 'car7'} 0 1000000
    careful_violated {'car': 'car7'} 3000000 4000000
    >>> monitors.finish()
    >>> monitors.report()
    (MonitorReport(monitor='careful', running=0, violated=2, satisfied=0, undecided=0),)
    """

    def __init__(self, definitions: Iterable[Monitor], *, calm_us: int = 0) -> None:
        shared = SharedWork()
        self._runs = tuple(_Run(one, calm_us, shared) for one in definitions)
        self._t_us: int | None = None  # of the last state
        self._least_us: int | None = None  # of the next one

    def update(self, t_us: int, state: State) -> tuple[MonitorEvent, ...]:
        """Take the next state.

        Parameters
        ----------
        t_us : later than that of the state before.
        state : the world at that time; it must not change afterwards.

        Returns
        -------
        What is certain now, in the order of the monitors, then of the objects in their sorts.

        Raises
        ------
        StateError
            If the time is not later, or before a time told to `advance`, or a value is of the wrong type.
        """
        if self._t_us is not None and t_us <= self._t_us:
            raise StateError(f"monitors: expected a state later than {self._t_us} us, got one at {t_us} us")
        if self._least_us is not None and t_us < self._least_us:
            raise StateError(
                f"monitors: expected a state at {self._least_us} us or later as promised, got one at {t_us} us"
            )
        self._t_us = t_us
        return tuple(event for run in self._runs for event in run.step(t_us, state))

    def advance(self, t_us: int) -> tuple[MonitorEvent, ...]:
        """Let time pass: no state before this time comes any more, so deadlines before it are over.

        Examples
        --------
        >>> from dyknow.mtl.parser import parse_monitors
        >>> from dyknow.mtl.progression.states import DictState
        >>> monitors = Monitors(parse_monitors("monitor starts per Car: eventually[0s, 10s] moving[?c]"))
        >>> monitors.update(0, DictState({("moving", ("car7",)): False}, {"Car": ["car7"]}))
        ()
        >>> [(one.name, one.t_us) for t_us in (10_000_000, 12_000_000) for one in monitors.advance(t_us)]
        [('starts_violated', 12000000)]
        """
        self._least_us = t_us if self._least_us is None else max(self._least_us, t_us)
        return tuple(event for run in self._runs for event in run.advance(t_us))

    def finish(self) -> None:
        """End every instance; the report then counts what stayed open as undecided."""
        for run in self._runs:
            run.finish()

    def report(self) -> tuple[MonitorReport, ...]:
        """Count the events and instances of each monitor so far."""
        return tuple(run.report() for run in self._runs)


class _Run:
    """All instances of one monitor."""

    def __init__(self, monitor: Monitor, calm_us: int, shared: SharedWork) -> None:
        self._monitor = monitor
        self._variables = tuple(one.variable.name for one in monitor.subjects)
        self._sorts = tuple(one.sort for one in monitor.subjects)
        self._version = version_of(monitor)
        self._recovery_us = max(calm_us, horizon_us(monitor.formula))
        self._shared = shared
        plan = plan_of(monitor.formula, self._variables)
        self._watching = None if plan is None else Watching(plan)
        self._instances: dict[Objects, _Instance] = {}
        self._told: dict[Outcome, int] = {"violated": 0, "satisfied": 0}
        self._undecided = 0

    def step(self, t_us: int, state: State) -> Iterator[MonitorEvent]:
        """Give one state to every instance, and begin those of objects that are new."""
        before = self._instances
        self._instances = {}
        for objects in product(*map(state.members, self._sorts)):
            instance = before.pop(objects, None) or _Instance(t_us, self._watch(objects))
            self._instances[objects] = instance
            watch = instance.watch
            if watch is None:
                continue
            if instance.begins_anew:
                instance.since_us, instance.begins_anew = t_us, False
            verdict = watch.progress(t_us, state)
            if verdict is not Verdict.UNKNOWN or instance.is_violated or watch.is_final:
                yield from self._conclude(verdict, objects, instance, t_us)
        yield from self._let_pass(before, t_us)
        self._undecided += sum(one.is_open for one in before.values())

    def advance(self, t_us: int) -> Iterator[MonitorEvent]:
        """Tell every instance that no state before a time comes any more."""
        return self._let_pass(self._instances, t_us)

    def finish(self) -> None:
        self._undecided += sum(one.is_open for one in self._instances.values())
        self._instances = {}

    def report(self) -> MonitorReport:
        running = sum(one.is_open for one in self._instances.values())
        return MonitorReport(self._monitor.name, running, **self._told, undecided=self._undecided)

    def _let_pass(self, instances: Mapping[Objects, _Instance], t_us: int) -> Iterator[MonitorEvent]:
        for objects, instance in instances.items():
            if instance.is_open:
                assert instance.watch is not None
                yield from self._conclude(instance.watch.advance(t_us), objects, instance, t_us)

    def _conclude(self, verdict: Verdict, objects: Objects, instance: _Instance, t_us: int) -> Iterator[MonitorEvent]:
        if verdict is Verdict.FALSE:
            if not instance.is_violated:
                yield self._event("violated", objects, instance, t_us)
            instance.watch, instance.begins_anew, instance.is_violated = self._watch(objects), True, True
        elif verdict is Verdict.TRUE:
            instance.watch = None
            yield self._event("satisfied", objects, instance, t_us)
        elif instance.watch is not None and instance.watch.is_final:
            instance.watch = None
            self._undecided += 1
        elif instance.is_violated and t_us - instance.since_us >= self._recovery_us:
            instance.is_violated = False

    def _watch(self, objects: Objects) -> Watch | Progressor:
        if self._watching is not None:
            return self._watching.watch(objects)
        return Progressor(self._monitor.formula, dict(zip(self._variables, objects, strict=True)), shared=self._shared)

    def _event(self, outcome: Outcome, objects: Objects, instance: _Instance, t_us: int) -> MonitorEvent:
        self._told[outcome] += 1
        roles = tuple(zip(self._variables, objects, strict=True))
        return MonitorEvent(self._monitor.name, self._version, outcome, roles, instance.since_us, t_us)


class _Instance:
    """One monitor of some objects, from state to state.

    Attributes
    ----------
    since_us : the first state of the watch, once it has had one.
    watch : None once the last word is spoken.
    begins_anew : the watch took over from one that was violated, and has had no state yet.
    is_violated : a violation was told and is not over.
    """

    __slots__ = ("begins_anew", "is_violated", "since_us", "watch")

    def __init__(self, since_us: int, watch: Watch | Progressor) -> None:
        self.since_us = since_us
        self.watch: Watch | Progressor | None = watch
        self.begins_anew = False
        self.is_violated = False

    @property
    def is_open(self) -> bool:
        return self.watch is not None and not self.begins_anew
