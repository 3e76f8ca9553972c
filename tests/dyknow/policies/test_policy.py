"""Policies: what may be asked for, and how it is written."""

from typing import Any  # what a policy must not be made of

import pytest

from dyknow.errors import PolicyError
from dyknow.policies.policy import AnyChange, Approximation, Order, Policy, SampleEvery

EVERY_SECOND = SampleEvery(1_000_000)


@pytest.mark.parametrize(
    ("policy", "text"),
    [
        (Policy(), "any update"),
        (Policy(AnyChange()), "any change"),
        (Policy(EVERY_SECOND, order=Order.STRICT), "sample every 1s, strict order"),
        (Policy(EVERY_SECOND, max_delay_us=1_500), "sample every 1s, max delay 1500us"),
        (Policy(approximation=Approximation.MOST_RECENT), "any update, use most recent"),
        (Policy(approximation=Approximation.LINEAR), "any update, linear interpolation"),
        (Policy(from_us=0, to_us=90_000_000), "any update, from 0s to 90s"),
        (Policy(to_us=60_000_000), "any update, to 1min"),
        (Policy(from_us=5_000, oldest_us=0), "any update, from 5ms, oldest 0s"),
        (Policy(AnyChange(), order=Order.MONOTONE), "any change, monotone order"),
    ],
    ids=str,
)
def test_policy_is_written_in_the_words_of_kpl(policy: Policy, text: str) -> None:
    assert str(policy) == text


@pytest.mark.parametrize(
    ("wanted", "message"),
    [
        ({"max_delay_us": -1}, r"max_delay_us must be None or >= 0 us, got -1"),
        ({"oldest_us": -2}, r"oldest_us must be None or >= 0 us, got -2"),
        ({"max_delay_us": 1.5}, r"max_delay_us must be None or a whole number of us, got 1.5"),
        ({"from_us": True}, r"from_us must be None or a whole number of us, got True"),
        ({"to_us": float("nan")}, r"to_us must be None or a whole number of us, got nan"),
        ({"from_us": 3, "to_us": 2}, r"from_us must be <= to_us, got 3 and 2"),
        ({"cause": EVERY_SECOND}, r"sample every 1s must have a max delay or an order .*, got neither"),
    ],
)
def test_policy_that_nothing_satisfies_is_refused(wanted: dict[str, object], message: str) -> None:
    with pytest.raises(PolicyError, match=message):
        Policy(**wanted)  # type: ignore[arg-type]  # one table for several fields


@pytest.mark.parametrize("period_us", [0, -5])
def test_sampling_period_must_be_positive(period_us: int) -> None:
    with pytest.raises(PolicyError, match=rf"period of 'sample every' must be > 0 us, got {period_us}"):
        SampleEvery(period_us)


def test_equal_policies_are_equal() -> None:
    assert Policy(SampleEvery(5), max_delay_us=2) == Policy(SampleEvery(5), max_delay_us=2)
    assert len({Policy(AnyChange()), Policy(AnyChange()), Policy()}) == 2


@pytest.mark.parametrize(
    "parts", [{"order": "strict"}, {"approximation": "linear"}, {"cause": AnyChange}], ids=["order", "word", "class"]
)
def test_parts_of_another_type_are_refused(parts: dict[str, Any]) -> None:
    with pytest.raises(PolicyError, match=r"policy: expected .* to be of type .*, got"):
        Policy(**parts)
