"""How does a repeated run take the place of the one before? It is written beside the log, and moved in at its end.

Until then readers see the run before, so a repeat that is killed loses nothing; its rows are left for the next one to
replace. One that was stopped takes the place only of a run that came no further.
"""

import re
from collections.abc import Mapping
from typing import Any

from sqlalchemy import Connection, MetaData, Table, delete, func, insert, literal, select

from service.store import schema
from service.store.chunks.kinds import FRAMES
from service.store.databases.database import Database, explained
from service.store.writer import insert_rows, take_seqs

_AT_ONCE = 1_000
_SEQ = re.compile(r'"seq":\d+')


def take_place(log: Database, beside: Database, run_id: str) -> bool:
    """Replace a run of a log by the one that was written beside, in one transaction.

    Returns
    -------
    False if the repeat was stopped before it came as far as the run that it repeats, which stays then.

    Raises
    ------
    LogError
        If the database refuses.
    """
    engine = log.writing(beside)
    theirs = {
        table: table.to_metadata(MetaData(), schema=beside.namespace) for table in schema.metadata.tables.values()
    }
    try:
        with explained(log, "a log that can be written"), engine.begin() as connection:
            run_no = connection.scalar(select(schema.runs.c.run_no).where(schema.runs.c.id == run_id))
            assert run_no is not None, run_id
            if not _came_as_far(connection, run_no, theirs):
                return False
            _delete(connection, run_no)
            _move_in(connection, run_no, theirs)
            return True
    finally:
        engine.dispose()


def _came_as_far(connection: Connection, run_no: int, theirs: Mapping[Table, Table]) -> bool:
    old = _status_and_frames(connection, schema.runs, schema.chunks, run_no)
    new = _status_and_frames(connection, theirs[schema.runs], theirs[schema.chunks], 1)
    return new[0] == "finished" or (old[0] != "finished" and new[1] >= old[1])


def _status_and_frames(connection: Connection, runs: Table, chunks: Table, run_no: int) -> tuple[str, int]:
    status = connection.scalar(select(runs.c.status).where(runs.c.run_no == run_no)) or ""
    of_frames = select(func.sum(chunks.c.rows)).where(chunks.c.run_no == run_no, chunks.c.kind == FRAMES.name)
    return status, connection.scalar(of_frames) or 0


def _delete(connection: Connection, run_no: int) -> None:
    of_run = select(schema.events.c.seq).where(schema.events.c.run_no == run_no)
    connection.execute(delete(schema.event_roles).where(schema.event_roles.c.seq.in_(of_run)))
    for table in (*schema.RUN_TABLES, schema.runs):
        connection.execute(delete(table).where(table.c.run_no == run_no))


def _move_in(connection: Connection, run_no: int, theirs: Mapping[Table, Table]) -> None:
    """Copy all rows, with the number of the run and with new numbers for its events."""
    events = theirs[schema.events]
    count = connection.scalar(select(func.max(events.c.seq))) or 0
    shift = take_seqs(connection, max(count, 1)) - 1  # one at least: what was here is gone
    for table in (schema.runs, schema.event_roles, *schema.RUN_TABLES):
        columns: dict[str, Any] = dict(theirs[table].c)  # Any: expressions of any type
        if "run_no" in columns:
            columns["run_no"] = literal(run_no)
        if "seq" in columns:
            columns["seq"] = columns["seq"] + shift
        if table is schema.events:  # the one body that tells its own number
            bodies = connection.execute(select(*columns.values()).execution_options(yield_per=_AT_ONCE)).partitions()
            for rows in bodies:
                insert_rows(connection, table, [(*row[:-1], _with_seq(row[-1], row[0])) for row in rows])
        else:
            connection.execute(insert(table).from_select(list(columns), select(*columns.values())))


def _with_seq(body: str, seq: int) -> str:
    """Give the text of an event its number; other numbers of that name may come behind it only."""
    return _SEQ.sub(f'"seq":{seq}', body, count=1)
