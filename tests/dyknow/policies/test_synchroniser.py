"""Synchronisers: the states do not depend on when they leave, and they leave as early as they may."""

import random
from collections.abc import Iterable
from itertools import pairwise
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from dyknow.errors import ProcessError
from dyknow.policies.policy import Approximation, Order, Policy
from dyknow.policies.synchroniser import State, Synchroniser
from dyknow.sample import NO_VALUE, Sample
from dyknow.streams.testing import samples_of
from tests.dyknow.oracle import Arrived, first_word_only, settling_time, states, value_at
from tests.dyknow.property import PROPERTY

NONE, MOST_RECENT, LINEAR = Approximation
HELD = Policy(approximation=MOST_RECENT, order=Order.STRICT)
UNORDERED = Policy(approximation=MOST_RECENT, order=Order.ANY)
PERIOD_US, DELAY_US = 10, 25

Pushes = list[tuple[int, Sample[Any]]]


def synchronise(fluents: dict[str, Policy], pushes: Iterable[tuple[int, Sample[Any]]]) -> list[Sample[State]]:
    synchroniser = Synchroniser(fluents, period_us=PERIOD_US, max_delay_us=DELAY_US)
    found = [state for index, sample in pushes for state in synchroniser.update(index, sample)]
    return found + synchroniser.finish()


def content(found: list[Sample[State]]) -> list[tuple[int, tuple[Any, ...]]]:
    return [(state.valid_us, state.value.values) for state in found]


FLUENTS = st.dictionaries(
    st.sampled_from("abcd"),
    st.builds(Policy, approximation=st.sampled_from(Approximation), order=st.sampled_from(Order)),
    min_size=1,
)
# Stream, step of the available time, delay and value; round times, so that many samples are exact.
ROUND_ROW = st.tuples(
    st.integers(0, 3), st.sampled_from([0, 5, 10]), st.sampled_from([-10, -5, 0, 5, 10, 20, 25, 30]), st.integers(0, 5)
)
ANY_ROW = st.tuples(st.integers(0, 3), st.integers(0, 12), st.integers(-4, 40), st.integers(0, 5))
ROWS = st.lists(ROUND_ROW, max_size=60) | st.lists(ANY_ROW, max_size=60)


def as_pushes(rows: list[tuple[int, int, int, int]], count: int) -> Pushes:
    pushes, now_us = [], 0
    for index, step_us, delay_us, value in rows:
        now_us += step_us
        pushes.append((index % count, Sample(now_us, now_us - delay_us, float(value))))
    return pushes


@PROPERTY
@given(FLUENTS, ROWS)
def test_states_are_those_of_the_definition(fluents: dict[str, Policy], rows: list[tuple[int, int, int, int]]) -> None:
    pushes = as_pushes(rows, len(fluents))
    arrived = {
        name: [(sample.available_us, sample) for index, sample in pushes if index == k]
        for k, name in enumerate(fluents)
    }
    end_us = pushes[-1][1].available_us if pushes else 0
    expected = states(fluents, arrived, period_us=PERIOD_US, max_delay_us=DELAY_US, start_us=0, end_us=end_us)
    found = synchronise(fluents, pushes)
    assert [(one.available_us, one.valid_us, one.value.values) for one in found] == expected


@PROPERTY
@given(FLUENTS, ROWS)
def test_states_leave_in_order_and_within_the_delay(
    fluents: dict[str, Policy], rows: list[tuple[int, int, int, int]]
) -> None:
    found = synchronise(fluents, as_pushes(rows, len(fluents)))
    assert [state.valid_us for state in found] == [k * PERIOD_US for k in range(len(found))]
    assert all(state.available_us <= state.valid_us + DELAY_US for state in found)
    assert all(a.available_us <= b.available_us for a, b in pairwise(found))


