"""Which relations held from when to when? The relation changes of a run, laid out as intervals.

What rests on a refuted link is left out, as when events are explained; relations that the run did not watch are
computed from its cars.
"""

from bisect import bisect_left
from collections.abc import Iterable, Iterator
from operator import attrgetter

from msgspec import Struct
from msgspec.structs import replace

from chronicles.events import Event
from dyknow.language.diagnostics import hinted
from qsr.relations import RANK
from service.errors import QueryError
from service.questions.events.cursors import decode_cursor, encode_cursor
from service.questions.observations.coverage import Coverage, LookedAt
from service.questions.observations.stored_events import Part, refuted_labels, stored_events, unwatched_relations
from service.records.runs import RunRecord
from service.records.seen import RelationRecord
from service.store.log import EventLog

_START_US, _T_US = attrgetter("start_us"), attrgetter("t_us")
_AT_ONCE_US = 60_000_000
_NOT_HELD = ("false", "unknown")


class RelationQuestion(Struct, frozen=True, kw_only=True):
    """Ask what held in a run.

    Attributes
    ----------
    run : which run; None for the only one of the log.
    names : of relations; empty for all that the run watched.
    about : who must take part, in any place of the relation.
    from_us, to_us : the window [from_us, to_us); None is open.
    limit : how many intervals are wanted at once.
    """

    run: str | None = None
    names: tuple[str, ...] = ()
    about: tuple[str, ...] = ()
    from_us: int | None = None
    to_us: int | None = None
    limit: int


class RelationInterval(Struct, frozen=True, order=True):
    """A relation that held during [start_us, end_us); `end_us` null: it still held at the end of the window.

    `value` is `true`, or the word of a relation that has words, such as `left`.
    """

    start_us: int
    name: str
    args: tuple[str, ...]
    end_us: int | None
    value: str


class RelationList(Struct, frozen=True):
    """What held in a window: `count` intervals, some of which are `items`; `next_cursor` is null with the last ones."""

    run: str
    from_us: int
    to_us: int
    count: int
    items: list[RelationInterval]
    next_cursor: str | None
    looked_at: list[LookedAt]


def relation_intervals(
    log: EventLog, question: RelationQuestion, coverage: Coverage, *, cursor: str | None = None
) -> RelationList:
    """List the relations that held in a window, the earliest first.

    Parameters
    ----------
    coverage : of the same log.
    cursor : `next_cursor` of the same question: what comes behind is wanted.

    Raises
    ------
    QueryError
        If there is no such relation, or the cursor is none of this question.
    LogError
        If there is no such run, or it did not watch a relation that cannot be computed any more.
    """
    for name in question.names:
        if name not in RANK:
            raise QueryError(f"name: expected a relation, got {name!r}{hinted(name, RANK)}", parameter="name")
    run = log.run(question.run)
    first_us, last_us = log.covered_us(run.id) or (0, 0)
    from_us = first_us if question.from_us is None else question.from_us
    to_us = last_us + 1 if question.to_us is None else question.to_us
    about, names = set(question.about), question.names or run.relations
    changes = (one for one in _changes(log, run, names, question.about, (from_us, to_us)) if about <= {*one.args})
    found = sorted(one for one in _laid_out(changes) if one.end_us is None or one.end_us > from_us)
    filters = replace(question, limit=0)
    begin = 0
    if cursor is not None:
        # All that began before, and as many of those that began then.
        start_us, among = decode_cursor(cursor, filters)
        begin = bisect_left(found, start_us, key=_START_US) + among
    items, more = found[begin : begin + question.limit], None
    if items and begin + len(items) < len(found):
        first = bisect_left(found, items[-1].start_us, key=_START_US)
        more = encode_cursor((items[-1].start_us, begin + len(items) - first), filters)
    return RelationList(run.id, from_us, to_us, len(found), items, more, coverage.of_run(run))


def watched_intervals(log: EventLog, run: RunRecord) -> Iterator[RelationInterval]:
    """Stream all intervals of the relations that a run watched, as they end; nothing is held of the log meanwhile."""
    refuted, end_us = refuted_labels(log, run.id), log.last_us(run.id) + 1

    def changes() -> Iterator[RelationRecord]:
        since_us = None
        for until_us in (*range(_AT_ONCE_US, end_us, _AT_ONCE_US), end_us):
            some = log.relations(run.id, names=run.relations, from_us=since_us, to_us=until_us)
            yield from sorted((one for one in some if refuted.isdisjoint(one.hypotheses)), key=_T_US)
            since_us = until_us

    return _laid_out(changes())


def _changes(
    log: EventLog, run: RunRecord, names: tuple[str, ...], about: tuple[str, ...], window_us: tuple[int, int]
) -> Iterable[Event]:
    """Read the changes before the end of a window, as far back as something that holds in it may have begun."""
    from_us, to_us = window_us
    # A relation ends with its cars, so none is older than they are.
    lives = (one for one in log.cars(run.id) if one.last_us >= from_us and (not about or one.car in about))
    since_us = min((one.first_us for one in lives), default=from_us)
    unwatched = unwatched_relations(log, run, names, window_us=(since_us, to_us))
    part = Part(names, from_us=to_us, to_us=to_us, about=about, first_us=min(since_us, from_us), last_us=to_us)
    stored = stored_events(log, run.id, part=part, computed=unwatched.changes)
    return sorted((one for one in stored.events if one.name in names), key=_T_US)


def _laid_out(changes: Iterable[Event | RelationRecord]) -> Iterator[RelationInterval]:
    """Turn changes, by time, into intervals."""
    held: dict[tuple[str, tuple[str, ...]], tuple[int, str]] = {}
    for change in changes:
        key = change.name, change.args
        if key in held:
            start_us, value = held.pop(key)
            if start_us < change.t_us:
                yield RelationInterval(start_us, *key, change.t_us, value)
        if change.new is not None and change.new not in _NOT_HELD:
            held[key] = change.t_us, change.new
    yield from (RelationInterval(start_us, *key, None, value) for key, (start_us, value) in held.items())
