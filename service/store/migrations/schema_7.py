"""How does schema 6 become schema 7? What comes by the thousand in a minute is kept in chunks.

The table of revisions gets its key first, as SQLite's own check of a file wants it.
"""

import json
from collections.abc import Iterator, Sequence
from itertools import groupby
from operator import itemgetter
from typing import Any  # a row has values of any type

from alembic import op

from service.store.chunks.columns import pack

revision, down_revision = "7", "6"

SPAN_US = 10_000_000
# What is in a table, by which time it is in a span, and in which order it is there.
TABLES = {
    "car_states": ("t_us", "car, t_us"),
    "seen_objects": ("t_us", "vision_id, t_us"),
    "views": ("t_us", "t_us"),
    "frames": ("t_us", "number"),
    "relations": ("decided_us", "number"),
}
BOOLEANS = ("linked", "observed", "clipped")
ARRAYS = ("args", "hypotheses", "pixel_from_ground")
STATEMENTS = (
    """CREATE TABLE chunks (
        run_no INTEGER NOT NULL, kind TEXT NOT NULL, span_us BIGINT NOT NULL, number INTEGER NOT NULL,
        first_us BIGINT NOT NULL, last_us BIGINT NOT NULL, rows INTEGER NOT NULL, data BLOB,
        PRIMARY KEY (run_no, kind, span_us, number))""",
    "ALTER TABLE revisions RENAME TO former_revisions",
    """CREATE TABLE revisions (revised TEXT NOT NULL, run_no INTEGER NOT NULL, PRIMARY KEY (revised)) WITHOUT ROWID""",
    "INSERT INTO revisions SELECT revised, run_no FROM former_revisions",
    "DROP TABLE former_revisions",
)


def upgrade() -> None:
    """Move the rows."""
    for statement in STATEMENTS:
        op.execute(statement)
    database = op.get_bind().connection.driver_connection
    assert database is not None
    for number, row in enumerate(_chunks(database), start=1):
        database.execute("INSERT INTO chunks VALUES (?, ?, ?, ?, ?, ?, ?, ?)", (*row[:3], number, *row[3:]))
    for table in TABLES:
        database.execute(f"DROP TABLE {table}")


def _chunks(database: Any) -> Iterator[tuple[Any, ...]]:  # Any: the driver's connection
    for table, (time, order) in TABLES.items():
        span = f"{time} / {SPAN_US} * {SPAN_US}"
        cursor = database.execute(f"SELECT {span}, * FROM {table} ORDER BY run_no, 1, {order}")
        names = [one[0] for one in cursor.description]
        for (run_no, span_us), group in groupby(cursor, key=itemgetter(1, 0)):
            columns = {
                name: _values(name, values)
                for name, values in zip(names[2:], zip(*(row[2:] for row in group), strict=True), strict=True)
                if table == "frames" or name != "number"
            }
            times_us = columns["t_us"]
            yield run_no, table, span_us, min(times_us), max(times_us), len(times_us), pack(columns)


def _values(name: str, values: Sequence[Any]) -> list[Any]:
    if name in BOOLEANS:
        return [bool(value) for value in values]
    return [tuple(json.loads(value)) for value in values] if name in ARRAYS else list(values)
