"""What a recogniser tells: occurrences, their evidence, and what is under way."""

from typing import Any  # what an event must not be

import pytest

from chronicles.chronicle_set import load
from chronicles.errors import ChronicleError
from chronicles.events import Event, ExpectedEvent
from chronicles.recogniser import Recogniser, recognise
from tests.chronicles.support import run, shown, steps

RACE = """
timeunit 1s
chronicle race[?car](t1, t3) {
  event(start[?car], t1) event(turn[?car], t2) event(goal[?car], t3)
  t2 - t1 in [2, 10]  t3 - t2 in [3, 10]
  noevent(crash[?car], (t1, t3 + 5))
}
"""


def test_occurrence_carries_its_evidence() -> None:
    text = "chronicle c[?x](t0, t2) { event(a[?x], t1) event(b[?x], t2) t2 - t1 in [0s, 5s] t0 = t1 - 1s }"
    first = Event("a", ("u",), 1_000_000, hypotheses=("h2", "h1"))
    second = Event("b", ("u",), 3_000_000, hypotheses=("h1", "h3"))
    [found] = run(text, [first, second, 9_000_000])
    assert (found.start_us, found.end_us) == (0, 3_000_000)
    assert found.sub_events == (("t0", 0), ("t1", 1_000_000), ("t2", 3_000_000))
    assert found.events == (first, second)
    assert found.hypotheses == ("h1", "h2", "h3")
    assert found.recognised_us == 3_000_000
    assert found.version == load(text).plans[0].version


def test_partial_instance_tells_what_is_expected_when() -> None:
    recogniser = Recogniser(load(RACE))
    recogniser.observe(Event("start", ("u",), 0, hypotheses=("h",)))
    [found] = recogniser.partial_instances()
    assert (found.chronicle, found.roles, found.matched) == ("race", {"car": "u"}, (("t1", 0),))
    assert found.expected == (
        ExpectedEvent("t2", "turn[?car]", 2_000_000, 10_000_000),
        ExpectedEvent("t3", "goal[?car]", 5_000_000, 20_000_000),
    )
    assert found.latest_us == 10_000_000
    assert found.hypotheses == ("h",)


def test_windows_of_expected_events_shrink_as_time_passes() -> None:
    recogniser = Recogniser(load(RACE))
    recogniser.observe(Event("start", ("u",), 0))
    recogniser.advance(6_000_000)
    [found] = recogniser.partial_instances()
    assert [one.earliest_us for one in found.expected] == [6_000_000, 9_000_000]


def test_instance_waiting_for_an_absence_expects_nothing() -> None:
    recogniser = Recogniser(load(RACE))
    for step in steps("0s start[u]\n5s turn[u]\n9s goal[u]"):
        assert isinstance(step, Event)
        assert recogniser.observe(step) == []
    waiting = [one for one in recogniser.partial_instances() if not one.expected]
    assert [(one.matched[-1], one.latest_us) for one in waiting] == [(("t3", 9_000_000), 14_000_000)]
    assert shown(recogniser.advance(14_000_000)) == ["race[car=u] 0s..9s"]


def test_instance_whose_absence_is_already_refuted_is_not_shown() -> None:
    recogniser = Recogniser(load(RACE))
    for step in steps("0s start[u]\n5s turn[u]\n9s goal[u]\n10s crash[u]\nuntil 11s"):
        _ = recogniser.observe(step) if isinstance(step, Event) else recogniser.advance(step)
    assert [one for one in recogniser.partial_instances() if not one.expected] == []


def test_emitted_events_feed_other_chronicles_in_any_order_of_the_text() -> None:
    text = """
    chronicle twice[?x](t1, t2) { event(seen[?x], t1) event(seen[?x], t2) t2 - t1 in ]0s, 60s] }
    chronicle seen[?x](t1, t2) {
      event(a[?x], t1) event(b[?x], t2) t2 - t1 in [0s, 5s] noevent(d[?x], (t2, t2 + 2s))
      when recognised { emit event(seen[?x], t1) }
    }"""
    stream = "1s a[u]\n3s b[u]\n10s a[u]\n11s b[u]\nuntil 99s"
    assert shown(run(text, stream)) == ["seen[x=u] 1s..3s", "seen[x=u] 10s..11s", "twice[x=u] 1s..10s"]


def test_chronicle_of_emitted_events_waits_until_no_more_can_come() -> None:
    text = """
    chronicle seen[?x](t1, t2) {
      event(a[?x], t1) event(b[?x], t2) t2 - t1 in [0s, 5s] when recognised { emit event(seen[?x], t1) }
    }
    chronicle unseen[?x](t1) { event(c[?x], t1) noevent(seen[?x], (t1, t1 + 1s)) }"""
    recogniser = Recogniser(load(text))
    recogniser.observe(Event("c", ("u",), 10_000_000))
    assert recogniser.advance(15_999_999) == []
    assert shown(recogniser.advance(16_000_000)) == ["unseen[x=u] 10s..10s"]


