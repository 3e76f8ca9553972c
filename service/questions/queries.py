"""Which events of a log does a user ask for?

An `EventFilter` says what is wanted; `find_events` gives one page of it and `iterate_events` all of it. Values of one
field are alternatives, fields are joined by *and*. Pages follow each other by the key (start, sequence number), never
by counting rows, so page 10,000 costs what page 1 costs, and rows that arrive meanwhile shift nothing.

Intervals are half-open. Events that overlap a window are found by an index range scan: an event that reaches into
the window cannot start earlier than the longest duration of its type before it.
"""

import base64
import hashlib
import struct
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import msgspec
from msgspec import Struct
from sqlalchemy import ColumnElement, Connection, bindparam, exists, func, or_, select, tuple_, union_all

from service.errors import CursorError, FilterError, QueryError
from service.records import EventRecord, EventStatus
from service.store.log import EventLog
from service.store.schema import HIDDEN_STATUSES, durations, event_roles, events, meta, revisions, role_names, runs
from service.times import TimePoint

Match = Literal["overlap", "start", "end", "inside"]
Order = Literal["start", "-start"]

DEFAULT_LIMIT = 100
MAX_LIMIT = 1_000
MAX_VALUES = 50  # of one repeated parameter
MAX_ROLES = 20  # different roles in one question

_RARE_ROWS = 2_000
_CURSOR = struct.Struct(">qq8s")

_Condition = ColumnElement[bool]


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
    order: Order = "start"

    def named(self) -> dict[str, tuple[str, ...]]:
        """Give the names that are asked for, by parameter."""
        return {
            "type": self.types,
            "actor": self.actors,
            "road": self.roads,
            "source": self.sources,
            "run": self.runs,
            "role": tuple(name for name, _ in self.roles),
        } | {f"role.{name}": actors for name, actors in self.roles}


