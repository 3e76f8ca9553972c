"""What an explanation of an occurrence tells."""

import pytest

from chronicles import library
from chronicles.chronicle_set import ChronicleSet, load, load_texts
from chronicles.errors import ChronicleError
from chronicles.events import Event, Occurrence
from chronicles.explanation.explanations import CountReading, Explanation, HoldReading
from chronicles.explanation.why import why
from chronicles.recogniser import recognise
from tests.chronicles.support import steps

VISITS = """
chronicle visit[?car](t1, t2) {
  event(enter[?car], t1)  event(leave[?car], t2)  t2 - t1 in [1s, 1min]
  when recognised { emit visited[?car] }
}
chronicle regular[?car](t1, t2) {
  event(visited[?car], t1)  event(visited[?car], t2)  t2 - t1 in ]0s, 5min]
}
"""
TWO_VISITS = "10s enter[a]\n20s leave[a]\n70s enter[a]\n80s leave[a]"


def events_of(stream: str) -> list[Event]:
    return [one for one in steps(stream) if isinstance(one, Event)]


def only(chronicles: ChronicleSet, events: list[Event], name: str, until_us: int | None = None) -> Occurrence:
    [found] = [one for one in recognise(chronicles, events, until_us=until_us) if one.chronicle == name]
    return found


def explained(text: str, stream: str, until_us: int | None = None) -> Explanation:
    chronicles, events = load(text), events_of(stream)
    return why(chronicles, only(chronicles, events, chronicles.names[-1], until_us), events)


def test_constraints_stand_with_value_bounds_and_slack_the_tightest_first() -> None:
    text = """chronicle one(t1, t3) {
      event(a[], t1)  event(b[], t2)  event(c[], t3)
      t2 - t1 in [1s, 10s]   t3 - t2 in ]0s, 3s[   t3 > t1
    }"""
    readings = explained(text, "0s a[]\n4s b[]\n6.5s c[]").constraints
    assert [(one.text, one.value_us, one.slack_us) for one in readings] == [
        ("t3 - t2 in ]0s, 3s[", 2_500_000, 499_999),
        ("t2 - t1 in [1s, 10s]", 4_000_000, 3_000_000),
        ("t3 > t1", 6_500_000, 6_499_999),
    ]
    assert (readings[2].slack_low_us, readings[2].slack_high_us) == (6_499_999, None)


def test_lines_count_in_the_text_that_was_loaded() -> None:
    text = """# a comment
    chronicle one(t1)  {
      event(a[], t1)  event(b[], t2)

      0ms <= t2 - t1 <= 5000ms  # the canonical text writes this in another way, and in another line
      noevent(
        c[], (t1, t2))
    }"""
    first = "message a[] message b[] message c[] attribute unused[]"
    chronicles = load_texts([("words", first), ("one", text)])
    events = events_of("1s a[]\n2s b[]")
    explanation = why(chronicles, only(chronicles, events, "one"), events)
    assert [(one.text, one.line) for one in explanation.constraints] == [("0s <= t2 - t1 <= 5s", 5)]
    assert [one.line for one in explanation.obligations] == [6]
    assert dict(chronicles.statement_places)["one"] == (("one", 3), ("one", 3), ("one", 5), ("one", 6))


def test_hold_tells_which_change_set_its_value_and_how_long_it_lasted() -> None:
    text = """chronicle paused[?x](t1, t2) {
      event(stop[?x], t1)  event(go[?x], t2)  t2 - t1 in [0s, 1min]  hold(lit[?x]:on, (t1, t2))
    }"""
    stream = "1s lit[a] unknown -> on\n3s stop[a]\n5s go[a]\n5.5s lit[a] on -> off"
    [hold] = explained(text, stream).obligations
    assert isinstance(hold, HoldReading)
    [span] = hold.spans
    assert (span.value, span.start_us, span.end_us) == ("on", 1_000_000, 5_500_000)
    assert span.change == Event("lit", ("a",), 1_000_000, "unknown", "on")
    assert (hold.outcome, hold.slack_us) == ("met", 500_000)


