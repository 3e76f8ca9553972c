"""Counts, assumptions and what a conclusion rests on."""

import pytest

from chronicles.chronicle_set import load
from chronicles.events import Event
from chronicles.recogniser import Recogniser
from tests.chronicles.support import run, shown, steps


@pytest.mark.parametrize(
    ("count", "numbers"), [("0, 1", [0, 1]), ("2, 3", [2, 3]), ("1, oo", [1, 2, 3, 4]), ("0, 0", [0])]
)
def test_occurs_counts_events_between_both_bounds(count: str, numbers: list[int]) -> None:
    text = f"chronicle c(t1) {{ event(a[], t1) occurs(({count}), b[], (t1, t1 + 5s)) }}"
    streams = ["0s a[]\n" + "1s b[]\n" * number + "until 9s" for number in range(5)]
    assert [number for number, stream in enumerate(streams) if run(text, stream)] == numbers


def test_occurs_counts_its_start_and_not_its_end() -> None:
    text = "chronicle c(t1) { event(a[], t1) occurs((1, oo), b[], (t1, t1 + 5s)) }"
    assert len(run(text, "0s a[]\n0s b[]\nuntil 9s")) == 1
    assert run(text, "0s a[]\n5s b[]\nuntil 9s") == []


def test_occurs_counts_only_what_agrees_with_bound_variables() -> None:
    text = "chronicle c[?x](t1) { event(a[?x], t1) occurs((1, oo), b[?x], (t1, t1 + 5s)) }"
    assert shown(run(text, "0s a[u]\n0s a[v]\n1s b[v]\nuntil 9s")) == ["c[x=v] 0s..0s"]


def test_variables_known_only_in_an_occurs_stand_for_any_other_thing() -> None:
    text = "chronicle c[?x](t1) { event(a[?x], t1) occurs((2, 2), a[?other], (t1 - 9s, t1)) ALLOW }"
    stream = "0s a[u]\n1s a[v]\n2s a[w]\n3s a[u]"
    assert shown(run(text.replace("ALLOW", ""), stream)) == ["c[x=w] 2s..2s", "c[x=u] 3s..3s"]
    assert shown(run(text.replace("ALLOW", "allow ?x == ?other"), stream)) == ["c[x=w] 2s..2s"]


def test_occurs_that_may_be_zero_takes_an_empty_interval_and_others_do_not() -> None:
    text = "chronicle c(t1, t2) { event(a[], t1) event(d[], t2) t2 - t1 in [0s, 9s] occurs((N, oo), b[], (t1, t2)) }"
    assert len(run(text.replace("N", "0"), "1s a[]\n1s d[]\nuntil 9s")) == 1
    assert run(text.replace("N", "1"), "1s a[]\n1s b[]\n1s d[]\nuntil 9s") == []


def test_assert_is_broken_only_by_evidence_against_it() -> None:
    text = "chronicle c(t1) { event(a[], t1) assert(p[]:on, (t1 - 5s, t1 + 5s)) }"
    assert len(run(text, "10s a[]\nuntil 99s")) == 1
    assert len(run(text, "8s p[] unknown -> on\n10s a[]\n12s p[] on -> unknown\nuntil 99s")) == 1
    assert run(text, "8s p[] unknown -> off\n9s p[] off -> on\n10s a[]\nuntil 99s") == []
    assert run(text, "1s p[] unknown -> off\n10s a[]\nuntil 99s") == []
    assert len(run(text, "1s p[] unknown -> off\n5s p[] off -> on\n10s a[]\n15s p[] on -> off\nuntil 99s")) == 1


def test_default_speaks_against_an_assert() -> None:
    text = "attribute p[] { default off } message a[] chronicle c(t1) { event(a[], t1) assert(p[]:V, (t1, t1 + 5s)) }"
    assert run(text.replace("V", "on"), "10s a[]\nuntil 99s") == []
    assert len(run(text.replace("V", "off"), "10s a[]\nuntil 99s")) == 1