@pytest.mark.long
@PROPERTY
@given(FLUENTS, ROWS, st.lists(st.integers(0, 500), max_size=20))
def test_time_told_in_between_changes_nothing(
    fluents: dict[str, Policy], rows: list[tuple[int, int, int, int]], told_us: list[int]
) -> None:
    pushes, waiting = as_pushes(rows, len(fluents)), sorted(told_us)
    synchroniser = Synchroniser(fluents, period_us=PERIOD_US, max_delay_us=DELAY_US)
    found = []
    for index, sample in pushes:
        while waiting and waiting[0] <= sample.available_us:
            found += synchroniser.advance(waiting.pop(0))
        found += synchroniser.update(index, sample)
    assert [*found, *synchroniser.finish()] == synchronise(fluents, pushes)


@pytest.mark.parametrize("approximation", Approximation)
@pytest.mark.parametrize("seed", range(10))
def test_samples_out_of_order_within_the_delay_do_not_change_the_states(
    approximation: Approximation, seed: int
) -> None:
    rng = random.Random(seed)
    fluents = {"a": Policy(approximation=approximation), "b": Policy(approximation=approximation)}
    spoken = [(k % 2, 3 * k, float(rng.randrange(9))) for k in range(80)]  # each time once in a stream
    in_order: Pushes = [(index, Sample(t_us, t_us, value)) for index, t_us, value in spoken]
    # Interpolation also waits for the next sample, 6 us later, so that much less may be lost on the way.
    latest_us = DELAY_US - 6 if approximation is LINEAR else DELAY_US
    delayed: Pushes = [(k, Sample(t_us + rng.randint(0, latest_us), t_us, value)) for k, t_us, value in spoken]
    delayed.sort(key=lambda push: push[1].available_us)
    assert [one.valid_us for _, one in delayed] != [one.valid_us for _, one in in_order]
    assert content(synchronise(fluents, delayed)) == content(synchronise(fluents, in_order))


def test_state_leaves_when_every_stream_has_gone_on() -> None:
    fluents = {"a": HELD, "b": Policy(approximation=LINEAR, order=Order.MONOTONE)}
    pushes = list(zip((0, 1, 0, 1), samples_of((0, 0, "x"), (1, 0, 0.0), (12, 12, "y"), (14, 14, 7.0)), strict=True))
    found = synchronise(fluents, pushes)
    assert [(one.available_us, one.valid_us, dict(one.value)) for one in found] == [
        (1, 0, {"a": "x", "b": 0.0}),
        (14, 10, {"a": "x", "b": 5.0}),
    ]


def test_exact_sample_settles_a_stream_without_order() -> None:
    synchroniser = Synchroniser({"a": UNORDERED}, period_us=PERIOD_US, max_delay_us=DELAY_US)
    assert content(synchroniser.observe("a", Sample(3, 0, "x"))) == [(0, ("x",))]


@pytest.mark.parametrize(
    ("approximation", "values"), [(NONE, NO_VALUE), (MOST_RECENT, 5.0), (LINEAR, NO_VALUE)], ids=str
)
def test_stalled_stream_delays_states_by_exactly_the_delay(approximation: Approximation, values: object) -> None:
    fluents = {"alive": HELD, "stalled": Policy(approximation=approximation, order=Order.STRICT)}
    synchroniser = Synchroniser(fluents, period_us=PERIOD_US, max_delay_us=DELAY_US)
    found = synchroniser.observe("stalled", Sample(0, 0, 5.0))
    for t_us in range(0, 100, PERIOD_US):
        found += synchroniser.observe("alive", Sample(t_us, t_us, t_us))
    assert [one.delay_us for one in found] == [0] + [DELAY_US] * (len(found) - 1)
    assert len(found) > 5
    assert {one.value["stalled"] for one in found[1:]} == {values}


def test_all_streams_idle_states_leave_by_the_told_time() -> None:
    synchroniser = Synchroniser({"a": HELD, "b": HELD}, period_us=PERIOD_US, max_delay_us=DELAY_US)
    synchroniser.observe("a", Sample(2, 2, "x"))
    found = synchroniser.advance(100)
    assert [(one.available_us, one.valid_us) for one in found] == [(t + DELAY_US, t) for t in range(0, 80, 10)][:8]
    assert found[-1].value.values == ("x", NO_VALUE)


