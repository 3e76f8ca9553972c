"""How do streams become rows? Subscribers that write what a pipeline finds to the event log."""

import math
from bisect import bisect_right
from collections import deque
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from functools import partial
from operator import itemgetter
from typing import Any  # a stream may carry any value

import msgspec
import numpy as np

from anchoring.adapter import Anchored
from anchoring.observations import Cars, Observations
from chronicles.adapter import event_of
from chronicles.events import Occurrence, OccurrenceKey
from chronicles.execution.unfit_events import UnfitCounter
from dyknow.kpl.loader import DeclaredStream
from dyknow.mtl.monitors import MonitorEvent
from dyknow.sample import Sample
from gis.roads.road_network import RoadNetwork
from qsr.adapter import FrameRelations
from service.errors import InputError
from service.records.events import ChronicleRef, EventDraft, EventRecord, Place, SubEvent
from service.records.runs import CameraRecord
from service.records.seen import HypothesisRecord, LeftOutFrame, LinkRecord, SeenObject, Verdict, ViewRecord
from service.runs.graph.pipeline import CARS, OBJECTS, OCCURRENCE, RELATIONS, VERDICT, Pipeline
from service.runs.graph.rows import STALE_US, CarRows, event_drafts, relation_record
from service.store.writer import RunWriter
from vision.objects import FloatArray, VisionObjects
from vision.video.frames import VideoSource


def recorded_streams(pipeline: Pipeline) -> dict[str, DeclaredStream]:
    """Find the streams that a pipeline declares for the log, by name; what it leaves out is not recorded.

    Raises
    ------
    InputError
        If one of them carries other values than its name says, or a stream looks like one of them and is none.
    """
    strange = [name for name in pipeline.deployment.streams if name.startswith("recorded_") and name not in _RECORDED]
    if strange:
        raise InputError(f"{pipeline.kpl.name}: expected streams among {list(_RECORDED)}, got {strange[0]!r}")
    found = {name: pipeline.stream(name, value_type) for name, (value_type, _) in _RECORDED.items()}
    return {name: stream for name, stream in found.items() if stream is not None}


