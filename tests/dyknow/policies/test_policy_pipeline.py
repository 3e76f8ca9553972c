"""Policy pipelines: what a subscriber receives is a function of the samples offered and of its policy."""

import random
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from dyknow.errors import PolicyError
from dyknow.policies.policy import AnyChange, AnyUpdate, Approximation, Order, Policy, SampleEvery
from dyknow.policies.policy_pipeline import PolicyPipeline
from dyknow.sample import NO_VALUE, Sample
from dyknow.streams.testing import samples_of, under
from tests.dyknow.oracle import count_used, received
from tests.dyknow.property import PROPERTY

MOST_RECENT, LINEAR = Approximation.MOST_RECENT, Approximation.LINEAR
TEN = SampleEvery(10)


@dataclass(frozen=True)
class Seen:
    """A value of the kind that engines hand on."""

    name: str
    outline: Any  # Any: an array


# Available time, valid time, value: the third comes late and out of order, the fourth repeats the value and the time
# of the second, the last is late.
MIXED = samples_of((0, 0, 1.0), (4, 4, 2.0), (9, 2, 3.0), (10, 4, 2.0), (12, 11, 2.0), (30, 21, 4.0))

FORMS = [
    ("any update", Policy(), MIXED),
    ("any change", Policy(AnyChange()), [MIXED[k] for k in (0, 1, 2, 3, 5)]),
    (
        "sample every",
        Policy(SampleEvery(2), order=Order.STRICT, to_us=4),
        samples_of((0, 0, 1.0), (4, 2, NO_VALUE), (4, 4, 2.0)),
    ),
    (
        "no approximation",
        Policy(TEN, order=Order.MONOTONE),
        samples_of((0, 0, 1.0), (12, 10, NO_VALUE), (30, 20, NO_VALUE)),
    ),
    (
        "use most recent",
        Policy(TEN, MOST_RECENT, order=Order.MONOTONE),
        samples_of((0, 0, 1.0), (12, 10, 2.0), (30, 20, 2.0)),
    ),
    (
        "linear interpolation",
        Policy(TEN, LINEAR, order=Order.MONOTONE),
        samples_of((0, 0, 1.0), (12, 10, 2.0), (30, 20, 3.8)),
    ),
    ("max delay", Policy(max_delay_us=6), [MIXED[k] for k in (0, 1, 3, 4)]),
    (
        "max delay of sampled values",
        Policy(TEN, MOST_RECENT, max_delay_us=6),
        samples_of((0, 0, 1.0), (16, 10, 2.0), (26, 20, 2.0)),
    ),
    ("max delay oo", Policy(max_delay_us=None), MIXED),
    ("from", Policy(from_us=4), [MIXED[k] for k in (1, 3, 4, 5)]),
    ("to", Policy(to_us=4), MIXED[:4]),
    ("from to", Policy(from_us=2, to_us=11), MIXED[1:5]),
    ("oldest", Policy(oldest_us=5), MIXED),  # it says what comes before; see test_stream
    ("any order", Policy(order=Order.ANY), MIXED),
    ("monotone order", Policy(order=Order.MONOTONE), [MIXED[k] for k in (0, 1, 3, 4, 5)]),
    ("strict order", Policy(order=Order.STRICT), [MIXED[k] for k in (0, 1, 4, 5)]),
]


@pytest.mark.parametrize(("policy", "expected"), [form[1:] for form in FORMS], ids=[form[0] for form in FORMS])
def test_form_delivers_what_it_says(policy: Policy, expected: list[Sample[Any]]) -> None:
    assert under(policy, MIXED) == expected


def test_first_sample_counts_as_a_change_even_when_it_is_none() -> None:
    assert len(under(Policy(AnyChange()), samples_of((0, 0, None), (1, 1, None)))) == 1


