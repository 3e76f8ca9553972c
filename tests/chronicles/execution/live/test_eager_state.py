"""What the eager store keeps, gives away as a state, and takes back."""

import pickle
import random

import pytest

from chronicles.chronicle_set import load
from chronicles.compilation.plan import Plan
from chronicles.compilation.steps import steps_from
from chronicles.events import Event
from chronicles.execution.instances import Record
from chronicles.execution.live.programs import extend_code
from tests.chronicles.execution.live.instance_store import InstanceStore
from tests.chronicles.execution.live.test_eager import case, wanted

PAIR = "chronicle pair[?k](t1, t2) { event(a[?k], t1) event(b[?k], t2) t2 - t1 in [1us, 100us] }"


def plan_of(text: str) -> Plan:
    [plan] = load(text).plans
    return plan


def record(t_us: int, name: str, *args: str) -> Record:
    return t_us, t_us, Event(name, args, t_us)


def is_plain(data: object) -> bool:
    if isinstance(data, dict):
        return all(is_plain(one) for item in data.items() for one in item)
    if type(data) in {list, tuple}:
        return all(map(is_plain, data))
    return data is None or type(data) in {int, str, float}


@pytest.mark.long
def test_restored_store_goes_on_as_if_it_had_not_stopped() -> None:
    found = 0
    for seed in range(800, 900):
        plans, records = case(seed)
        for plan in plans:
            mine = wanted(plan, records)
            stop = random.Random(seed).randint(0, len(mine))
            first, whole = InstanceStore(plan), InstanceStore(plan)
            for one in mine[:stop]:
                assert first.feed(one) == whole.feed(one)
            state = first.state()
            assert is_plain(state)
            second = InstanceStore(plan)
            for one in mine:  # what was there before must be gone
                second.feed(one)
            second.restore(pickle.loads(pickle.dumps(state)))
            for one in mine[stop:]:
                complete, created = whole.feed(one)
                assert second.feed(one) == (complete, created)
                found += len(complete)
            end_us = records[-1][0] + 3
            assert second.sweep(end_us) == whole.sweep(end_us)
            assert list(second.waiting(end_us)) == list(whole.waiting(end_us))
    assert found > 100


def test_events_come_out_as_they_went_in_after_a_restore() -> None:
    plan = plan_of("chronicle c[?k]() { event(a[?k, ?], t1) event(p[?k]:(?, on), t2) t2 - t1 in [1us, 9us] }")
    first = Event("a", ("k", "x"), 1, hypotheses=("same",))
    changes = [Event("p", ("k",), t_us, old, "on") for t_us, old in ((2, None), (3, "off"), (4, ""))]
    store, other = InstanceStore(plan), InstanceStore(plan)
    store.feed((1, 1, first))
    other.restore(store.state())
    events = [other.feed((one.t_us, one.t_us, one))[0][0][-2:] for one in changes]
    assert [[one[2] for one in pair] for pair in events] == [[first, change] for change in changes]


def test_program_has_the_windows_as_constants() -> None:
    plan = plan_of(PAIR)
    [step] = steps_from(plan, 0b1)
    lines = extend_code(plan, step, ()).lines
    assert "    if from_0 <= t0 <= to_0:" in lines
    assert "from_0 = t_us - 100" in lines


def test_new_instances_drive_out_dead_ones_without_a_sweep() -> None:
    store = InstanceStore(plan_of(PAIR))
    for number in range(1000):
        store.feed((0, number, Event("a", (f"k{number}",), 0)))
    for number in range(1000):
        store.feed((1000, 1000 + number, Event("a", (f"k{number % 7}",), 1000)))
    assert len(list(store.waiting(1000))) == 1000
    assert sum(map(len, store.state()["firsts"])) < 1050


def test_one_event_waits_for_few_dead_instances_only() -> None:
    store = InstanceStore(plan_of(PAIR))
    for number in range(1000):
        store.feed((0, number, Event("a", ("k",), 0)))
    store.feed(record(1000, "a", "k"))
    assert sum(map(len, store.state()["firsts"])) > 900


def test_sweeps_empty_a_store_that_gets_no_events() -> None:
    store = InstanceStore(plan_of(PAIR))
    for number in range(10_000):
        store.feed((0, number, Event("a", (f"k{number % 9}",), 0)))
    left = [store.sweep(101) for _ in range(3)]
    assert left == sorted(left, reverse=True)
    assert left[0] > 0 == left[-1]


def test_instance_lives_until_its_deadline_and_not_beyond() -> None:
    store = InstanceStore(plan_of(PAIR))
    store.feed(record(10, "a", "k"))
    assert store.sweep(110) == 1
    assert len(store.feed(record(110, "b", "k"))[0]) == 1
    assert store.sweep(111) == 0
    assert store.feed(record(111, "b", "k")) == ([], 0)


def test_events_of_the_last_position_are_not_kept() -> None:
    store = InstanceStore(plan_of(PAIR))
    assert store.feed(record(1, "b", "k")) == ([], 0)
    assert store.sweep(1) == 0


def test_all_instances_with_the_same_values_are_extended() -> None:
    store = InstanceStore(plan_of(PAIR))
    for t_us in (1, 2, 3, 60, 101):
        store.feed(record(t_us, "a", "k"))
    complete, created = store.feed(record(102, "b", "k"))
    assert sorted(one[1] for one in complete) == [2, 3, 60, 101]
    assert created == 0
