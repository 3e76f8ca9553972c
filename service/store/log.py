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

Questions about events are in `service.questions.queries`.
"""

import re
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from types import TracebackType
from typing import Any, Literal, Self

import msgspec
from sqlalchemy import ColumnElement, Connection, Engine, Select, Table, delete, func, inspect, select
from sqlalchemy.exc import DBAPIError
from sqlalchemy.schema import CreateIndex, CreateTable

from service.errors import LogError, NotInLogError
from service.records import (
    CarRecord,
    CarState,
    HypothesisRecord,
    LinkRecord,
    RelationRecord,
    RunRecord,
    RunStatus,
    SeenObject,
    StreamRecord,
    ViewRecord,
)
from service.store import schema
from service.store.engine import explained, reading_engine, writing_engine
from service.store.location import check_writable, parse_log_url
from service.store.run_lock import RunLock
from service.store.writer import RunWriter, insert_rows

__all__ = ["EventLog", "RunWriter", "open_log"]

Mode = Literal["r", "w"]

_RUN_ID = re.compile(r"[A-Za-z0-9._-]{1,64}", re.ASCII)
_ROWS_AT_ONCE = 5_000


def open_log(url: str, mode: Mode = "r") -> "EventLog":
    """Open an event log.

    Parameters
    ----------
    url : `sqlite:///PATH`, or a path that ends in `.db`.
    mode : `r` reads a log that exists; `w` also writes runs. Opening for writing checks that the log can be
        written, but creates nothing: that is left to the first `begin_run`.

    Raises
    ------
    LogError
        If the URL is not understood, the file is missing (`r`) or cannot be written (`w`), is not a DyKnow log, or
        was written by a version with another schema.
    """
    path = parse_log_url(url)
    if mode == "w":
        check_writable(path)
    elif not path.is_file():
        came = "a folder" if path.is_dir() else "no such file"
        raise LogError(f"log {str(path)!r}: expected an event log, got {came}")
    if path.exists():
        _check_is_log(path, may_be_empty=mode == "w")
    return EventLog(path, mode)


class EventLog:
    """An open event log; close it after use, or use it in a `with` statement.

    Readers may be on any number of threads; one writer at a time.

    Attributes
    ----------
    path : the SQLite file.
    """

    def __init__(self, path: Path, mode: Mode) -> None:
        self.path = path
        self._mode = mode
        self._reading: Engine | None = None
        self._writing: Engine | None = None
        self._locks: list[RunLock] = []

    def begin_run(self, run: RunRecord) -> RunWriter:
        """Start a run, creating the log if need be; a run with the same identifier is replaced.

        The old rows go and the new run appears in one transaction, so a repeated run never doubles its events.

        Raises
        ------
        RunBusyError
            If another writer is at this run; one that was killed is not.
        LogError
            If the log is open for reading only, the identifier is not made of letters, digits, `.`, `_` and `-`, or
            the database refuses.
        """
        if self._mode != "w":
            raise LogError(f"log {str(self.path)!r}: expected mode 'w' to begin a run, got {self._mode!r}")
        if not _RUN_ID.fullmatch(run.id):
            raise LogError(f"run: expected an identifier of 1 to 64 letters, digits, '.', '_' or '-', got {run.id!r}")
        lock = RunLock(self.path, run.id)
        self._locks.append(lock)
        self._writing = self._writing or writing_engine(self.path)
        with explained(self.path, "a log that can be written"), self._writing.begin() as connection:
            _create_schema(connection)
            run_no = _replace_run(connection, run)
        return RunWriter(self._writing, self.path, run_no, run, lock)

    def close(self) -> None:
        """Close all connections; rows that were not flushed are lost, and their runs may be written anew."""
        for lock in self._locks:
            lock.release()
        for engine in (self._reading, self._writing):
            if engine is not None:
                engine.dispose()

    @contextmanager
    def connect(self) -> Iterator[Connection]:
        """Give a connection for reading, in one transaction: everything read through it is one state of the log."""
        if self._reading is None:
            self._reading = reading_engine(self.path)
        with explained(self.path, "a log that can be read"), self._reading.begin() as connection:
            yield connection

    def runs(self) -> list[RunRecord]:
        """List the runs in the order in which they first came to the log."""
        with self.connect() as connection:
            rows = connection.execute(_RUNS.order_by(schema.runs.c.run_no)).all()
        return [_run_record(*row) for row in rows]

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
        raise NotInLogError(f"log {str(self.path)!r}: expected {wanted}, got {[run.id for run in runs]!r}")

    def cars(self, run_id: str) -> list[CarRecord]:
        """List the car symbols of a run in the order of first sight."""
        table = schema.cars
        query = select(table.c.car, table.c.number, table.c.car_class, table.c.first_us, table.c.last_us)
        with self.connect() as connection:
            rows = connection.execute(query.where(_of_run(table.c.run_no, run_id)).order_by(table.c.number)).all()
        return [CarRecord(*row) for row in rows]

    def states(
        self, run_id: str, *, car: str | None = None, from_us: int | None = None, to_us: int | None = None
    ) -> Iterator[CarState]:
        """Stream the car states of a run with `from_us <= t_us < to_us`, ordered by time, then by first sight."""
        table, cars = schema.car_states, schema.cars
        same_car = (cars.c.run_no == table.c.run_no) & (cars.c.car == table.c.car)
        query = select(*list(table.c)[1:]).join(cars, same_car).where(_of_run(table.c.run_no, run_id))
        if car is not None:
            life = select(cars.c.first_us, cars.c.last_us).where(_of_run(cars.c.run_no, run_id), cars.c.car == car)
            with self.connect() as connection:
                first_us, last_us = connection.execute(life).one_or_none() or (0, -1)
            query = query.where(table.c.car == car, table.c.t_us.between(first_us, last_us))
        query = _between(query, table.c.t_us, from_us, to_us).order_by(table.c.t_us, cars.c.number)
        return (CarState(*row) for row in self._stream(query))

    def objects(self, run_id: str) -> Iterator[SeenObject]:
        """Stream the vision objects of a run, ordered by time; none for a run without vision, or of an older log."""
        return (SeenObject(*row) for row in self._rows_of_newer_table(schema.seen_objects, run_id))

    def views(self, run_id: str) -> Iterator[ViewRecord]:
        """Stream where the camera of a run looked, ordered by time; none for a fixed camera."""
        for t_us, numbers in self._rows_of_newer_table(schema.views, run_id):
            yield ViewRecord(t_us, msgspec.json.decode(numbers, type=tuple[float, ...]))

    # Any: a row has the types of the table's columns.
    def _rows_of_newer_table(self, table: Table, run_id: str) -> Iterator[Any]:
        """Stream the rows of a table that older logs do not have, in the order of its primary key."""
        with self.connect() as connection:
            if not inspect(connection).has_table(table.name):
                return iter(())
        query = select(*list(table.c)[1:]).where(_of_run(table.c.run_no, run_id))
        return self._stream(query.order_by(*table.primary_key.columns))

    def frames(self, run_id: str) -> Iterator[tuple[int, int]]:
        """Stream (number from 1, t_us) of the frames of a run, in the order of the input."""
        table = schema.frames
        query = select(table.c.number, table.c.t_us).where(_of_run(table.c.run_no, run_id)).order_by(table.c.number)
        return ((number, t_us) for number, t_us in self._stream(query))

    def links(self, run_id: str) -> Iterator[LinkRecord]:
        """Stream the changes of the identity chain of a run in the order in which they were decided."""
        table = schema.links
        query = select(*list(table.c)[2:]).where(_of_run(table.c.run_no, run_id)).order_by(table.c.number)
        return (LinkRecord(*row) for row in self._stream(query))

    def hypotheses(self, run_id: str) -> Iterator[HypothesisRecord]:
        """Stream what has become of the links on trial, in the order in which it was decided."""
        table = schema.hypotheses
        query = select(*list(table.c)[2:]).where(_of_run(table.c.run_no, run_id)).order_by(table.c.number)
        return (HypothesisRecord(*row) for row in self._stream(query))

    def streams(self, run_id: str) -> tuple[StreamRecord, ...]:
        """List the processes of a run and what they did, inputs before what reads them; empty if it told nothing."""
        table = schema.streams
        query = select(table.c.body).where(_of_run(table.c.run_no, run_id)).order_by(table.c.number)
        with self.connect() as connection:
            if not inspect(connection).has_table(table.name):
                return ()  # an older log
            return tuple(msgspec.json.decode(body, type=StreamRecord) for body in connection.scalars(query))

    def costs(self, run_id: str) -> dict[str, int]:
        """Give the microseconds that each process of a run took, by label; empty if the log does not tell."""
        table = schema.costs
        query = select(table.c.label, table.c.busy_us).where(_of_run(table.c.run_no, run_id))
        with self.connect() as connection:
            if not inspect(connection).has_table(table.name):
                return {}  # an older log
            return {row.label: row.busy_us for row in connection.execute(query.order_by(table.c.number))}

    def covered_us(self, run_id: str) -> tuple[int, int] | None:
        """Return the times of the first and the last frame of a run; None if it has none."""
        table = schema.frames
        query = select(func.min(table.c.t_us), func.max(table.c.t_us)).where(_of_run(table.c.run_no, run_id))
        with self.connect() as connection:
            first_us, last_us = connection.execute(query).one()
        return None if first_us is None else (first_us, last_us)

    def last_us(self, run_id: str) -> int:
        """Return the time of the last frame of a run, up to which everything is known; 0 if it has none."""
        return (self.covered_us(run_id) or (0, 0))[1]

    def relations(
        self, run_id: str, *, name: str | None = None, from_us: int | None = None, to_us: int | None = None
    ) -> Iterator[RelationRecord]:
        """Stream the relation changes of a run with `from_us <= t_us < to_us` in the order they were decided."""
        table = schema.relations
        query = select(*list(table.c)[2:]).where(_of_run(table.c.run_no, run_id))
        if name is not None:
            query = query.where(table.c.name == name)
        query = _between(query, table.c.t_us, from_us, to_us).order_by(table.c.number)
        for t_us, decided_us, relation, args, old, new, hypotheses in self._stream(query):
            yield RelationRecord(t_us, decided_us, relation, _texts(args), old, new, _texts(hypotheses))

    def _stream(self, query: Select[Any]) -> Iterator[Any]:  # Any: a row has the types of the query's columns
        with self.connect() as connection:
            for rows in connection.execute(query).partitions(_ROWS_AT_ONCE):
                yield from rows

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        self.close()


_RUNS = select(schema.runs.c.body, schema.runs.c.status, schema.runs.c.reason)


def _run_record(body: str, status: RunStatus, reason: str) -> RunRecord:
    run = msgspec.json.decode(body, type=RunRecord)
    return msgspec.structs.replace(run, status=status, reason=reason)


def _texts(array: str) -> tuple[str, ...]:
    return msgspec.json.decode(array, type=tuple[str, ...])


def _of_run(run_no: ColumnElement[int], run_id: str) -> ColumnElement[bool]:
    return run_no == select(schema.runs.c.run_no).where(schema.runs.c.id == run_id).scalar_subquery()


# Any: it narrows any query, whatever its columns.
def _between(query: Select[Any], t_us: ColumnElement[int], from_us: int | None, to_us: int | None) -> Select[Any]:
    if from_us is not None:
        query = query.where(t_us >= from_us)
    return query if to_us is None else query.where(t_us < to_us)


def _check_is_log(path: Path, *, may_be_empty: bool) -> None:
    """Refuse a file that is not an event log, or is one of a newer schema."""
    wanted = "an event log written by dyknow"
    engine = reading_engine(path)
    try:
        with explained(path, wanted), engine.begin() as connection:
            tables = inspect(connection).get_table_names()
            if not tables and may_be_empty:
                return  # a first run was killed before its first transaction
            found = _meta(connection) if schema.meta.name in tables else {}
    finally:
        engine.dispose()
    if found.get("application") != schema.APPLICATION:
        raise LogError(f"log {str(path)!r}: expected {wanted}, got a database with tables {sorted(tables)[:5]!r}")
    version = found.get("schema_version", "")
    if version != str(schema.SCHEMA_VERSION):
        is_newer = version.isdigit() and int(version) > schema.SCHEMA_VERSION
        hint = "; a newer dyknow reads it" if is_newer else "; process the input again into a new log"
        raise LogError(f"log {str(path)!r}: expected schema version {schema.SCHEMA_VERSION}, got {version!r}{hint}")


def _meta(connection: Connection) -> dict[str, str]:
    try:
        return {key: value for key, value in connection.execute(select(schema.meta.c.key, schema.meta.c.value))}  # noqa: C416
    except DBAPIError:
        return {}  # another program's table of that name


def _create_schema(connection: Connection) -> None:
    is_new = not inspect(connection).has_table(schema.meta.name)
    _create_tables(connection)  # what is missing: an older log has no `streams`
    if not is_new:
        return
    values = {"application": schema.APPLICATION, "schema_version": str(schema.SCHEMA_VERSION), "last_seq": "0"}
    insert_rows(connection, schema.meta, list(values.items()))


def _create_tables(connection: Connection) -> None:
    """Create the missing tables in an order of their own: `create_all` takes indexes as a set gives them."""
    present = set(inspect(connection).get_table_names())
    for table in schema.metadata.sorted_tables:
        if table.name not in present:
            connection.execute(CreateTable(table))
            for index in sorted(table.indexes, key=lambda one: str(one.name)):
                connection.execute(CreateIndex(index))


def _replace_run(connection: Connection, run: RunRecord) -> int:
    """Put a run in place of the one of the same identifier, or after all others; return its number."""
    table = schema.runs
    run_no = connection.scalar(select(table.c.run_no).where(table.c.id == run.id))
    if run_no is None:
        run_no = (connection.scalar(select(func.max(table.c.run_no))) or 0) + 1
    else:
        _delete_run(connection, run_no)
    body = msgspec.json.encode(run).decode()
    insert_rows(connection, table, [(run_no, run.id, run.source, run.start_utc_us, run.status, run.reason, body)])
    return run_no


def _delete_run(connection: Connection, run_no: int) -> None:
    of_run = select(schema.events.c.seq).where(schema.events.c.run_no == run_no)
    connection.execute(delete(schema.event_roles).where(schema.event_roles.c.seq.in_(of_run)))
    for table in (*schema.RUN_TABLES, schema.runs):
        connection.execute(delete(table).where(table.c.run_no == run_no))