def test_promise_settles_a_stream_that_only_reports_changes() -> None:
    synchroniser = Synchroniser({"a": HELD, "b": UNORDERED}, period_us=PERIOD_US, max_delay_us=DELAY_US)
    synchroniser.observe("b", Sample(0, 0, "x"))
    synchroniser.observe("a", Sample(11, 11, 1))
    assert content(synchroniser.promise("b", 12, available_us=13)) == [(10, (NO_VALUE, "x"))]


def test_promise_does_not_settle_what_is_interpolated() -> None:
    synchroniser = Synchroniser(
        {"a": Policy(approximation=LINEAR, order=Order.STRICT)}, period_us=PERIOD_US, max_delay_us=DELAY_US
    )
    synchroniser.observe("a", Sample(5, 5, 1.0))
    assert synchroniser.promise("a", 30, available_us=5) == []
    assert content(synchroniser.observe("a", Sample(20, 15, 2.0)))[-1] == (10, (1.5,))


def test_sample_that_breaks_a_promise_is_dropped_and_counted() -> None:
    synchroniser = Synchroniser({"a": UNORDERED}, period_us=PERIOD_US, max_delay_us=DELAY_US)
    assert synchroniser.promise("a", 5, available_us=7) == [Sample(7, 0, State(("a",), (NO_VALUE,)))]
    assert synchroniser.observe("a", Sample(8, 4, "x")) == []
    assert synchroniser.dropped == {"a": {"late": 1}}


def test_sample_of_the_promised_time_itself_breaks_the_promise() -> None:
    synchroniser = Synchroniser({"a": UNORDERED, "b": HELD}, period_us=PERIOD_US, max_delay_us=DELAY_US)
    synchroniser.promise("a", 10, available_us=10)
    synchroniser.observe("a", Sample(10, 10, "x"))
    assert content(synchroniser.observe("b", Sample(11, 11, 1))) == [
        (0, (NO_VALUE, NO_VALUE)),
        (10, (NO_VALUE, NO_VALUE)),
    ]


def test_settled_state_leaves_with_the_one_that_it_waited_for() -> None:
    synchroniser = Synchroniser({"a": UNORDERED}, period_us=PERIOD_US, max_delay_us=DELAY_US)
    assert synchroniser.observe("a", Sample(10, 10, "x")) == []  # settled, but the state at 0 is not
    found = synchroniser.advance(26)
    assert [(one.available_us, one.valid_us) for one in found] == [(25, 0), (25, 10)]


def test_late_sample_before_the_last_one_is_of_no_use_to_interpolation() -> None:
    fluents = {"a": Policy(approximation=LINEAR)}
    synchroniser = Synchroniser(fluents, period_us=PERIOD_US, max_delay_us=DELAY_US)
    synchroniser.observe("a", Sample(5, 5, 1.0))
    synchroniser.advance(36)
    synchroniser.observe("a", Sample(36, 4, 9.0))
    assert synchroniser.dropped == {"a": {"late": 1}}


def test_a_state_is_never_revised() -> None:
    synchroniser = Synchroniser({"a": UNORDERED}, period_us=PERIOD_US, max_delay_us=DELAY_US)
    synchroniser.observe("a", Sample(10, 8, "old"))
    assert content(synchroniser.advance(50)) == [(0, (NO_VALUE,)), (10, ("old",)), (20, ("old",))]
    assert synchroniser.observe("a", Sample(50, 15, "late, but the most recent")) == []
    assert synchroniser.observe("a", Sample(50, 9, "too late")) == []
    assert content(synchroniser.advance(56)) == [(30, ("late, but the most recent",))]
    assert synchroniser.dropped == {"a": {"late": 1}}


