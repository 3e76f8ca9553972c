"""The lazy store against the eager one, and how it forgets, orders its search and starts again."""

from collections.abc import Sequence
from typing import Any

import pytest

from chronicles.chronicle_set import load
from chronicles.compilation.plan import Plan
from chronicles.errors import ChronicleError
from chronicles.events import Event
from chronicles.execution.backward_search import last_positions, search_source
from chronicles.execution.instances import Instance, InstanceStore, Record
from chronicles.execution.lazy import LazyStore
from tests.chronicles.execution.random_cases import CaseMaker

CASES_A_BLOCK = 100
BLOCKS = 8
CHAIN = """
chronicle chain[?x](t1, t3) {
  event(a[?x], t1) event(b[?x, ?y], t2) event(c[?y], t3)  t2 - t1 in [1us, 5us]  t3 - t2 in [1us, 5us]
}
"""


def plan_of(text: str) -> Plan:
    [plan] = load(text).plans
    return plan


def records_of(events: Sequence[Event]) -> list[Record]:
    ordered = sorted(events, key=lambda event: event.t_us)
    return [(event.t_us, number, event) for number, event in enumerate(ordered)]


def shown(instances: Sequence[Instance]) -> list[str]:
    # The deadline of a complete instance says nothing.
    return sorted(repr(instance[1:]) for instance in instances)


def under_way(store: InstanceStore | LazyStore, now_us: int) -> list[str]:
    return sorted(repr((mask, instance)) for mask, instance in store.waiting(now_us))


def random_plans(seed: int) -> tuple[CaseMaker, tuple[Plan, ...]]:
    maker = CaseMaker(seed)
    while True:
        try:
            return maker, load(maker.text()).plans
        except ChronicleError:
            continue


def check_case(seed: int, *, forget: bool) -> int:
    maker, plans = random_plans(seed)
    found = 0
    for plan in plans:
        lazy, eager = LazyStore(plan), InstanceStore(plan)
        assert lazy.names == eager.names
        for record in records_of(maker.trace()):
            if record[2].name in eager.names:
                complete = lazy.feed(record)[0]
                assert shown(complete) == shown(eager.feed(record)[0]), (seed, record)
                found += len(complete)
            if forget:
                lazy.sweep(record[0])
        now_us = record[0]
        assert under_way(lazy, now_us) == under_way(eager, now_us)
    return found


@pytest.mark.parametrize("block", range(BLOCKS))
def test_finds_what_the_eager_store_finds_event_by_event(block: int) -> None:
    seeds = range(block * CASES_A_BLOCK, (block + 1) * CASES_A_BLOCK)
    found = [check_case(seed, forget=bool(block % 2)) for seed in seeds]
    # A block without instances would prove nothing.
    assert sum(map(bool, found)) >= CASES_A_BLOCK // 10


def feed_all(store: LazyStore, events: Sequence[Event]) -> list[list[Instance]]:
    return [list(store.feed(record)[0]) for record in records_of(events)]


def test_simultaneous_events_complete_an_instance_once() -> None:
    plan = plan_of(
        "chronicle tie[] { event(a[], t1) event(a[], t2) event(b[], t3) t2 - t1 in [0us, 3us] t3 - t1 in [-2us, 2us] }"
    )
    events = [Event("a", (), 5), Event("b", (), 5), Event("a", (), 5)]
    assert [len(found) for found in feed_all(LazyStore(plan), events)] == [0, 0, 2]


def test_variables_of_the_middle_join_both_sides() -> None:
    events = [Event("a", (x,), 1) for x in "pq"] + [Event("b", xy, 3) for xy in (("p", "r"), ("q", "s"))]
    found = feed_all(LazyStore(plan_of(CHAIN)), [*events, Event("c", ("s",), 5)])
    assert [len(one) for one in found] == [0, 0, 0, 0, 1]
    assert [record[2].args for record in found[-1][0][-3:]] == [("q",), ("q", "s"), ("s",)]


