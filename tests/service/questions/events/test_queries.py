"""Do filters and pages return exactly the events they should?"""

import random
from collections.abc import Iterator
from pathlib import Path
from typing import Any  # what a row holds

import msgspec
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from sqlalchemy import Connection

from service.errors import CursorError, FilterError, QueryError
from service.questions.events.queries import (
    EventFilter,
    Match,
    Order,
    decode_event,
    decode_events,
    find_event,
    find_events,
    find_role_names,
    find_rows,
    iterate_events,
    iterate_pages,
)
from service.records.events import EventRecord, EventStatus
from service.records.times import TimePoint, parse_time
from service.store.databases.database import driver_rows
from service.store.log import EventLog, open_log
from tests.cases import first_kept
from tests.service.conftest import NewLog
from tests.service.logs import SECOND_US, START_UTC_US, overtake, random_drafts, read_all, read_rows, run, write_log

HOUR_US = 3_600_000_000


@pytest.fixture(scope="module")
def log(new_log: NewLog) -> Iterator[EventLog]:
    """Two runs of different sources and start times, 400 random events, a fifth of them newer states of others."""
    url = write_log(new_log(), random_drafts(random.Random(1), 250))
    later = run("r2", source="late.mp4", start_utc_us=START_UTC_US + 10 * SECOND_US)
    write_log(url, random_drafts(random.Random(2), 150, "r2"), record=later)
    with open_log(url) as opened:
        yield opened


def slow_filter(events: list[EventRecord], wanted: EventFilter) -> list[EventRecord]:
    """Test every event by the words of the documentation, and sort."""
    events = [event for event in events if wanted.as_of is None or event.seq <= wanted.as_of]
    revised = {event.revises for event in events}
    found = [event for event in events if event.id not in revised and _is_wanted(event, wanted)]
    return sorted(found, key=lambda event: (event.start_us, event.seq), reverse=wanted.order == "-start")


@pytest.mark.parametrize(
    "wanted",
    [
        EventFilter(),
        EventFilter(types=("pass", "follow"), roads=("road1",)),
        EventFilter(actors=("car1",), runs=("r2",)),
        EventFilter(roles=(("overtaker", ("car1", "car2")), ("overtaken", ("car3",)))),
        EventFilter(statuses=("retracted",), sources=("demo.mp4",)),
        EventFilter(runs=("nosuch",)),
    ],
)
def test_rows_behind_a_number_are_all_that_fit_newest_or_not(
    log: EventLog, monkeypatch: pytest.MonkeyPatch, wanted: EventFilter
) -> None:
    monkeypatch.setattr("service.questions.events.queries._NUMBERS_AT_ONCE", 7)
    found, seq, as_of_seq = list[EventRecord](), 0, 1
    while seq < as_of_seq:
        rows = find_rows(log, wanted, seq)
        found += [decode_event(body) for _, _, body in rows.items]
        assert [(one.seq, one.status) for one in found[-len(rows.items) :] if rows.items] == [
            (number, status) for number, status, _ in rows.items
        ]
        seq, as_of_seq = rows.until_seq, rows.as_of_seq
    states = wanted.statuses or ("recognised", "tentative", "confirmed", "retracted")
    asked = msgspec.structs.replace(wanted, statuses=states)
    assert found == [one for one in read_rows(log.place.url) if _is_wanted(one, asked)]


def _is_wanted(event: EventRecord, wanted: EventFilter) -> bool:
    fields = [
        (wanted.types, event.type),
        (wanted.sources, event.source),
        (wanted.runs, event.run),
        (wanted.statuses or ("recognised", "tentative", "confirmed"), event.status),
        (wanted.roads, event.place.road if event.place else ""),
        (wanted.chronicles, event.chronicle.name),
        *((actors, event.roles.get(role, "")) for role, actors in wanted.roles),
    ]
    if not all(value in allowed for allowed, value in fields if allowed):
        return False
    if wanted.actors and not set(wanted.actors) & set(event.roles.values()):
        return False
    most_us = event.end_us - event.start_us if wanted.max_duration_us is None else wanted.max_duration_us
    return (wanted.min_duration_us or 0) <= event.end_us - event.start_us <= most_us and _lies_right(event, wanted)


def _lies_right(event: EventRecord, wanted: EventFilter) -> bool:
    tests = []
    for bound, is_from in [(wanted.from_, True), (wanted.to, False)]:
        if bound is None:
            continue
        offset = 0 if bound.clock == "media" else parse_time(event.start, parameter="").us - event.start_us
        start, end = event.start_us + offset, event.end_us + offset
        tests.append(
            {
                "overlap": end > bound.us or start >= bound.us if is_from else start < bound.us,
                "start": start >= bound.us if is_from else start < bound.us,
                "end": end >= bound.us if is_from else end < bound.us,
                "inside": start >= bound.us if is_from else end <= bound.us and start < bound.us,
            }[wanted.match]
        )
    return all(tests)


