"""Who drove the wrong way, and who stopped again and again?"""

from itertools import pairwise

import numpy as np
import pytest

from data_gen.simulation.states import FloatArray
from data_gen.truth.alone import find_solitary, stop_times_us
from data_gen.truth.event import TruthEvent
from tests.data_gen.support import straight_road
from tests.data_gen.truth_support import STEP_US, Drive, along, tables_of

STEPS = 250
X_M = 50 + 15.0 * np.arange(STEPS) * STEP_US / 1e6


def events_of(drives: dict[str, Drive]) -> list[TruthEvent]:
    return list(find_solitary(tables_of(drives, straight_road())))


def wrong_side(first: int, last: int) -> FloatArray:
    """Give y of a drive on the oncoming lane from one step to another."""
    return np.interp(np.arange(STEPS), [first - 1, first, last - 1, last], [-1.75, 1.75, 1.75, -1.75])


@pytest.mark.parametrize(
    ("steps", "expected"),
    [
        pytest.param((20, 160), [True], id="14 s"),
        pytest.param((20, 141), [False], id="12 s"),
        pytest.param((20, 120), [], id="10 s"),
    ],
)
def test_twelve_seconds_on_the_oncoming_lane_are_the_wrong_way(steps: tuple[int, int], expected: list[bool]) -> None:
    events = events_of({"a": along(X_M, wrong_side(*steps))})
    assert [event.countable for event in events] == expected
    assert all(event.end_us - event.start_us == 12_000_000 for event in events)


def test_a_long_overtake_is_not_the_wrong_way() -> None:
    slower_m = X_M[80] + 12.0 * (np.arange(STEPS) - 80) * STEP_US / 1e6
    assert events_of({"a": along(X_M, wrong_side(20, 180)), "b": along(slower_m, -1.75)}) == []


def test_the_right_lane_is_right_both_ways() -> None:
    assert events_of({"a": along(X_M, -1.75), "b": along(900 - X_M, 1.75)}) == []


def speeds(*stops: tuple[int, int], low_mps: float = 0.0) -> FloatArray:
    """Give speeds of 8 m/s with stops from one step to another."""
    speed_mps = np.full(1200, 8.0)
    for first, last in stops:
        speed_mps[first:last] = low_mps
    return speed_mps


def drive(speed_mps: FloatArray) -> Drive:
    return along(20 + np.cumsum(speed_mps) * STEP_US / 1e6, -1.75)


def test_three_stops_are_stop_and_go() -> None:
    (event,) = events_of({"a": drive(speeds((100, 150), (200, 300), (400, 450)))})
    assert (event.type, event.countable, event.places) == ("stop_and_go", True, (("road", "east"),))
    assert abs(event.start_us - 100 * STEP_US) <= STEP_US
    assert abs(event.end_us - 400 * STEP_US) <= STEP_US


def test_two_stops_are_not() -> None:
    assert events_of({"a": drive(speeds((100, 150), (400, 450)))}) == []


def test_a_stop_that_is_nearly_none_leaves_it_open() -> None:
    (event,) = events_of({"a": drive(speeds((100, 150), (200, 300), (400, 450), low_mps=1.3))})
    assert event.why_not_countable == "the car is at about 2 m/s"


@pytest.mark.parametrize("seed", range(5))
def test_stops_agree_with_a_walk_over_crossings(seed: int) -> None:
    rng = np.random.default_rng(seed)
    speed_mps = np.abs(3 + np.cumsum(rng.normal(0, 0.4, 2000)) % 6 - 3)
    found = stop_times_us(np.arange(2000), speed_mps, 0.5)
    below = [step for step in range(1, 2000) if speed_mps[step] < 2.0 <= speed_mps[step - 1]]
    assert set(found) <= set(below)
    for first, second in pairwise(found):
        assert speed_mps[first:second].max() > 2.5
    assert all(speed_mps[step : step + 2000].min() < 1.5 for step in found)
