"""Who breaks the rules while the pipeline runs? Monitors as processes of the stream graph.

::

    cars ──────┐
               ├── states ── monitors ──> verdicts ──┐
    relations ─┤                                     ├── chronicles ──> occurrences
               └─────────────────────────────────────┘

A verdict speaks of a time that lies back by the dating back of relations, just as far as the recogniser waits for them.
So it is not late, as the monitors get each frame's relations before the chronicles: a process that reads another one is
made after it.

Monitors that look at events of chronicles are another matter: their states wait until these events stand, so what they
tell is told later, and no chronicle may look at it. Recognition for them goes on beside the states; see
`StandingEvents`.

An event is true in one state: the first at or after its time. A state is *complete* when no event up to its time can
come or go; until then it is held back from the monitors that look at events.
"""

from bisect import bisect_right, insort
from collections import deque
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from operator import attrgetter
from typing import NamedTuple

from anchoring.adapter import Anchored
from chronicles.adapter import RecognitionUnit
from chronicles.chronicle_set import ChronicleSet
from chronicles.compilation.hierarchy import levels
from chronicles.events import Event, Occurrence
from chronicles.execution.limits import USUAL, Limits
from chronicles.recogniser import Recogniser
from dyknow.mtl.monitors import MonitorEvent, MonitorReport, Monitors
from dyknow.sample import Sample
from gis.roads.road_network import RoadNetwork
from qsr.adapter import FrameRelations
from service.runs.graph.monitored_states import IDLE_US, TrafficState, TrafficStates
from service.runs.graph.rows import CarRows
from service.texts.monitor_files import LoadedMonitors

_NEVER_US, _FOR_GOOD_US = -(2**62), 2**62
_time = attrgetter("t_us")
# Speeds of a video wobble about a limit; what is back within a second was no new deed.
CALM_US = 1_000_000


class StandingEvents:
    """Holds states back until they are complete; recognises the chronicles that monitors look at meanwhile.

    Parameters
    ----------
    chronicles : those of the run.
    names : the events that are looked at; without any, each state is complete at once.
    lag_us : how far back relation changes are dated, at most.
    """

    def __init__(
        self, chronicles: ChronicleSet, names: Collection[str], *, lag_us: int, limits: Limits = USUAL
    ) -> None:
        feeding = chronicles.feeding(names)
        placed = levels(feeding.plans)
        delays_us = (placed[plan.name][1] + us for plan in feeding.plans for name, _, us in plan.given if name in names)
        self._names = names
        self._delay_us = max(delays_us, default=0)
        # Final answers only: what the run tells early, by its own recogniser, may be taken back.
        self._recogniser = Recogniser(feeding, lag_us, early=False, limits=limits)
        self._unit = RecognitionUnit(self._recogniser, horizon_us=lag_us)
        self._complete_us = _NEVER_US if names else _FOR_GOOD_US
        self._waiting: deque[tuple[int, TrafficState]] = deque()
        self._events: list[Event] = []

    def take(self, t_us: int, frame: FrameRelations) -> None:
        """Take what a frame decided."""
        if self._names:
            self._add(one.value for one in self._unit.update(Sample(t_us, t_us, frame)))
            self._complete_us = self._recogniser.settled_us - self._delay_us - 1  # of that very time more may come

    def finish(self, found: Iterable[Occurrence] = ()) -> None:
        """Take it that nothing comes any more, but for what was found otherwise."""
        self._add(one.value for one in self._unit.finish())
        self._add(found)
        self._complete_us = _FOR_GOOD_US

    def hold(self, t_us: int, state: TrafficState) -> None:
        """Take the next state."""
        self._waiting.append((t_us, state))

    def complete(self) -> Iterator[tuple[int, TrafficState]]:
        """Give the states that are complete by now, with their times, and the events in them."""
        while self._waiting and self._waiting[0][0] <= self._complete_us:
            t_us, state = self._waiting.popleft()
            count = bisect_right(self._events, t_us, key=_time)
            yield t_us, state.with_events(self._events[:count])
            del self._events[:count]

    def _add(self, found: Iterable[Occurrence]) -> None:
        for one in found:
            for event in one.given:
                if event.name in self._names and one.confidence >= one.floor:
                    insort(self._events, event, key=_time)


class SynchronisationUnit:
    """Make states as a computational unit: cars (input 0) and relations (input 1) in, traffic states out.

    Parameters
    ----------
    features : what is asked of the states; None if nobody asks, and then there are none.
    standing : hears of the relations; the states' events will be of it.
    """

    def __init__(
        self, features: Collection[str] | None, network: RoadNetwork | None, standing: StandingEvents, *, lag_us: int
    ) -> None:
        self._standing = standing
        self._is_asked = features is not None
        self._states = TrafficStates(features or (), lag_us=lag_us)
        self._rows = CarRows(network)
        self._now_us = 0

    @property
    def left_out(self) -> dict[str, int]:
        """Count by cause what no state needed."""
        return self._states.left_out

    def update(self, index: int, sample: Sample[Anchored] | Sample[FrameRelations]) -> list[Sample[TrafficState]]:
        """Take one frame's cars, or one frame's relations, which make earlier states complete."""
        if not self._is_asked:
            return []
        self._now_us = sample.available_us
        value = sample.value
        if isinstance(value, Anchored):
            rows = tuple(self._rows.of(value.cars))
            return self._samples(self._states.take_cars(sample.valid_us, rows, value.hypotheses.about))
        self._standing.take(sample.valid_us, value)
        changes = ((change, value.hypotheses_of(change)) for change in value.changes)
        known = value.hypotheses
        states = self._states.take_relations(sample.valid_us, changes, known.refuted, known.validated)
        return self._samples(states)

    def advance(self, available_us: int) -> list[Sample[TrafficState]]:
        """Give the states that need not, or may not, wait longer."""
        self._now_us = max(self._now_us, available_us)
        return self._samples(self._states.advance(available_us))

    def finish(self) -> list[Sample[TrafficState]]:
        """Give the states that still wait."""
        self._standing.finish()
        return self._samples(self._states.finish())

    def _samples(self, states: Iterable[tuple[int, TrafficState]]) -> list[Sample[TrafficState]]:
        return [Sample(self._now_us, t_us, state) for t_us, state in states]