@pytest.mark.parametrize(
    ("values", "delivered"),
    [
        ([np.array([1, 2]), np.array([1, 2]), np.array([1, 3])], 2),
        ([np.array([1, 2]), np.array([1, 2, 3]), None, np.array([1, 2]), NO_VALUE], 5),
        ([np.array(1.0), np.float64(1.0), 1.0], 1),
        ([np.zeros(0), np.zeros(0), np.zeros((0, 2))], 2),
        ([("car1", np.array([1, 2])), ("car1", np.array([1, 2])), ("car1", np.array([1, 4]))], 2),
        ([{"car1": np.array([1, 2])}, {"car1": np.array([1, 2])}, {"car2": np.array([1, 2])}], 2),
        ([Seen("a", np.array([1, 2])), Seen("a", np.array([1, 2])), Seen("a", np.array([2, 2]))], 2),
        ([[np.array([1, 2])], [np.array([1, 2])], (np.array([1, 2]),)], 2),
        ([float("nan"), float("nan")], 2),
    ],
    ids=["arrays", "shapes", "numbers", "empty", "tuples", "mappings", "dataclasses", "lists", "nan"],
)
def test_values_with_arrays_are_compared_by_their_elements(values: list[object], delivered: int) -> None:
    stream = samples_of(*((k, k, value) for k, value in enumerate(values)))
    assert len(under(Policy(AnyChange()), stream)) == delivered


def test_value_that_cannot_be_compared_is_refused_in_words() -> None:
    class Odd:
        __hash__ = None  # type: ignore[assignment]  # it has no equality worth the name

        def __eq__(self, other: object) -> bool:
            raise ValueError("no idea")

    with pytest.raises(PolicyError, match="'any change' expected values that == compares, got 'Odd' and no idea"):
        under(Policy(AnyChange()), samples_of((0, 0, Odd()), (1, 1, Odd())))


def test_max_delay_includes_its_end() -> None:
    assert [one.value for one in under(Policy(max_delay_us=100), samples_of((100, 0, 1), (101, 0, 2)))] == [1]


def test_sample_that_is_too_late_moves_neither_order_nor_change() -> None:
    policy = Policy(AnyChange(), max_delay_us=5, order=Order.STRICT)
    stream = samples_of((10, 10, "a"), (100, 50, "b"), (21, 20, "b"))
    assert [one.valid_us for one in under(policy, stream)] == [10, 20]


def test_drops_are_counted_by_cause() -> None:
    pipeline = PolicyPipeline(Policy(AnyChange(), max_delay_us=5, from_us=0, order=Order.STRICT))
    for sample in samples_of((0, -1, 0), (0, 0, 1), (1, 1, 1), (2, 0, 2), (90, 3, 3)):
        pipeline.offer(sample)
    assert pipeline.dropped == {"duration": 1, "no change": 1, "order": 1, "delay": 1}


def test_samples_that_no_sampled_time_needs_are_counted() -> None:
    pipeline = PolicyPipeline(Policy(TEN, MOST_RECENT, order=Order.MONOTONE))
    for sample in samples_of((0, 0, 1), (1, 1, 2), (2, 2, 3), (2, 2, 4), (3, 1, 5), (11, 11, 6)):
        pipeline.offer(sample)
    assert pipeline.dropped == {"not sampled": 1, "repeated": 1, "order": 1}


def test_sampled_value_leaves_as_soon_as_an_ordered_stream_goes_on() -> None:
    pipeline = PolicyPipeline(Policy(TEN, MOST_RECENT, order=Order.STRICT))
    assert pipeline.offer(Sample(8, 8, "a")) == []
    assert pipeline.offer(Sample(13, 13, "b")) == samples_of((13, 10, "a"))


def test_sampled_value_of_a_silent_stream_leaves_at_its_deadline() -> None:
    pipeline = PolicyPipeline(Policy(TEN, MOST_RECENT, max_delay_us=4, order=Order.STRICT))
    pipeline.offer(Sample(8, 8, "a"))
    assert pipeline.advance(14) == []  # what becomes available at 14 may still come
    assert pipeline.advance(15) == samples_of((14, 10, "a"))