class Recorder:
    """Write what a pipeline finds to one run of an event log.

    Attributes
    ----------
    events : number of events that stand so far; a retracted or a doubtful one does not.
    records_cars, records_events : whether there is a stream of them; without one, they are not known.
    unfit : counts the relation changes that chronicles cannot take.
    lost_views : from when to when a camera's view was lost, and why; the end is None where it was not found again.
    """

    def __init__(
        self,
        writer: RunWriter,
        network: RoadNetwork | None,
        unfit: UnfitCounter,
        *,
        history_us: int,
        min_confidence: float | None = None,
        video: VideoSource | None = None,
        camera: CameraRecord | None = None,
    ) -> None:
        self.unfit = unfit
        self._camera = camera
        self._video = video
        self._min_confidence = min_confidence
        self.events = 0
        self.records_cars = self.records_events = False
        self.lost_views: list[tuple[int, int | None, str]] = []
        self._writer = writer
        self._rows = CarRows(network)
        self._history = CarHistory(history_us)
        self._history_us = history_us
        # When, the identifiers of the events written, and how many of them stand.
        self._told: dict[OccurrenceKey, tuple[int, list[str], int]] = {}

    def attach(self, streams: Mapping[str, DeclaredStream]) -> None:
        """Subscribe to the streams that are to be recorded; see `recorded_streams`."""
        self.records_cars = "recorded_cars" in streams
        self.records_events = not streams.keys().isdisjoint(("recorded_verdicts", "recorded_occurrences"))
        for name, stream in streams.items():
            stream.subscribe(partial(_RECORDED[name][1], self))

    @property
    def cars(self) -> int:
        """Return the number of cars that are written, which is at most ten seconds of media time ago."""
        return self._writer.cars

    def _record_frame(self, sample: Sample[object]) -> None:
        self.record_left_out(sample.valid_us)
        index = getattr(sample.value, "index", None)  # of the source's moments; objects of trajectories have none
        self._writer.append_frames((sample.valid_us,), number=None if index is None else index + 1)

    def record_left_out(self, before_us: float = math.inf) -> None:
        """Write when the frames of the video before a time were that are not looked at."""
        left_out = self._video.take_left_out(before_us) if self._video else ()
        self._writer.append(LeftOutFrame(index + 1, t_us) for index, t_us in left_out)

    def _record_objects(self, sample: Sample[VisionObjects | Observations]) -> None:
        objects = sample.value
        self._writer.append(_seen_objects(objects))
        if isinstance(objects, VisionObjects):
            self._record_view(objects)

    def _record_view(self, objects: VisionObjects) -> None:
        """Write where a moving camera looks; of a fixed one, only that its view is lost, and when it is back.

        One sample tells of a loss, the next one ends it.
        """
        view: tuple[float, ...] | None = None
        if objects.is_lost:
            view = ()
            self.lost_views.append((objects.t_us, None, objects.why_lost))
        elif objects.pixel_from_ground is not None:
            view = tuple(objects.pixel_from_ground.ravel().tolist())
        if not objects.is_lost and self.lost_views and self.lost_views[-1][1] is None:
            from_us, _, why = self.lost_views[-1]
            self.lost_views[-1] = from_us, objects.t_us, why
            view = self._camera.pixel_from_ground if view is None and self._camera else view
        if view is not None:
            self._writer.append((ViewRecord(objects.t_us, view),))

    def _record_cars(self, sample: Sample[Anchored]) -> None:
        cars, filled, former = sample.value.cars, sample.value.filled, sample.value.former
        last_us = {car: self._history.last_us(car) for one in filled for car in one.ids}
        # A vision object may have been seen for a while before it was taken for a hidden car: those rows are better.
        seen = {(one.t_us, car) for one in former for car in one.ids}
        for one in (*former, *filled):
            self._history.insert(one)
        for one in filled:
            self._writer.append_states(
                row for row in self._rows.of(one) if row.t_us > last_us[row.car] and (row.t_us, row.car) not in seen
            )
        self._history.remember(cars)
        for one in (*former, cars):
            self._writer.append_states(self._rows.of(one))
        links = (change._asdict() | {"confidence": round(change.confidence, 3)} for change in sample.value.link_changes)
        self._writer.append(msgspec.convert(link, LinkRecord) for link in links)

    def _record_relations(self, sample: Sample[FrameRelations]) -> None:
        frame = sample.value
        verdicts: list[tuple[tuple[str, ...], Verdict]] = [
            (frame.hypotheses.refuted, "refuted"),
            (frame.hypotheses.validated, "validated"),
            (frame.hypotheses.undecided, "undecided"),
        ]
        self._writer.append(
            HypothesisRecord(sample.valid_us, label, verdict) for labels, verdict in verdicts for label in labels
        )
        for change in frame.changes:
            self.unfit.count(event_of(change))
        self._writer.append(relation_record(change, frame.hypotheses_of(change)) for change in frame.changes)

    def _record_verdict(self, sample: Sample[MonitorEvent]) -> None:
        """Write what a monitor told: a moment, with the beginning of the time that was judged as its first part."""
        event = sample.value
        roles = dict(event.roles)
        draft = EventDraft(
            type=event.name,
            chronicle=ChronicleRef(event.monitor, event.version),
            start_us=event.t_us,
            end_us=event.t_us,
            roles=roles,
            recognised_us=sample.available_us,
            sub_events=(SubEvent("since", event.since_us), SubEvent(event.outcome, event.t_us)),
            place=self._place(roles, event.t_us),
        )
        self._writer.append_events((draft,))
        self.events += 1

    def retract(self, chronicles: Collection[str], events: Iterable[EventRecord], now_us: int) -> None:
        """Take back all events of some chronicles, as the newest states of them."""
        self._told = {key: told for key, told in self._told.items() if key[0] not in chronicles}
        for event in events:
            draft = {name: getattr(event, name) for name in EventDraft.__struct_fields__}
            newer = {"status": "retracted", "revises": event.id, "recognised_us": now_us}
            self._writer.append_events((EventDraft(**draft | newer),))
            self.events -= event.status != "doubtful"

    def _record_occurrence(self, sample: Sample[Occurrence]) -> None:
        occurrence = sample.value
        place = self._place(occurrence.roles, occurrence.start_us)
        self.record_occurrence(occurrence, place, sample.available_us)
        self._forget_before(sample.available_us - self._history_us)

    def record_occurrence(self, occurrence: Occurrence, place: Place | None, now_us: int) -> None:
        """Write an occurrence, or its newer state beside the one that was written before."""
        _, told, stood = self._told.pop(occurrence.key, (now_us, [], 0))
        drafts = event_drafts(occurrence, place, least=self._min_confidence, told=told, now_us=now_us)
        event_ids = self._writer.append_events(drafts)
        standing = sum(draft.status not in ("retracted", "doubtful") for draft in drafts)
        if occurrence.status != "retracted":
            self._told[occurrence.key] = now_us, event_ids, standing
        self.events += standing - stood

    def _forget_before(self, t_us: int) -> None:
        """Forget what was written so long ago that nothing can revise it: hypotheses are decided within seconds."""
        while self._told and next(iter(self._told.values()))[0] < t_us:
            del self._told[next(iter(self._told))]

    def _place(self, roles: Mapping[str, str], start_us: int) -> Place | None:
        """Find where the event began: the first role that is a car, at the start."""
        for symbol in roles.values():
            found = self._history.find(symbol, start_us)
            if found is not None:
                road, x_m, y_m = found
                return Place(self._rows.road(road), x_m, y_m)
        return None