def test_emitted_event_has_its_arguments_time_and_hypotheses() -> None:
    text = """chronicle c[?x](t1, t2) {
      event(a[?x], t1) event(b[?x], t2) t2 - t1 in [0s, 5s]
      when recognised { emit event(d[?x, north]:(off, on), t1 + 1s) emit e[?x] report "?x: ?y at ?x" }
    }"""
    [found] = run(text, [Event("a", ("u",), 0, hypotheses=("h",)), Event("b", ("u",), 2_000_000)])
    assert found.emitted == (
        Event("d", ("u", "north"), 1_000_000, "off", "on", ("h",)),
        Event("e", ("u",), 2_000_000, hypotheses=("h",)),
    )
    assert found.reports == ("u: ?y at u",)


def test_events_of_other_kinds_and_arities_are_passed_over() -> None:
    text = "chronicle c[?x](t1) { event(a[?x], t1) }"
    assert shown(run(text, "1s b[u]\n1s a[u, v]\n1s a[]\n1s a[u] off -> on\n1s a[u]")) == ["c[x=u] 1s..1s"]


def test_output_is_sorted_by_the_time_of_certainty() -> None:
    text = """chronicle slow(t1) { event(a[], t1) noevent(x[], (t1, t1 + 9s)) }
    chronicle quick(t1) { event(a[], t1) noevent(x[], (t1, t1 + 2s)) }"""
    assert shown(run(text, "1s a[]\n3s a[]\nuntil 60s")) == [
        "quick[] 1s..1s",
        "quick[] 3s..3s",
        "slow[] 1s..1s",
        "slow[] 3s..3s",
    ]


def test_recogniser_without_chronicles_finds_nothing() -> None:
    assert run("", "1s a[]\nuntil 9s") == []


def test_stored_events_may_come_in_any_order() -> None:
    events = [one for one in steps("9s goal[u]\n0s start[u]\n5s turn[u]") if isinstance(one, Event)]
    assert recognise(load(RACE), events) == []
    assert shown(recognise(load(RACE), events, until_us=60_000_000)) == ["race[car=u] 0s..9s"]


@pytest.mark.parametrize("executor", ["eager", "backfill"])
@pytest.mark.parametrize("condition", ["", "noevent(stop[?car], (t1, t1 + 1s))"], ids=["events alone", "obligations"])
def test_an_occurrence_never_ends_before_it_starts(executor: str, condition: str) -> None:
    found_by = "event(start[?car], t1) event(goal[?car], t2) t2 - t1 in [-9s, 9s]"
    text = f"chronicle near[?car](t2, t1) {{ {found_by} {condition} }}"
    events = [Event("start", ("u",), 1_000_000), Event("goal", ("u",), 5_000_000)]
    [found] = recognise(load(text), events, executor=executor)
    assert (found.start_us, found.end_us) == (1_000_000, 5_000_000)
    assert found.sub_events == (("t1", 1_000_000), ("t2", 5_000_000))


@pytest.mark.parametrize("executor", ["auto", "lazy", "fast"])
def test_other_executors_than_the_two_are_refused(executor: str) -> None:
    with pytest.raises(ChronicleError, match=f"expected the executor 'eager' or 'backfill', got '{executor}'"):
        recognise(load(RACE), [], executor=executor)


@pytest.mark.parametrize("t_us", [1.5, float("nan"), 2**61, "1", None])
def test_event_without_a_usable_time_is_refused(t_us: Any) -> None:
    with pytest.raises(ChronicleError, match="event 'start': expected t_us, a whole number of us, got"):
        Event("start", ("u",), t_us)


def test_event_with_an_old_value_alone_is_refused() -> None:
    with pytest.raises(ChronicleError, match="event 'p': expected a new value with the old one 'on', got none"):
        Event("p", ("u",), 0, "on")


@pytest.mark.parametrize("lateness_us", [1.5, None, float("nan")])
def test_lateness_that_is_no_number_of_microseconds_is_refused(lateness_us: Any) -> None:
    with pytest.raises(ChronicleError, match="recogniser: expected a lateness >= 0 us"):
        Recogniser(load(RACE), lateness_us)


def test_late_events_are_counted() -> None:
    recogniser = Recogniser(load(RACE), lateness_us=1_000_000)
    recogniser.advance(5_000_000)
    in_time, late = Event("start", ("u",), 4_000_000), Event("start", ("v",), 3_999_999)
    recogniser.observe(in_time)
    recogniser.observe(late)
    assert recogniser.late_count == 1


def test_negative_lateness_is_refused() -> None:
    with pytest.raises(ChronicleError, match="expected a lateness >= 0 us, got -1"):
        Recogniser(load(RACE), lateness_us=-1)
