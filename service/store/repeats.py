"""How does a repeated run take the place of the one before? It is written beside the log, and moved in at its end.

Until then readers see the run before, so a repeat that is killed loses nothing; its file is left for the next one to
replace. One that was stopped takes the place only of a run that came no further.
"""

from pathlib import Path
from typing import Any

from sqlalchemy import Connection, MetaData, Table, delete, func, insert, literal, select

from service.store import schema
from service.store.chunks import FRAMES
from service.store.engine import explained, writing_engine
from service.store.writer import take_seqs


def file_beside(log: Path, run_id: str) -> Path:
    """Say where a repeat is written."""
    return log.with_name(f"{log.name}-{run_id}.again")


def remove_log(path: Path) -> None:
    """Remove the file of a log that nobody has open, if there is one."""
    for suffix in ("", "-wal", "-shm"):
        path.with_name(path.name + suffix).unlink(missing_ok=True)


def take_place(log: Path, beside: Path, run_id: str) -> bool:
    """Replace a run of a log by the one that was written beside, in one transaction.

    Returns
    -------
    False if the repeat was stopped before it came as far as the run that it repeats, which stays then.

    Raises
    ------
    LogError
        If the database refuses.
    """
    engine = writing_engine(log, beside=beside)
    try:
        with explained(log, "a log that can be written"), engine.begin() as connection:
            run_no = connection.scalar(select(schema.runs.c.run_no).where(schema.runs.c.id == run_id))
            assert run_no is not None, run_id
            if not _came_as_far(connection, run_no):
                return False
            _delete(connection, run_no)
            _move_in(connection, run_no)
            return True
    finally:
        engine.dispose()


def _came_as_far(connection: Connection, run_no: int) -> bool:
    old = _status_and_frames(connection, schema.runs, schema.chunks, run_no)
    new = _status_and_frames(connection, _beside(schema.runs), _beside(schema.chunks), 1)
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


def _move_in(connection: Connection, run_no: int) -> None:
    """Copy all rows, with the number of the run and with new numbers for its events."""
    events = _beside(schema.events)
    count = connection.scalar(select(func.max(events.c.seq))) or 0
    shift = take_seqs(connection, count) - 1
    for table in (schema.runs, schema.event_roles, *schema.RUN_TABLES):
        source = _beside(table)
        columns: dict[str, Any] = dict(source.c)  # Any: expressions of any type
        if "run_no" in columns:
            columns["run_no"] = literal(run_no)
        if "seq" in columns:
            columns["seq"] = source.c.seq + shift
        if table is schema.events:  # the one body that tells its own number
            columns["body"] = func.json_set(source.c.body, "$.seq", source.c.seq + shift)
        connection.execute(insert(table).from_select(list(columns), select(*columns.values())))


def _beside(table: Table) -> Table:
    return table.to_metadata(MetaData(), schema="beside")
