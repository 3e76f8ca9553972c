"""How are events written to files?

JSONL is the log's own form, one event a line. CSV and Parquet have a column for each role (`role.overtaker`), so that a
spreadsheet or a data frame can filter and count by it; lists stay JSON inside their cell. WebVTT gives chapters to a
player. Everything streams: memory does not grow with the log.
"""

import csv
import io
from collections.abc import Iterable, Iterator, Mapping, Sequence
from html import escape
from itertools import chain
from operator import attrgetter
from typing import Literal

import msgspec

from service.export.ocel import ocel
from service.export.parquet import parquet
from service.questions.events.queries import EventFilter, decode_events, find_role_names, iterate_pages
from service.records.events import EventRecord
from service.records.times import format_media
from service.store.log import EventLog

ExportFormat = Literal["jsonl", "csv", "vtt", "geojson", "ocel", "openlabel", "parquet"]

ROLE_PREFIX = "role."
SHORTEST_SHOWN_US = 1_000_000
COLUMNS = (
    "id", "seq", "type", "chronicle", "version", "source", "run", "start", "end", "start_us", "end_us", "status",
    "confidence", "revises", "place_road", "place_x_m", "place_y_m", "recognised_us", "hypotheses", "sub_events",
)  # fmt: skip
_INTEGERS, _NUMBERS = {"seq", "start_us", "end_us", "recognised_us"}, {"confidence", "place_x_m", "place_y_m"}
_OF_EVENT = attrgetter(
    "id", "seq", "type", "chronicle.name", "chronicle.version", "source", "run", "start", "end", "start_us", "end_us",
    "status", "confidence", "revises",
)  # fmt: skip
_OF_PLACE = attrgetter("road", "x_m", "y_m")
_NOWHERE = (None, None, None)


class _Line(EventRecord, frozen=True, kw_only=True, gc=False):
    """An event whose lists stay JSON."""

    hypotheses: msgspec.Raw  # type: ignore[assignment]  # in place of what they are read into
    sub_events: msgspec.Raw  # type: ignore[assignment]


def events_jsonl(pages: Iterable[str]) -> Iterator[str]:
    """Write events, given as lines of JSON, a page at once."""
    return (f"{lines}\n" for lines in pages)


def events_csv(pages: Iterable[str], role_names: Sequence[str]) -> Iterator[str]:
    """Write events, given as lines of JSON, as CSV, first the titles and then a page at once.

    Parameters
    ----------
    role_names : the roles that get a column; a role that an event lacks stays empty.
    """
    titles = (*COLUMNS, *(ROLE_PREFIX + name for name in role_names))
    for rows in chain([[titles]], (_rows(lines, role_names) for lines in pages)):
        out = io.StringIO(newline="")
        csv.writer(out, lineterminator="\n").writerows(rows)
        yield out.getvalue()


def _rows(lines: str, role_names: Sequence[str]) -> Iterator[tuple[object, ...]]:
    """Give the values of each event in the columns of a table."""
    for event in msgspec.json.Decoder(_Line).decode_lines(lines):
        place = _OF_PLACE(event.place) if event.place else _NOWHERE
        lists = (bytes(event.hypotheses).decode(), bytes(event.sub_events).decode())
        roles = map(event.roles.get, role_names)
        yield (*_OF_EVENT(event), *place, event.recognised_us, *lists, *roles)


def exported(log: EventLog, wanted: EventFilter, form: ExportFormat) -> Iterator[str] | Iterator[bytes]:
    """Write the events of a filter, some at once; between two of these nothing is held of the log.

    Raises
    ------
    QueryError, FilterError
        As `iterate_pages`, at once.
    NotInLogError
        As `openlabel`.
    ExtraMissingError
        As `parquet`.
    """
    if form == "openlabel":
        from service.export.openlabel import openlabel  # loads what holds relations

        return openlabel(log, wanted)
    pages = iterate_pages(log, wanted)
    match form:
        case "jsonl":
            return events_jsonl(pages)
        case "csv" | "parquet":
            return (events_csv if form == "csv" else _parquet)(pages, find_role_names(log, wanted))
        case "vtt":
            return _vtt(pages, {run.id: run.file.first_pts_us or 0 for run in log.runs() if run.file})
        case "geojson":
            from service.export.geojson import event_features, frame_of  # loads what projects

            return event_features(pages, {run.id: frame_of(run) for run in log.runs()})
        case "ocel":
            return ocel(pages, lambda run: {one.car: one.car_class for one in log.cars(run)})


def _parquet(pages: Iterable[str], role_names: Sequence[str]) -> Iterator[bytes]:
    kinds = dict.fromkeys(COLUMNS, "string") | dict.fromkeys(_INTEGERS, "int64") | dict.fromkeys(_NUMBERS, "float64")
    roles = [(ROLE_PREFIX + name, "string") for name in role_names]
    return parquet([*kinds.items(), *roles], chain.from_iterable(_rows(lines, role_names) for lines in pages))


def _vtt(pages: Iterable[str], first_pts_us: Mapping[str, int]) -> Iterator[str]:
    """Write cues in the times of the video, for which a run says where its media time begins."""
    yield "WEBVTT\n"
    for lines in pages:
        yield "".join(_cue(event, first_pts_us.get(event.run, 0)) for event in decode_events(lines))


def _cue(event: EventRecord, zero_us: int) -> str:
    # A cue without duration is never shown.
    times_us = zero_us + event.start_us, zero_us + max(event.end_us, event.start_us + SHORTEST_SHOWN_US)
    start, end = (text if text.count(":") == 1 else text.zfill(12) for text in map(format_media, times_us))
    said = ", ".join(f"{role} {actor}" for role, actor in event.roles.items())
    return f"\n{start} --> {end}\n{escape(f'{event.type}: {said}', quote=False)}\n"