def test_noevent_tells_the_nearest_forbidden_events_outside() -> None:
    text = "chronicle alone[?x](t1) { event(a[?x], t1) noevent(b[?x], (t1 - 1s, t1 + 1s)) }"
    [reading] = explained(text, "1s b[x]\n3s b[y]\n3s a[x]\n4.25s b[x]\n9s b[x]").obligations
    assert isinstance(reading, CountReading)
    assert reading.before == Event("b", ("x",), 1_000_000)
    assert reading.after == Event("b", ("x",), 4_250_000)
    assert (reading.counted, reading.slack_us) == ((), 250_000)


def test_occurs_tells_the_events_it_counted() -> None:
    text = "chronicle busy[](t1) { event(a[], t1) occurs((2, 3), b[?], (t1, t1 + 5s)) }"
    [reading] = explained(text, "0s a[]\n1s b[x]\n4.5s b[y]\n6s c[]").obligations
    assert isinstance(reading, CountReading)
    assert [event.t_us for event in reading.counted] == [1_000_000, 4_500_000]
    assert (reading.least, reading.most, reading.slack_us) == (2, 3, 499_999)


def test_assert_is_met_by_what_is_unknown() -> None:
    text = "chronicle calm[?x](t1) { event(a[?x], t1) assert(alarm[?x]:off, (t1 - 1s, t1)) }"
    [reading] = explained(text, "5s a[x]").obligations
    assert isinstance(reading, HoldReading)
    assert (reading.kind, reading.outcome, [span.value for span in reading.spans]) == ("assert", "met", ["unknown"])


def test_roles_name_the_statement_that_gave_their_value() -> None:
    text = """chronicle on_road[?car, ?road, ?kind](t1) {
      event(seen[?car, ?kind], t1)  hold(on[?car, ?road]:true, (t1 - 1s, t1))  ?kind == lorry
    }"""
    roles = explained(text, "1s on[a, e4] unknown -> true\n5s seen[a, lorry]").roles
    assert [(role.name, role.value, role.source) for role in roles] == [
        ("car", "a", "event(seen[?car, ?kind], t1)"),
        ("road", "e4", "hold(on[?car, ?road]:true, (t1 - 1s, t1))"),
        ("kind", "lorry", "the text"),
    ]


def test_emitted_events_are_explained_one_level_deep() -> None:
    explanation = explained(VISITS, TWO_VISITS)
    causes = [one.emitted_by for one in explanation.events]
    assert [(cause.chronicle, cause.start_us) for cause in causes if cause] == [
        ("visit", 10_000_000),
        ("visit", 70_000_000),
    ]
    assert causes[0] is not None
    assert [one.event.name for one in causes[0].events] == ["enter", "leave"]


def test_occurrence_without_its_events_is_found_again_by_time_points_and_roles() -> None:
    chronicles = library.load_library(["crossing"])
    events = events_of(
        "1s in_crossing[a, j] unknown -> false\n2s in_crossing[a, j] false -> true\n"
        "2s in_crossing[b, j] false -> true\n4s in_crossing[a, j] true -> false\n"
    )
    found = only(chronicles, events, "crossing")
    read = Occurrence(**{name: getattr(found, name) for name in Occurrence.__slots__} | {"events": ()})
    assert why(chronicles, read, events) == why(chronicles, found, events)


def test_events_that_lack_the_occurrence_are_refused() -> None:
    chronicles, events = load(VISITS), events_of(TWO_VISITS)
    found = recognise(chronicles, events)[0]
    with pytest.raises(ChronicleError, match=r"visit\[car=a\] at 10000000 us: expected the events"):
        why(chronicles, found, events[1:])


def test_occurrence_of_another_version_is_refused() -> None:
    events = events_of(TWO_VISITS)
    found = recognise(load(VISITS), events)[0]
    with pytest.raises(ChronicleError, match="expected version"):
        why(load(VISITS.replace("1min", "2min")), found, events)