class EventPage(Struct, frozen=True):
    """One page of events.

    Attributes
    ----------
    items : events as JSON text, each as it was stored; `decode_event` reads one.
    next_cursor : where the next page begins; None on the last page.
    as_of_seq : the newest sequence number of the log when the page was read.
    """

    items: tuple[str, ...]
    next_cursor: str | None
    as_of_seq: int


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
        If the window is empty; if the cursor is damaged or belongs to another filter.
    """
    check_filter(wanted)
    if not 1 <= limit <= MAX_LIMIT:
        raise QueryError(f"limit: expected 1 to {MAX_LIMIT}, got {limit!r}", parameter="limit")
    after = _decode_cursor(cursor, wanted) if cursor is not None else None
    with log.connect() as connection:
        as_of_seq = _last_seq(connection)
        rows = _read_page(connection, _plan(connection, wanted), limit=limit + 1, after=after)
    has_more = len(rows) > limit
    last_start_us, last_seq, _ = rows[limit - 1] if has_more else (0, 0, "")
    next_cursor = _encode_cursor(last_start_us, last_seq, wanted) if has_more else None
    return EventPage(tuple(body for _, _, body in rows[:limit]), next_cursor, as_of_seq)


def iterate_events(log: EventLog, wanted: EventFilter, *, limit: int | None = None) -> Iterator[str]:
    """Stream all events of a filter as JSON text, in one state of the log and in constant memory.

    Raises
    ------
    QueryError, FilterError
        As `find_events`, at once and not at the first event.
    """
    check_filter(wanted)
    return _iterate(log, wanted, limit)


def find_event(log: EventLog, event_id: str) -> str | None:
    """Find one event by its identifier; None if there is none."""
    with log.connect() as connection:
        return connection.scalar(select(events.c.body).where(events.c.id == event_id))


def find_role_names(log: EventLog, wanted: EventFilter) -> list[str]:
    """List the role names that events of a filter may have, in alphabetical order."""
    query = select(role_names.c.role).distinct().order_by(role_names.c.role)
    if wanted.types:
        query = query.where(role_names.c.type.in_(wanted.types))
    if wanted.runs:
        query = query.where(role_names.c.run_no.in_(select(runs.c.run_no).where(runs.c.id.in_(wanted.runs))))
    with log.connect() as connection:
        return list(connection.scalars(query))


def find_last_seq(log: EventLog) -> int:
    """Return the newest sequence number handed out in a log; 0 before the first event."""
    with log.connect() as connection:
        return _last_seq(connection)


def decode_event(text: str) -> EventRecord:
    """Read the JSON text of an event."""
    return msgspec.json.decode(text, type=EventRecord)


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
        plan = _plan(connection, wanted)
        while left is None or left > 0:
            size = MAX_LIMIT if left is None else min(MAX_LIMIT, left)
            rows = _read_page(connection, plan, limit=size, after=after)
            yield from (body for _, _, body in rows)
            if len(rows) < size:
                return
            start_us, seq, _ = rows[-1]
            after = (start_us, seq)
            left = None if left is None else left - size


@dataclass(frozen=True, slots=True)
class _Plan:
    """A filter as SQL: a range of starts that an index can walk, and what to test on each row.

    Attributes
    ----------
    lower_us, upper_us : bounds of the start in media time, the upper one exclusive; None for open.
    """

    types: tuple[str, ...]
    is_descending: bool
    lower_us: int | None
    upper_us: int | None
    conditions: tuple[_Condition, ...]


def _plan(connection: Connection, wanted: EventFilter) -> _Plan:
    conditions = [*_one_of(events.c.road, wanted.roads), *_one_of(events.c.source, wanted.sources)]
    hidden = ("retracted",) if wanted.min_confidence is not None else HIDDEN_STATUSES
    conditions += _one_of(events.c.status, wanted.statuses) or [events.c.status.not_in(hidden)]
    if wanted.statuses and set(wanted.statuses) <= set(HIDDEN_STATUSES):
        conditions.append(_IS_HIDDEN)
    if wanted.min_confidence is not None:
        conditions.append(events.c.confidence >= wanted.min_confidence)
    conditions.append(~exists().where(revisions.c.revised == events.c.id))
    if wanted.runs:
        numbers = connection.scalars(select(runs.c.run_no).where(runs.c.id.in_(wanted.runs))).all()
        conditions += _one_of(events.c.run_no, tuple(numbers) or (-1,))
    if wanted.actors:
        conditions.append(_takes_part(connection, _one_of(event_roles.c.actor, wanted.actors)))
    for role, actors in wanted.roles:
        fills = [*_one_of(event_roles.c.actor, actors), event_roles.c.role == role]
        conditions.append(_takes_part(connection, fills))
    return _Plan(
        types=tuple(sorted(set(wanted.types))),
        is_descending=wanted.order == "-start",
        lower_us=_lower_us(connection, wanted),
        upper_us=_upper_us(connection, wanted),
        conditions=(*conditions, *_window(wanted)),
    )


# Any: the values of a column of any type.
def _one_of(column: ColumnElement[Any], values: tuple[Any, ...]) -> list[_Condition]:
    if not values:
        return []
    return [column == values[0] if len(values) == 1 else column.in_(sorted(set(values)))]


def _takes_part(connection: Connection, conditions: list[_Condition]) -> _Condition:
    """Ask for events with a role row like this, in the cheaper of two forms.

    Few rows (a car): look up their events and sort those. Many rows (a road in a role): walk the events in order and
    probe each. Databases without statistics cannot tell these apart, so the rows are counted, up to a bound.
    """
    some = select(event_roles.c.seq).where(*conditions).limit(_RARE_ROWS + 1).subquery()
    count = connection.scalar(select(func.count()).select_from(some)) or 0
    if count <= _RARE_ROWS:
        return events.c.seq.in_(select(event_roles.c.seq).where(*conditions))
    return exists().where(event_roles.c.seq == events.c.seq, *conditions)


def _lower_us(connection: Connection, wanted: EventFilter) -> int | None:
    """Find the earliest start that an event of the window can have."""
    if wanted.from_ is None:
        return None
    bound_us = wanted.from_.us
    if wanted.from_.clock == "utc":
        bound_us -= connection.scalar(select(func.max(runs.c.start_utc_us))) or 0
    if wanted.match in ("overlap", "end"):
        bound_us -= _longest_us(connection, wanted.types)
    return bound_us


def _upper_us(connection: Connection, wanted: EventFilter) -> int | None:
    """Find the time before which an event of the window must start."""
    if wanted.to is None:
        return None
    if wanted.to.clock == "media":
        return wanted.to.us
    return wanted.to.us - (connection.scalar(select(func.min(runs.c.start_utc_us))) or 0)


def _window(wanted: EventFilter) -> Iterator[_Condition]:
    """Say exactly what the window asks for, beyond the bounds of the start in media time."""
    if wanted.from_ is not None:
        from_us, is_utc = wanted.from_.us, wanted.from_.clock == "utc"
        start, end = _interval(is_utc=is_utc)
        if wanted.match == "overlap":
            yield or_(end > from_us, start >= from_us)  # the second for an event without duration, at from
        elif wanted.match == "end":
            yield end >= from_us
        elif is_utc:
            yield start >= from_us
    if wanted.to is not None:
        to_us, is_utc = wanted.to.us, wanted.to.clock == "utc"
        start, end = _interval(is_utc=is_utc)
        if wanted.match == "end":
            yield end < to_us
        elif wanted.match == "inside":
            yield end <= to_us
        if is_utc:
            yield start < to_us


def _interval(*, is_utc: bool) -> tuple[ColumnElement[int], ColumnElement[int]]:
    if not is_utc:
        return events.c.start_us, events.c.end_us
    return events.c.start_utc_us, events.c.start_utc_us + (events.c.end_us - events.c.start_us)


def _read_page(
    connection: Connection, plan: _Plan, *, limit: int, after: tuple[int, int] | None
) -> Sequence[tuple[int, int, str]]:
    """Read (start_us, seq, body) of the next rows after a key, in the order of the plan."""
    key = (events.c.start_us, events.c.seq)
    page = select(*key, events.c.body).where(*_key_range(plan, after), *plan.conditions)
    if len(plan.types) <= 1:
        query = page.where(*_one_of(events.c.type, plan.types)).order_by(*_ordered(plan, *key)).limit(limit)
        return connection.execute(query).fetchall()
    # The first rows of each type by its index, merged: cheaper than sorting all rows of all types.
    parts = [page.where(events.c.type == name).order_by(*_ordered(plan, *key)).limit(limit) for name in plan.types]
    merged = union_all(*(select(part.subquery()) for part in parts)).subquery()
    by_key = _ordered(plan, merged.c.start_us, merged.c.seq)
    query = select(merged).order_by(*by_key).limit(limit)
    return connection.execute(query).fetchall()


def _key_range(plan: _Plan, after: tuple[int, int] | None) -> Iterator[_Condition]:
    """Bound the key once on each side: given two lower bounds, SQLite may walk from the worse one."""
    start_us = events.c.start_us
    if plan.lower_us is not None and (after is None or plan.is_descending or after[0] < plan.lower_us):
        yield start_us >= plan.lower_us
    if plan.upper_us is not None and (after is None or not plan.is_descending or after[0] >= plan.upper_us):
        yield start_us < plan.upper_us
    if after is not None:
        place, here = tuple_(start_us, events.c.seq), tuple_(*after)
        yield place < here if plan.is_descending else place > here


def _ordered(plan: _Plan, *columns: ColumnElement[int]) -> list[ColumnElement[int]]:
    return [column.desc() if plan.is_descending else column for column in columns]


# Built once: putting a statement together takes longer than the database needs for it.
_LAST_SEQ = select(meta.c.value).where(meta.c.key == "last_seq")
_LONGEST = select(func.max(durations.c.longest_us))
_LONGEST_OF_ONE = _LONGEST.where(durations.c.type == bindparam("event_type"))


# The condition of an index, which is taken only where a query has it word for word.
_IS_HIDDEN = events.c.status.in_(bindparam(None, HIDDEN_STATUSES, expanding=True, literal_execute=True))


def _last_seq(connection: Connection) -> int:
    return int(connection.scalar(_LAST_SEQ) or 0)


def _longest_us(connection: Connection, types: tuple[str, ...]) -> int:
    if len(types) == 1:
        return connection.scalar(_LONGEST_OF_ONE, {"event_type": types[0]}) or 0
    return connection.scalar(_LONGEST.where(*_one_of(durations.c.type, types))) or 0


def _encode_cursor(start_us: int, seq: int, wanted: EventFilter) -> str:
    return base64.urlsafe_b64encode(_CURSOR.pack(start_us, seq, _filter_digest(wanted))).decode().rstrip("=")


def _decode_cursor(cursor: str, wanted: EventFilter) -> tuple[int, int]:
    try:
        raw = base64.b64decode(cursor + "=" * (-len(cursor) % 4), altchars=b"-_", validate=True)
        start_us, seq, digest = _CURSOR.unpack(raw)
    except (ValueError, struct.error) as error:
        raise CursorError(f"cursor: expected 'next_cursor' of a page, got {cursor!r}", parameter="cursor") from error
    if digest != _filter_digest(wanted):
        message = f"cursor: expected the filters of the page it came from, got others with {cursor!r}"
        raise CursorError(message, parameter="cursor")
    return start_us, seq


def _filter_digest(wanted: EventFilter) -> bytes:
    """Digest what is asked for, whatever the order in which alternatives were written."""
    fields = msgspec.structs.asdict(wanted)
    plain = {name: sorted(value) if isinstance(value, tuple) else value for name, value in fields.items()}
    return hashlib.blake2b(msgspec.json.encode(plain, order="deterministic"), digest_size=8).digest()