def test_dropped_sample_tells_the_time_all_the_same() -> None:
    pipeline = PolicyPipeline(Policy(TEN, MOST_RECENT, max_delay_us=4, order=Order.STRICT))
    pipeline.offer(Sample(8, 8, "a"))
    assert pipeline.offer(Sample(15, 3, "out of order")) == samples_of((14, 10, "a"))


def test_sampled_times_start_at_from() -> None:
    policy = Policy(TEN, MOST_RECENT, from_us=3, order=Order.STRICT)
    assert [one.valid_us for one in under(policy, samples_of((0, 0, "a"), (4, 4, "b"), (30, 30, "c")))] == [3, 13, 23]


def test_value_known_before_from_is_the_most_recent_one_at_it() -> None:
    policy = Policy(TEN, MOST_RECENT, from_us=20, order=Order.STRICT)
    stream = samples_of((5, 5, "a"), (12, 12, "b"), (27, 27, "c"), (31, 31, "d"))
    assert under(policy, stream) == samples_of((27, 20, "b"), (31, 30, "c"))


def test_value_known_before_from_is_delivered_at_its_deadline() -> None:
    pipeline = PolicyPipeline(Policy(TEN, MOST_RECENT, max_delay_us=4, from_us=20))
    pipeline.offer(Sample(5, 5, "a"))
    assert pipeline.advance(30) == samples_of((24, 20, "a"))


@pytest.mark.parametrize("order", [Order.MONOTONE, Order.STRICT])
def test_sample_after_the_end_settles_what_lies_before_it(order: Order) -> None:
    pipeline = PolicyPipeline(Policy(TEN, MOST_RECENT, to_us=25, order=order))
    assert pipeline.offer(Sample(8, 8, "a")) == []
    assert pipeline.offer(Sample(27, 27, "b")) == samples_of((27, 10, "a"), (27, 20, "a"))
    assert pipeline.dropped == {"duration": 1}


def test_sample_after_the_end_counts_for_the_order_too() -> None:
    pipeline = PolicyPipeline(Policy(TEN, MOST_RECENT, to_us=25, order=Order.STRICT))
    delivered = [
        one for sample in samples_of((8, 8, "a"), (27, 27, "b"), (28, 19, "c")) for one in pipeline.offer(sample)
    ]
    assert [one.value for one in delivered] == ["a", "a"]
    assert pipeline.dropped == {"duration": 1, "order": 1}


def test_interpolation_reaches_over_both_ends() -> None:
    policy = Policy(TEN, LINEAR, from_us=10, to_us=20, order=Order.STRICT)
    assert under(policy, samples_of((5, 5, 0.0), (25, 25, 20.0))) == samples_of((25, 10, 5.0), (25, 20, 15.0))


def test_of_the_samples_before_from_one_is_held() -> None:
    policy = Policy(TEN, LINEAR, from_us=10_000, order=Order.STRICT)
    pipeline = PolicyPipeline(policy)
    for t_us in range(5, 5_000):
        pipeline.offer(Sample(t_us, t_us, 0.0))
    assert pipeline.dropped == {"duration": 4_994}


@pytest.mark.parametrize("approximation", Approximation)
def test_after_the_end_samples_are_counted_and_not_held(approximation: Approximation) -> None:
    pipeline = PolicyPipeline(Policy(TEN, approximation, max_delay_us=5, to_us=30))
    for t_us in range(0, 1_000, 10):
        pipeline.offer(Sample(t_us, t_us, 1.0))
    assert pipeline.dropped == {"duration": 96}


