"""Who breaks the rules while the pipeline runs? Monitors as processes of the stream graph.

::

    cars ──────┐
               ├── monitors ──> verdicts ──┐
    relations ─┤                           ├── chronicles ──> occurrences
               └───────────────────────────┘

A verdict speaks of a time that lies back by the dating back of relations, just as far as the recogniser waits for them.
So it is not late, as the monitors get each frame's relations before the chronicles: a process that reads another one is
made after it.
"""

from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence

from anchoring.adapter import Anchored
from chronicles.adapter import RecognitionUnit
from chronicles.events import Event, Occurrence
from chronicles.recogniser import Recogniser
from dyknow.monitors.monitors import MonitorEvent, MonitorReport, Monitors
from dyknow.sample import Sample
from gis.road_network import RoadNetwork
from qsr.adapter import FrameRelations
from qsr.changes import RelationChange
from service.car_states import CarRows
from service.monitor_files import LoadedMonitors
from service.monitored_states import TrafficState, WaitingStates
from service.records import CarState

# Speeds of a video wobble about a limit; what is back within a second was no new deed.
CALM_US = 1_000_000


class TrafficMonitors:
    """Runs monitors over the cars and relations of one frame after another, live or out of a log.

    Parameters
    ----------
    lag_us : how far back relation changes are dated, at most; verdicts come that much later than what they speak of.
    """

    def __init__(self, monitors: LoadedMonitors, *, lag_us: int) -> None:
        self._monitors = Monitors(monitors.definitions, calm_us=CALM_US)
        self._waiting = WaitingStates(monitors.features, lag_us=lag_us)

    def take_cars(self, t_us: int, cars: Sequence[CarState], hypotheses: Mapping[str, tuple[str, ...]]) -> None:
        """Take the cars of a frame, with the links on trial below them."""
        self._waiting.take_cars(t_us, cars, hypotheses)

    def take_relations(
        self, t_us: int, changes: Iterable[tuple[RelationChange, tuple[str, ...]]], refuted: Collection[str]
    ) -> list[MonitorEvent]:
        """Take what a frame decided about relations and links, and say which verdicts follow."""
        return self._run(self._waiting.take_relations(t_us, changes, refuted))

    def finish(self) -> list[MonitorEvent]:
        """Give the verdicts on the last states, and end."""
        events = self._run(self._waiting.finish())
        self._monitors.finish()
        return events

    def report(self) -> tuple[MonitorReport, ...]:
        """Count what became of each monitor."""
        return self._monitors.report()

    def _run(self, states: Iterator[tuple[int, TrafficState]]) -> list[MonitorEvent]:
        return [event for t_us, state in states for event in self._monitors.update(t_us, state)]


class MonitoringUnit:
    """Run monitors as a computational unit: cars (input 0) and relations (input 1) in, monitor events out."""

    def __init__(self, monitors: LoadedMonitors, network: RoadNetwork | None, *, lag_us: int) -> None:
        self._has_monitors = bool(monitors.definitions)
        self._traffic = TrafficMonitors(monitors, lag_us=lag_us)
        self._rows = CarRows(network)
        self._now_us = 0

    def update(self, index: int, sample: Sample[Anchored] | Sample[FrameRelations]) -> Iterable[Sample[MonitorEvent]]:
        """Take one frame's cars, or one frame's relations, which make earlier states complete."""
        if not self._has_monitors:
            return ()
        value = sample.value
        if isinstance(value, Anchored):
            self._traffic.take_cars(sample.valid_us, tuple(self._rows.of(value.cars)), value.hypotheses)
            return ()
        self._now_us = sample.available_us
        changes = ((change, value.hypotheses_of(change)) for change in value.changes)
        return self._samples(self._traffic.take_relations(sample.valid_us, changes, value.refuted))

    def finish(self) -> Iterable[Sample[MonitorEvent]]:
        """Give the verdicts on the states that still wait."""
        return self._samples(self._traffic.finish())

    def _samples(self, events: Iterable[MonitorEvent]) -> list[Sample[MonitorEvent]]:
        return [Sample(self._now_us, event.t_us, event) for event in events]


class MonitoredRecognitionUnit:
    """Run a recogniser over relations (input 0) and monitor events (input 1), which are messages to it.

    Parameters
    ----------
    horizon_us : as for `RecognitionUnit`.
    """

    def __init__(self, recogniser: Recogniser, *, horizon_us: int) -> None:
        self._recogniser = recogniser
        self._recognition = RecognitionUnit(recogniser, horizon_us=horizon_us)

    def update(self, index: int, sample: Sample[FrameRelations] | Sample[MonitorEvent]) -> Iterable[Sample[Occurrence]]:
        """Take one frame's relations, or one message such as ``careful_violated[car7]``."""
        value = sample.value
        if isinstance(value, FrameRelations):
            return self._recognition.update(Sample(sample.available_us, sample.valid_us, value))
        found = self._recogniser.observe(Event(value.name, value.objects, value.t_us))
        return [Sample(sample.available_us, occurrence.end_us, occurrence) for occurrence in found]

    def finish(self) -> Iterable[Sample[Occurrence]]:
        """Conclude what the end of the input allows."""
        return self._recognition.finish()
