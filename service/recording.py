"""How do streams become rows? Subscribers that write a pipeline's cars, relations and occurrences to the event log."""

from bisect import bisect_right
from collections import deque
from collections.abc import Iterable, Sequence

import numpy as np

from anchoring.adapter import Anchored
from anchoring.observations import Cars, LinkChange
from chronicles.events import Occurrence
from dyknow.sample import Sample
from gis.road_network import RoadNetwork
from qsr.changes import RelationChange
from service.pipeline import CARS, OCCURRENCES, RELATIONS, Pipeline
from service.records import (
    CarState,
    ChronicleRef,
    EventDraft,
    LinkRecord,
    Place,
    RelationRecord,
    RunStatus,
    SubEvent,
)
from service.store.log import RunWriter


class Recorder:
    """Write what a pipeline finds to one run of an event log.

    Attributes
    ----------
    events : number of events written so far.
    cars : symbols of all cars seen so far.
    """

    def __init__(self, writer: RunWriter, network: RoadNetwork | None, *, history_us: int) -> None:
        self.events = 0
        self.cars: set[str] = set()
        self._writer = writer
        self._roads = [road.id for road in network.roads] if network else []
        self._lanes = [lane.id for lane in network.lanes] if network else []
        self._history = CarHistory(history_us)

    def attach(self, pipeline: Pipeline) -> None:
        """Subscribe to the streams of a pipeline."""
        pipeline.source.subscribe(self._record_frame)
        pipeline.node.subscribe(CARS, self._record_cars)
        pipeline.node.subscribe(RELATIONS, self._record_relations)
        pipeline.node.subscribe(OCCURRENCES, self._record_occurrence)

    def finish(self, status: RunStatus, reason: str) -> None:
        """Write the rest and say how the run ended."""
        self._writer.finish(status, reason)

    def _record_frame(self, sample: Sample[object]) -> None:
        self._writer.append_frames((sample.valid_us,))

    def _record_cars(self, sample: Sample[Anchored]) -> None:
        cars = sample.value.cars
        self.cars.update(cars.ids)
        self._history.remember(cars)
        self._writer.append_states(self._states(cars))
        self._writer.append_links(_link_record(change) for change in sample.value.link_changes)

    def _record_relations(self, sample: Sample[Sequence[RelationChange]]) -> None:
        self._writer.append_relations(_relation_record(change) for change in sample.value)

    def _record_occurrence(self, sample: Sample[Occurrence]) -> None:
        drafts = self._drafts(sample.value)
        self.events += len(drafts)
        self._writer.append_events(drafts)

    def _states(self, cars: Cars) -> Iterable[CarState]:
        positions = cars.positions
        columns = zip(
            cars.ids,
            cars.centre_m.tolist(),
            cars.heading_rad.tolist(),
            cars.speed_mps.tolist(),
            cars.length_m.tolist(),
            cars.width_m.tolist(),
            cars.classes,
            positions.road.tolist(),
            positions.along_m.tolist(),
            positions.lane.tolist(),
            cars.linked.tolist(),
            cars.vision_ids,
            strict=True,
        )
        for car, (x_m, y_m), heading, speed, length, width, kind, road, along, lane, linked, vision in columns:
            yield CarState(
                t_us=cars.t_us,
                car=car,
                x_m=x_m,
                y_m=y_m,
                heading_rad=heading,
                speed_mps=speed,
                length_m=length,
                width_m=width,
                car_class=kind,
                road=self._roads[road] if road >= 0 else "",
                along_m=along if road >= 0 else None,
                lane=self._lanes[lane] if lane >= 0 else "",
                linked=linked,
                vision_id=vision,
            )

    def _drafts(self, occurrence: Occurrence) -> list[EventDraft]:
        names = [event.name for event in occurrence.emitted] or [occurrence.chronicle]
        return [
            EventDraft(
                type=name,
                chronicle=ChronicleRef(occurrence.chronicle, occurrence.version),
                start_us=occurrence.start_us,
                end_us=occurrence.end_us,
                roles=dict(occurrence.roles),
                recognised_us=occurrence.recognised_us,
                hypotheses=tuple(occurrence.hypotheses),
                sub_events=tuple(SubEvent(label, t_us) for label, t_us in occurrence.sub_events),
                place=self._place(occurrence),
            )
            for name in names
        ]

    def _place(self, occurrence: Occurrence) -> Place | None:
        """Find where the event began: the first role that is a car, at the start."""
        for symbol in occurrence.roles.values():
            found = self._history.find(symbol, occurrence.start_us)
            if found is not None:
                road, x_m, y_m = found
                return Place(self._roads[road] if road >= 0 else "", x_m, y_m)
        return None


class CarHistory:
    """Remember where the cars were over the last stretch of time."""

    def __init__(self, length_us: int) -> None:
        self._length_us = length_us
        self._times_us: deque[int] = deque()
        self._cars: deque[Cars] = deque()

    def remember(self, cars: Cars) -> None:
        """Add the cars of the newest time and forget what is too old."""
        self._times_us.append(cars.t_us)
        self._cars.append(cars)
        while self._times_us[0] < cars.t_us - self._length_us:
            self._times_us.popleft()
            self._cars.popleft()

    def find(self, car: str, t_us: int) -> tuple[int, float, float] | None:
        """Return road index, x and y in metres of a car at the last time <= t_us; None if it was not there."""
        at = bisect_right(self._times_us, t_us) - 1
        if at < 0 or car not in self._cars[at].ids:
            return None
        cars = self._cars[at]
        row = cars.ids.index(car)
        x_m, y_m = np.round(cars.centre_m[row], 3).tolist()
        return int(cars.positions.road[row]), x_m, y_m


def _link_record(change: LinkChange) -> LinkRecord:
    return LinkRecord(
        t_us=change.t_us,
        kind=change.kind,
        level=change.level,
        lower=change.lower,
        upper=change.upper,
        reason=change.reason,
    )


def _relation_record(change: RelationChange) -> RelationRecord:
    return RelationRecord(
        t_us=change.t_us,
        decided_us=change.decided_us,
        name=change.name,
        args=change.args,
        old=change.old,
        new=change.new,
    )