@pytest.mark.parametrize("order", [Order.MONOTONE, Order.STRICT])
def test_each_sample_is_a_sampled_value_or_counted(order: Order) -> None:
    """Of a stream of different values, those that are not delivered are all counted."""
    rng = random.Random(3)
    for _ in range(200):
        times_us = sorted(rng.sample(range(100), 30))
        stream = samples_of(*((max(t_us, 0), t_us + rng.choice((0, 0, 0, -6)), k) for k, t_us in enumerate(times_us)))
        policy = Policy(SampleEvery(rng.choice((3, 7, 20))), MOST_RECENT, None, rng.choice((None, 40)), 77, order=order)
        pipeline = PolicyPipeline(policy)
        delivered = [one for sample in stream for one in pipeline.offer(sample)] + list(pipeline.finish())
        values = {one.value for one in delivered} - {NO_VALUE}
        assert sum(pipeline.dropped.values()) == len(stream) - len(values)


def test_sampling_begins_with_what_can_still_come_in_time() -> None:
    policy = Policy(TEN, MOST_RECENT, max_delay_us=5)
    assert [one.valid_us for one in under(policy, samples_of((98, 20, "a")), told_us=120)] == [100, 110]


def test_interpolation_takes_tuples_of_numbers() -> None:
    stream = samples_of((0, 5, (0.0, 10.0)), (0, 15, (1.0, 20.0)))
    assert [one.value for one in under(Policy(TEN, LINEAR, order=Order.STRICT), stream)] == [(0.5, 15.0)]


def test_interpolation_next_to_no_value_is_no_value() -> None:
    stream = samples_of((0, 5, 1.0), (0, 15, NO_VALUE))
    assert [one.value for one in under(Policy(TEN, LINEAR, order=Order.STRICT), stream)] == [NO_VALUE]


@pytest.mark.parametrize("values", [("a", "b"), (True, False), ((1.0,), (1.0, 2.0))])
def test_interpolation_refuses_what_has_nothing_in_between(values: tuple[object, object]) -> None:
    stream = samples_of((0, 5, values[0]), (0, 15, values[1]))
    with pytest.raises(PolicyError, match=r"linear interpolation: expected numbers, .* got "):
        under(Policy(TEN, LINEAR, order=Order.STRICT), stream)


ANY_ROW = st.tuples(st.integers(0, 12), st.integers(-4, 30), st.integers(0, 3))
ROUND_ROW = st.tuples(st.sampled_from([0, 5, 10]), st.sampled_from([-5, 0, 5, 10, 25]), st.integers(0, 3))
STREAMS = (st.lists(ANY_ROW, max_size=40) | st.lists(ROUND_ROW, max_size=40)).map(
    lambda rows: [
        Sample(now_us, now_us - delay_us, float(value))
        for now_us, (_, delay_us, value) in zip(_running_sums(row[0] for row in rows), rows, strict=True)
    ]
)
CAUSES = st.one_of(st.just(AnyUpdate()), st.just(AnyChange()), st.builds(SampleEvery, st.sampled_from([3, 5, 10, 17])))


def _running_sums(steps: Any) -> list[int]:
    total, sums = 0, []
    for step in steps:
        total += step
        sums.append(total)
    return sums


@st.composite
def policies(draw: st.DrawFn) -> Policy:
    cause, order = draw(CAUSES), draw(st.sampled_from(Order))
    must_have_delay = isinstance(cause, SampleEvery) and order is Order.ANY
    delay_us = draw(st.integers(0, 25) if must_have_delay else st.none() | st.integers(0, 25))
    from_us = draw(st.none() | st.integers(-5, 60))
    to_us = draw(st.none() | st.integers(from_us or 0, 200)) if from_us is None or from_us >= 0 else None
    return Policy(cause, draw(st.sampled_from(Approximation)), delay_us, from_us, to_us, None, order)


@PROPERTY
@given(policies(), STREAMS, st.none() | st.integers(0, 400))
def test_pipeline_delivers_what_the_definition_says(
    policy: Policy, samples: list[Sample[float]], told_us: int | None
) -> None:
    assert under(policy, samples, told_us=told_us) == received(policy, samples, told_us)


