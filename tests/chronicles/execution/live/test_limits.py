"""Bounds on instances: what is kept below them, what is left out above them, and that it is counted."""

import pytest

from chronicles.chronicle_set import ChronicleSet, load
from chronicles.errors import ChronicleError
from chronicles.events import Event
from chronicles.execution.limits import Limits
from chronicles.recogniser import Recogniser


def repeated(count: int) -> ChronicleSet:
    """A chronicle of so many equal events, in order."""
    events = " ".join(f"event(ping[?a], t{k})" for k in range(count))
    order = " ".join(f"t{k} - t{k - 1} in [1us, 99s]" for k in range(1, count))
    return load(f"chronicle many[?a](t0, t{count - 1}) {{ {events} {order} }}")


def pings(count: int) -> list[Event]:
    return [Event("ping", ("a",), 1_000_000 * k) for k in range(count)]


def found(recogniser: Recogniser, count: int) -> list[tuple[int, ...]]:
    """The seconds of the events in each occurrence."""
    told = [one for event in pings(count) for one in recogniser.observe(event)]
    return [tuple(t_us // 1_000_000 for _, t_us in one.sub_events) for one in told]


def test_nothing_is_left_out_below_the_limits() -> None:
    recogniser = Recogniser(repeated(3))
    assert len(found(recogniser, 8)) == 56
    assert not recogniser.left_out


def test_one_event_completes_no_more_than_the_limit() -> None:
    free, bounded = Recogniser(repeated(2)), Recogniser(repeated(2), limits=Limits(most_matches=3))
    everything, kept = found(free, 6), found(bounded, 6)
    assert [sum(pair[1] == last for pair in kept) for last in range(1, 6)] == [1, 2, 3, 3, 3]
    assert set(kept) <= set(everything)
    assert bounded.left_out == {"many": len(everything) - len(kept)}


def test_those_that_came_first_go_on_waiting() -> None:
    bounded = Recogniser(repeated(3), limits=Limits(most_waiting=2))
    assert found(bounded, 5) == [(0, 1, 2), (0, 1, 3), (0, 2, 3), (0, 1, 4), (0, 2, 4)]
    assert bounded.left_out == {"many": 1 + 3 + 4}


def test_the_same_events_are_told_the_same_after_a_checkpoint() -> None:
    limits = Limits(most_waiting=2, most_matches=2)
    whole, first, second = (Recogniser(repeated(3), limits=limits) for _ in range(3))
    told = [found for event in pings(6) for found in whole.observe(event)]
    half = [found for event in pings(6)[:3] for found in first.observe(event)]
    second.restore(first.checkpoint())
    assert told == half + [found for event in pings(6)[3:] for found in second.observe(event)]


@pytest.mark.long
def test_a_dozen_equal_events_out_of_many_come_to_an_end() -> None:
    recogniser = Recogniser(repeated(12), limits=Limits(most_waiting=500, most_matches=100))
    assert 0 < len(found(recogniser, 40)) <= 100 * 40
    assert recogniser.left_out["many"] > 10_000


@pytest.mark.parametrize("name", ["most_waiting", "most_matches"])
def test_limits_are_numbers_above_zero(name: str) -> None:
    with pytest.raises(ChronicleError, match=f"limits: {name} must be 1 or more, got 0"):
        Limits(**{name: 0})


def test_other_limits_are_other_checkpoints() -> None:
    recogniser = Recogniser(repeated(2), limits=Limits(most_matches=3))
    with pytest.raises(ChronicleError, match="checkpoint: expected limits"):
        recogniser.restore(Recogniser(repeated(2)).checkpoint())
