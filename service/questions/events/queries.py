"""Which events of a log does a user ask for?

An `EventFilter` says what is wanted; `find_events` gives one page of it and `iterate_events` all of it. Values of one
field are alternatives, fields are joined by *and*. Pages follow each other by the key (start, sequence number), never
by counting rows, so page 10,000 costs what page 1 costs, and rows that arrive meanwhile shift nothing.

Intervals are half-open. Events that overlap a window are found by an index range scan: an event that reaches into
the window cannot start earlier than the longest duration of its type before it.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import chain
from typing import Literal

import msgspec
from msgspec import Struct
from msgspec.structs import replace
from sqlalchemy import Connection

from service.errors import FilterError, QueryError
from service.questions.events.cursors import decode_cursor, encode_cursor
from service.questions.events.sql_text import Sql, all_of, number_of, one_of, rows_of, value_of, values_of
from service.records.events import EventRecord, EventStatus
from service.records.times import TimePoint
from service.store.log import EventLog
from service.store.schema import HIDDEN_STATUSES

Match = Literal["overlap", "start", "end", "inside"]
Order = Literal["start", "-start"]

DEFAULT_LIMIT = 100
MAX_LIMIT = 1_000
MAX_VALUES = 50  # of one repeated parameter
MAX_ROLES = 20  # different roles in one question

_RARE_ROWS = 2_000
_NUMBERS_AT_ONCE = 200  # a tenth of a megabyte, which each client that does not read keeps a few times


class EventFilter(Struct, frozen=True, kw_only=True):
    """What to ask for; an empty field does not restrict.

    Only the newest state of each event is found, and of those retracted or doubtful only what `statuses` asks for.

    Attributes
    ----------
    from_, to : the window `[from_, to)`, in media time or UTC.
    match : how an event must lie to the window: overlap it, start in it, end in it, or lie inside it.
    actors : objects that take part in any role.
    roles : role names with the objects that may fill them.
    min_confidence : the least; it takes the place of the floors of chronicles, so doubtful events that are as sure are
        found too.
    chronicles : names of those that the events are of; a chronicle may emit several types.
    as_of : asks the log as it was when this was its newest sequence number; of a run that was repeated since, nothing
        of then is left.
    order : by start, earliest (`start`) or latest (`-start`) first.
    """

    types: tuple[str, ...] = ()
    from_: TimePoint | None = None
    to: TimePoint | None = None
    match: Match = "overlap"
    actors: tuple[str, ...] = ()
    roles: tuple[tuple[str, tuple[str, ...]], ...] = ()
    roads: tuple[str, ...] = ()
    sources: tuple[str, ...] = ()
    runs: tuple[str, ...] = ()
    statuses: tuple[EventStatus, ...] = ()
    min_confidence: float | None = None
    min_duration_us: int | None = None
    max_duration_us: int | None = None
    chronicles: tuple[str, ...] = ()
    as_of: int | None = None
    order: Order = "start"

    def named(self) -> dict[str, tuple[str, ...]]:
        """Give the names that are asked for, by parameter."""
        return {
            "type": self.types,
            "actor": self.actors,
            "road": self.roads,
            "source": self.sources,
            "run": self.runs,
            "chronicle": self.chronicles,
            "role": tuple(name for name, _ in self.roles),
        } | {f"role.{name}": actors for name, actors in self.roles}


class EventPage(Struct, frozen=True):
    """One page of events.

    Attributes
    ----------
    lines : events as JSON text, each as it was stored, one a line; `decode_events` reads them.
    next_cursor : where the next page begins; None on the last page.
    as_of_seq : the newest sequence number of the log when the page was read, or the one that was asked for.
    """

    lines: str
    next_cursor: str | None
    as_of_seq: int

    @property
    def items(self) -> tuple[str, ...]:
        """The events, one by one."""
        return tuple(_split(self.lines))


def find_events(
    log: EventLog, wanted: EventFilter, *, limit: int = DEFAULT_LIMIT, cursor: str | None = None
) -> EventPage:
    """Read one page of events.

    Parameters
    ----------
    limit : 1 to 1000 events.
    cursor : `next_cursor` of the page before, asked for with the same filter.

    Raises
    ------
    QueryError
        If the limit is out of range, or there are too many roles or values of a field.
    FilterError, CursorError
        If the window is empty, or the log has not come to `as_of`; if the cursor is damaged or belongs to another
        filter.
    """
    check_filter(wanted)
    if not 1 <= limit <= MAX_LIMIT:
        raise QueryError(f"limit: expected 1 to {MAX_LIMIT}, got {limit!r}", parameter="limit")
    after = decode_cursor(cursor, wanted) if cursor is not None else None
    with log.connect() as connection:
        as_of_seq = as_of(connection, wanted)
        lines = _read_page(connection, plan_of(connection, wanted), limit=limit + 1, after=after)
    if lines.count("\n") < limit:
        return EventPage(lines, None, as_of_seq)
    lines = lines[: lines.rindex("\n")]
    return EventPage(lines, encode_cursor(_last_key(lines), wanted), as_of_seq)


def iterate_events(log: EventLog, wanted: EventFilter, *, limit: int | None = None) -> Iterator[str]:
    """Stream all events of a filter as JSON text, in one state of the log and in constant memory.

    Raises
    ------
    QueryError, FilterError
        As `find_events`, at once and not at the first event.
    """
    check_filter(wanted)
    return _iterate(log, wanted, limit)


def iterate_pages(log: EventLog, wanted: EventFilter) -> Iterator[str]:
    """Stream all events of a filter as lines of JSON, some at once; between two of these nothing is held of the log.

    So who takes them may be as slow as can be. They are those of one state of the log; of a run that is repeated
    meanwhile the rest is missing.

    Raises
    ------
    QueryError, FilterError
        As `find_events`, at once.
    """
    first = find_events(log, wanted, limit=MAX_LIMIT)

    def pages() -> Iterator[str]:
        page, then = first, replace(wanted, as_of=first.as_of_seq)
        # The cursor of the first page is of another filter: the key alone is the same.
        cursor = encode_cursor(_last_key(page.lines), then) if page.next_cursor else None
        while page.lines:
            yield page.lines
            if cursor is None:
                return
            page = find_events(log, then, limit=MAX_LIMIT, cursor=cursor)
            cursor = page.next_cursor

    return pages()


class EventRows(Struct, frozen=True):
    """Rows of events in the order in which they were written; newer states are rows of their own.

    Attributes
    ----------
    items : sequence number, status and JSON text of each.
    until_seq : all rows up to this number were looked at.
    as_of_seq : the newest number; more rows are to be read if it is another one.
    """

    items: tuple[tuple[int, str, str], ...]
    until_seq: int
    as_of_seq: int


def find_rows(log: EventLog, wanted: EventFilter, after_seq: int) -> EventRows:
    """Read the next rows behind a sequence number: retracted ones too, doubtful ones only if asked for.

    Parameters
    ----------
    wanted : its window and order change nothing.
    """
    with log.connect() as connection:
        as_of_seq = _last_seq(connection)
        until_seq = min(after_seq + _NUMBERS_AT_ONCE, as_of_seq)
        asked = [*one_of("events.type", wanted.types), *_of_row(connection, wanted, ("doubtful",))]
        asked += [_has_role(conditions) for conditions in _role_conditions(wanted)]
        text, values = all_of(asked or [_ANY])
        # An inner query with a limit is answered by itself, by the key.
        walked = f"SELECT * FROM events WHERE seq > ? AND seq <= ? LIMIT {_NUMBERS_AT_ONCE}"
        query = f"SELECT seq, status, body FROM ({walked}) AS events WHERE {text} ORDER BY seq"
        return EventRows(tuple(rows_of(connection, query, after_seq, until_seq, *values)), until_seq, as_of_seq)


def find_event(log: EventLog, event_id: str) -> str | None:
    """Find one event by its identifier; None if there is none."""
    with log.connect() as connection:
        body: str | None = value_of(connection, "SELECT body FROM events WHERE id = ?", event_id)
    return body


def find_role_names(log: EventLog, wanted: EventFilter) -> list[str]:
    """List the role names that events of a filter may have, in alphabetical order."""
    asked = [*one_of("type", wanted.types)]
    if wanted.runs:
        text, values = all_of(one_of("id", wanted.runs))
        asked.append((f"run_no IN (SELECT run_no FROM runs WHERE {text})", values))
    text, values = all_of(asked or [_ANY])
    with log.connect() as connection:
        query = f"SELECT DISTINCT role FROM role_names WHERE {text}"
        return sorted(values_of(connection, query, *values))


def find_last_seq(log: EventLog) -> int:
    """Return the newest sequence number handed out in a log; 0 before the first event."""
    with log.connect() as connection:
        return _last_seq(connection)


def decode_event(text: str) -> EventRecord:
    """Read the JSON text of an event."""
    return msgspec.json.decode(text, type=EventRecord)


def decode_events(lines: str) -> list[EventRecord]:
    """Read events as JSON text, one a line."""
    return msgspec.json.Decoder(EventRecord).decode_lines(lines)


def check_filter(wanted: EventFilter) -> None:
    """Refuse a filter that cannot be answered; raises `QueryError` or `FilterError`."""
    if len(wanted.roles) > MAX_ROLES:
        raise QueryError(f"role: expected at most {MAX_ROLES} roles, got {len(wanted.roles)}", parameter="role")
    for parameter, values in wanted.named().items():
        if len(values) > MAX_VALUES:
            raise QueryError(
                f"{parameter}: expected at most {MAX_VALUES} values, got {len(values)}", parameter=parameter
            )
    if wanted.min_confidence is not None and not 0 <= wanted.min_confidence <= 1:
        parameter, came = "min_confidence", wanted.min_confidence
        raise QueryError(f"{parameter}: expected 0 to 1, got {came!r}", parameter=parameter)
    start, end = wanted.from_, wanted.to
    if start and end and start.clock == end.clock and start.us >= end.us:
        raise FilterError(f"from: expected a time before 'to' ({end.us} us), got {start.us} us", parameter="from")


def _iterate(log: EventLog, wanted: EventFilter, limit: int | None) -> Iterator[str]:
    left = limit
    after = None
    with log.connect() as connection:
        plan = plan_of(connection, wanted)
        while left is None or left > 0:
            size = MAX_LIMIT if left is None else min(MAX_LIMIT, left)
            lines = _read_page(connection, plan, limit=size, after=after)
            items = _split(lines)
            yield from items
            if len(items) < size:
                return
            after = _last_key(lines)
            left = None if left is None else left - size


@dataclass(frozen=True, slots=True)
class Plan:
    """A filter as SQL: a range of starts that an index can walk, and what to test on each row.

    Attributes
    ----------
    lower_us, upper_us : bounds of the start in media time, the upper one exclusive; None for open.
    """

    types: tuple[str, ...]
    is_descending: bool
    lower_us: int | None
    upper_us: int | None
    conditions: tuple[Sql, ...]


def plan_of(connection: Connection, wanted: EventFilter, *, by_index: bool = False) -> Plan:
    """Turn a filter into SQL.

    Parameters
    ----------
    by_index : what is hidden or has a newer state is looked up first, so that an index alone can tell of all others.
    """
    conditions = _of_row(connection, wanted, () if by_index else HIDDEN_STATUSES)
    if wanted.statuses and set(wanted.statuses) <= set(HIDDEN_STATUSES):
        conditions.append(_IS_HIDDEN)
    if by_index:
        conditions.append(_IS_SHOWN)
    elif wanted.as_of is None:
        conditions.append(_IS_NEWEST)
    else:
        revises = _REVISES[connection.dialect.name]
        later = f"events.id IN (SELECT {revises} FROM events AS later WHERE later.seq > ?)"
        conditions.append((f"events.seq <= ? AND ({_IS_NEWEST[0]} OR {later})", (wanted.as_of, wanted.as_of)))
    conditions += [_takes_part(connection, one) for one in _role_conditions(wanted)]
    return Plan(
        types=tuple(sorted(set(wanted.types))),
        is_descending=wanted.order == "-start",
        lower_us=_lower_us(connection, wanted),
        upper_us=_upper_us(connection, wanted),
        conditions=(*conditions, *_window(wanted)),
    )


def _of_row(connection: Connection, wanted: EventFilter, hidden: tuple[str, ...]) -> list[Sql]:
    """Say what is asked of the row of an event by itself, but for its type and its time."""
    conditions = [*one_of("events.road", wanted.roads), *one_of("events.source", wanted.sources)]
    if wanted.min_confidence is not None:
        hidden = tuple(one for one in hidden if one != "doubtful")
        conditions.append(("events.confidence >= ?", (wanted.min_confidence,)))
    conditions += one_of("events.status", wanted.statuses) or one_of("NOT events.status", hidden)
    duration = "events.end_us - events.start_us"
    if wanted.min_duration_us is not None:
        conditions.append((f"{duration} >= ?", (wanted.min_duration_us,)))
    if wanted.max_duration_us is not None:
        conditions.append((f"{duration} <= ?", (wanted.max_duration_us,)))
    conditions += one_of(_CHRONICLE[connection.dialect.name], wanted.chronicles)
    if wanted.runs:
        text, values = all_of(one_of("id", wanted.runs))
        numbers = values_of(connection, f"SELECT run_no FROM runs WHERE {text}", *values)
        conditions += one_of("events.run_no", tuple(numbers) or (-1,))
    return conditions


def _role_conditions(wanted: EventFilter) -> Iterator[list[Sql]]:
    """Say which role rows an event must have, one of each."""
    if wanted.actors:
        yield one_of("event_roles.actor", wanted.actors)
    for role, actors in wanted.roles:
        yield [*one_of("event_roles.actor", actors), *one_of("event_roles.role", (role,))]


def _takes_part(connection: Connection, conditions: list[Sql]) -> Sql:
    """Ask for events with a role row like this, in the cheaper of two forms.

    Few rows (a car): look up their events and sort those. Many rows (a road in a role): walk the events in order and
    probe each. Databases without statistics cannot tell these apart, so the rows are counted, up to a bound.
    """
    text, values = all_of(conditions)
    some = f"SELECT seq FROM event_roles WHERE {text} LIMIT {_RARE_ROWS + 1}"
    if number_of(connection, f"SELECT count(*) FROM ({some}) AS found", *values) <= _RARE_ROWS:
        return f"events.seq IN (SELECT seq FROM event_roles WHERE {text})", values
    return _has_role(conditions)


def _has_role(conditions: list[Sql]) -> Sql:
    text, values = all_of(conditions)
    return f"EXISTS (SELECT 1 FROM event_roles WHERE event_roles.seq = events.seq AND {text})", values


def _lower_us(connection: Connection, wanted: EventFilter) -> int | None:
    """Find the earliest start that an event of the window can have."""
    if wanted.from_ is None:
        return None
    bound_us = wanted.from_.us
    if wanted.from_.clock == "utc":
        bound_us -= number_of(connection, "SELECT max(start_utc_us) FROM runs")
    if wanted.match in ("overlap", "end"):
        bound_us -= _longest_us(connection, wanted.types)
    return bound_us


def _upper_us(connection: Connection, wanted: EventFilter) -> int | None:
    """Find the time before which an event of the window must start."""
    if wanted.to is None:
        return None
    if wanted.to.clock == "media":
        return wanted.to.us
    return wanted.to.us - number_of(connection, "SELECT min(start_utc_us) FROM runs")


def _window(wanted: EventFilter) -> Iterator[Sql]:
    """Say exactly what the window asks for, beyond the bounds of the start in media time."""
    if wanted.from_ is not None:
        from_us, is_utc = wanted.from_.us, wanted.from_.clock == "utc"
        start, end = _interval(is_utc=is_utc)
        if wanted.match == "overlap":  # the second for an event without duration, at from
            yield f"({end} > ? OR {start} >= ?)", (from_us, from_us)
        elif wanted.match == "end":
            yield f"{end} >= ?", (from_us,)
        elif is_utc:
            yield f"{start} >= ?", (from_us,)
    if wanted.to is not None:
        to_us, is_utc = wanted.to.us, wanted.to.clock == "utc"
        start, end = _interval(is_utc=is_utc)
        if wanted.match == "end":
            yield f"{end} < ?", (to_us,)
        elif wanted.match == "inside":
            yield f"{end} <= ?", (to_us,)
        if is_utc:
            yield f"{start} < ?", (to_us,)


def _interval(*, is_utc: bool) -> tuple[str, str]:
    return ("start_utc_us", "start_utc_us + (end_us - start_us)") if is_utc else ("start_us", "end_us")


def _read_page(connection: Connection, plan: Plan, *, limit: int, after: tuple[int, int] | None) -> str:
    """Read the next events after a key, in the order of the plan, one a line."""
    of_one_type = one_of("type", plan.types) if len(plan.types) == 1 else []
    text, values = all_of([*of_one_type, *key_range(plan, after), *plan.conditions])
    order = "start_us DESC, seq DESC" if plan.is_descending else "start_us, seq"
    page = f"SELECT start_us, seq, body FROM events WHERE {text}"
    if len(plan.types) > 1:
        # The first rows of each type by its index, merged: cheaper than sorting all rows of all types.
        of_type = f"SELECT * FROM ({page} AND type = ? ORDER BY {order} LIMIT {limit}) AS one"
        page = f"SELECT * FROM ({' UNION ALL '.join([of_type] * len(plan.types))}) AS several"
        values = tuple(chain.from_iterable((*values, name) for name in plan.types))
    # One row, since the driver gives up the interpreter lock at each. JSON has no line ends but between its parts.
    joined = _JOINED[connection.dialect.name]
    lines = f"SELECT {joined} FROM ({page} ORDER BY {order} LIMIT {limit}) AS page"
    return value_of(connection, lines, *values) or ""


def key_range(plan: Plan, after: tuple[int, int] | None) -> Iterator[Sql]:
    """Bound the key once on each side: given two lower bounds, SQLite may walk from the worse one."""
    if plan.lower_us is not None and (after is None or plan.is_descending or after[0] < plan.lower_us):
        yield "start_us >= ?", (plan.lower_us,)
    if plan.upper_us is not None and (after is None or not plan.is_descending or after[0] >= plan.upper_us):
        yield "start_us < ?", (plan.upper_us,)
    if after is not None:
        yield f"(start_us, seq) {'<' if plan.is_descending else '>'} (?, ?)", after


_JOINED = {"sqlite": "group_concat(body, char(10))", "postgresql": "string_agg(body, chr(10))"}
_CHRONICLE = {
    "sqlite": "json_extract(events.body, '$.chronicle.name')",
    "postgresql": "(events.body::json #>> '{chronicle,name}')",
}
_REVISES = {"sqlite": "json_extract(later.body, '$.revises')", "postgresql": "(later.body::json ->> 'revises')"}
_ANY: Sql = ("1 = 1", ())
_IS_NEWEST: Sql = ("NOT EXISTS (SELECT 1 FROM revisions WHERE revised = events.id)", ())
_IS_LEFT_OUT = f"status IN {HIDDEN_STATUSES!r} OR id IN (SELECT revised FROM revisions)"
_IS_SHOWN: Sql = (f"events.seq NOT IN (SELECT seq FROM events WHERE {_IS_LEFT_OUT})", ())
# The condition of an index, which is taken only where a query has it word for word.
_IS_HIDDEN: Sql = (f"events.status IN {HIDDEN_STATUSES!r}", ())


def as_of(connection: Connection, wanted: EventFilter) -> int:
    """Say as of which sequence number a filter is answered; raises `FilterError` if the log has not come to it."""
    last_seq = _last_seq(connection)
    if wanted.as_of is not None and wanted.as_of > last_seq:
        message = f"as_of: expected one up to {last_seq}, the newest of this log, got {wanted.as_of}"
        raise FilterError(message, parameter="as_of")
    return last_seq if wanted.as_of is None else wanted.as_of


def _last_seq(connection: Connection) -> int:
    return number_of(connection, "SELECT value FROM meta WHERE key = 'last_seq'")


def _longest_us(connection: Connection, types: tuple[str, ...]) -> int:
    text, values = all_of(one_of("type", types) or [_ANY])
    return number_of(connection, f"SELECT max(longest_us) FROM durations WHERE {text}", *values)


class _Key(Struct):
    """What an event is found again by; its other fields are passed over."""

    start_us: int
    seq: int


def _last_key(lines: str) -> tuple[int, int]:
    key = msgspec.json.decode(lines[lines.rfind("\n") + 1 :], type=_Key)
    return key.start_us, key.seq


def _split(lines: str) -> list[str]:
    return lines.split("\n") if lines else []
