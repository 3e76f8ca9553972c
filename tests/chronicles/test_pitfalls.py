"""The 17 pitfalls that recognisers fall into, one by one, each with what we do: the number is part of the name.

They are those of other systems: choices told once or many times, ties, closed bounds, signs, endless waits, absence
without time, lateness, silence, split windows, restarts, counts, forgetting, initial values, identities, text order.
"""

import itertools
import random
from collections.abc import Sequence

import pytest

from chronicles.chronicle_set import load
from chronicles.errors import ChronicleError
from chronicles.events import Event, Occurrence
from chronicles.recogniser import Recogniser
from tests.cases import for_each
from tests.chronicles.support import run, shown, steps

PAIR = "chronicle pair(t1, t2) { event(a[], t1) event(a[], t2) t2 - t1 in [0s, 5s] }"


def observed(recogniser: Recogniser, stream: Sequence[Event | int]) -> list[Occurrence]:
    found: list[Occurrence] = []
    for step in stream:
        found += recogniser.advance(step) if isinstance(step, int) else recogniser.observe(step)
    return found


def test_01_all_choices_are_told_unless_a_selection_is_asked_for() -> None:
    text = "chronicle c(t1, t2) { event(a[], t1) event(b[], t2) t2 - t1 in [0s, 9s] SELECT }"
    stream = "1s a[]\n2s a[]\n3s b[]\n4s b[]\n6s a[]\n7s b[]\nuntil 60s"
    every = ["1s..3s", "2s..3s", "1s..4s", "2s..4s", "1s..7s", "2s..7s", "6s..7s"]
    for select, wanted in (
        ("", every),
        ("select all", every),
        ("select first(t1)", ["1s..3s", "2s..3s", "6s..7s"]),
        ("select first(t2)", ["1s..3s", "1s..4s", "1s..7s"]),
        ("select non_overlapping", ["1s..3s", "6s..7s"]),
    ):
        assert shown(run(text.replace("SELECT", select), stream)) == [f"c[] {times}" for times in wanted]


def test_02_symmetric_positions_give_a_set_of_events_once() -> None:
    unordered = "chronicle c { event(a[], t1) event(a[], t2) t2 - t1 in [-5s, 5s] }"
    assert shown(run(unordered, "1s a[]\n2s a[]")) == ["c[] 1s..2s"]


def test_03_two_equal_events_at_one_time_are_two_events() -> None:
    assert len(run(PAIR, "1s a[]\n1s a[]")) == 1
    assert len(run(PAIR, "1s a[]\n1s a[]\n1s a[]")) == 3


def test_03_simultaneous_events_fit_in_every_order_of_arrival() -> None:
    text = "chronicle c { event(a[], t1) event(b[], t2) event(d[], t3) t1 = t2 t2 <= t3 t3 - t1 in [0s, 1s] }"
    for arrival in itertools.permutations(["1s a[]", "1s b[]", "1s d[]"]):
        assert len(run(text, "\n".join(arrival))) == 1


def test_04_one_event_does_not_fill_two_positions() -> None:
    assert run(PAIR, "1s a[]") == []


def test_04_two_variables_of_one_sort_differ_unless_allowed() -> None:
    text = "chronicle c[?x, ?y] { event(a[?x], t1) event(b[?y], t2) t2 - t1 in [0s, 5s] ALLOWED }"
    stream = "1s a[u]\n2s b[u]\n2s b[v]"
    assert shown(run(text.replace("ALLOWED", ""), stream)) == ["c[x=u, y=v] 1s..2s"]
    both = ["c[x=u, y=u] 1s..2s", "c[x=u, y=v] 1s..2s"]
    assert shown(run(text.replace("ALLOWED", "allow ?x == ?y"), stream)) == both
    assert shown(run(text.replace("ALLOWED", "?x == ?y"), stream)) == ["c[x=u, y=u] 1s..2s"]


