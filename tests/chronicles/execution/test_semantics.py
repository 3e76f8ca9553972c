"""The pitfalls that recognisers fall into, one by one, each with what we do."""

import itertools
import random

import pytest

from chronicles.chronicle_set import load
from chronicles.errors import ChronicleError
from chronicles.events import Event
from chronicles.recogniser import Recogniser
from tests.chronicles.support import run, shown, steps

PAIR = "chronicle pair(t1, t2) { event(a[], t1) event(a[], t2) t2 - t1 in [0s, 5s] }"


def test_all_matches_are_found_and_nothing_is_consumed() -> None:
    text = "chronicle c(t1, t2) { event(a[], t1) event(b[], t2) t2 - t1 in [0s, 9s] }"
    assert shown(run(text, "1s a[]\n2s a[]\n3s b[]\n4s b[]")) == [
        "c[] 1s..3s",
        "c[] 2s..3s",
        "c[] 1s..4s",
        "c[] 2s..4s",
    ]


def test_symmetric_positions_give_a_set_of_events_once() -> None:
    unordered = "chronicle c { event(a[], t1) event(a[], t2) t2 - t1 in [-5s, 5s] }"
    assert shown(run(unordered, "1s a[]\n2s a[]")) == ["c[] 1s..2s"]


def test_symmetric_positions_with_roles_give_each_cast_of_roles() -> None:
    text = "chronicle c[?x, ?y] { event(a[?x], t1) event(a[?y], t2) t2 - t1 in [-5s, 5s] }"
    assert shown(run(text, "1s a[u]\n2s a[v]")) == ["c[x=u, y=v] 1s..2s", "c[x=v, y=u] 1s..2s"]


def test_two_equal_events_at_one_time_are_two_events() -> None:
    assert len(run(PAIR, "1s a[]\n1s a[]")) == 1
    assert len(run(PAIR, "1s a[]\n1s a[]\n1s a[]")) == 3


def test_the_same_event_object_observed_twice_is_two_events() -> None:
    event = Event("a", (), 1)
    assert len(run(PAIR, [event, event])) == 1


def test_simultaneous_events_fit_in_every_order_of_arrival() -> None:
    text = "chronicle c { event(a[], t1) event(b[], t2) event(d[], t3) t1 = t2 t2 <= t3 t3 - t1 in [0s, 1s] }"
    for arrival in itertools.permutations(["1s a[]", "1s b[]", "1s d[]"]):
        assert len(run(text, "\n".join(arrival))) == 1


def test_one_event_does_not_fill_two_positions() -> None:
    assert run(PAIR, "1s a[]") == []


def test_two_variables_of_one_sort_differ_unless_allowed() -> None:
    text = "chronicle c[?x, ?y] { event(a[?x], t1) event(b[?y], t2) t2 - t1 in [0s, 5s] ALLOWED }"
    stream = "1s a[u]\n2s b[u]\n2s b[v]"
    assert shown(run(text.replace("ALLOWED", ""), stream)) == ["c[x=u, y=v] 1s..2s"]
    both = ["c[x=u, y=u] 1s..2s", "c[x=u, y=v] 1s..2s"]
    assert shown(run(text.replace("ALLOWED", "allow ?x == ?y"), stream)) == both
    assert shown(run(text.replace("ALLOWED", "?x == ?y"), stream)) == ["c[x=u, y=u] 1s..2s"]


def test_variables_of_two_sorts_may_be_equal() -> None:
    text = """domain Car = symbol domain Road = symbol message on[?c, ?r] { ?c in Car ?r in Road }
    chronicle c[?x, ?y] { event(on[?x, ?y], t1) }"""
    assert shown(run(text, "1s on[e4, e4]")) == ["c[x=e4, y=e4] 1s..1s"]


@pytest.mark.parametrize(
    ("bounds", "gaps_us"),
    [
        ("in [2us, 4us]", [2, 3, 4]),
        ("in ]2us, 4us[", [3]),
        ("in ]2us, 4us]", [3, 4]),
        ("in [2us, 4us[", [2, 3]),
    ],
)
def test_bounds_are_closed_unless_written_open(bounds: str, gaps_us: list[int]) -> None:
    text = f"chronicle c {{ event(a[], t1) event(b[], t2) t2 - t1 {bounds} }}"
    found = [gap for gap in range(7) if run(text, [Event("a", (), 0), Event("b", (), gap)])]
    assert found == gaps_us


