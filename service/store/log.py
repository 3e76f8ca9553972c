"""How is an event log opened, filled and read?

::

    with open_log("sqlite:///demo.db", "w") as log:           # nothing is created yet
        writer = log.begin_run(RunRecord(id="r1", source="demo.mp4", start_utc_us=0))
        writer.append_frames([0, 40_000])                     # then states, links, relations, events
        writer.append_states([CarState(...), ...])
        writer.finish("finished")

    with open_log("demo.db") as log:
        for run in log.runs(): ...
        for state in log.states("r1"): ...

Questions about events are in `service.questions.events.queries`.
"""

import heapq
import re
import sqlite3
import time
from collections.abc import Collection, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from functools import cached_property
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Literal, Self, TypeVar

import msgspec
from msgspec import Struct
from sqlalchemy import ColumnElement, Connection, Engine, Select, Table, func, inspect, select

from service.errors import LogError, NotInLogError
from service.records import seen
from service.records.runs import RunRecord, StreamRecord
from service.store import schema
from service.store.chunks import kinds
from service.store.databases.database import Database, Lock, driver_rows, explained
from service.store.databases.location import database_of
from service.store.databases.sqlite_file import SqliteFile
from service.store.repeats import take_place
from service.store.versions import create_schema, up_to_date
from service.store.writer import RunWriter, insert_rows, lock_seqs

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

# What packs and unpacks chunks rests on NumPy, which takes a tenth of a second to load: who lists events needs none.

Mode = Literal["r", "w"]

_Record = TypeVar("_Record", bound=Struct)

_RUN_ID = re.compile(r"[A-Za-z0-9._-]{1,64}", re.ASCII)
_ROWS_AT_ONCE = 5_000
_CHUNKS_AT_ONCE = 8
HASTY_S = 0.01  # ten times what a page of events takes
_STEPS = 1_000  # of SQLite's machine between two looks at the clock; a page takes some thousands


def open_log(url: str, mode: Mode = "r") -> "EventLog":
    """Open an event log.

    Parameters
    ----------
    url : `sqlite:///PATH`, a path that ends in `.db`, or `postgresql+psycopg://...`.
    mode : `r` reads a log that exists; `w` also writes runs. Opening for writing checks that the log can be
        written, but creates nothing: that is left to the first `begin_run`.

    A log of an older schema is carried over to today's, or a copy of it where it cannot be written.

    Raises
    ------
    LogError
        If the URL is not understood, the file is missing (`r`) or cannot be written (`w`), is not a DyKnow log, or
        was written by a newer version.
    """
    database = database_of(url)
    if mode == "w":
        database.check_writable()
    else:
        database.check_readable()
    return EventLog(database, mode)


