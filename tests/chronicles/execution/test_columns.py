"""Events kept as columns and made again."""

import numpy as np
import pytest

from chronicles.errors import ChronicleError
from chronicles.events import Event
from chronicles.execution.columns import NO_TEXT, EventColumns
from tests.chronicles.execution.random_cases import CaseMaker

EVENTS = [
    Event("enter", ("car2",), 7, hypotheses=("h1",)),
    Event("near", ("car1", "car2"), 5, "false", "true"),
    Event("enter", ("car1",), 5),
    Event("near", ("car1", "car2"), 5, None, "true"),
    Event("enter", (), 1),
]


@pytest.mark.parametrize("keep", [False, True])
def test_events_come_back_in_the_order_of_time_and_as_given_where_simultaneous(keep: bool) -> None:
    columns = EventColumns.from_events(EVENTS, keep=keep)
    assert list(columns.events()) == [EVENTS[4], EVENTS[1], EVENTS[2], EVENTS[3], EVENTS[0]]
    assert len(columns) == 5


def test_kept_events_are_the_same_objects() -> None:
    columns = EventColumns.from_events(EVENTS, keep=True)
    assert {id(event) for event in columns.events()} == {id(event) for event in EVENTS}
    assert {id(event) for event in columns.between(5, 6).events()} == {id(event) for event in EVENTS[1:4]}


def test_events_of_random_traces_come_back() -> None:
    for seed in range(50):
        maker = CaseMaker(seed)
        maker.text()
        trace = maker.trace()
        assert list(EventColumns.from_events(trace).events()) == sorted(trace, key=lambda event: event.t_us)


def test_slice_of_time_is_half_open_and_keeps_hypotheses() -> None:
    columns = EventColumns.from_events(EVENTS)
    assert list(columns.between(5, 7).events()) == EVENTS[1:4]
    assert list(columns.between(6, 9).events()) == [EVENTS[0]]


def test_events_of_some_names() -> None:
    assert {event.name for event in EventColumns.from_events(EVENTS).of({"near"}).events()} == {"near"}


def test_times_of_all_events_ascend() -> None:
    assert EventColumns.from_events(EVENTS).times_us.tolist() == [1, 5, 5, 5, 7]


def test_no_events_make_empty_columns() -> None:
    columns = EventColumns.from_events([])
    assert (len(columns), list(columns.events()), columns.times_us.tolist()) == (0, [], [])
    assert len(EventColumns.from_arrays({}, [])) == 0


def test_arrays_in_any_order_of_time_become_the_same_columns() -> None:
    arrays = {
        ("enter", 1, False): (np.array([7, 5]), np.array([[1], [0]])),
        ("near", 2, True): (np.array([5]), np.array([[0, 1, NO_TEXT, 2]])),
    }
    columns = EventColumns.from_arrays(arrays, ["car1", "car2", "true"], {("enter", 1, False): {0: ("h1",)}})
    assert list(columns.events()) == [EVENTS[2], EVENTS[3], EVENTS[0]]


@pytest.mark.parametrize(
    ("codes", "message"),
    [
        ([[0]], r"expected codes of shape \(1, 4\), got \(1, 1\)"),
        ([[0, 1, 2, 3]], r"expected codes from -1 to 2, got 0 to 3"),
        ([[0, NO_TEXT, 2, 2]], "expected every argument and new value, got -1"),
        ([[0, 1, 2, NO_TEXT]], "expected every argument and new value, got -1"),
    ],
    ids=["shape", "range", "argument", "new value"],
)
def test_arrays_that_do_not_fit_are_refused(codes: list[list[int]], message: str) -> None:
    with pytest.raises(ChronicleError, match=message):
        EventColumns.from_arrays({("near", 2, True): (np.array([5]), np.array(codes))}, ["a", "b", "true"])


def test_symbols_that_come_twice_are_refused() -> None:
    with pytest.raises(ChronicleError, match="expected symbols without doubles"):
        EventColumns.from_arrays({}, ["a", "a"])


@pytest.mark.parametrize("keep", [False, True])
def test_added_events_take_their_place_in_time_and_sequence(keep: bool) -> None:
    columns = EventColumns.from_events([EVENTS[0], EVENTS[4]], keep=keep)
    added = [Event("enter", ("car3",), 7, hypotheses=("h2",)), Event("enter", ("car4",), 3), Event("leave", (), 7)]
    more = columns.with_events(added, np.array([0, 1, 2]))
    assert list(more.events()) == [EVENTS[4], added[1], added[0], EVENTS[0], added[2]]
    assert len(columns) == 2