class MonitoringUnit:
    """Run monitors as a computational unit: traffic states in, monitor events out.

    Parameters
    ----------
    standing : holds the states back from monitors that look at events.
    lag_us : how long after its time a state comes; the idle time of the synchroniser comes on top.
    """

    def __init__(self, loaded: LoadedMonitors, standing: StandingEvents, *, lag_us: int) -> None:
        late = loaded.looking_at_events
        self._standing = standing
        self._monitors = Monitors([one for one in loaded.definitions if one not in late], calm_us=CALM_US)
        self._late = Monitors(late, calm_us=CALM_US)
        self._wait_us = lag_us + IDLE_US
        self._now_us = 0

    def update(self, sample: Sample[TrafficState]) -> Iterable[Sample[MonitorEvent]]:
        """Give the verdicts on the next state, and those on events in the states that are complete now."""
        self._now_us = sample.available_us
        self._standing.hold(sample.valid_us, sample.value)
        return self._samples((*self._monitors.update(sample.valid_us, sample.value), *self._judge_complete()))

    def advance(self, available_us: int) -> Iterable[Sample[MonitorEvent]]:
        """Give the verdicts on deadlines that have passed without a state: the synchroniser lets none wait longer."""
        self._now_us = available_us
        return self._samples(self._monitors.advance(available_us - self._wait_us))

    def finish(self) -> Iterable[Sample[MonitorEvent]]:
        """Give the verdicts on what has passed by now, and end every instance; what is still open is no event."""
        now_us = self._now_us
        events = (*self._monitors.advance(now_us), *self._judge_complete(), *self._late.advance(now_us))
        self._monitors.finish()
        self._late.finish()
        return self._samples(events)

    def report(self) -> tuple[MonitorReport, ...]:
        """Count the events and instances of each monitor so far."""
        return self._monitors.report() + self._late.report()

    def _judge_complete(self) -> Iterator[MonitorEvent]:
        for t_us, state in self._standing.complete():
            yield from self._late.update(t_us, state)

    def _samples(self, events: Iterable[MonitorEvent]) -> list[Sample[MonitorEvent]]:
        return [Sample(self._now_us, event.t_us, event) for event in events]


class MonitoredRecognitionUnit:
    """Run a recogniser over relations (input 0) and monitor events (input 1), which are messages to it.

    While it runs, recognisers of other chronicles may come beside it, and chronicles may end.

    Parameters
    ----------
    chronicles : names of those that the recogniser is asked for.
    horizon_us : as for `RecognitionUnit`.

    Attributes
    ----------
    now_us : the time of the newest frame.
    """

    def __init__(self, recogniser: Recogniser, chronicles: Collection[str], *, horizon_us: int) -> None:
        self._horizon_us = horizon_us
        self._parts: list[_Part] = []
        self.now_us = 0
        self.replace((), recogniser, chronicles)

    @property
    def left_out(self) -> Mapping[str, int]:
        """Count by chronicle the instances that were beyond its limits."""
        return {name: count for part in self._parts for name, count in part.recognition.left_out.items()}

    @property
    def open_hypotheses(self) -> dict[str, int]:
        """See `Recogniser.open_hypotheses`."""
        return {label: us for part in self._parts for label, us in part.recogniser.open_hypotheses.items()}

    def replace(self, ended: Collection[str], recogniser: Recogniser, begun: Collection[str]) -> None:
        """Tell nothing more of some chronicles, and of others what a recogniser finds that has come as far."""
        for part in self._parts:
            part.asked.difference_update(ended)
        recognition = RecognitionUnit(recogniser, horizon_us=self._horizon_us, now_us=self.now_us)
        parts = [*self._parts, _Part(recogniser, recognition, set(begun))]
        self._parts = [part for part in parts if part.asked]

    def update(self, index: int, sample: Sample[FrameRelations] | Sample[MonitorEvent]) -> Iterable[Sample[Occurrence]]:
        """Take one frame's relations, or one message such as ``careful_violated[car7]``."""
        value = sample.value
        if isinstance(value, FrameRelations):
            self.now_us = sample.valid_us
            relations = Sample(sample.available_us, sample.valid_us, value)
            return self._asked(lambda part: part.recognition.update(relations))
        message = Event(value.name, value.objects, value.t_us)
        return self._asked(
            lambda part: (
                Sample(sample.available_us, occurrence.end_us, occurrence)
                for occurrence in part.recogniser.observe(message)
            )
        )

    def finish(self) -> Iterable[Sample[Occurrence]]:
        """Conclude what the end of the input allows."""
        return self._asked(lambda part: part.recognition.finish())

    def _asked(self, look: "Callable[[_Part], Iterable[Sample[Occurrence]]]") -> list[Sample[Occurrence]]:
        """Let each recogniser look, and keep what is asked of it."""
        return [one for part in self._parts for one in look(part) if one.value.chronicle in part.asked]


class _Part(NamedTuple):
    """A recogniser, as a unit, and the chronicles that it is asked for; the others of its set only feed these."""

    recogniser: Recogniser
    recognition: RecognitionUnit
    asked: set[str]