def test_decimal_bounds_are_exact_at_their_edges() -> None:
    text = "chronicle c { event(a[], t1) event(b[], t2) t2 - t1 in [0.1s, 0.3s] }"
    at_us = 7_100_000
    found = [
        gap
        for gap in (99_999, 100_000, 300_000, 300_001)
        if run(text, [Event("a", (), at_us), Event("b", (), at_us + gap)])
    ]
    assert found == [100_000, 300_000]


@pytest.mark.parametrize("constraint", ["t2 - t1 in [-2s, 5s]", "t1 - t2 in [-5s, 2s]", "t2 >= t1 - 2s t2 <= t1 + 5s"])
def test_sign_of_a_difference_is_that_of_the_text(constraint: str) -> None:
    text = f"chronicle c(t1, t2) {{ event(a[], t1) event(b[], t2) {constraint} }}"
    assert shown(run(text, "10s a[]\n15s b[]")) == ["c[] 10s..15s"]
    assert shown(run(text, "10s b[]\n12s a[]")) == ["c[] 12s..10s"]
    assert run(text, "10s b[]\n13s a[]") == []
    assert run(text, "10s a[]\n16s b[]") == []


def test_chronicle_that_could_wait_for_ever_is_refused() -> None:
    with pytest.raises(ChronicleError, match="could wait for ever"):
        load("chronicle c { event(a[], t1) event(b[], t2) t2 > t1 }")


def test_instances_are_dropped_when_their_deadline_passes() -> None:
    recogniser = Recogniser(load("chronicle c { event(a[], t1) event(b[], t2) t2 - t1 in [0s, 5s] }"))
    recogniser.observe(Event("a", (), 0))
    recogniser.advance(5_000_000)
    assert len(recogniser.partial_instances()) == 1
    recogniser.advance(5_000_001)
    assert recogniser.partial_instances() == ()


def test_memory_does_not_grow_with_the_length_of_the_stream() -> None:
    text = """chronicle c[?x] {
      event(a[?x], t1) event(b[?x], t2) t2 - t1 in [0s, 1s]
      noevent(d[?x], (t1, t2)) hold(p[?x]:on, (t1 - 1s, t2)) hold(q[?x, ?]:on, (t1, t2 + 1us))
    }"""
    recogniser = Recogniser(load(text))
    stage = recogniser._stages[0]
    sizes = []
    for second in range(6000):
        thing = f"x{second}"
        for name in ("a", "d"):
            recogniser.observe(Event(name, (thing,), second * 1_000_000))
        recogniser.observe(Event("p", (thing,), second * 1_000_000, "unknown", "on"))
        recogniser.observe(Event("p", (thing,), second * 1_000_000 + 10, "on", "unknown"))
        sizes.append(stage._next_sweep)
    assert max(sizes) == min(sizes)


def test_absence_at_the_end_waits_for_time_to_pass() -> None:
    text = "chronicle c(t1) { event(a[], t1) noevent(b[], (t1, t1 + 5s)) }"
    recogniser = Recogniser(load(text))
    assert recogniser.observe(Event("a", (), 0)) == []
    assert recogniser.advance(4_999_999) == []
    [found] = recogniser.advance(5_000_000)
    assert (found.end_us, found.recognised_us) == (0, 5_000_000)


def test_absence_is_refuted_by_an_event_inside_and_not_by_one_at_its_end() -> None:
    text = "chronicle c(t1) { event(a[], t1) noevent(b[], (t1, t1 + 5s)) }"
    assert run(text, "0s a[]\n0s b[]\nuntil 9s") == []
    assert run(text, "0s a[]\n4.999999s b[]\nuntil 9s") == []
    assert len(run(text, "0s a[]\n5s b[]\nuntil 9s")) == 1


def test_absence_waits_for_late_events() -> None:
    text = "chronicle c(t1) { event(a[], t1) noevent(b[], (t1, t1 + 5s)) }"
    assert run(text, "0s a[]\nuntil 6s\n4s b[]\nuntil 20s", lateness_us=2_000_000) == []
    [found] = run(text, "0s a[]\nuntil 6.9s\nuntil 7s", lateness_us=2_000_000)
    assert found.recognised_us == 7_000_000


