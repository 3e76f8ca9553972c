"""How are events written to files?

JSONL is the log's own form, one event a line. CSV has a column for each role (`role.overtaker`), so that a spreadsheet
can filter and count by it; lists stay JSON inside their cell. Everything streams: memory does not grow with the log.
"""

import csv
from collections.abc import Iterable, Sequence
from typing import TextIO

import msgspec
from msgspec.structs import asdict

from service.questions.queries import decode_event
from service.records import EventRecord

ROLE_PREFIX = "role."
COLUMNS = (
    "id", "seq", "type", "chronicle", "version", "source", "run", "start", "end", "start_us", "end_us", "status",
    "confidence", "revises", "place_road", "place_x_m", "place_y_m", "recognised_us", "hypotheses", "sub_events",
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


def _cells(event: EventRecord) -> list[object]:
    cells = asdict(event) | {
        "chronicle": event.chronicle.name,
        "version": event.chronicle.version,
        "hypotheses": msgspec.json.encode(event.hypotheses).decode(),
        "sub_events": msgspec.json.encode(event.sub_events).decode(),
    }
    if event.place:
        cells |= {f"place_{name}": value for name, value in asdict(event.place).items()}
    return [cells.get(name) for name in COLUMNS]
