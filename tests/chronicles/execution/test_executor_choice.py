"""Which store is chosen for which stream."""

from collections import Counter

import pytest

from benchmarks.bench_chronicles import STREAMS, Stream, chronicle_set
from chronicles.chronicle_set import load
from chronicles.execution.executor_choice import prefer_lazy


@pytest.mark.parametrize("stream", STREAMS, ids=lambda one: one.name)
def test_lazy_is_preferred_where_the_last_event_of_the_benchmark_is_rare(stream: Stream) -> None:
    [plan] = chronicle_set(stream).plans
    events = stream.events(0.02)
    counts = Counter(event.name for event in events)
    span_us = events[-1].t_us - events[0].t_us
    # Without any D, as in `none`, all partial instances of the eager store are in vain.
    assert prefer_lazy(plan, counts, span_us) == (stream.name in ("none", "skew"))


def test_choice_does_not_depend_on_the_order_of_the_text() -> None:
    parts = ["event(a[], t1)", "event(b[], t2)", "event(c[], t3)", "t2 - t1 in [1s, 9s]", "t3 - t2 in [1s, 9s]"]
    for rare in "abc":
        counts = {name: 1 if name == rare else 500 for name in "abc"}
        chosen = {
            prefer_lazy(load(f"chronicle one[] {{ {' '.join(text)} }}").plans[0], counts, 60_000_000)
            for text in (parts, parts[::-1])
        }
        assert chosen == {rare == "c"}


def test_no_events_ask_for_nothing_lazy() -> None:
    [plan] = load("chronicle one[] { event(a[], t1) }").plans
    assert not prefer_lazy(plan, {}, 1)
