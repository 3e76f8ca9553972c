"""Policies: what a subscriber receives is a function of the samples offered and of its policy."""

import random
from itertools import pairwise

import pytest

from dyknow.errors import PolicyError
from dyknow.policy import Cause, Order, Policy, PolicyFilter
from dyknow.sample import Sample


def delivered(policy: Policy, samples: list[Sample[int]]) -> list[Sample[int]]:
    policy_filter = PolicyFilter(policy)
    return [sample for sample in samples if policy_filter.admits(sample)]


def valid_times(policy: Policy, times_us: list[int]) -> list[int]:
    return [sample.valid_us for sample in delivered(policy, [Sample(1_000, t_us, t_us) for t_us in times_us])]


def test_any_update_in_any_order_delivers_everything() -> None:
    assert valid_times(Policy(), [3, 1, 1, 2]) == [3, 1, 1, 2]


def test_monotone_order_drops_late_samples_and_keeps_repeated_times() -> None:
    assert valid_times(Policy(order=Order.MONOTONE), [1, 3, 2, 3, 4]) == [1, 3, 3, 4]


def test_strict_order_drops_late_samples_and_repeated_times() -> None:
    assert valid_times(Policy(order=Order.STRICT), [1, 3, 2, 3, 4]) == [1, 3, 4]


def test_any_change_compares_values_with_the_last_one_delivered() -> None:
    samples = [Sample(t, t, value) for t, value in enumerate([7, 7, 8, 8, 7])]
    assert [sample.value for sample in delivered(Policy(cause=Cause.ANY_CHANGE), samples)] == [7, 8, 7]


def test_first_sample_counts_as_a_change_even_when_it_is_none() -> None:
    assert PolicyFilter(Policy(cause=Cause.ANY_CHANGE)).admits(Sample(0, 0, None))


def test_max_delay_includes_its_end() -> None:
    samples = [Sample(100, 0, 1), Sample(101, 0, 2)]
    assert [sample.value for sample in delivered(Policy(max_delay_us=100), samples)] == [1]


def test_a_dropped_sample_does_not_move_the_order() -> None:
    policy = Policy(order=Order.STRICT, max_delay_us=5)
    samples = [Sample(10, 10, 1), Sample(100, 50, 2), Sample(21, 20, 3)]
    assert [sample.value for sample in delivered(policy, samples)] == [1, 3]


def test_drops_are_counted_by_cause() -> None:
    policy_filter = PolicyFilter(Policy(cause=Cause.ANY_CHANGE, order=Order.STRICT, max_delay_us=5))
    for sample in (Sample(0, 0, 1), Sample(1, 1, 1), Sample(2, 0, 2), Sample(90, 3, 3)):
        policy_filter.admits(sample)
    assert policy_filter.dropped == {"no change": 1, "order": 1, "delay": 1}


def test_negative_delay_is_refused() -> None:
    with pytest.raises(PolicyError, match=r"max_delay_us must be None or >= 0 us, got -1"):
        Policy(max_delay_us=-1)


@pytest.mark.parametrize("seed", range(20))
def test_delivered_stream_satisfies_its_policy(seed: int) -> None:
    rng = random.Random(seed)
    samples = [Sample(t, t - rng.randrange(8), rng.randrange(3)) for t in range(100)]
    policy = Policy(rng.choice(list(Cause)), rng.choice(list(Order)), rng.choice([None, 3]))
    kept = delivered(policy, samples)
    pairs = list(pairwise(kept))
    if policy.order is Order.STRICT:
        assert all(a.valid_us < b.valid_us for a, b in pairs)
    if policy.order is Order.MONOTONE:
        assert all(a.valid_us <= b.valid_us for a, b in pairs)
    if policy.cause is Cause.ANY_CHANGE:
        assert all(a.value != b.value for a, b in pairs)
    if policy.max_delay_us is not None:
        assert all(sample.delay_us <= policy.max_delay_us for sample in kept)
