"""Pulled streams: bounded, and every loss counted. Histories: what is kept for those who come later."""

import pytest

from dyknow.errors import StreamError
from dyknow.sample import Sample
from dyknow.streams.buffers import History, Stream


def test_take_gives_as_many_as_asked_for() -> None:
    stream = Stream("s", capacity=5)
    for t_us in range(4):
        stream.accept(Sample(t_us, t_us, t_us))
    assert [sample.value for sample in stream.take(3)] == [0, 1, 2]
    assert [sample.value for sample in stream.take(3)] == [3]
    assert stream.take(3) == ()


def test_full_stream_can_be_seen_before_it_drops() -> None:
    stream = Stream("s", capacity=1)
    assert not stream.is_full
    stream.accept(Sample(0, 0, 0))
    assert (stream.is_full, stream.dropped) == (True, {})


def test_stream_without_room_is_refused() -> None:
    with pytest.raises(StreamError, match="stream 's': expected a capacity of at least 1 sample, got 0"):
        Stream("s", capacity=0)


def test_number_to_take_and_word_for_full_must_make_sense() -> None:
    with pytest.raises(StreamError, match="stream 's': expected to take 0 samples or more, got -1"):
        Stream("s", capacity=1).take(-1)
    with pytest.raises(StreamError, match=r"stream 's': expected one of .*, got 'drop oldest'"):
        Stream("s", 1, "drop oldest")  # type: ignore[arg-type]


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