# The streams that are written, the type that each carries, and what takes it; of frames only their times are written,
# so any type will do.
_RECORDED: Mapping[str, tuple[str | None, Callable[[Recorder, Sample[Any]], None]]] = {
    "recorded_frames": (None, Recorder._record_frame),
    "recorded_objects": (OBJECTS, Recorder._record_objects),
    "recorded_cars": (CARS, Recorder._record_cars),
    "recorded_relations": (RELATIONS, Recorder._record_relations),
    "recorded_verdicts": (VERDICT, Recorder._record_verdict),
    "recorded_occurrences": (OCCURRENCE, Recorder._record_occurrence),
}


class CarHistory:
    """Remember where the cars were over the last stretch of time, and nothing else of them: it is minutes long."""

    def __init__(self, length_us: int) -> None:
        self._length_us = length_us
        # When, who was there, and road, x and y of each.
        self._frames: deque[tuple[int, tuple[str, ...], FloatArray]] = deque()

    def remember(self, cars: Cars) -> None:
        """Add the cars of the newest time and forget what is too old."""
        self._frames.append((cars.t_us, cars.ids, np.column_stack((cars.positions.road, cars.centre_m))))
        while self._frames[0][0] < cars.t_us - self._length_us:
            self._frames.popleft()

    def insert(self, cars: Cars) -> None:
        """Add cars of which it was not known where they were at an earlier time."""
        at = self._place_of(cars.t_us)
        if at >= 0 and self._frames[at][0] == cars.t_us:
            _, ids, places = self._frames[at]
            more = np.column_stack((cars.positions.road, cars.centre_m))
            self._frames[at] = cars.t_us, (*ids, *cars.ids), np.concatenate((places, more))

    def last_us(self, car: str) -> int:
        """Return the last time of a car; -1 if there is none."""
        return next((t_us for t_us, ids, _ in reversed(self._frames) if car in ids), -1)

    def find(self, car: str, t_us: int) -> tuple[int, float, float] | None:
        """Return road index, x and y in metres of a car at a time or a little before; None if it was not there."""
        at = self._place_of(t_us)
        while at >= 0 and self._frames[at][0] >= t_us - STALE_US:
            _, ids, places = self._frames[at]
            if car in ids:
                road, x_m, y_m = places[ids.index(car)].tolist()
                return int(road), x_m, y_m
            at -= 1
        return None

    def _place_of(self, t_us: int) -> int:
        """Find the last frame up to a time; -1 if there is none."""
        return bisect_right(self._frames, t_us, key=itemgetter(0)) - 1


def _seen_objects(objects: VisionObjects | Observations) -> Iterator[SeenObject]:
    columns = zip(
        objects.ids,
        objects.centre_m.tolist(),
        objects.heading_rad.tolist(),
        objects.length_m.tolist(),
        objects.width_m.tolist(),
        objects.observed.tolist(),
        objects.clipped.tolist(),
        strict=True,
    )
    for name, (x_m, y_m), heading, length, width, observed, clipped in columns:
        yield SeenObject(objects.t_us, name, x_m, y_m, heading, length, width, observed, clipped)