def _random_filter(rng: random.Random) -> EventFilter:
    def some(values: list[str], most: int = 2) -> tuple[str, ...]:
        return tuple(rng.sample(values, rng.randint(1, most))) if rng.random() < 0.3 else ()

    def time(low: int, high: int) -> TimePoint | None:
        if rng.random() < 0.4:
            return None
        us = rng.randint(low, high) * SECOND_US
        return TimePoint(us, "media") if rng.random() < 0.6 else TimePoint(START_UTC_US + us, "utc")

    matches: list[Match] = ["overlap", "start", "end", "inside"]
    orders: list[Order] = ["start", "-start"]
    statuses: list[EventStatus] = ["recognised", "tentative", "retracted"]
    roles = (("overtaker", some(["car1", "car2", "car9"], 2) or ("car3",)),) if rng.random() < 0.2 else ()
    return EventFilter(
        types=some(["overtake", "pass", "follow", "nothing"], 3),
        from_=time(0, 25),
        to=time(26, 60),
        match=rng.choice(matches),
        actors=some(["car1", "car2", "car3"]),
        roles=roles,
        roads=some(["road1", "road2"]),
        sources=some(["demo.mp4", "late.mp4"]),
        runs=some(["r1", "r2", "r9"]),
        statuses=tuple(rng.sample(statuses, 1)) if rng.random() < 0.2 else (),
        min_duration_us=rng.randint(0, 2) * SECOND_US if rng.random() < 0.2 else None,
        max_duration_us=rng.randint(1, 7) * SECOND_US if rng.random() < 0.2 else None,
        chronicles=rng.choice([("overtake",), ("nothing",)]) if rng.random() < 0.2 else (),
        as_of=rng.randrange(400) if rng.random() < 0.3 else None,
        order=rng.choice(orders),
    )


@pytest.mark.parametrize("seed", first_kept(range(4)))
def test_filters_equal_the_slow_obvious_ones(log: EventLog, seed: int) -> None:
    rng = random.Random(seed)
    everything = read_rows(log.place.url)
    for _ in range(150):
        wanted = _random_filter(rng)
        found = [decode_event(text) for text in iterate_events(log, wanted)]
        assert found == slow_filter(everything, wanted), wanted


def test_frequent_actors_are_found_as_rare_ones_are(log: EventLog, monkeypatch: pytest.MonkeyPatch) -> None:
    wanted = EventFilter(actors=("car1",), roles=(("overtaken", ("car2", "car3")),))
    rare = list(iterate_events(log, wanted))
    monkeypatch.setattr("service.questions.events.queries._RARE_ROWS", 3)
    assert list(iterate_events(log, wanted)) == rare


@settings(max_examples=30, deadline=None)
@given(
    limit=st.integers(1, 450),
    order=st.sampled_from(["start", "-start"]),
    types=st.sampled_from([(), ("overtake",), ("overtake", "pass")]),
    from_us=st.one_of(st.none(), st.integers(0, 20 * SECOND_US)),
)
def test_all_pages_together_are_the_whole_list(
    log: EventLog, limit: int, order: Order, types: tuple[str, ...], from_us: int | None
) -> None:
    bound = None if from_us is None else TimePoint(from_us, "media")
    wanted = EventFilter(order=order, types=types, from_=bound)
    pages: list[str] = []
    cursor = None
    while True:
        page = find_events(log, wanted, limit=limit, cursor=cursor)
        pages += page.items
        assert len(page.items) == limit or page.next_cursor is None
        cursor = page.next_cursor
        if cursor is None:
            break
    assert pages == list(iterate_events(log, wanted))


def test_events_that_touch_the_window_do_not_overlap_it(tmp_path: Path) -> None:
    url = write_log(tmp_path / "a.db", [overtake(10, 20), overtake(20, 20), overtake(20, 30), overtake(30, 30)])
    window = EventFilter(from_=TimePoint(20, "media"), to=TimePoint(30, "media"))
    assert [(event.start_us, event.end_us) for event in read_all(url, window)] == [(20, 20), (20, 30)]


def test_a_long_event_is_found_by_the_middle_of_it(tmp_path: Path) -> None:
    url = write_log(tmp_path / "a.db", [overtake(0, HOUR_US), *(overtake(n * SECOND_US) for n in range(100))])
    window = EventFilter(from_=TimePoint(HOUR_US - 1, "media"), to=TimePoint(HOUR_US, "media"))
    assert [event.start_us for event in read_all(url, window)] == [0]


def test_a_limit_stops_the_stream(log: EventLog) -> None:
    assert list(iterate_events(log, EventFilter(), limit=7)) == list(iterate_events(log, EventFilter()))[:7]


@pytest.mark.parametrize("count", [0, 1, 999, 1000, 1001, 2500])
def test_pages_that_are_taken_slowly_are_of_one_state_of_the_log(tmp_path: Path, count: int) -> None:
    url = write_log(tmp_path / "a.db", [overtake(number) for number in range(count)])
    with open_log(url) as log:
        pages = iterate_pages(log, EventFilter())
        taken = [next(pages, "")]
        write_log(url, [overtake(number) for number in range(7)], record=run("r2"))
        taken += pages
        assert [event.id for lines in taken for event in decode_events(lines)] == [
            f"r1-{number}" for number in range(1, count + 1)
        ]