@pytest.mark.long
@PROPERTY
@given(policies(), STREAMS, st.lists(st.integers(0, 480), max_size=30))
def test_time_told_in_between_changes_nothing(policy: Policy, samples: list[Sample[float]], told_us: list[int]) -> None:
    pipeline, silent = PolicyPipeline(policy), PolicyPipeline(policy)
    told: list[Sample[Any]] = []
    untold: list[Sample[Any]] = []
    waiting = sorted(told_us)
    for sample in samples:
        while waiting and waiting[0] <= sample.available_us:
            told += pipeline.advance(waiting.pop(0))
        told += pipeline.offer(sample)
        untold += silent.offer(sample)
    assert [*told, *pipeline.finish()] == [*untold, *silent.finish()]
    assert pipeline.dropped == silent.dropped


@pytest.mark.long
@PROPERTY
@given(policies(), STREAMS)
def test_delivered_stream_keeps_order_delay_and_duration(policy: Policy, samples: list[Sample[float]]) -> None:
    delivered = under(policy, samples)
    pairs = list(pairwise(delivered))
    assert all(a.available_us <= b.available_us for a, b in pairs)
    if policy.order is Order.STRICT or isinstance(policy.cause, SampleEvery):
        assert all(a.valid_us < b.valid_us for a, b in pairs)
    if policy.order is Order.MONOTONE:
        assert all(a.valid_us <= b.valid_us for a, b in pairs)
    if isinstance(policy.cause, AnyChange):
        assert all(a.value != b.value for a, b in pairs)
    if policy.max_delay_us is not None:
        assert all(one.delay_us <= policy.max_delay_us for one in delivered)
    assert all(policy.from_us is None or one.valid_us >= policy.from_us for one in delivered)
    assert all(policy.to_us is None or one.valid_us <= policy.to_us for one in delivered)


@pytest.mark.long
@PROPERTY
@given(policies(), STREAMS, st.none() | st.integers(0, 400))
def test_duration_takes_a_part_of_what_is_sampled_without_it(
    policy: Policy, samples: list[Sample[float]], told_us: int | None
) -> None:
    if not isinstance(policy.cause, SampleEvery):
        policy = replace(policy, cause=SampleEvery(10), order=Order.STRICT)
    whole = under(replace(policy, to_us=None), samples, told_us=told_us)
    assert under(policy, samples, told_us=told_us) == [
        one for one in whole if policy.to_us is None or one.valid_us <= policy.to_us
    ]
    if policy.from_us is not None and policy.from_us % policy.cause.period_us == 0:  # else other times are sampled
        before = under(replace(policy, from_us=None), samples, told_us=told_us)
        part = [(one.valid_us, one.value) for one in before if one.valid_us >= policy.from_us]
        got = [(one.valid_us, one.value) for one in under(policy, samples, told_us=told_us)]
        assert got[: len(part)] == part  # and perhaps times that need not wait for one before `from` any more


@pytest.mark.long
@PROPERTY
@example(
    Policy(SampleEvery(3), Approximation.NONE, from_us=0, order=Order.MONOTONE),
    [Sample(available_us=0, valid_us=-3, value=0.0)],
    None,
)
@given(policies(), STREAMS, st.none() | st.integers(0, 400))
def test_every_sample_is_delivered_serves_a_sampled_value_or_is_counted(
    policy: Policy, samples: list[Sample[float]], told_us: int | None
) -> None:
    pipeline = PolicyPipeline(policy)
    for sample in samples:
        pipeline.offer(sample)
    pipeline.advance(told_us or 0)
    pipeline.finish()
    assert sum(pipeline.dropped.values()) == len(samples) - count_used(policy, samples, told_us)


def test_last_sample_of_a_fast_stream_is_counted_at_the_end() -> None:
    pipeline = PolicyPipeline(Policy(SampleEvery(1_000), MOST_RECENT, order=Order.STRICT))
    for t_us in range(0, 2_400, 40):
        pipeline.offer(Sample(t_us, t_us, t_us))
    assert pipeline.dropped == {"not sampled": 56}  # of 60; 2,360 may still be the value at 3,000
    assert pipeline.finish() == []
    assert pipeline.dropped == {"not sampled": 57}
