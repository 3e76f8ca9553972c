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
from typing import Literal, TextIO

import msgspec

from service.export.ocel import ocel
from service.export.parquet import parquet
from service.questions.events.queries import EventFilter, decode_event, find_role_names, iterate_pages
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


class _Line(EventRecord, frozen=True, kw_only=True):
    """An event whose lists stay JSON."""

    hypotheses: msgspec.Raw  # type: ignore[assignment]  # in place of what they are read into
    sub_events: msgspec.Raw  # type: ignore[assignment]


def write_events_jsonl(texts: Iterable[str], out: TextIO) -> int:
    """Write events, given as JSON text, one a line; return how many."""
    count = 0
    for text in texts:
        out.write(f"{text}\n")
        count += 1
    return count


def write_events_csv(texts: Iterable[str], role_names: Sequence[str], out: TextIO, *, with_header: bool = True) -> int:
    """Write events, given as JSON text, as CSV; return how many.

    Parameters
    ----------
    role_names : the roles that get a column; a role that an event lacks stays empty.
    out : a text file opened with `newline=""`.
    """
    table = csv.writer(out, lineterminator="\n")
    if with_header:
        table.writerow([*COLUMNS, *(ROLE_PREFIX + name for name in role_names)])
    count = 0
    for row in _rows(texts, role_names):
        table.writerow(row)
        count += 1
    return count


def _rows(texts: Iterable[str], role_names: Sequence[str]) -> Iterator[tuple[object, ...]]:
    """Give the values of each event in the columns of a table."""
    for event in map(msgspec.json.Decoder(_Line).decode, texts):
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
            return _jsonl(pages)
        case "csv" | "parquet":
            return (_csv if form == "csv" else _parquet)(pages, find_role_names(log, wanted))
        case "vtt":
            return _vtt(pages, {run.id: run.file.first_pts_us or 0 for run in log.runs() if run.file})
        case "geojson":
            from service.export.geojson import event_features, frame_of  # loads what projects

            return event_features(pages, {run.id: frame_of(run) for run in log.runs()})
        case "ocel":
            return ocel(pages, lambda run: {one.car: one.car_class for one in log.cars(run)})


def _jsonl(pages: Iterable[Iterable[str]]) -> Iterator[str]:
    return ("".join(f"{text}\n" for text in page) for page in pages)


def _csv(pages: Iterable[Iterable[str]], role_names: Sequence[str]) -> Iterator[str]:
    for number, page in enumerate(pages):
        out = io.StringIO(newline="")
        write_events_csv(page, role_names, out, with_header=number == 0)
        yield out.getvalue()


def _parquet(pages: Iterable[Iterable[str]], role_names: Sequence[str]) -> Iterator[bytes]:
    kinds = dict.fromkeys(COLUMNS, "string") | dict.fromkeys(_INTEGERS, "int64") | dict.fromkeys(_NUMBERS, "float64")
    roles = [(ROLE_PREFIX + name, "string") for name in role_names]
    return parquet([*kinds.items(), *roles], _rows(chain.from_iterable(pages), role_names))


def _vtt(pages: Iterable[Iterable[str]], first_pts_us: Mapping[str, int]) -> Iterator[str]:
    """Write cues in the times of the video, for which a run says where its media time begins."""
    yield "WEBVTT\n"
    for page in pages:
        yield "".join(_cue(event, first_pts_us.get(event.run, 0)) for event in map(decode_event, page))


def _cue(event: EventRecord, zero_us: int) -> str:
    # A cue without duration is never shown.
    times_us = zero_us + event.start_us, zero_us + max(event.end_us, event.start_us + SHORTEST_SHOWN_US)
    start, end = (text if text.count(":") == 1 else text.zfill(12) for text in map(format_media, times_us))
    said = ", ".join(f"{role} {actor}" for role, actor in event.roles.items())
    return f"\n{start} --> {end}\n{escape(f'{event.type}: {said}', quote=False)}\n"
