"""What does a log hold, is all of it readable, how is it copied, and how does it lose what nobody asks for any more?"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any  # rows of any kind

from sqlalchemy import ColumnElement, Connection, Delete, Update, delete, func, select, update

from service.errors import LogError
from service.store import schema
from service.store.chunks.columns import DamagedChunkError
from service.store.chunks.kinds import CHUNK_KINDS, FRAMES, SPAN_US, ChunkKind
from service.store.chunks.packing import PRUNED, opened, said_of_missing
from service.store.databases.database import Database, explained
from service.store.databases.sqlite_file import SqliteFile
from service.store.log import EventLog
from service.store.versions import read_version
from service.store.writer import take_seqs

KEPT_FOR_EVER = FRAMES.name
"""By its frames a log knows what time it covers, so that nobody takes what was pruned for what never was."""

AUDIT = schema.audit.name
"""Rows of no run, by the time at which they were written."""

PRUNABLE = ("events", AUDIT, *(name for name in CHUNK_KINDS if name != KEPT_FOR_EVER))


@dataclass(frozen=True, slots=True)
class Holding:
    """Say what a run holds of a kind.

    Attributes
    ----------
    kind : `events`, or a kind of `CHUNK_KINDS`.
    rows : those that can be read.
    pruned : rows that were there.
    size_bytes : of what is stored, without the pages and indexes of the database.
    first_us, last_us : media times of the first and the last row that can be read; None if there is none.
    """

    kind: str
    rows: int
    pruned: int
    size_bytes: int
    first_us: int | None
    last_us: int | None


def holdings(log: EventLog, run_id: str) -> list[Holding]:
    """Say what a run holds, by kind; kinds of which it never had anything are left out."""
    chunks, events = schema.chunks, schema.events
    is_kept = chunks.c.data.is_not(None)
    of_kind = select(
        chunks.c.kind,
        func.coalesce(func.sum(chunks.c.rows).filter(is_kept), 0),
        func.coalesce(func.sum(chunks.c.rows).filter(~is_kept), 0),
        func.coalesce(func.sum(func.length(chunks.c.data)), 0),
        func.min(chunks.c.first_us).filter(is_kept),
        func.max(chunks.c.last_us).filter(is_kept),
    ).group_by(chunks.c.kind)
    of_events = select(
        func.count(),
        func.coalesce(func.sum(func.length(events.c.body)), 0),
        func.min(events.c.start_us),
        func.max(events.c.end_us),
    )
    with log.connect() as connection:
        run_no = connection.scalar(select(schema.runs.c.run_no).where(schema.runs.c.id == run_id))
        found = [Holding(*row) for row in connection.execute(of_kind.where(chunks.c.run_no == run_no))]
        count, *rest = connection.execute(of_events.where(events.c.run_no == run_no)).one()
    return [Holding("events", count, 0, *rest), *found]


def damage(log: EventLog) -> Iterator[str]:
    """Read everything, and say what cannot be read; nothing if all is well."""
    yield from (f"database: {line}" for line in log.place.faults())
    for run in log.runs():
        for kind in CHUNK_KINDS.values():
            missing = ((span_us, why) for span_us, why in _unreadable(log, run.id, kind) if why != PRUNED)
            yield from (f"run {run.id!r}: {line}" for line in said_of_missing(kind.name, missing))


def _unreadable(log: EventLog, run_id: str, kind: ChunkKind[Any]) -> Iterator[tuple[int, str]]:
    for chunk in log.chunks(run_id, kind):
        try:
            times_us = opened(chunk)["t_us"].codes
        except DamagedChunkError as error:
            yield chunk.span_us, str(error)
        else:
            came = len(times_us), int(times_us.min()), int(times_us.max())
            wanted = chunk.rows, chunk.first_us, chunk.last_us
            if came != wanted:
                yield (
                    chunk.span_us,
                    f"other than their row says: expected rows, first and last time {wanted}, got {came}",
                )


def back_up(source: Database, target: Database) -> list[str]:
    """Copy a log into a file that is not there yet, whoever is writing to the log; both keep their schema.

    The copy gets its name when it is whole and was read; killed before, it is left as `TARGET.part`.

    Returns
    -------
    What is damaged in the copy, as `damage` says it, and so in the log.

    Raises
    ------
    LogError
        If there is no log to copy, or the file is there or cannot be written.
    """
    if not isinstance(target, SqliteFile):
        raise LogError(f"log {target.name!r}: expected a SQLite file, got a server's database, which pg_restore fills")
    source.check_readable()
    version = read_version(source)
    if version is None:
        raise LogError(f"log {source.name!r}: expected an event log, got an empty database")
    target.check_writable()
    _refuse_existing(target.path)
    copy = SqliteFile(target.path.with_name(f"{target.path.name}.part"))
    copy.remove()  # of somebody who was killed
    try:
        source.back_up(copy.path)
        if version == schema.SCHEMA_VERSION:
            with EventLog(copy, "r") as log:
                found = list(damage(log))
        else:  # it would be carried over to be read
            found = list(copy.faults())
        _refuse_existing(target.path)  # it took a while
        copy.path.replace(target.path)
    finally:
        copy.remove()
    return found


def _refuse_existing(target: Path) -> None:
    # A journal that was left would be taken for that of the new file.
    for path in (target, target.with_name(f"{target.name}-wal")):
        if path.exists():
            raise LogError(f"{path}: expected no such file, got one, which stays as it is")


@dataclass(frozen=True, slots=True)
class Pruned:
    """Say what was removed of a kind, or would be."""

    kind: str
    rows: int
    size_bytes: int


def prune(log: EventLog, keep_us: Mapping[str, int], now_utc_us: int, *, dry_run: bool = False) -> list[Pruned]:
    """Remove what is older than it is to be kept, and give its room back.

    Of a run nobody knows when it was (`start_from` of its record), all stays.

    Parameters
    ----------
    keep_us : how long rows of a kind are kept; of others all.
    dry_run : only say what would go.

    Raises
    ------
    LogError
        If a kind is unknown or is kept for ever, or the log cannot be written.
    """
    for kind in keep_us:
        if kind not in PRUNABLE:
            raise LogError(f"prune: expected kinds among {', '.join(PRUNABLE)}, got {kind!r}")
    engine = log.place.writing()
    removed = dict.fromkeys(keep_us, (0, 0))
    with explained(log.place, "a log that can be pruned"), engine.begin() as connection:
        for run in log.runs():
            before_us = {kind: now_utc_us - us - run.start_utc_us for kind, us in keep_us.items() if kind != AUDIT}
            for kind, us in before_us.items() if run.start_from != "unknown" else ():
                rows, size_bytes = _remove(connection, run.id, kind, us, dry_run=dry_run)
                removed[kind] = removed[kind][0] + rows, removed[kind][1] + size_bytes
        if AUDIT in keep_us:
            removed[AUDIT] = _remove(connection, "", AUDIT, now_utc_us - keep_us[AUDIT], dry_run=dry_run)
    engine.dispose()
    if not dry_run and any(rows for rows, _ in removed.values()):
        log.place.compact()
    return [Pruned(kind, *counts) for kind, counts in removed.items()]


def _remove(connection: Connection, run_id: str, kind: str, before_us: int, *, dry_run: bool) -> tuple[int, int]:
    """Remove what of a kind ended before a time; return how many rows, and of how many bytes."""
    run_no = select(schema.runs.c.run_no).where(schema.runs.c.id == run_id).scalar_subquery()
    is_old: ColumnElement[bool]
    if kind == "events":
        events, roles, revisions = schema.events, schema.event_roles, schema.revisions
        is_old = (events.c.run_no == run_no) & (events.c.end_us < before_us)
        sizes = select(func.count(), func.sum(func.length(events.c.body))).where(is_old)
        old_seqs, old_ids = (select(column).where(is_old) for column in (events.c.seq, events.c.id))
        statements: list[Delete | Update] = [
            delete(roles).where(roles.c.seq.in_(old_seqs)),
            delete(revisions).where(revisions.c.revised.in_(old_ids)),
            delete(events).where(is_old),
        ]
    elif kind == AUDIT:
        audit = schema.audit
        is_old = audit.c.at_us < before_us
        texts = audit.c.token + audit.c.method + audit.c.path + audit.c.request_id
        sizes = select(func.count(), func.sum(func.length(texts))).where(is_old)
        statements = [delete(audit).where(is_old)]
    else:
        chunks = schema.chunks
        is_old = (chunks.c.run_no == run_no) & (chunks.c.kind == kind) & chunks.c.data.is_not(None)
        is_old &= chunks.c.span_us <= before_us - SPAN_US
        sizes = select(func.sum(chunks.c.rows), func.sum(func.length(chunks.c.data))).where(is_old)
        statements = [update(chunks).where(is_old).values(data=None)]
    rows, size_bytes = connection.execute(sizes).one()
    if rows and not dry_run:
        for statement in statements:
            connection.execute(statement)
        if kind == "events":
            take_seqs(connection, 1)  # by which who has a page of events knows that it has changed
    return rows or 0, size_bytes or 0
