"""What would a text recognise in a log, and what does a change of it change?"""

from collections.abc import Iterator

import pytest

from service.errors import FilterError
from service.questions.events.queries import EventFilter, decode_event, iterate_events
from service.questions.recognition.explaining import AbsenceQuestion, Explainer
from service.questions.recognition.trials import difference
from service.records.events import EventRecord
from service.records.seen import RelationRecord
from service.store.log import EventLog, open_log
from tests.conftest import Demo
from tests.service.logs import overtake, run

NEAR = """\
chronicle near[?a, ?b](t1, t2) {
  event(close[?a, ?b]:(false, true), t1)
  event(beside[?a, ?b]:(false, true), t2)
  %s
}
"""
SOON = NEAR % "t2 - t1 in [0s, 5s]"
SECOND = 1_000_000


@pytest.fixture
def log(tmp_path_factory: pytest.TempPathFactory) -> Iterator[EventLog]:
    """A run in which car1 came near car2 after 2 s, and near car3 after 8 s."""
    with open_log(str(tmp_path_factory.mktemp("near") / "a.db"), "w") as opened:
        writer = opened.begin_run(run(relations=("beside", "close")))
        writer.append_frames(second * SECOND for second in range(41))
        writer.append(
            RelationRecord(second * SECOND, second * SECOND, name, ("car1", other), "false", "true")
            for second, name, other in [
                (1, "close", "car2"),
                (3, "beside", "car2"),
                (10, "close", "car3"),
                (18, "beside", "car3"),
            ]
        )
        writer.finish("finished")
        yield opened


def window(start: int | None = None, end: int | None = None, limit: int = 5) -> AbsenceQuestion:
    start_us, end_us = (None if one is None else one * SECOND for one in (start, end))
    return AbsenceQuestion(chronicle="", roles={}, start_us=start_us, end_us=end_us, limit=limit)


def times(events: list[EventRecord]) -> list[tuple[int, int]]:
    return [(one.start_us // SECOND, one.end_us // SECOND) for one in events]


def test_a_text_is_tried_without_a_trace(log: EventLog) -> None:
    tried = Explainer(log).try_text(window(), SOON)
    assert (tried.run, tried.count, times(tried.items)) == ("r1", 1, [(1, 3)])
    assert tried.items[0].roles == {"a": "car1", "b": "car2"}
    (miss,) = tried.near_misses["near"]["near_misses"]
    assert {one["name"]: one["value"] for one in miss["roles"]} == {"a": "car1", "b": "car3"}
    assert list(iterate_events(log, EventFilter())) == []


@pytest.mark.parametrize(
    ("start", "end", "found"),
    [(0, 1, []), (0, 2, [(1, 3)]), (2, 3, [(1, 3)]), (3, 10, []), (None, 2, [(1, 3)]), (2, None, [(1, 3)])],
)
def test_a_window_asks_for_what_overlaps_it(
    log: EventLog, start: int | None, end: int | None, found: list[tuple[int, int]]
) -> None:
    assert times(Explainer(log).try_text(window(start, end), SOON).items) == found


def test_a_wrong_window_is_refused(log: EventLog) -> None:
    with pytest.raises(FilterError, match="expected a time before 'to'"):
        Explainer(log).try_text(window(2, 1), SOON)


def test_texts_are_compared(log: EventLog) -> None:
    found = Explainer(log).compare_texts(window(), SOON, NEAR % "t2 - t1 in [0s, 9s]")
    assert (found.same, times(found.gained), found.lost, found.moved) == (1, [(10, 18)], [], [])
    back = Explainer(log).compare_texts(window(9), NEAR % "t2 - t1 in [0s, 9s]", SOON)
    assert (back.same, back.gained, times(back.lost), back.moved) == (0, [], [(10, 18)], [])


def record(start: int, **fields: object) -> EventRecord:
    return EventRecord.of(overtake(start * SECOND, **fields), run())


def test_events_of_the_same_roles_are_the_same_or_have_moved() -> None:
    other = {"overtaker": "car1", "overtaken": "car2"}
    before = [record(1), record(5), record(9), record(1, roles=other)]
    after = [record(1), record(6), record(1, type="pass")]
    found = difference("r1", before, after)
    assert (found.run, found.same) == ("r1", 1)
    assert [(one.before, one.after) for one in found.moved] == [(before[1], after[1])]
    assert (found.gained, found.lost) == ([after[2]], [before[2], before[3]])


def test_the_text_of_a_run_finds_what_the_run_found(demo: Demo) -> None:
    with open_log(str(demo.log)) as opened:
        (text,) = [one.text for one in opened.run().texts if one.name == "overtake.chronicle"]
        stored = [decode_event(one) for one in iterate_events(opened, EventFilter(types=("overtake",)))]
        tried = Explainer(opened).try_text(window(), text)
    assert len(stored) > 3
    assert [(one.start_us, one.end_us, one.roles, one.place) for one in tried.items] == [
        (one.start_us, one.end_us, one.roles, one.place) for one in stored
    ]
