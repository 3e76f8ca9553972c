"""What happened to whom, on which frames? Objects, events and relations of one run, as ASAM OpenLABEL 1.0.0.

An interval is the frames that a player shows during it, both ends included, counted from 0. Elements have whole numbers
there: that of an event is its sequence number; the names of ours are their `name`. What fills a role of an event is a
relation from the event to it, of the name of the role. Media times to the microsecond stand in the data of events.
"""

from collections.abc import Callable, Iterator
from itertools import chain

import numpy as np
from msgspec.structs import replace

from service.export.json_items import Json, as_json, json_items
from service.questions.events.queries import EventFilter, decode_events, find_last_seq, iterate_pages
from service.questions.observations.relation_intervals import watched_intervals
from service.records.events import EventRecord
from service.records.runs import RunRecord
from service.records.times import TimePoint
from service.store.log import EventLog

_NUMBERS = ("start_us", "end_us", "confidence")
_TEXTS = ("start", "end", "status")
_ALWAYS_US = 1 << 62


def openlabel(log: EventLog, wanted: EventFilter) -> Iterator[str]:
    """Write the events of a filter, the cars of its window, and the relations that were watched and held in it.

    Raises
    ------
    NotInLogError
        If the log holds several runs, and the filter names none or several.
    QueryError, FilterError
        As `iterate_pages`; all of these at once.
    """
    run = log.run(wanted.runs[0] if len(wanted.runs) == 1 else None)
    as_of = find_last_seq(log) if wanted.as_of is None else wanted.as_of
    wanted = replace(wanted, runs=(run.id,), as_of=as_of)  # since events are read twice
    iterate_pages(log, wanted)  # for its errors: what is written begins later
    return _written(log, run, wanted)


def _written(log: EventLog, run: RunRecord, wanted: EventFilter) -> Iterator[str]:
    frames, cars = _Frames(log, run.id), log.cars(run.id)
    from_us, to_us = _media_us(wanted.from_, run, 0), _media_us(wanted.to, run, _ALWAYS_US)
    uids = {one.car: str(number) for number, one in enumerate(cars)}
    seen = {one.car: (one.car_class, frames.shown(one.first_us, one.last_us + 1)) for one in cars}
    told = {one.car for one in cars if one.first_us < to_us and one.last_us >= from_us}

    def events() -> Iterator[EventRecord]:
        return chain.from_iterable(map(decode_events, iterate_pages(log, wanted)))

    def agent(name: str) -> Json:
        told.add(name)
        return {"type": "object", "uid": uids.setdefault(name, str(len(uids)))}

    def roles() -> Iterator[Json]:
        for event in events():
            shown, subject = frames.shown(event.start_us, event.end_us), {"type": "event", "uid": str(event.seq)}
            for role, actor in event.roles.items():
                yield _relation(role, role, [subject], [agent(actor)], shown)

    def relations() -> Iterator[Json]:
        for one in watched_intervals(log, run):
            end_us = _ALWAYS_US if one.end_us is None else one.end_us
            if one.start_us < to_us and end_us > from_us:
                name = one.name if one.value == "true" else f"{one.name} {one.value}"
                first, *others = map(agent, one.args)
                yield _relation(name, one.name, [first], others, frames.shown(one.start_us, end_us))

    def objects() -> Iterator[tuple[str, Json]]:
        for name in filter(told.__contains__, uids):
            kind, shown = seen.get(name, ("other", []))
            yield uids[name], {"name": name, "type": kind, "frame_intervals": shown}

    head = {"openlabel": {"metadata": _metadata(run), "streams": _streams(run), "frame_intervals": frames.shown()}}
    yield f'{as_json(head)[:-2]},"events":{{'
    yield from json_items(_member(str(one.seq), _event(one, frames.shown)) for one in events())
    yield '\n},"relations":{'
    yield from json_items(_member(str(number), one) for number, one in enumerate(chain(roles(), relations())))
    yield '\n},"objects":{'
    yield from json_items(_member(*one) for one in objects())
    yield "\n}}}\n"


class _Frames:
    """The frames of a run's source, counted from 0."""

    def __init__(self, log: EventLog, run_id: str) -> None:
        rows = np.fromiter(chain.from_iterable(log.source_frames(run_id)), np.int64).reshape(-1, 2)
        self._numbers, self._times_us = rows[:, 0] - 1, rows[:, 1].copy()

    def shown(self, start_us: int = 0, end_us: int = _ALWAYS_US) -> list[Json]:
        """Give the frames that are shown during `[start_us, end_us)`, of one without a length that at its time."""
        if not len(self._numbers):
            return []
        places = np.searchsorted(self._times_us, (start_us, max(start_us, end_us - 1)), side="right") - 1
        first, last = self._numbers[places.clip(0)].tolist()
        return [{"frame_start": first, "frame_end": last}]


def _metadata(run: RunRecord) -> Json:
    comment = "Frame 0 is the first one of the source. Times in microseconds count from the start of the source."
    known = {"schema_version": "1.0.0", "name": run.id, "annotator": run.software, "comment": comment}
    return known | {"tagged_file": run.source}


def _streams(run: RunRecord) -> Json:
    return {run.source: {"type": "other" if run.camera is None else "camera", "uri": run.source}}


def _event(event: EventRecord, shown: Callable[[int, int], list[Json]]) -> Json:
    numbers, texts = ([{"name": name, "val": getattr(event, name)} for name in of] for of in (_NUMBERS, _TEXTS))
    texts.append({"name": "chronicle", "val": event.chronicle.name})
    data = {"num": numbers, "text": texts}
    frames = shown(event.start_us, event.end_us)
    return {"name": event.id, "type": event.type, "frame_intervals": frames, "event_data": data}


def _relation(name: str, kind: str, subjects: list[Json], objects: list[Json], frames: list[Json]) -> Json:
    named = {"name": name, "type": kind, "frame_intervals": frames}
    return named | {"rdf_subjects": subjects, "rdf_objects": objects}


def _member(uid: str, element: Json) -> str:
    return f'"{uid}":{as_json(element)}'


def _media_us(time: TimePoint | None, run: RunRecord, default_us: int) -> int:
    if time is None:
        return default_us
    return time.us - (run.start_utc_us if time.clock == "utc" else 0)