@pytest.mark.parametrize(("approximation", "per_time"), [(NONE, 1), (MOST_RECENT, 1), (LINEAR, 2)])
def test_memory_is_bounded_by_delay_and_period(approximation: Approximation, per_time: int) -> None:
    """A sample for each time that waits, the one before them and the one after: or two, where two are needed."""
    bound = per_time * (DELAY_US // PERIOD_US + 3)
    fluents = {"quick": Policy(approximation=approximation, order=Order.STRICT), "stalled": HELD}
    synchroniser = Synchroniser(fluents, period_us=PERIOD_US, max_delay_us=DELAY_US)
    most = 0
    for t_us in range(2_000):
        synchroniser.observe("quick", Sample(t_us, t_us, float(t_us)))
        most = max(most, synchroniser.held["quick"])
    assert 1 < most <= bound


def test_memory_is_two_samples_a_stream_while_every_state_is_settled() -> None:
    synchroniser = Synchroniser({"a": HELD, "b": HELD}, period_us=PERIOD_US, max_delay_us=10**6)
    for t_us in range(1_000):
        for name in ("a", "b"):
            synchroniser.observe(name, Sample(t_us, t_us, t_us))
        assert max(synchroniser.held.values()) <= 2


def test_state_gives_values_by_name() -> None:
    state = State(("a", "b"), (1, NO_VALUE))
    assert dict(state) == {"a": 1, "b": NO_VALUE}
    with pytest.raises(KeyError):
        state["c"]


def test_unknown_fluent_is_refused() -> None:
    synchroniser = Synchroniser({"a": HELD}, period_us=10, max_delay_us=0)
    with pytest.raises(ProcessError, match=r"expected one of the fluents \('a',\), got 'b'"):
        synchroniser.observe("b", Sample(0, 0, 0))


@pytest.mark.parametrize(
    ("fluents", "period_us", "max_delay_us"), [({}, 10, 0), ({"a": HELD}, 0, 0), ({"a": HELD}, 10, -1)]
)
def test_impossible_settings_are_refused(fluents: dict[str, Policy], period_us: int, max_delay_us: int) -> None:
    with pytest.raises(ProcessError, match="synchroniser: expected one fluent or more"):
        Synchroniser(fluents, period_us=period_us, max_delay_us=max_delay_us)


# ---- at the times of a fluent


def follow(fluents: dict[str, Policy], pushes: Iterable[tuple[int, Sample[Any]]]) -> list[Sample[State]]:
    synchroniser = Synchroniser(fluents, at="leader", max_delay_us=DELAY_US)
    found = [state for index, sample in pushes for state in synchroniser.update(index, sample)]
    return found + synchroniser.finish()


def led_states(
    policies: dict[str, Policy], arrived: dict[str, Arrived], end_us: int
) -> list[tuple[int, int, tuple[Any, ...]]]:
    """Say by definition which states leave when: one for each sample of the leader that comes before its deadline."""
    result: list[tuple[int, int, tuple[Any, ...]]] = []
    in_time = [(now_us, one) for now_us, one in arrived["leader"] if now_us <= one.valid_us + DELAY_US]
    samples = {name: first_word_only(policies[name], rows) for name, rows in {**arrived, "leader": in_time}.items()}
    at_us = -(10**9)
    for came_us, head in samples["leader"]:
        t_us = head.valid_us
        times = [settling_time(policies[name], rows, t_us) for name, rows in samples.items()]
        settled_us = None if None in times else max(one for one in times if one is not None)
        if t_us + DELAY_US < end_us and (settled_us is None or settled_us > t_us + DELAY_US):
            at_us = max(at_us, t_us + DELAY_US)
        else:
            at_us = end_us if settled_us is None else max(at_us, settled_us, came_us)
        known = {name: [one for now_us, one in rows if now_us <= at_us] for name, rows in samples.items()}
        values = tuple(value_at(policies[name].approximation, known[name], t_us) for name in policies)
        result.append((at_us, t_us, values))
    return result


LEADERS = st.builds(Policy, approximation=st.sampled_from(Approximation), order=st.sampled_from(list(Order)[1:]))
LED = st.builds(lambda leader, others: {**others, "leader": leader}, LEADERS, FLUENTS)


def test_orders_are_listed_with_any_first() -> None:
    assert next(iter(Order)) is Order.ANY  # what `LEADERS` relies on


@pytest.mark.long
@PROPERTY
@given(LED, ROWS)
def test_states_at_the_times_of_a_fluent_are_those_of_the_definition(
    fluents: dict[str, Policy], rows: list[tuple[int, int, int, int]]
) -> None:
    pushes = as_pushes(rows, len(fluents))
    arrived = {
        name: [(sample.available_us, sample) for index, sample in pushes if index == k]
        for k, name in enumerate(fluents)
    }
    expected = led_states(fluents, arrived, pushes[-1][1].available_us if pushes else 0)
    found = follow(fluents, pushes)
    assert [(one.available_us, one.valid_us, one.value.values) for one in found] == expected


@pytest.mark.long
@PROPERTY
@given(LED, ROWS)
def test_states_at_the_times_of_a_fluent_leave_in_order_and_within_the_delay(
    fluents: dict[str, Policy], rows: list[tuple[int, int, int, int]]
) -> None:
    found = follow(fluents, as_pushes(rows, len(fluents)))
    assert all(one.available_us <= one.valid_us + DELAY_US for one in found)
    assert all(a.valid_us < b.valid_us and a.available_us <= b.available_us for a, b in pairwise(found))


@pytest.mark.long
@PROPERTY
@given(LED, ROWS, st.lists(st.integers(0, 500), max_size=20))
def test_time_told_in_between_changes_nothing_at_the_times_of_a_fluent(
    fluents: dict[str, Policy], rows: list[tuple[int, int, int, int]], told_us: list[int]
) -> None:
    pushes, waiting = as_pushes(rows, len(fluents)), sorted(told_us)
    synchroniser = Synchroniser(fluents, at="leader", max_delay_us=DELAY_US)
    found = []
    for index, sample in pushes:
        while waiting and waiting[0] <= sample.available_us:
            found += synchroniser.advance(waiting.pop(0))
        found += synchroniser.update(index, sample)
    assert [*found, *synchroniser.finish()] == follow(fluents, pushes)


@pytest.mark.parametrize("silent", ["leader", "other"])
def test_memory_is_bounded_by_the_delay_whoever_is_silent(silent: str) -> None:
    fluents = {"leader": HELD, "other": UNORDERED}
    synchroniser = Synchroniser(fluents, at="leader", max_delay_us=DELAY_US)
    quick = "other" if silent == "leader" else "leader"
    most = 0
    for t_us in range(2_000):
        synchroniser.observe(quick, Sample(t_us, t_us, t_us))
        most = max(most, synchroniser.held[quick])
    assert 1 < most <= DELAY_US + 3
    assert synchroniser.held[silent] == 0


def test_a_sample_of_the_leader_after_its_own_deadline_is_late() -> None:
    synchroniser = Synchroniser({"leader": HELD, "other": HELD}, at="leader", max_delay_us=DELAY_US)
    synchroniser.observe("other", Sample(100, 100, "x"))
    assert synchroniser.observe("leader", Sample(100, 100 - DELAY_US - 1, "a")) == []
    assert content(synchroniser.observe("leader", Sample(100, 100 - DELAY_US, "b"))) == [
        (100 - DELAY_US, ("b", NO_VALUE))
    ]
    assert synchroniser.dropped == {"leader": {"late": 1}, "other": {}}
    assert synchroniser.left_out == {"leader late": 1}


def test_a_promise_settles_the_times_of_a_fluent() -> None:
    synchroniser = Synchroniser({"leader": HELD, "other": UNORDERED}, at="leader", max_delay_us=DELAY_US)
    synchroniser.observe("other", Sample(3, 3, "x"))
    assert synchroniser.observe("leader", Sample(7, 7, 1)) == []
    assert content(synchroniser.promise("other", 7, available_us=8)) == [(7, (1, "x"))]


@pytest.mark.parametrize(
    ("at", "period_us", "expected"),
    [
        (None, None, "expected a period or a fluent to follow, got None and None"),
        ("a", 10, "expected a period or a fluent to follow, got 10 and 'a'"),
        ("b", None, r"expected to follow one of the ordered fluents \('a',\), got 'b'"),
        ("c", None, r"expected to follow one of the ordered fluents \('a',\), got 'c'"),
    ],
)
def test_states_are_formed_at_a_period_or_at_an_ordered_fluent(
    at: str | None, period_us: int | None, expected: str
) -> None:
    with pytest.raises(ProcessError, match=expected):
        Synchroniser({"a": HELD, "b": UNORDERED}, at=at, period_us=period_us, max_delay_us=0)