def test_event_at_the_watermark_is_in_time_and_one_before_is_late() -> None:
    recogniser = Recogniser(load(PAIR), lateness_us=10)
    recogniser.observe(Event("a", (), 100))
    assert recogniser.observe(Event("a", (), 90)) == []
    assert recogniser.late_count == 0
    recogniser.observe(Event("a", (), 89))
    assert recogniser.late_count == 1
    assert len(recogniser.advance(110)) == 1


def test_events_out_of_order_within_the_lateness_give_the_same_matches() -> None:
    text = "chronicle c(t1, t3) { event(a[], t1) event(b[], t2) event(d[], t3) t1 < t2 t2 < t3 t3 - t1 in [0s, 9s] }"
    stream = [one for one in steps("1s a[]\n2s b[]\n3s d[]\n4s b[]\n5s d[]") if isinstance(one, Event)]
    expected = sorted(shown(run(text, [*stream, 60_000_000])))
    for seed in range(20):
        shuffled = list(stream)
        random.Random(seed).shuffle(shuffled)
        assert sorted(shown(run(text, [*shuffled, 60_000_000], lateness_us=5_000_000))) == expected
    assert len(expected) == 3


def test_time_advances_without_events_and_never_backwards() -> None:
    recogniser = Recogniser(load("chronicle c(t1) { event(a[], t1) noevent(b[], (t1 + 1us, t1 + 5s)) }"))
    recogniser.observe(Event("a", (), 1_000_000))
    assert recogniser.advance(3_000_000) == []
    assert recogniser.advance(2_000_000) == []
    assert len(recogniser.advance(60_000_000)) == 1


def test_chronicles_do_not_take_events_from_each_other() -> None:
    text = "chronicle c(t1) { event(a[], t1) } chronicle d(t1) { event(a[], t1) }"
    assert shown(run(text, "1s a[]")) == ["c[] 1s..1s", "d[] 1s..1s"]


def test_hold_needs_a_reported_value() -> None:
    text = "attribute p[?x] { DEFAULT } message a[?x] "
    text += "chronicle c[?x](t1) { event(a[?x], t1) hold(p[?x]:on, (t1 - 1s, t1)) }"
    plain, with_default = text.replace("DEFAULT", ""), text.replace("DEFAULT", "default on")
    assert run(plain, "5s a[u]") == []
    assert len(run(plain, "4s p[u] unknown -> on\n5s a[u]")) == 1
    assert run(plain, "4.1s p[u] off -> on\n5s a[u]") == []
    assert len(run(with_default, "5s a[u]")) == 1
    assert run(with_default, "1s p[u] on -> unknown\n5s a[u]") == []


def test_hold_ends_before_its_end_point() -> None:
    text = "chronicle c(t1) { event(a[], t1) hold(p[]:on, (t1, t1 + 5s)) }"
    assert len(run(text, "0s p[] off -> on\n0s a[]\n5s p[] on -> off")) == 1
    assert run(text, "0s p[] off -> on\n0s a[]\n4s p[] on -> off\nuntil 9s") == []


def test_hold_gives_its_variables_every_value_that_holds() -> None:
    text = "chronicle c[?x, ?r](t1) { event(a[?x], t1) hold(on[?x, ?r]:true, (t1 - 1s, t1)) }"
    stream = "0s on[u, r1] false -> true\n0s on[u, r2] false -> true\n0s on[v, r3] false -> true\n5s a[u]"
    assert shown(run(text, stream)) == ["c[x=u, r=r1] 5s..5s", "c[x=u, r=r2] 5s..5s"]


def test_hold_with_anything_is_one_occurrence() -> None:
    text = "chronicle c[?x](t1) { event(a[?x], t1) hold(on[?x, ?]:true, (t1 - 1s, t1)) }"
    stream = "0s on[u, r1] false -> true\n0s on[u, r2] false -> true\n5s a[u]"
    assert shown(run(text, stream)) == ["c[x=u] 5s..5s"]


def test_restated_value_is_no_change() -> None:
    text = "chronicle c(t1) { event(p[]:(?, on), t1) }"
    assert shown(run(text, "1s p[] on -> on\n2s p[] off -> on")) == ["c[] 2s..2s"]


@pytest.mark.parametrize("seed", range(10))
def test_order_of_the_text_does_not_change_matches_or_work(seed: int) -> None:
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
