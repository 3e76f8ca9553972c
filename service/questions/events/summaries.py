"""How many events are there of each type, road, object or hour, and when? Counts for a strip of time.

What is asked most, types over time, is counted by an index, bin by bin: of a million events in a tenth of a second. To
group the rows takes the database longer.
"""

from typing import Literal

from msgspec import Struct
from sqlalchemy import Connection

from service.errors import FilterError
from service.questions.events.queries import EventFilter, Plan, as_of, check_filter, key_range, plan_of
from service.questions.events.sql_text import all_of, number_of, one_of, rows_of
from service.store.log import EventLog

By = Literal["type", "road", "actor", "hour"]

MAX_BINS = 5_000
MAX_KEYS = 1_000
_HOUR_US = 3_600_000_000


class Counted(Struct, frozen=True):
    """How many events there are of a type, on a road, with an object, or in an hour of the day (UTC, `0` to `23`).

    `bins` are those with events: where each begins, and how many begin in it; none if no size of bins was asked for.
    """

    key: str
    count: int
    bins: list[tuple[int, int]]


def count_events(log: EventLog, wanted: EventFilter) -> int:
    """Count the events of a filter; raises as `find_events`."""
    check_filter(wanted)
    with log.connect() as connection:
        plan = plan_of(connection, wanted, by_index=_is_plain(wanted))
        text, values = all_of(_conditions(plan))
        return number_of(connection, f"SELECT count(*) FROM events WHERE {text}", *values)


def summarise(
    log: EventLog, wanted: EventFilter, by: By, *, bin_us: int | None = None, limit: int = MAX_KEYS
) -> tuple[int, list[Counted]]:
    """Count the events of a filter.

    Parameters
    ----------
    bin_us : the size of bins of media time, each of which begins at a multiple of it; None for no bins.
    limit : how many keys are told at most, those with the most events.

    Returns
    -------
    The sequence number as of which was counted, and the counts, the highest first. An event with several objects
    counts for each.

    Raises
    ------
    QueryError, FilterError
        As `find_events`, and the latter if there were more than `MAX_BINS` bins.
    """
    check_filter(wanted)
    with log.connect() as connection:
        as_of_seq = as_of(connection, wanted)
        plan = plan_of(connection, wanted, by_index=_is_plain(wanted))
        first, last, size_us = _bins(connection, plan, bin_us)
        found: dict[str, list[tuple[int, int]]] = {}
        for key, number, count in _cells(connection, plan, by, (first, last), size_us):
            if count:
                found.setdefault(str(key), []).append((number * size_us, count))
    counted = [
        Counted(key, sum(count for _, count in cells), sorted(cells) if bin_us else []) for key, cells in found.items()
    ]
    return as_of_seq, sorted(counted, key=lambda one: (-one.count, one.key))[:limit]


def _is_plain(wanted: EventFilter) -> bool:
    return not wanted.statuses and wanted.min_confidence is None and wanted.as_of is None


def _conditions(plan: Plan) -> list[tuple[str, tuple[object, ...]]]:
    return [*one_of("events.type", plan.types), *key_range(plan, None), *plan.conditions]


def _bins(connection: Connection, plan: Plan, bin_us: int | None) -> tuple[int, int, int]:
    """Give the number of the first bin, of the last one, and their size; one for all if no size was asked for."""
    first_us = max(number_of(connection, "SELECT min(start_us) FROM events"), plan.lower_us or 0)
    last_us = number_of(connection, "SELECT max(start_us) FROM events")
    last_us = last_us if plan.upper_us is None else min(last_us, plan.upper_us - 1)
    size_us = bin_us or max(last_us, first_us) + 1
    first, last = first_us // size_us, last_us // size_us
    if last - first >= MAX_BINS:
        expected = f"bin_us: expected at most {MAX_BINS} bins from {first_us} us to {last_us} us"
        raise FilterError(f"{expected}, got {last - first + 1} of {bin_us} us", parameter="bin_us")
    return first, last, size_us


def _cells(
    connection: Connection, plan: Plan, by: By, bins: tuple[int, int], size_us: int
) -> list[tuple[str | int, int, int]]:
    """Count by key and number of the bin."""
    first, last = bins
    text, values = all_of(_conditions(plan))
    if by == "type":
        in_cell = f"events.type = cell_type AND start_us >= number * {size_us} AND start_us < (number + 1) * {size_us}"
        query = f"""
            WITH RECURSIVE bins(number) AS (SELECT {first} UNION ALL SELECT number + 1 FROM bins WHERE number < {last})
            SELECT cell_type, number, (SELECT count(*) FROM events WHERE {in_cell} AND {text})
            FROM (SELECT DISTINCT type AS cell_type FROM durations) AS types, bins"""
    else:
        # Of these there may be any number, and so too many cells. No time is negative, so that division rounds down.
        key = {"road": "events.road", "actor": "actor", "hour": f"start_utc_us / {_HOUR_US} % 24"}[by]
        taking = "JOIN (SELECT DISTINCT seq, actor FROM event_roles) AS taking ON taking.seq = events.seq"
        rows = f"events {taking}" if by == "actor" else "events"
        query = f"SELECT {key}, events.start_us / {size_us}, count(*) FROM {rows} WHERE {text} GROUP BY 1, 2"
    return rows_of(connection, query, *values)
