"""Which occurrences are told where not all are asked for."""

import itertools

import pytest

from chronicles.chronicle_set import load
from chronicles.events import Event
from chronicles.recogniser import Recogniser
from tests.chronicles.support import run, shown, steps

PAIR = "chronicle c[?x](t1, t2) { event(a[?x], t1) event(b[?], t2) t2 - t1 in [LOWs, 9s] select KIND }"


def pair(kind: str, low: int = 0) -> str:
    return PAIR.replace("KIND", kind).replace("LOW", str(low))


def test_first_tells_one_occurrence_for_each_event_at_the_anchor() -> None:
    stream = "1s a[u]\n2s a[v]\n3s b[k]\n4s b[l]\nuntil 20s"
    assert shown(run(pair("first(t1)"), stream)) == ["c[x=u] 1s..3s", "c[x=v] 2s..3s"]
    assert shown(run(pair("first(t2)"), stream)) == ["c[x=u] 1s..3s", "c[x=u] 1s..4s"]


def test_equal_events_at_the_anchor_are_two_events() -> None:
    assert len(run(pair("first(t1)"), "1s a[u]\n1s a[u]\n3s b[k]\nuntil 20s")) == 2


def test_first_is_first_in_the_order_of_results_and_not_of_arrival() -> None:
    for arrival in itertools.permutations(["1s a[v]", "1s a[u]", "1s b[k]"]):
        found = run(pair("first(t2)"), "\n".join([*arrival, "until 20s"]))
        assert shown(found) == ["c[x=u] 1s..1s"]


def test_non_overlapping_is_meant_for_each_combination_of_roles() -> None:
    stream = "1s a[u]\n2s a[v]\n3s b[k]\n4s b[l]\nuntil 20s"
    assert shown(run(pair("non_overlapping"), stream)) == ["c[x=u] 1s..3s", "c[x=v] 2s..3s"]


def test_occurrences_that_touch_do_not_overlap() -> None:
    text = "chronicle c(t1, t2) { event(a[], t1) event(a[], t2) t2 - t1 in [1s, 2s] select non_overlapping }"
    assert shown(run(text, "1s a[]\n2s a[]\n3s a[]\n4s a[]\nuntil 20s")) == [
        "c[] 1s..2s",
        "c[] 2s..3s",
        "c[] 3s..4s",
    ]


def test_occurrence_without_length_overlaps_one_that_has_its_time() -> None:
    stream = "1s a[u]\n1s b[k]\n1s b[l]\n5s b[m]\nuntil 20s"
    assert shown(run(pair("non_overlapping"), stream)) == ["c[x=u] 1s..1s"]


def test_the_order_of_the_time_points_does_not_matter() -> None:
    text = pair("non_overlapping", low=-9)
    assert shown(run(text, "1s b[k]\n5s a[u]\n7s b[l]\nuntil 20s")) == ["c[x=u] 1s..5s", "c[x=u] 5s..7s"]
    assert shown(run(text, "1s b[k]\n2s b[l]\n5s a[u]\nuntil 20s")) == ["c[x=u] 1s..5s"]


def test_what_is_not_selected_emits_nothing() -> None:
    text = pair("first(t1) when recognised { emit seen[?x] }")
    text += " chronicle seen[?x](t1) { event(seen[?x], t1) }"
    assert shown(run(text, "1s a[u]\n3s b[k]\n4s b[l]\nuntil 20s")) == ["c[x=u] 1s..3s", "seen[x=u] 3s..3s"]


def test_selected_occurrence_is_told_one_microsecond_after_it_closes() -> None:
    recogniser = Recogniser(load(pair("first(t1)")))
    for step in steps("1s a[u]\n3s b[k]"):
        assert isinstance(step, Event)
        assert recogniser.observe(step) == []
    [found] = recogniser.advance(3_000_001)
    assert (found.end_us, found.recognised_us) == (3_000_000, 3_000_001)


@pytest.mark.parametrize("kind", ["first(t1)", "non_overlapping"])
def test_selection_remembers_while_it_matters_and_no_longer(kind: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("chronicles.execution.stage._FIRST_SWEEP", 1)
    for seconds in (1, 9):
        stream = f"0s a[u]\n0.5s b[k]\n{seconds}s b[l]\n{seconds + 0.1}s b[m]\nuntil 60s"
        assert shown(run(pair(kind), stream)) == ["c[x=u] 0s..0.5s"]
    recogniser = Recogniser(load(pair(kind)))
    for second in range(100):
        for step in steps(f"{second}s a[u]\n{second}.5s b[k]"):
            assert isinstance(step, Event)
            recogniser.observe(step)
    [matcher] = recogniser._engine._stages[0]._matchers.values()
    anchors, intervals = matcher.builder._selector.state()
    assert len(anchors) + sum(len(told) for _, told in intervals) < 25
