"""`assert` as an action: setting attributes, and what others see of it."""

import itertools

from chronicles.chronicle_set import load
from chronicles.events import Event
from chronicles.recogniser import Recogniser
from tests.chronicles.support import run, shown, steps

SWITCH = """
chronicle on[?x](t1) { event(start[?x], t1) when recognised { assert(lit[?x]:on, t1) } }
chronicle off[?x](t1) { event(stop[?x], t1) when recognised { assert(lit[?x]:off, t1) } }
"""


def changes(text: str, stream: str) -> list[str]:
    emitted = [event for one in run(text, stream) for event in one.emitted]
    return [f"{one.t_us / 1e6:g}s {one.name}[{', '.join(one.args)}] {one.old} -> {one.new}" for one in emitted]


def test_assert_changes_the_value_it_finds_at_its_time() -> None:
    assert changes(SWITCH, "1s lit[u] unknown -> red\n2s start[u]\n3s lit[v] unknown -> on\n4s start[v]\nuntil 9s") == [
        "2s lit[u] red -> on"
    ]


def test_assert_finds_what_was_asserted_before_by_any_chronicle() -> None:
    stream = "1s start[u]\n2s start[u]\n3s stop[u]\n4s stop[u]\n5s start[u]\nuntil 9s"
    assert changes(SWITCH, stream) == [
        "1s lit[u] unknown -> on",
        "3s lit[u] on -> off",
        "5s lit[u] off -> on",
    ]


def test_assert_comes_after_what_is_reported_at_the_same_time_in_any_order_of_arrival() -> None:
    for arrival in itertools.permutations(["2s lit[u] unknown -> red", "2s start[u]", "2s start[v]"]):
        stream = "\n".join([*arrival, "until 9s"])
        assert changes(SWITCH, stream) == ["2s lit[u] red -> on", "2s lit[v] unknown -> on"]


def test_assert_does_not_depend_on_how_time_is_cut() -> None:
    text = """chronicle c[?x](t1, t2) {
      event(a[?x], t1) event(b[?x], t2) t2 - t1 in [0s, 9s] when recognised { assert(p[?x]:on, t1 - 1s) }
    }"""
    stream = steps("0s p[u] unknown -> off\n2s a[u]\n2.5s p[u] off -> red\n4s b[u]\n4s a[u]\n5s b[u]\nuntil 20s")
    cut = [step for one in stream for step in (one.t_us if isinstance(one, Event) else one, one)]
    for lateness_us in (0, 3_000_000):
        found = [one.emitted for one in run(text, [*stream, 99_000_000], lateness_us=lateness_us)]
        assert found == [one.emitted for one in run(text, [*cut, 99_000_000], lateness_us=lateness_us)]
        assert [(one.t_us, one.old) for emitted in found for one in emitted] == [(1_000_000, "off"), (3_000_000, "red")]


def test_assert_in_the_future_waits_for_its_time() -> None:
    text = "chronicle c(t1) { event(a[], t1) when recognised { assert(p[]:on, t1 + 5s) } }"
    recogniser = Recogniser(load(text))
    recogniser.observe(Event("a", (), 0))
    recogniser.observe(Event("p", (), 4_000_000, "unknown", "off"))
    assert recogniser.advance(5_000_001) == []
    [found] = recogniser.advance(5_000_002)
    assert found.emitted == (Event("p", (), 5_000_000, "off", "on"),)


def test_asserted_value_feeds_other_chronicles() -> None:
    text = (
        SWITCH
        + """
    chronicle blink[?x](t1, t2) { event(lit[?x]:(?, on), t1) event(lit[?x]:(on, off), t2) t2 - t1 in [0s, 5s] }
    chronicle glow[?x](t1) { event(check[?x], t1) hold(lit[?x]:on, (t1 - 2s, t1)) }
    """
    )
    stream = "1s start[u]\n2s stop[u]\n3s start[u]\n6s check[u]\n6s check[v]\nuntil 20s"
    found = [line for line in shown(run(text, stream)) if line.startswith(("blink", "glow"))]
    assert found == ["blink[x=u] 1s..2s", "glow[x=u] 6s..6s"]


def test_assert_carries_the_hypotheses_of_its_occurrence() -> None:
    [found] = run(SWITCH, [Event("start", ("u",), 1, hypotheses=("h",)), 9])
    assert found.emitted == (Event("lit", ("u",), 1, "unknown", "on", ("h",)),)