def test_number_of_instances_is_known_without_making_them() -> None:
    plan = plan_of("chronicle burst[] { event(a[], t1) event(b[], t2) t2 - t1 in [0us, 9us] }")
    store = LazyStore(plan)
    feed_all(store, [Event("a", (), t_us) for t_us in range(5)])
    complete = store.feed((6, 9, Event("b", (), 6)))[0]
    assert len(complete) == 5
    assert complete[-1] == list(complete)[-1]
    assert [instance[1] for instance in complete[1:3]] == [1, 2]


def test_sweep_keeps_exactly_what_an_instance_can_still_need() -> None:
    store = LazyStore(plan_of(CHAIN))
    feed_all(store, [Event("a", ("x",), t_us) for t_us in range(20)])
    assert store.sweep(20) == 10
    assert store.sweep(29) == 1
    assert store.sweep(30) == 0


def test_an_event_that_is_always_last_is_not_kept() -> None:
    store = LazyStore(plan_of(CHAIN))
    feed_all(store, [Event("c", ("x",), 1)])
    assert store.sweep(1) == 0


def test_continues_from_the_state_of_another_store() -> None:
    maker, [plan, *_] = random_plans(3)
    records = records_of([event for _ in range(4) for event in maker.trace()])
    wanted = [record for record in records if record[2].name in LazyStore(plan).names]
    whole, first, second = LazyStore(plan), LazyStore(plan), LazyStore(plan)
    found: list[Any] = [shown(whole.feed(record)[0]) for record in wanted]
    half = len(wanted) // 2
    parts: list[Any] = [shown(first.feed(record)[0]) for record in wanted[:half]]
    second.restore(first.state())
    parts += [shown(second.feed(record)[0]) for record in wanted[half:]]
    assert parts == found
    assert any(found[half:])
    assert second.state() == whole.state()


def test_an_eager_store_goes_on_where_the_lazy_one_stopped() -> None:
    maker, [plan, *_] = random_plans(3)
    records = records_of([event for _ in range(4) for event in maker.trace()])
    wanted = [record for record in records if record[2].name in LazyStore(plan).names]
    half = len(wanted) // 2
    whole, lazy = LazyStore(plan), LazyStore(plan)
    for record in wanted[:half]:
        whole.feed(record)
        lazy.feed(record)
    eager = lazy.eager()
    found = [(shown(whole.feed(record)[0]), shown(eager.feed(record)[0])) for record in wanted[half:]]
    assert all(one == other for one, other in found)
    assert any(one for one, _ in found)


def test_search_begins_with_the_rarest_position() -> None:
    plan = plan_of(
        "chronicle skewed[] { event(a[], t1) event(b[], t2) event(c[], t3)"
        " t3 - t1 in [1us, 9us] t3 - t2 in [1us, 9us] t2 - t1 in [-9us, 9us] }"
    )
    store = LazyStore(plan)
    many = [Event("a", (), 0)] + [Event("b", (), t_us) for t_us in range(8)]
    [*_, found] = feed_all(store, [*many, Event("c", (), 8)])
    # The families of a search are in the order of its outer loop: one a, and all b with it.
    complete = store.feed((9, 99, Event("c", (), 9)))[0]
    assert len(found) == len(complete) == 8
    assert len(complete._parts[0][0]) == 1  # type: ignore[attr-defined]  # what the search did, not what it found


@pytest.mark.parametrize("text", [CHAIN, "chronicle one[?x] { event(a[?x], t1) }"])
def test_source_of_a_search_tests_each_bound_once(text: str) -> None:
    plan = plan_of(text)
    [last] = last_positions(plan)
    others = [one for one in range(len(plan.positions)) if one != last]
    source = search_source(plan, last, tuple(reversed(others)))
    # The bounds between the first and the last event follow from the others.
    assert source.count("bisect_left") == len(others)
    assert "max(" not in source