@pytest.mark.parametrize(
    ("bounds", "gaps_us"),
    [
        ("in [2us, 4us]", [2, 3, 4]),
        ("in ]2us, 4us[", [3]),
        ("in ]2us, 4us]", [3, 4]),
        ("in [2us, 4us[", [2, 3]),
    ],
)
def test_05_bounds_are_closed_unless_written_open(bounds: str, gaps_us: list[int]) -> None:
    text = f"chronicle c {{ event(a[], t1) event(b[], t2) t2 - t1 {bounds} }}"
    found = [gap for gap in range(7) if run(text, [Event("a", (), 0), Event("b", (), gap)])]
    assert found == gaps_us


def test_05_decimal_bounds_are_exact_at_their_edges() -> None:
    text = "chronicle c { event(a[], t1) event(b[], t2) t2 - t1 in [0.1s, 0.3s] }"
    at_us = 7_100_000
    found = [
        gap
        for gap in (99_999, 100_000, 300_000, 300_001)
        if run(text, [Event("a", (), at_us), Event("b", (), at_us + gap)])
    ]
    assert found == [100_000, 300_000]


@pytest.mark.parametrize("constraint", ["t2 - t1 in [-2s, 5s]", "t1 - t2 in [-5s, 2s]", "t2 >= t1 - 2s t2 <= t1 + 5s"])
def test_06_sign_of_a_difference_is_that_of_the_text(constraint: str) -> None:
    text = f"chronicle c(t1, t2) {{ event(a[], t1) event(b[], t2) {constraint} }}"
    assert shown(run(text, "10s a[]\n15s b[]")) == ["c[] 10s..15s"]
    assert shown(run(text, "10s b[]\n12s a[]")) == ["c[] 10s..12s"]
    assert run(text, "10s b[]\n13s a[]") == []
    assert run(text, "10s a[]\n16s b[]") == []


def test_07_chronicle_that_could_wait_for_ever_is_refused() -> None:
    with pytest.raises(ChronicleError, match="could wait for ever"):
        load("chronicle c { event(a[], t1) event(b[], t2) t2 > t1 }")


def test_08_absence_at_the_end_waits_for_time_to_pass() -> None:
    text = "chronicle c(t1) { event(a[], t1) noevent(b[], (t1, t1 + 5s)) }"
    recogniser = Recogniser(load(text))
    assert recogniser.observe(Event("a", (), 0)) == []
    assert recogniser.advance(4_999_999) == []
    [found] = recogniser.advance(5_000_000)
    assert (found.end_us, found.recognised_us) == (0, 5_000_000)


def test_09_event_at_the_watermark_is_in_time_and_one_before_is_late() -> None:
    recogniser = Recogniser(load(PAIR), lateness_us=10)
    recogniser.observe(Event("a", (), 100))
    assert recogniser.observe(Event("a", (), 90)) == []
    assert recogniser.late_count == 0
    recogniser.observe(Event("a", (), 89))
    assert recogniser.late_count == 1
    assert len(recogniser.advance(110)) == 1


def test_10_time_advances_without_events_and_never_backwards() -> None:
    recogniser = Recogniser(load("chronicle c(t1) { event(a[], t1) noevent(b[], (t1 + 1us, t1 + 5s)) }"))
    recogniser.observe(Event("a", (), 1_000_000))
    assert recogniser.advance(3_000_000) == []
    assert recogniser.advance(2_000_000) == []
    assert len(recogniser.advance(60_000_000)) == 1


def test_11_steps_and_restated_values_do_not_split_what_holds() -> None:
    text = "chronicle c(t1, t2) { event(a[], t1) event(b[], t2) t2 - t1 in [0s, 1h] hold(p[]:on, (t1, t2)) }"
    stream = "0s p[] off -> on\n1s a[]\n5s p[] on -> on\n500s b[]"
    in_steps = [step for one in steps(stream) for step in (one.t_us - 1 if isinstance(one, Event) else one, one)]
    assert shown(run(text, stream)) == shown(run(text, in_steps)) == ["c[] 1s..500s"]


def test_13_count_pattern_fires_again_for_each_new_event() -> None:
    text = "chronicle many(t1) { event(honk[], t1) occurs((3, oo), honk[], (t1, t1 + 5s)) }"
    stream = "1s honk[]\n2s honk[]\n3s honk[]\n4s honk[]\n5.5s honk[]\n60s honk[]\n61s honk[]\n62s honk[]\nuntil 99s"
    assert shown(run(text, stream)) == [f"many[] {at}..{at}" for at in ("1s", "2s", "3s", "60s")]


