"""Histories: what is kept for those who come later."""

import pytest

from dyknow.errors import StreamError
from dyknow.streams.history import History
from dyknow.streams.sample import Sample


def test_age_counts_from_now_and_includes_its_end() -> None:
    history = History(duration_us=10, capacity=9)
    for t_us in (0, 1, 11):
        history.append(Sample(t_us, t_us, t_us), now_us=t_us)
    assert [sample.value for sample in history.since(0)] == [1, 11]


def test_late_sample_is_given_by_its_valid_time() -> None:
    history = History(duration_us=100, capacity=9)
    for available_us, valid_us in ((50, 50), (60, 5), (70, 70)):
        history.append(Sample(available_us, valid_us, valid_us), now_us=available_us)
    assert [sample.value for sample in history.since(50)] == [50, 70]


@pytest.mark.parametrize(("duration_us", "capacity"), [(-1, 5), (5, 0)])
def test_impossible_bounds_are_refused(duration_us: int, capacity: int) -> None:
    with pytest.raises(StreamError, match="history: expected a duration >= 0 us and a capacity >= 1"):
        History(duration_us=duration_us, capacity=capacity)
