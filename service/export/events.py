"""How are events written to files, and read back?

JSONL is the log's own form, one event a line. CSV has a column for each role (`role.overtaker`), so that a spreadsheet
can filter and count by it; lists stay JSON inside their cell. Everything streams: memory does not grow with the log.
"""

import csv
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import TextIO

import msgspec

from service.errors import ExportError
from service.questions.queries import decode_event
from service.records import ChronicleRef, EventRecord, Place, SubEvent

ROLE_PREFIX = "role."
COLUMNS = (
    "id", "seq", "type", "chronicle", "version", "source", "run", "start", "end", "start_us", "end_us", "status",
    "revises", "place_road", "place_x_m", "place_y_m", "recognised_us", "hypotheses", "sub_events",
)  # fmt: skip


def write_events_jsonl(texts: Iterable[str], out: TextIO) -> int:
    """Write events, given as JSON text, one a line; return how many."""
    count = 0
    for text in texts:
        out.write(f"{text}\n")
        count += 1
    return count


def write_events_csv(texts: Iterable[str], role_names: Sequence[str], out: TextIO) -> int:
    """Write events, given as JSON text, as CSV with a header; return how many.

    Parameters
    ----------
    role_names : the roles that get a column; a role that an event lacks stays empty.
    out : a text file opened with `newline=""`.
    """
    table = csv.writer(out, lineterminator="\n")
    table.writerow([*COLUMNS, *(ROLE_PREFIX + name for name in role_names)])
    count = 0
    for event in map(decode_event, texts):
        table.writerow([*_cells(event), *(event.roles.get(name, "") for name in role_names)])
        count += 1
    return count


def read_events_jsonl(lines: Iterable[str], *, name: str) -> Iterator[EventRecord]:
    """Read events from JSONL lines; `name` is what errors call the file.

    Raises
    ------
    ExportError
        At the first line that is not an event.
    """
    for number, line in enumerate(lines, start=1):
        try:
            yield decode_event(line)
        except msgspec.MsgspecError as error:
            raise ExportError(f"{name}:{number}: expected an event as one JSON object, got {line[:80]!r}") from error


def read_events_csv(lines: Iterable[str], *, name: str) -> Iterator[EventRecord]:
    """Read events from CSV lines as `write_events_csv` writes them; `name` is what errors call the file.

    Raises
    ------
    ExportError
        If a column is missing, or at the first row that is not an event.
    """
    table = csv.DictReader(lines)
    missing = [column for column in COLUMNS if column not in (table.fieldnames or ())]
    if missing:
        raise ExportError(f"{name}:1: expected columns {', '.join(missing)}, got {table.fieldnames!r}")
    for row in table:
        try:
            yield _event(row)
        except (ValueError, TypeError, msgspec.MsgspecError) as error:
            raise ExportError(f"{name}:{table.line_num}: expected an event, got {row!r}") from error


def _cells(event: EventRecord) -> list[str | int | float]:
    place = event.place
    return [
        event.id,
        event.seq,
        event.type,
        event.chronicle.name,
        event.chronicle.version,
        event.source,
        event.run,
        event.start,
        event.end,
        event.start_us,
        event.end_us,
        event.status,
        event.revises or "",
        *((place.road, place.x_m, place.y_m) if place else ("", "", "")),
        event.recognised_us,
        msgspec.json.encode(event.hypotheses).decode(),
        msgspec.json.encode(event.sub_events).decode(),
    ]


def _event(row: Mapping[str, str]) -> EventRecord:
    if None in row:
        raise ValueError("more cells than columns")
    roles = {
        column.removeprefix(ROLE_PREFIX): actor
        for column, actor in row.items()
        if column.startswith(ROLE_PREFIX) and actor
    }
    place = Place(row["place_road"], float(row["place_x_m"]), float(row["place_y_m"])) if row["place_x_m"] else None
    plain = {
        "chronicle": ChronicleRef(row["chronicle"], row["version"]),
        "roles": roles,
        "place": place,
        "revises": row["revises"] or None,
        "hypotheses": msgspec.json.decode(row["hypotheses"], type=tuple[str, ...]),
        "sub_events": msgspec.json.decode(row["sub_events"], type=tuple[SubEvent, ...]),
        **{column: int(row[column]) for column in ("seq", "start_us", "end_us", "recognised_us")},
        **{column: row[column] for column in ("id", "type", "source", "run", "start", "end", "status")},
    }
    return msgspec.convert(plain, EventRecord)