def test_a_page_of_then_is_the_same_whatever_came_after_it(log: EventLog) -> None:
    then = [find_events(log, EventFilter(as_of=seq), limit=50).items for seq in range(0, 250, 40)]
    assert len(set(then)) == len(then)
    with pytest.raises(FilterError, match="as_of: expected one up to 400, the newest of this log, got 401"):
        find_events(log, EventFilter(as_of=401))


def test_an_event_is_found_by_its_identifier(log: EventLog) -> None:
    text = find_event(log, "r2-3")
    assert text is not None
    assert decode_event(text).id == "r2-3"
    assert find_event(log, "r9-1") is None


def test_role_names_are_those_of_the_types_asked_for(tmp_path: Path) -> None:
    path = tmp_path / "a.db"
    write_log(path, [overtake(), overtake(type="turn", roles={"car": "car1", "road": "road1"})])
    with open_log(str(path)) as opened:
        assert find_role_names(opened, EventFilter()) == ["car", "overtaken", "overtaker", "road"]
        assert find_role_names(opened, EventFilter(types=("turn",), runs=("r1",))) == ["car", "road"]


def test_a_cursor_of_other_filters_is_refused(log: EventLog) -> None:
    cursor = find_events(log, EventFilter(), limit=1).next_cursor
    with pytest.raises(CursorError, match="expected the filters of the page it came from"):
        find_events(log, EventFilter(types=("pass",)), cursor=cursor)


def test_a_cursor_survives_another_order_of_alternatives(log: EventLog) -> None:
    cursor = find_events(log, EventFilter(types=("pass", "overtake")), limit=1).next_cursor
    assert find_events(log, EventFilter(types=("overtake", "pass")), limit=5, cursor=cursor).items


@pytest.mark.parametrize("cursor", ["", "x", "å", "AAAA", "A" * 32, "%%%%"])
def test_a_damaged_cursor_is_refused(log: EventLog, cursor: str) -> None:
    with pytest.raises(CursorError, match="cursor: expected"):
        find_events(log, EventFilter(), cursor=cursor)


def test_an_empty_window_is_refused(log: EventLog) -> None:
    window = EventFilter(from_=TimePoint(5, "media"), to=TimePoint(5, "media"))
    with pytest.raises(FilterError, match="from: expected a time before 'to'"):
        iterate_events(log, window)


@pytest.mark.parametrize("limit", [0, -1, 1001])
def test_a_limit_out_of_range_is_refused(log: EventLog, limit: int) -> None:
    with pytest.raises(QueryError, match="limit: expected 1 to 1000"):
        find_events(log, EventFilter(), limit=limit)


@pytest.mark.parametrize(
    ("text", "us"),
    [("0", 0), ("12500000", 12_500_000), ("12.5s", 12_500_000), ("0.0000005s", 0), ("90s", 90_000_000),
     ("01:23.5", 83_500_000), ("1:02:03", 3_723_000_000), ("00:59.999999", 59_999_999)],
)  # fmt: skip
def test_media_times_are_read_exactly(text: str, us: int) -> None:
    assert parse_time(text, parameter="from") == TimePoint(us, "media")


@pytest.mark.parametrize(
    "text", ["", "12.5", "-3s", "1:75", "1:60:00", "noon", "2026-05-01", "2026-05-01T08:00:00", "2026-02-30T08:00:00Z",
             "12s ", "٣s", "9" * 30, "999999999999999s"],
)  # fmt: skip
def test_other_times_are_refused_with_the_parameter(text: str) -> None:
    with pytest.raises(QueryError, match="from: expected microseconds") as refused:
        parse_time(text, parameter="from")
    assert refused.value.parameter == "from"
    assert repr(text) in str(refused.value)


@pytest.mark.parametrize("statuses", [("retracted",), ("doubtful",), ("retracted", "doubtful")])
def test_hidden_events_are_found_by_their_own_index(
    log: EventLog, monkeypatch: pytest.MonkeyPatch, statuses: tuple[EventStatus, ...]
) -> None:
    if not log.place.url.startswith("sqlite"):
        pytest.skip("a server has statistics, by which it walks through 400 rows")
    asked: list[tuple[str, tuple[object, ...]]] = []

    def note(connection: Connection, query: str, values: tuple[object, ...]) -> list[tuple[Any, ...]]:
        asked.append((query, values))
        return driver_rows(connection, query, values)

    monkeypatch.setattr("service.questions.events.sql_text.driver_rows", note)
    list(iterate_events(log, EventFilter(statuses=statuses)))
    [(query, values)] = [one for one in asked if "FROM events" in one[0]]
    with log.connect() as connection:
        plan = driver_rows(connection, f"explain query plan {query}", values)
    assert "events_by_status" in str(plan)
