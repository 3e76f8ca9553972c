"""Are counts those of the events that the same filter finds, on both kinds of databases?"""

import random
from collections import Counter
from collections.abc import Iterator
from typing import get_args

import pytest
from msgspec.structs import replace

from service.errors import FilterError, QueryError
from service.questions.events.queries import EventFilter, decode_event, iterate_events
from service.questions.events.summaries import By, count_events, summarise
from service.records.events import EventRecord
from service.records.times import TimePoint, parse_time
from service.store.log import EventLog, open_log
from tests.service.conftest import NewLog
from tests.service.logs import SECOND_US, START_UTC_US, random_drafts, run, write_log

HOUR_US = 3_600_000_000


@pytest.fixture(scope="module")
def log(new_log: NewLog) -> Iterator[EventLog]:
    """Two runs, of which the later one begins an hour and a half after the other, with revised events."""
    url = write_log(new_log(), random_drafts(random.Random(1), 250))
    later = run("r2", source="late.mp4", start_utc_us=START_UTC_US + 3 * HOUR_US // 2)
    write_log(url, random_drafts(random.Random(2), 150, "r2"), record=later)
    with open_log(url) as opened:
        yield opened


def keys_of(event: EventRecord, by: By) -> set[str]:
    match by:
        case "type":
            return {event.type}
        case "road":
            return {event.place.road if event.place else ""}
        case "actor":
            return set(event.roles.values())
        case _:
            return {str(parse_time(event.start, parameter="").us // HOUR_US % 24)}


FILTERS = (
    EventFilter(),
    EventFilter(types=("pass", "follow")),
    EventFilter(from_=TimePoint(5 * SECOND_US, "media"), to=TimePoint(30 * SECOND_US, "media")),
    EventFilter(from_=TimePoint(START_UTC_US + HOUR_US, "utc"), runs=("r1", "r2")),
    EventFilter(statuses=("retracted",)),
    EventFilter(min_confidence=0.5, actors=("car1",)),
    EventFilter(as_of=200),
    EventFilter(roads=("road2",), min_duration_us=SECOND_US),
    EventFilter(sources=("nosuch",)),
)


@pytest.mark.parametrize("by", get_args(By))
@pytest.mark.parametrize("bin_us", [None, 7 * SECOND_US])
def test_counts_are_those_of_the_events_found(log: EventLog, by: By, bin_us: int | None) -> None:
    for wanted in FILTERS:
        found = [decode_event(text) for text in iterate_events(log, wanted)]
        counts = Counter(key for event in found for key in keys_of(event, by))
        cells = Counter(
            (key, event.start_us // bin_us * bin_us) for event in found for key in keys_of(event, by) if bin_us
        )
        as_of_seq, told = summarise(log, wanted, by, bin_us=bin_us)
        assert {one.key: one.count for one in told} == counts, wanted
        assert {(one.key, start_us): count for one in told for start_us, count in one.bins} == cells, wanted
        assert as_of_seq == (wanted.as_of or 400)
        assert count_events(log, wanted) == len(found), wanted


def test_the_highest_counts_are_told(log: EventLog) -> None:
    _, told = summarise(log, EventFilter(), "type")
    assert [one.count for one in told] == sorted((one.count for one in told), reverse=True)
    assert summarise(log, EventFilter(), "type", limit=2)[1] == told[:2]


def test_too_many_bins_are_refused(log: EventLog) -> None:
    with pytest.raises(QueryError, match="from 0 us to 39000000 us, got 7801 of 5000 us"):
        summarise(log, EventFilter(), "type", bin_us=5_000)
    narrow = EventFilter(from_=TimePoint(0, "media"), to=TimePoint(SECOND_US, "media"))
    assert summarise(log, narrow, "type", bin_us=5_000)[1]


def test_an_empty_window_is_refused(log: EventLog) -> None:
    point = TimePoint(SECOND_US, "media")
    with pytest.raises(FilterError):
        summarise(log, replace(EventFilter(), from_=point, to=point), "type")
