"""How do the results of a run become rows of the event log?

A `RunWriter` collects rows and writes them in batches, one transaction each. A batch goes out when it is large or when
the media time of a chunk is over, so that readers follow a run and a killed one loses little. No clock is read: the
same input gives the same rows in the same transactions.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from itertools import groupby
from operator import attrgetter
from typing import Any  # records of any kind

import msgspec
from msgspec import Struct
from msgspec.structs import asdict, astuple
from sqlalchemy import Connection, Engine, Table, case, select, update
from sqlalchemy.dialects import postgresql, sqlite

from service.errors import RunBusyError
from service.records.events import EventDraft, EventRecord
from service.records.runs import RunRecord, RunStatus, StreamRecord
from service.records.seen import CarState, FrameRecord
from service.store import schema
from service.store.chunks.kinds import CHUNK_KINDS, SPAN_US, ChunkKind
from service.store.databases.database import Database, Lock, explained

BATCH_ROWS = 20_000

# Rows of these keep the order in which they were appended.
_NUMBERED = (schema.links, schema.hypotheses, schema.streams, schema.costs)
_CHUNKED: Mapping[type[Struct], ChunkKind[Any]] = {kind.record: kind for kind in CHUNK_KINDS.values()}

_Life = tuple[str, int, int]
"""Of a car: its class, its first and its last time."""

# What tells of rows that are there already is said in the words of each database, which are the same.
_INSERT: Mapping[str, Any] = {"sqlite": sqlite.insert, "postgresql": postgresql.insert}  # Any: of two types

Row = tuple[str | int | float | bool | bytes | None, ...]


class RunWriter:
    """Write one run; made by `EventLog.begin_run`.

    Rows become visible to readers at each `flush`, in the order in which they were appended; `finish` flushes and
    closes the run. A run that never finishes stays `running` in the log until it is repeated.

    Attributes
    ----------
    run_id : the identifier of the run.
    cars : how many there are, as of the last flush.
    is_repeat : whether its rows are not in the log until it is finished, since there is a run of that identifier.
    """

    def __init__(
        self,
        engine: Engine,
        place: Database,
        run_no: int,
        run: RunRecord,
        lock: Lock,
        *,
        take_place: Callable[[], bool] | None = None,
    ) -> None:
        self.run_id = run.id
        self.is_repeat = take_place is not None
        self._lock, self._take_place = lock, take_place
        self._engine = engine
        self._place = place
        self._run_no = run_no
        self._run = run
        self._drafts: list[tuple[str, EventDraft]] = []
        self._rows: dict[Table, list[Row]] = {table: [] for table in _NUMBERED}
        self._records: dict[type[Struct], list[Struct]] = {kind: [] for kind in _CHUNKED}
        self._counts = dict.fromkeys((schema.events, schema.chunks, *_NUMBERED), 0)
        self._frame_number = 0
        self.cars = 0
        self._flushed_us = 0
        self._is_open = True

    def append_frames(self, times_us: Iterable[int], *, number: int | None = None) -> None:
        """Add the time stamps of frames that were looked at, with or without cars, in the order of the input.

        Frame numbers of exports come from here.

        Parameters
        ----------
        times_us : of neighbours in the source.
        number : of the first of them in the source, from 1; None for the one after the last that was added.
        """
        if number is not None:
            self._frame_number = number - 1
        for t_us in times_us:
            self._flush_when_due(t_us)
            self._frame_number += 1
            self._records[FrameRecord].append(FrameRecord(self._frame_number, t_us))

    def append_states(self, states: Iterable[CarState]) -> None:
        """Add cars at one or more frames, in the order of time; a car has one state a frame."""
        for t_us, group in groupby(states, key=attrgetter("t_us")):
            self._flush_when_due(t_us)
            self._records[CarState] += group

    def append_events(self, events: Iterable[EventDraft]) -> list[str]:
        """Add recognised events, or newer states of such; return their identifiers.

        An event gets its sequence number when it is written.
        """
        first = len(self._drafts)
        for draft in events:
            assert draft.end_us >= draft.start_us, draft
            self._drafts.append((f"{self.run_id}-{self._next(schema.events)}", draft))
        event_ids = [event_id for event_id, _ in self._drafts[first:]]
        self._flush_when_due(self._flushed_us)
        return event_ids

    def append(self, records: Iterable[Struct]) -> None:
        """Add records that are kept in chunks or in a table, those of one kind in the order of time or of decision."""
        for record in records:
            kind = type(record)
            if kind in self._records:
                self._records[kind].append(record)
            else:
                # A tuple is a JSON array there.
                values = tuple(_json(one) if isinstance(one, tuple) else one for one in astuple(record))
                self._append(schema.TABLE_OF[kind], values)

    def append_streams(self, streams: Iterable[StreamRecord]) -> None:
        """Add what the processes of the run did, inputs before what reads them."""
        for stream in streams:
            self._append(schema.streams, (_json(stream),))

    def append_costs(self, costs: Mapping[str, int]) -> None:
        """Add the microseconds that were spent in the code of each process, by label."""
        for cost in costs.items():
            self._append(schema.costs, cost)

    def _append(self, table: Table, values: Row) -> None:
        self._rows[table].append((self._run_no, self._next(table), *values))

    def flush(self) -> None:
        """Write everything collected so far in one transaction.

        Raises
        ------
        LogError
            If the database refuses (disk full, locked by another writer), or a car has two states at a frame; if its
            server was restarted, and somebody else is at the run since then.
        """
        assert self._is_open, "the run is finished"
        if not self._lock.is_held():
            wanted = f"log {self._place.name!r}: expected run {self.run_id!r} to stay ours"
            raise RunBusyError(f"{wanted}, got another writer since its server was restarted")
        with explained(self._place, "a log that can be written"), self._engine.begin() as connection:
            self._write_events(connection)
            for table, rows in self._rows.items():
                insert_rows(connection, table, rows)
            insert_rows(connection, schema.chunks, list(self._chunk_rows()))
            self._write_cars(connection)
        for waiting in self._waiting:
            waiting.clear()

    def _chunk_rows(self) -> Iterator[Row]:
        from service.store.chunks.packing import packed

        for kind, records in self._records.items():
            for chunk in packed(_CHUNKED[kind], records):
                number = self._next(schema.chunks)
                yield (self._run_no, _CHUNKED[kind].name, chunk.span_us, number, *chunk[1:])

    def describe(self, run: RunRecord) -> None:
        """Say other things about the run: of the same name, source and start.

        Raises
        ------
        LogError
            If the database refuses.
        """
        self._change_run(body=_json(run))

    def finish(self, status: RunStatus, reason: str = "") -> bool:
        """Write the rest and close the run; nothing can be appended afterwards.

        Parameters
        ----------
        status : `finished`; `broken` if the input could not be read to its end; `interrupted`; `failed`.
        reason : where and why it stopped early; empty when finished.

        Returns
        -------
        False if it repeats a run that came further: then that one stays, and this one is gone.
        """
        self.flush()
        self._change_run(status=status, reason=reason)
        self._is_open = False
        has_place = self._take_place is None or self._take_place()
        self._lock.release()
        return has_place

    def _change_run(self, **values: str) -> None:
        with explained(self._place, "a log that can be written"), self._engine.begin() as connection:
            of_run = schema.runs.c.run_no == self._run_no
            connection.execute(update(schema.runs).where(of_run).values(values))

    def _next(self, table: Table) -> int:
        self._counts[table] += 1
        return self._counts[table]

    def _flush_when_due(self, now_us: int) -> None:
        """Write what waits before anything of another span comes, so that a span is rarely cut in two chunks."""
        if now_us // SPAN_US > self._flushed_us // SPAN_US or sum(map(len, self._waiting)) >= BATCH_ROWS:
            self.flush()
            self._flushed_us = max(now_us, self._flushed_us)

    @property
    def _waiting(self) -> list[list[Any]]:
        return [self._drafts, *self._rows.values(), *self._records.values()]

    def _write_events(self, connection: Connection) -> None:
        if not self._drafts:
            return
        first_seq = take_seqs(connection, len(self._drafts))
        event_rows: list[Row] = []
        role_rows: list[Row] = []
        for seq, (event_id, draft) in enumerate(self._drafts, start=first_seq):
            event_rows.append(self._event_row(seq, event_id, draft))
            role_rows.extend((seq, role, actor, draft.start_us) for role, actor in draft.roles.items())
        insert_rows(connection, schema.events, event_rows)
        insert_rows(connection, schema.event_roles, role_rows)
        revised = [(draft.revises, self._run_no) for _, draft in self._drafts if draft.revises is not None]
        insert_rows(connection, schema.revisions, revised)
        _write_types(connection, self._run_no, [draft for _, draft in self._drafts])

    def _write_cars(self, connection: Connection) -> None:
        """Write the life spans of cars that are new, and lengthen those of cars seen again."""
        table = schema.cars
        seen = _lives(self._records[CarState])
        query = select(table.c.car, table.c.car_class, table.c.first_us, table.c.last_us)
        query = query.where(table.c.run_no == self._run_no, table.c.car.in_(seen))
        known: dict[str, _Life] = {car: (kind, *life_us) for car, kind, *life_us in connection.execute(query)}
        rows = list[Row]()
        for name, life in seen.items():
            if name in known:
                values = dict(zip(("car_class", "first_us", "last_us"), _longer(known[name], life), strict=True))
                is_it = (table.c.run_no == self._run_no) & (table.c.car == name)
                connection.execute(update(table).where(is_it).values(values))
            else:
                self.cars += 1
                rows.append((self._run_no, name, self.cars, *life))
        insert_rows(connection, table, rows)

    def _event_row(self, seq: int, event_id: str, draft: EventDraft) -> Row:
        record = EventRecord.of(draft, self._run, event_id, seq)
        values = asdict(record) | {
            "run_no": self._run_no,
            "start_utc_us": self._run.start_utc_us + record.start_us,
            "road": record.place.road if record.place else "",
            "body": _json(record),
        }
        return tuple(values[column.name] for column in schema.events.c)


def _lives(states: Iterable[Any]) -> dict[str, _Life]:
    """Give the life span of each car in some states."""
    lives: dict[str, _Life] = {}
    for state in states:
        now = state.car_class, state.t_us, state.t_us
        lives[state.car] = _longer(lives.get(state.car, now), now)
    return lives


def _longer(before: _Life, now: _Life) -> _Life:
    """Join two parts of a life; `unknown` replaces no class."""
    return before[0] if now[0] == "unknown" else now[0], min(before[1], now[1]), max(before[2], now[2])


def _write_types(connection: Connection, run_no: int, drafts: Sequence[EventDraft]) -> None:
    """Write the longest duration and the role names of each event type, as far as they are new."""
    table = schema.durations
    longest_us: dict[str, int] = {}
    for draft in drafts:
        longest_us[draft.type] = max(draft.end_us - draft.start_us, longest_us.get(draft.type, 0))
    rows = [{"run_no": run_no, "type": name, "longest_us": us} for name, us in sorted(longest_us.items())]
    insert = _INSERT[connection.dialect.name]
    new = insert(table)
    is_longer = table.c.longest_us > new.excluded.longest_us
    longer = case((is_longer, table.c.longest_us), else_=new.excluded.longest_us)
    connection.execute(new.on_conflict_do_update(index_elements=table.primary_key, set_={"longest_us": longer}), rows)
    roles = {(draft.type, role) for draft in drafts for role in draft.roles}
    if roles:
        named = [{"run_no": run_no, "type": name, "role": role} for name, role in sorted(roles)]
        connection.execute(insert(schema.role_names).on_conflict_do_nothing(), named)


def _json(value: object) -> str:
    return msgspec.json.encode(value).decode()


def insert_rows(connection: Connection, table: Table, rows: Sequence[Row]) -> None:
    """Insert rows whose values stand in the order of the table's columns.

    The driver gets the tuples as they are: building a dictionary a row costs more than the insert itself.
    """
    if not rows:
        return
    if connection.dialect.name == "postgresql":
        cursor: Any = connection.connection.cursor()  # Any: the driver's, which may not be installed
        with cursor, cursor.copy(f"COPY {table.name} FROM STDIN") as copy:  # three times as fast as inserts
            for row in rows:
                copy.write_row(row)
        return
    compiled = table.insert().compile(dialect=connection.dialect)
    assert compiled.positional, connection.dialect.paramstyle
    connection.exec_driver_sql(str(compiled), list(rows))


def take_seqs(connection: Connection, count: int) -> int:
    """Reserve sequence numbers within the transaction of a connection; return the first one."""
    last = lock_seqs(connection)
    connection.execute(update(schema.meta).where(_IS_LAST_SEQ).values(value=str(last + count)))
    return last + 1


_IS_LAST_SEQ = schema.meta.c.key == "last_seq"


def lock_seqs(connection: Connection) -> int:
    """Let no other transaction take a number before this one ends; return the last number taken."""
    return int(connection.scalar(select(schema.meta.c.value).where(_IS_LAST_SEQ).with_for_update()) or 0)
