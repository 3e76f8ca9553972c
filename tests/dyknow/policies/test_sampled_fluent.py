"""Fluents at sampled times: what is forgotten is not missed."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from dyknow.policies.policy import Approximation, Order
from dyknow.policies.sampled_fluent import SampledFluent
from dyknow.sample import NO_VALUE, Sample
from tests.dyknow.oracle import value_at
from tests.dyknow.property import PROPERTY

NONE, MOST_RECENT, LINEAR = Approximation
PERIOD_US = 10


def fluent(approximation: Approximation, order: Order = Order.ANY, *valid_us: int) -> SampledFluent:
    """Make a fluent whose samples have ten times their valid time as value."""
    made = SampledFluent(approximation, order, start_us=0, period_us=PERIOD_US)
    for t_us in valid_us:
        made.insert(Sample(t_us, t_us, 10.0 * t_us))
    return made


@PROPERTY
@given(st.sampled_from(Approximation), st.lists(st.lists(st.integers(-20, 60), max_size=8), max_size=6))
def test_values_are_those_out_of_all_samples(approximation: Approximation, batches: list[list[int]]) -> None:
    """Samples come in any order, some before each sampled time is taken; each batch tells times that it is near."""
    made, known = fluent(approximation), list[Sample[float]]()
    for k, batch in enumerate(batches):
        for offset_us in batch:
            sample = Sample(0, k * PERIOD_US + offset_us - 20, float(len(known) % 7))
            made.insert(sample)
            if sample.valid_us not in [one.valid_us for one in known]:
                known.append(sample)
        assert made.take(k * PERIOD_US) == value_at(approximation, known, k * PERIOD_US)


@pytest.mark.parametrize(
    ("approximation", "valid_us", "held"),
    [
        (NONE, (1, 5, 10, 12), 1),
        (MOST_RECENT, (1, 5, 9, 12), 2),
        (MOST_RECENT, (9, 5, 1), 1),
        (LINEAR, (1, 5, 9, 12), 3),
        (LINEAR, (5, 9, 1), 2),
        (LINEAR, (9, 1, 5), 2),
    ],
)
def test_only_what_can_matter_is_held(approximation: Approximation, valid_us: tuple[int, ...], held: int) -> None:
    made = fluent(approximation, Order.ANY, *valid_us)
    assert len(made) == held
    assert made.dropped.get("not sampled", 0) == len(valid_us) - held


def test_sample_before_the_first_one_in_a_gap_is_the_new_neighbour() -> None:
    made = fluent(LINEAR, Order.ANY, -5, 5, 9)
    made.insert(Sample(9, 3, 100.0))
    assert made.take(0) == pytest.approx(-50.0 + 150.0 * 5 / 8)


def test_first_word_about_a_time_counts() -> None:
    made = fluent(MOST_RECENT, Order.ANY, 10)
    made.insert(Sample(11, 10, "another"))
    assert (made.take(10), made.dropped) == (100.0, {"repeated": 1})


@pytest.mark.parametrize(
    ("order", "settled"), [(Order.ANY, [False, True, False]), (Order.MONOTONE, [True, True, False])]
)
def test_order_settles_what_lies_before_a_sample(order: Order, settled: list[bool]) -> None:
    made = fluent(MOST_RECENT, order, 10)
    assert [made.is_settled(t_us) for t_us in (0, 10, 20)] == settled


def test_before_the_first_sample_nothing_is_known() -> None:
    assert fluent(MOST_RECENT, Order.STRICT, 12).take(10) is NO_VALUE
