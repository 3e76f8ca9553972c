"""What statements mean where it could be doubted; the pitfalls of other systems are in `test_pitfalls.py`."""

import random

from chronicles.chronicle_set import load
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


def test_symmetric_positions_with_roles_give_each_cast_of_roles() -> None:
    text = "chronicle c[?x, ?y] { event(a[?x], t1) event(a[?y], t2) t2 - t1 in [-5s, 5s] }"
    assert shown(run(text, "1s a[u]\n2s a[v]")) == ["c[x=u, y=v] 1s..2s", "c[x=v, y=u] 1s..2s"]


def test_the_same_event_object_observed_twice_is_two_events() -> None:
    event = Event("a", (), 1)
    assert len(run(PAIR, [event, event])) == 1


def test_variables_of_two_sorts_may_be_equal() -> None:
    text = """domain Car = symbol domain Road = symbol message on[?c, ?r] { ?c in Car ?r in Road }
    chronicle c[?x, ?y] { event(on[?x, ?y], t1) }"""
    assert shown(run(text, "1s on[e4, e4]")) == ["c[x=e4, y=e4] 1s..1s"]


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
    stage = recogniser._engine._stages[0]
    sizes = []
    for second in range(6000):
        thing = f"x{second}"
        for name in ("a", "d"):
            recogniser.observe(Event(name, (thing,), second * 1_000_000))
        recogniser.observe(Event("p", (thing,), second * 1_000_000, "unknown", "on"))
        recogniser.observe(Event("p", (thing,), second * 1_000_000 + 10, "on", "unknown"))
        sizes.append(stage._next_sweep)
    assert max(sizes) == min(sizes)


def test_who_left_is_forgotten_long_before_the_longest_hold() -> None:
    text = """chronicle c[?x] {
      event(p[?x]:(?, on), t1) hold(p[?x]:on, (t1, t2)) event(p[?x]:(on, ?), t2) t2 - t1 in [5s, 10min]
    }"""
    recogniser = Recogniser(load(text))
    stage = recogniser._engine._stages[0]
    found = 0
    for second in range(0, 6000, 2):
        told = recogniser.observe(Event("p", (f"x{second}",), second * 1_000_000, "unknown", "on"))
        if second >= 10:
            told = recogniser.observe(Event("p", (f"x{second - 10}",), second * 1_000_000, "on", "unknown"))
        found += len(told)
    assert found == 2_995
    stage._sweep(recogniser._engine.watermark_us)
    assert len(stage.state()["history"][0]) < 10


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


def test_events_out_of_order_within_the_lateness_give_the_same_matches() -> None:
    text = "chronicle c(t1, t3) { event(a[], t1) event(b[], t2) event(d[], t3) t1 < t2 t2 < t3 t3 - t1 in [0s, 9s] }"
    stream = [one for one in steps("1s a[]\n2s b[]\n3s d[]\n4s b[]\n5s d[]") if isinstance(one, Event)]
    expected = sorted(shown(run(text, [*stream, 60_000_000])))
    for seed in range(20):
        shuffled = list(stream)
        random.Random(seed).shuffle(shuffled)
        assert sorted(shown(run(text, [*shuffled, 60_000_000], lateness_us=5_000_000))) == expected
    assert len(expected) == 3


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