def test_14_chronicles_do_not_take_events_from_each_other() -> None:
    text = "chronicle c(t1) { event(a[], t1) } chronicle d(t1) { event(a[], t1) }"
    assert shown(run(text, "1s a[]")) == ["c[] 1s..1s", "d[] 1s..1s"]


def test_15_hold_needs_a_reported_value() -> None:
    text = "attribute p[?x] { DEFAULT } message a[?x] "
    text += "chronicle c[?x](t1) { event(a[?x], t1) hold(p[?x]:on, (t1 - 1s, t1)) }"
    plain, with_default = text.replace("DEFAULT", ""), text.replace("DEFAULT", "default on")
    assert run(plain, "5s a[u]") == []
    assert len(run(plain, "4s p[u] unknown -> on\n5s a[u]")) == 1
    assert run(plain, "4.1s p[u] off -> on\n5s a[u]") == []
    assert len(run(with_default, "5s a[u]")) == 1
    assert run(with_default, "1s p[u] on -> unknown\n5s a[u]") == []


@for_each("seed", range(10))
def test_17_order_of_the_text_does_not_change_matches_or_work(seed: int) -> None:
    lines = [f"event({name}[?x], t{index})" for index, name in enumerate("abcd", 1)]
    lines += [f"t{index + 1} - t{index} in [0s, 5s]" for index in range(1, 4)]
    random.Random(seed).shuffle(lines)
    pick = random.Random(1)
    stream = [Event(pick.choice("abc"), (pick.choice("xyz"),), second * 300_000) for second in range(300)]
    stream += [Event("d", (thing,), 90_000_000) for thing in "xyz"]
    recogniser = Recogniser(load(f"chronicle c[?x](t1, t4) {{ {' '.join(lines)} }}"))
    found = [one for event in stream for one in recogniser.observe(event)]
    in_order = Recogniser(load(f"chronicle c[?x](t1, t4) {{ {' '.join(sorted(lines))} }}"))
    assert [one.sub_events for one in found] == [one.sub_events for event in stream for one in in_order.observe(event)]
    assert len(recogniser.partial_instances()) == len(in_order.partial_instances())


def test_12_restart_from_a_checkpoint_changes_nothing() -> None:
    text = """chronicle c[?x](t1, t2) {
      event(a[?x], t1) event(b[?x], t2) t2 - t1 in [0s, 9s]
      noevent(d[?x], (t1, t2 + 3s)) hold(p[?x]:on, (t1 - 2s, t2)) select first(t1)
    }"""
    stream = steps("0s p[u] off -> on\n3s a[u]\n4s b[u]\n5s b[u]\n6s a[u]\nuntil 7s\n5.5s b[u]\n8s b[u]\nuntil 30s")
    expected = run(text, stream, lateness_us=2_000_000)
    assert shown(expected) == ["c[x=u] 3s..4s", "c[x=u] 6s..8s"]
    for cut in range(len(stream) + 1):
        first, second = (Recogniser(load(text), lateness_us=2_000_000) for _ in range(2))
        found = observed(first, stream[:cut])
        second.restore(first.checkpoint())
        assert found + observed(second, stream[cut:]) == expected


def test_16_what_rests_on_a_retracted_identity_is_taken_back() -> None:
    text = "chronicle c[?x](t1, t2) { event(a[?x], t1) event(b[?x], t2) t2 - t1 in [0s, 9s] }"
    events = [
        Event("a", ("car1",), 1_000_000),
        Event("b", ("car1",), 2_000_000, hypotheses=("car1 is track7",)),
        Event("b", ("car1",), 3_000_000),
    ]
    recogniser = Recogniser(load(text))
    found = observed(recogniser, events)
    assert [(one.end_us, one.status) for one in found] == [(2_000_000, "tentative"), (3_000_000, "recognised")]
    taken_back = recogniser.retract("car1 is track7")
    assert [(one.end_us, one.status) for one in taken_back] == [(2_000_000, "retracted")]
