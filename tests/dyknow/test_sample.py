"""Samples, and the value that says that nothing is known."""

import copy
import pickle

import pytest

from dyknow.sample import NO_VALUE, NoValue, Sample


@pytest.mark.parametrize("other", [pickle.loads(pickle.dumps(NO_VALUE)), copy.deepcopy(NO_VALUE), NoValue("no_value")])
def test_no_value_is_one_object(other: object) -> None:
    assert other is NO_VALUE


def test_no_value_is_written_as_in_the_language() -> None:
    assert (repr(NO_VALUE), str(NO_VALUE), f"{[NO_VALUE]}") == ("no_value", "no_value", "[no_value]")


@pytest.mark.parametrize("value", [None, False, 0, "no_value", ""])
def test_no_value_differs_from_every_value(value: object) -> None:
    assert value != NO_VALUE


def test_prediction_has_a_negative_delay() -> None:
    assert Sample(available_us=10, valid_us=30, value="there").delay_us == -20