class EventLog:
    """An open event log; close it after use, or use it in a `with` statement.

    Readers may be on any number of threads; one writer at a time.

    Attributes
    ----------
    place : where it lies.
    read_from : what is read: the same, or a copy where an older log could not be carried over in its place.
    """

    def __init__(self, place: Database, mode: Mode) -> None:
        self.place = place
        self._mode = mode
        self._closing = ExitStack()
        self.read_from = up_to_date(place, self._closing, may_be_empty=mode == "w") if place.exists() else place

    def begin_run(self, run: RunRecord) -> RunWriter:
        """Start a run, creating the log if need be.

        A run with the same identifier is replaced when the new one finishes, in one transaction; until then its rows
        stay, and those of the new one are not seen.

        Raises
        ------
        RunBusyError
            If another writer is at this run; one that was killed is not.
        LogError
            If the log is open for reading only, the identifier is not made of letters, digits, `.`, `_` and `-`, or
            the database refuses.
        """
        if self._mode != "w":
            raise LogError(f"log {self.place.name!r}: expected mode 'w' to begin a run, got {self._mode!r}")
        if not _RUN_ID.fullmatch(run.id):
            raise LogError(f"run: expected an identifier of 1 to 64 letters, digits, '.', '_' or '-', got {run.id!r}")
        lock = self.place.lock(run.id)
        self._closing.callback(lock.release)
        run_no = self._add_run(self._writing, run)
        if run_no is not None:
            return RunWriter(self._writing, self.place, run_no, run, lock)
        return self._begin_repeat(run, lock)

    def _begin_repeat(self, run: RunRecord, lock: Lock) -> RunWriter:
        """Start to write a run beside the log, in which it is already."""
        beside = self.place.beside(run.id)
        beside.remove()  # of a repeat that was killed
        self._closing.callback(beside.remove)
        engine = self._closed_after_use(beside.writing())
        run_no = self._add_run(engine, run)
        assert run_no is not None, beside

        def move_in() -> bool:
            engine.dispose()
            has_place = take_place(self.place, beside, run.id)
            beside.remove()
            return has_place

        return RunWriter(engine, self.place, run_no, run, lock, take_place=move_in)

    def _add_run(self, engine: Engine, run: RunRecord) -> int | None:
        """Put a run after all others and return its number; None if it is there."""
        table = schema.runs
        with explained(self.place, "a log that can be written"), engine.begin() as connection:
            create_schema(connection)
            lock_seqs(connection)  # one at a time takes a number
            if connection.scalar(select(table.c.run_no).where(table.c.id == run.id)) is not None:
                return None
            run_no = (connection.scalar(select(func.max(table.c.run_no))) or 0) + 1
            first_pts_us = run.file.first_pts_us if run.file else None
            body = msgspec.json.encode(run).decode()
            row = (run_no, run.id, run.source, run.start_utc_us, first_pts_us, run.status, run.reason, body)
            insert_rows(connection, table, [row])
        return run_no

    @cached_property
    def _reading(self) -> Engine:
        return self._closed_after_use(self.read_from.reading())

    @cached_property
    def _writing(self) -> Engine:
        return self._closed_after_use(self.place.writing())

    def _closed_after_use(self, engine: Engine) -> Engine:
        self._closing.callback(engine.dispose)
        return engine

    def hasty(self) -> "HastyLog | None":
        """Give this log once more, for a thread that may not wait; None if it is on a server. Closed with this one."""
        place = self.read_from
        return self._closing.enter_context(HastyLog(place, "r")) if isinstance(place, SqliteFile) else None

    def close(self) -> None:
        """Close all connections; rows that were not flushed are lost, and their runs may be written anew."""
        self._closing.close()

    def has_finished(self, run_id: str) -> bool:
        """Tell whether a run is here and went to its end; a log that is not made yet has none."""
        if not self.read_from.exists():
            return False
        with self.connect() as connection:
            if not inspect(connection).has_table(schema.runs.name):
                return False
            query = select(schema.runs.c.status).where(schema.runs.c.id == run_id)
            return connection.scalar(query) == "finished"

    @contextmanager
    def connect(self) -> Iterator[Connection]:
        """Give a connection for reading, in one transaction: everything read through it is one state of the log."""
        with explained(self.place, "a log that can be read"), self._reading.begin() as connection:
            yield connection

    @contextmanager
    def change(self) -> Iterator[Connection]:
        """Give a connection that writes what belongs to no run, in one transaction; others wait for its end."""
        with explained(self.place, "a log that can be written"), self._writing.begin() as connection:
            yield connection

    def rows(self, kind: type[_Record], query: Select[Any]) -> list[_Record]:  # Any: as in `_stream`
        """Read what belongs to no run; a query gives the columns of a kind of entry in its order."""
        with self.connect() as connection:
            return [kind(*row) for row in connection.execute(query)]

    def runs(self) -> list[RunRecord]:
        """List the runs in the order in which they first came to the log."""
        table = schema.runs
        with self.connect() as connection:
            rows = connection.execute(select(table.c.body, table.c.status, table.c.reason).order_by(table.c.run_no))
            return [
                msgspec.structs.replace(msgspec.json.decode(body, type=RunRecord), status=status, reason=reason)
                for body, status, reason in rows
            ]

    def run(self, run_id: str | None = None) -> RunRecord:
        """Find a run; without an identifier, the only one of the log.

        Raises
        ------
        NotInLogError
            If there is no such run, or several when none is named.
        """
        runs = self.runs()
        found = [run for run in runs if run_id is None or run.id == run_id]
        if len(found) == 1:
            return found[0]
        wanted = "the name of one run" if run_id is None else f"a run {run_id!r}"
        raise NotInLogError(f"log {self.place.name!r}: expected {wanted}, got {[run.id for run in runs]!r}")

    def cars(self, run_id: str) -> list[seen.CarRecord]:
        """List the car symbols of a run in the order of first sight."""
        return sorted(self._records(seen.CarRecord, run_id), key=lambda car: car.number)

    def states(
        self, run_id: str, *, cars: Collection[str] | None = None, from_us: int | None = None, to_us: int | None = None
    ) -> Iterator[seen.CarState]:
        """Stream the states of cars, or of all, with `from_us <= t_us < to_us`, ordered by time, then by name."""
        where: kinds.Where = {}
        if cars is not None:
            first_us, last_us = self.life_us(run_id, cars) or (0, -1)
            from_us = first_us if from_us is None else max(first_us, from_us)
            to_us = last_us + 1 if to_us is None else min(last_us + 1, to_us)
            where = {"car": cars.__contains__}
        return self._unpacked(kinds.CAR_STATES, run_id, from_us, to_us, where)

    def state_columns(
        self, run_id: str, names: Sequence[str], *, from_us: int | None = None, to_us: int | None = None
    ) -> "Iterator[tuple[int, list[str], NDArray[np.float64]]]":
        """Stream some numbers of the car states, a span of ten seconds at once; see `packing.numbers`.

        Spans that reach into `from_us <= t_us < to_us` are read whole.
        """
        from service.store.chunks.packing import numbers

        return numbers(
            kinds.CAR_STATES, self.chunks(run_id, kinds.CAR_STATES, from_us, to_us), names, log=self.place.name
        )

    def objects(self, run_id: str) -> Iterator[seen.SeenObject]:
        """Stream the vision objects of a run, ordered by time, then by name; none for a run without vision."""
        return self._unpacked(kinds.SEEN_OBJECTS, run_id)

    def views(self, run_id: str) -> Iterator[seen.ViewRecord]:
        """Stream where the camera of a run looked, ordered by time; none for a fixed camera."""
        return self._unpacked(kinds.VIEWS, run_id)

    def frames(self, run_id: str, *, from_us: int | None = None, to_us: int | None = None) -> Iterator[tuple[int, int]]:
        """Stream (number in the source from 1, t_us) of the frames that a run looked at, in the order of the input.

        Only those with `from_us <= t_us < to_us`.
        """
        return ((one.number, one.t_us) for one in self._unpacked(kinds.FRAMES, run_id, from_us, to_us))

    def source_frames(self, run_id: str) -> Iterator[tuple[int, int]]:
        """Stream (number, t_us) of all frames of the source that a run came to, those not looked at included.

        Runs of before schema 7 know only those that were looked at.
        """
        left_out = ((one.number, one.t_us) for one in self._unpacked(kinds.LEFT_OUT, run_id))
        return heapq.merge(self.frames(run_id), left_out)

    def links(self, run_id: str, *, uppers: Collection[str] | None = None) -> Iterator[seen.LinkRecord]:
        """Stream the changes of the identity chain of a run, or of some upper objects, as they were decided."""
        return self._records(seen.LinkRecord, run_id, *_among(schema.links.c.upper, uppers))

    def hypotheses(self, run_id: str, *, labels: Collection[str] | None = None) -> Iterator[seen.HypothesisRecord]:
        """Stream what has become of the links on trial, all or some of them, in the order in which it was decided."""
        return self._records(seen.HypothesisRecord, run_id, *_among(schema.hypotheses.c.label, labels))

    def streams(self, run_id: str) -> tuple[StreamRecord, ...]:
        """List the processes of a run and what they did, inputs before what reads them; empty if it told nothing."""
        query = select(schema.streams.c.body).where(_of_run(schema.streams.c.run_no, run_id))
        bodies = self._stream(query.order_by(schema.streams.c.number))
        return tuple(msgspec.json.decode(body, type=StreamRecord) for (body,) in bodies)

    def costs(self, run_id: str) -> dict[str, int]:
        """Give the microseconds that each process of a run took, by label; empty if the log does not tell."""
        table = schema.costs
        query = select(table.c.label, table.c.busy_us).where(_of_run(table.c.run_no, run_id))
        return dict(self._stream(query.order_by(table.c.number)))

    def covered_us(self, run_id: str) -> tuple[int, int] | None:
        """Return the times of the first and the last frame of a run; None if it has none."""
        return self._span_us(schema.chunks, run_id, schema.chunks.c.kind == kinds.FRAMES.name)

    def life_us(self, run_id: str, cars: Collection[str]) -> tuple[int, int] | None:
        """Return when the first of some cars was first seen, and the last one last; None if there are none of them."""
        return self._span_us(schema.cars, run_id, schema.cars.c.car.in_(sorted(cars)))

    def _span_us(self, table: Table, run_id: str, condition: ColumnElement[bool]) -> tuple[int, int] | None:
        query = select(func.min(table.c.first_us), func.max(table.c.last_us))
        with self.connect() as connection:
            first_us, last_us = connection.execute(query.where(_of_run(table.c.run_no, run_id), condition)).one()
        return None if first_us is None else (first_us, last_us)

    def last_us(self, run_id: str) -> int:
        """Return the time of the last frame of a run, up to which everything is known; 0 if it has none."""
        return (self.covered_us(run_id) or (0, 0))[1]

    def relations(
        self,
        run_id: str,
        *,
        names: Collection[str] | None = None,
        about: Collection[str] = (),
        from_us: int | None = None,
        to_us: int | None = None,
    ) -> Iterator[seen.RelationRecord]:
        """Stream the relation changes of a run with `from_us <= t_us < to_us` in the order they were decided.

        Parameters
        ----------
        names : of relations; None for all.
        about : only changes with one of these among their arguments are wanted.
        """
        where: kinds.Where = {} if names is None else {"name": names.__contains__}
        if wanted := frozenset(about):
            where = {**where, "args": lambda args: not wanted.isdisjoint(args)}
        return self._unpacked(kinds.RELATIONS, run_id, from_us, to_us, where)

    def late_us(self, run_id: str) -> int:
        """Say how long after it happened a relation change of a run was decided at most, roughly; at least how long."""
        table = schema.chunks
        query = select(func.max(table.c.span_us - table.c.first_us))
        with self.connect() as connection:
            most_us = connection.scalar(
                query.where(_of_run(table.c.run_no, run_id), table.c.kind == kinds.RELATIONS.name)
            )
        return kinds.SPAN_US + (most_us or 0)

    def _unpacked(
        self,
        kind: kinds.ChunkKind[_Record],
        run_id: str,
        from_us: int | None = None,
        to_us: int | None = None,
        where: kinds.Where = MappingProxyType({}),
    ) -> Iterator[_Record]:
        """Stream rows of a kind that is kept in chunks; see `packing.unpacked`."""
        from service.store.chunks.packing import unpacked

        chunks = self.chunks(run_id, kind, from_us, to_us)
        return unpacked(kind, chunks, from_us=from_us, to_us=to_us, where=where, log=self.place.name)

    def chunks(
        self, run_id: str, kind: kinds.ChunkKind[Any], from_us: int | None = None, to_us: int | None = None
    ) -> Iterator[kinds.Chunk]:
        """Stream the chunks of a kind, as they are stored, that may have rows with `from_us <= t_us < to_us`."""
        table = schema.chunks
        query = select(*(table.c[name] for name in kinds.Chunk._fields))
        query = query.where(_of_run(table.c.run_no, run_id), table.c.kind == kind.name)
        if from_us is not None:
            query = query.where(table.c.span_us > from_us - kinds.SPAN_US, table.c.last_us >= from_us)
        if to_us is not None:
            query = query.where(table.c.first_us < to_us)
        if to_us is not None and kind.spans_by == "t_us":
            query = query.where(table.c.span_us < to_us)  # by the index
        rows = self._stream(query.order_by(table.c.span_us, table.c.number), at_once=_CHUNKS_AT_ONCE)
        return map(kinds.Chunk._make, rows)

    def _records(self, kind: type[_Record], run_id: str, *conditions: ColumnElement[bool]) -> Iterator[_Record]:
        """Stream records of a kind, in the order of the primary key of their table."""
        table = schema.TABLE_OF[kind]
        columns = [table.c[name] for name in kind.__struct_fields__]
        query = select(*columns).where(_of_run(table.c.run_no, run_id), *conditions)
        *first, last = table.primary_key.columns
        # Asked for the order of an index, SQLite goes through all rows of the run instead of looking for the few.
        ordered = query.order_by(*first, last + 0 if conditions else last)
        return (kind(*row) for row in self._stream(ordered))

    def _stream(
        self, query: Select[Any], *, at_once: int = _ROWS_AT_ONCE
    ) -> Iterator[Any]:  # Any: a row has the types of the query's columns
        with self.connect() as connection:
            query = query.execution_options(yield_per=at_once)  # nothing is read ahead, wherever rows come from
            for rows in connection.execute(query).partitions(at_once):
                yield from rows

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