def test_empty_interval_asserts_nothing() -> None:
    text = "chronicle c(t1, t2) { event(a[], t1) event(b[], t2) t2 - t1 in [0s, 9s] assert(p[]:on, (t1, t2)) }"
    assert len(run(text, "1s p[] on -> off\n2s a[]\n2s b[]\nuntil 9s")) == 1
    assert run(text, "1s p[] on -> off\n2s a[]\n3s b[]\nuntil 9s") == []


def test_assert_takes_its_values_from_events_and_holds() -> None:
    text = """chronicle c[?x, ?r](t1) {
      event(a[?x], t1) hold(on[?x, ?r]:true, (t1 - 1s, t1)) assert(busy[?r]:false, (t1 - 1s, t1))
    }"""
    stream = "0s on[u, r1] false -> true\n0s on[u, r2] false -> true\n1s busy[r1] unknown -> true\n5s a[u]"
    assert shown(run(text, stream)) == ["c[x=u, r=r2] 5s..5s"]


def test_instance_is_shown_until_its_count_or_assert_is_broken() -> None:
    text = """chronicle c(t1, t2) {
      event(a[], t1) event(b[], t2) t2 - t1 in [0s, 9s] occurs((1, 2), d[], (t1, t1 + 4s)) assert(p[]:on, (t1, t1 + 9s))
    }"""

    def is_shown(stream: str) -> bool:
        recogniser = Recogniser(load(text))
        for step in steps(stream):
            _ = recogniser.advance(step) if isinstance(step, int) else recogniser.observe(step)
        return bool(recogniser.partial_instances())

    assert is_shown("0s a[]\nuntil 3s")
    assert not is_shown("0s a[]\nuntil 5s")
    assert is_shown("0s a[]\n1s d[]\n2s d[]\nuntil 3s")
    assert not is_shown("0s a[]\n1s d[]\n2s d[]\n3s d[]\nuntil 3.5s")
    assert not is_shown("0s a[]\n1s d[]\n2s p[] on -> off\nuntil 3s")


# ---- hypotheses


def change(t_us: int, old: str, new: str, *labels: str, args: tuple[str, ...] = ()) -> Event:
    return Event("p", args, t_us, old, new, labels)


def test_hold_rests_on_the_latest_change_at_or_before_its_start() -> None:
    text = "chronicle c(t1) { event(a[], t1) hold(p[]:on, (t1 - 5us, t1)) }"
    stream = [
        change(1, "off", "on", "old"),
        change(3, "on", "on", "latest"),
        change(3, "on", "on", "same time"),
        change(8, "on", "on", "later"),
        Event("a", (), 10, hypotheses=("event",)),
    ]
    [found] = run(text, stream)
    assert found.hypotheses == ("event", "latest", "same time")


def test_hold_satisfied_by_a_default_rests_on_nothing() -> None:
    text = "attribute p[] { default on } message a[] "
    text += "chronicle c(t1) { event(a[], t1) hold(p[]:on, (t1 - 5us, t1)) }"
    assert [one.hypotheses for one in run(text, [Event("a", (), 10), change(12, "on", "off", "h")])] == [()]


def test_hold_of_anything_rests_on_everything_it_is_true_of() -> None:
    text = "chronicle c(t1) { event(a[], t1) hold(p[?]:on, (t1 - 5us, t1)) }"
    stream = [change(1, "off", "on", label, args=(label,)) for label in ("u", "v")]
    [found] = run(text, [*stream, change(2, "on", "off", "w", args=("w",)), Event("a", (), 10)])
    assert found.hypotheses == ("u", "v")


def test_assert_rests_on_what_speaks_for_it() -> None:
    text = "chronicle c(t1) { event(a[], t1) assert(p[]:on, (t1 - 5us, t1 + 5us)) }"
    unknown = change(2, "off", "unknown", "gone")
    assert [one.hypotheses for one in run(text, [unknown, Event("a", (), 10), 99])] == [()]
    stream = [unknown, change(7, "unknown", "on", "back"), Event("a", (), 10), change(11, "on", "on", "again"), 99]
    assert [one.hypotheses for one in run(text, stream)] == [("back",)]
    assert [one.hypotheses for one in run(text, [change(2, "off", "on", "before"), Event("a", (), 10), 99])] == [
        ("before",)
    ]
