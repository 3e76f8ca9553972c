"""The bound on instances against the instances that the store really holds."""

import math
import random
from collections import Counter
from collections.abc import Sequence

import pytest

from chronicles.chronicle_set import load
from chronicles.compilation.cost import cost, reachable
from chronicles.compilation.plan import Plan
from chronicles.errors import ChronicleError
from chronicles.events import Event
from tests.cases import seeds
from tests.chronicles.execution.live.instance_store import InstanceStore
from tests.chronicles.execution.random_cases import CaseMaker

FOUR = """timeunit 1s
chronicle p4[?k](t1, t4) {
  event(A[?k], t1) event(B[?k], t2) event(C[?k], t3) event(D[?k], t4)
  t2 - t1 in [1, 5]  t3 - t2 in [1, 5]  t4 - t3 in [0.5, 4]  t4 - t1 in [3, 10]
}"""
APART = """timeunit 1s
chronicle apart[?a, ?b](t1, t2) {
  event(A[?a], t1) event(B[?b, ?c], t2) event(C[?c], t3)
  t2 - t1 in [-3, 8]  t3 - t2 in [-4, 4]  t3 - t1 in [-5, 9]
}"""


def stream(plan: Plan, rates_hz: dict[str, float], keys: int, seed: int) -> list[Event]:
    """Draw events as dense as the assumptions of the bound allow, or less; some keys have many, others none."""
    pick = random.Random(seed)
    events: list[Event] = []
    for name, arity in sorted({(one.test.name, one.test.arity) for one in plan.positions}):
        gap_us = math.ceil(1_000_000 / rates_hz[name])
        turn = pick.randrange(keys)  # which values stand together in the arguments of this name
        for key in range(keys):
            density = pick.choice((1.0, 0.9, 0.0) if key else (1.0, 0.9))
            for t_us in range(pick.choice((0, 1, gap_us // 2)), 40_000_000, gap_us):
                if pick.random() < density:
                    arguments = tuple(f"k{(key + turn * place) % keys}" for place in range(arity))
                    events.append(Event(name, arguments, t_us))
    return sorted(events, key=lambda event: event.t_us)


def held(store: InstanceStore, now_us: int) -> Counter[int]:
    return Counter(mask for mask, _ in store.waiting(now_us))


def largest(plan: Plan, events: Sequence[Event]) -> Counter[int]:
    """Feed events one by one; give the most instances of each set of positions that were there at a time."""
    store, most = InstanceStore(plan), Counter[int]()
    for number, event in enumerate(events):
        store.feed((event.t_us, number, event))
        most |= held(store, event.t_us)
    return most


def bounds(plan: Plan, rates_hz: dict[str, float], keys: int) -> dict[int, int]:
    position_of = {one.label: index for index, one in enumerate(plan.positions)}
    rows = cost(plan, rates_hz, keys=keys).rows
    return {sum(1 << position_of[label] for label in row.points): row.instances for row in rows}


@pytest.mark.long
@pytest.mark.parametrize(
    ("text", "keys"),
    [
        pytest.param(FOUR, 1, id="joined-1"),
        pytest.param(APART, 3, id="apart-3"),
        pytest.param(FOUR, 3, id="joined-3", marks=pytest.mark.slow),
        pytest.param(APART, 1, id="apart-1", marks=pytest.mark.slow),
    ],
)
@seeds(range(6), kept=1)
def test_no_stream_of_the_stated_rates_holds_more_instances(text: str, keys: int, seeds: range) -> None:
    plan = load(text).plans[0]
    for seed in seeds:
        rates_hz = {name: random.Random(f"{seed}{name}").choice((0.3, 1.0, 1.7)) for name in "ABCD"}
        most = largest(plan, stream(plan, rates_hz, keys, seed))
        bound = bounds(plan, rates_hz, keys)
        assert most, seed
        assert {mask: count for mask, count in most.items() if count > bound[mask]} == {}, seed


def test_bound_of_the_first_event_is_reached() -> None:
    plan = load(FOUR).plans[0]
    rates_hz = dict.fromkeys("ABCD", 1.0)
    only_first = [event for event in stream(plan, rates_hz, 1, 0) if event.name == "A"]
    first = next(index for index, one in enumerate(plan.positions) if one.label == "t1")
    assert max(largest(plan, only_first).values()) == bounds(plan, rates_hz, 1)[1 << first] == 6


@pytest.mark.long
def test_every_set_of_positions_that_the_store_reaches_is_counted() -> None:
    compared = 0
    for seed in range(120):
        maker = CaseMaker(seed)
        try:
            plan = load(maker.text()).plans[0]
        except ChronicleError:
            continue
        store = InstanceStore(plan)
        masks = set(reachable(plan))
        for number, event in enumerate(sorted(maker.trace(), key=lambda one: one.t_us)):
            if event.name in store.names:
                store.feed((event.t_us, number, event))
            assert held(store, event.t_us).keys() <= masks
        compared += 1
    assert compared > 50


def test_sets_that_the_order_of_time_rules_out_are_not_counted() -> None:
    plan = load(FOUR).plans[0]
    assert [len(row.points) for row in cost(plan, {}).rows] == [1, 2, 3]


def test_complete_instances_wait_for_their_intervals() -> None:
    text = "chronicle c(t1) { event(a[], t1) event(b[], t2) t2 - t1 in [0s, 4s] noevent(d[], (t1 + 1us, t2 + 3s)) }"
    report = cost(load(text).plans[0], {"a": 2.0, "b": 0.5})
    complete = report.rows[-1]
    assert complete.is_complete
    # b up to 3 s ago: 0.5 * 3 + 1 = 2; a up to 4 s before it: 2 * 4 + 1 = 9
    assert complete.instances == report.complete == 2 * 9
    assert report.waiting == sum(row.instances for row in report.rows[:-1])


def test_keys_multiply_the_rate_of_events_that_are_not_joined() -> None:
    many = cost(load(FOUR).plans[0], {}, 10.0, keys=10)
    single = cost(load(FOUR).plans[0], {}, 10.0, keys=1)
    assert (many.rows[0].instances, single.rows[0].instances) == (10 * 51, 51)
    assert (many.rows[1].instances, single.rows[1].instances) == (10 * 51 * 41, 51 * 41)
    apart = cost(load(APART).plans[0], {}, 10.0, keys=10)
    assert apart.rows[0].formula.startswith("keys (")
    [both] = [row for row in apart.rows if row.points == ("t1", "t2")]
    assert both.formula.count("keys") == 2


def test_bound_is_reached_by_a_skewed_stream() -> None:
    plan = load("chronicle c[?k](t1, t2) { event(a[?k], t1) event(b[?k], t2) t2 - t1 in [1s, 10s] }").plans[0]
    events = [Event("a", (f"k{key}",), second * 1_000_000) for second in range(30) for key in range(4)]
    one_key = [event for event in events if event.args == ("k0",)]
    assert max(largest(plan, one_key).values()) == cost(plan, {"a": 1.0}).waiting == 11
    assert max(largest(plan, events).values()) == cost(plan, {"a": 1.0}, keys=4).waiting == 44


def test_values_in_the_text_and_no_arguments_are_one_key() -> None:
    events = "event(a[], t1) event(b[x, ?], t2) event(d[?], t3)"
    text = f"chronicle c(t1, t3) {{ {events} t2 - t1 in [1s, 2s] t3 - t2 in [1s, 2s] }}"
    rows = cost(load(text).plans[0], {}, keys=5).rows
    assert [row.formula.count("keys") for row in rows] == [0, 0]


def test_value_of_an_attribute_is_no_key() -> None:
    events = "event(a[?p]:(?, ?v), t1) event(b[?q]:(?, ?v), t2)"
    text = f"chronicle c(t1, t2) {{ {events} t2 - t1 in [-9s, 9s] hold(e[]:x, (t2, t2 + 9s)) }}"
    both = cost(load(text).plans[0], {}, keys=5).rows[-1]
    assert both.formula.count("keys") == 2


def test_report_lists_formulas() -> None:
    assert cost(load(FOUR).plans[0], {"A": 2.0}, 1.0, keys=5).render().splitlines() == [
        "p4: at most 1,450 instances wait for events, 0 for the end of an interval,",
        "if an argument has at most 5 values, and events of one name with one of them are at least 1/rate apart",
        "  t1                 55  keys (A*5s + 1)",
        "  t1 t2             270  keys (B*5s + 1) (A*4s + 1)",
        "  t1 t2 t3        1,125  keys (C*4s + 1) (B*4s + 1) (A*4s + 1)",
    ]
    assert cost(load(FOUR).plans[0], {}).render().splitlines()[1] == "if events of one name are at least 1/rate apart"