class HastyLog(EventLog):
    """A log in a file, read by one thread that may not wait: what takes longer than `HASTY_S` is a `LogError`."""

    def __init__(self, place: Database, mode: Mode) -> None:
        super().__init__(place, mode)
        self._kept = self._closing.enter_context(self._reading.connect())
        self._due_s = 0.0
        driver = self._kept.connection.driver_connection
        assert isinstance(driver, sqlite3.Connection)
        driver.execute("PRAGMA busy_timeout = 0")
        driver.set_progress_handler(lambda: time.monotonic() > self._due_s, _STEPS)

    @contextmanager
    def connect(self) -> Iterator[Connection]:
        """Give the one connection, in one transaction; of SQLAlchemy that would take as long as a small question."""
        self._due_s = time.monotonic() + HASTY_S
        with explained(self.place, "an answer at once"):
            driver_rows(self._kept, "BEGIN")
            try:
                yield self._kept
            finally:
                driver_rows(self._kept, "COMMIT")

    def version(self) -> int:
        """Give a number that is another one after anybody has changed the log."""
        self._due_s = time.monotonic() + HASTY_S
        with explained(self.place, "an answer at once"):
            return int(driver_rows(self._kept, "PRAGMA data_version")[0][0])


def _of_run(run_no: ColumnElement[int], run_id: str) -> ColumnElement[bool]:
    return run_no == select(schema.runs.c.run_no).where(schema.runs.c.id == run_id).scalar_subquery()


def _among(column: ColumnElement[str], values: Collection[str] | None) -> list[ColumnElement[bool]]:
    return [] if values is None else [column.in_(sorted(values))]
