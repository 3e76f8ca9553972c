"""Who cut in on whom? Hand-made lane changes."""

import numpy as np
import pytest

from data_gen.simulation.states import FloatArray
from data_gen.truth.cut_in import find_cut_ins
from data_gen.truth.event import TruthEvent
from tests.data_gen.truth_support import STEP_US, Drive, along, motorway, tables_of

STEPS = 200
CAR_M = 100 + 20.0 * np.arange(STEPS) * STEP_US / 1e6
CHANGES_AT = 100


def change(*, over_steps: int = 25) -> FloatArray:
    """Give y of a change from the left lane to the right one whose middle is at `CHANGES_AT`."""
    first, last = CHANGES_AT - over_steps / 2, CHANGES_AT + over_steps / 2
    return np.interp(np.arange(STEPS), [first, last], [3.5, 0.0])


def events_of(drives: dict[str, Drive]) -> list[TruthEvent]:
    return list(find_cut_ins(tables_of(drives, motorway())))


def ahead(bumper_m: float) -> FloatArray:
    return CAR_M + 4.0 + bumper_m


def test_a_change_that_leaves_half_a_second_is_a_cut_in() -> None:
    (event,) = events_of({"a": along(ahead(10), change()), "b": along(CAR_M, 0.0)})
    assert (event.type, event.roles, event.countable) == ("cut_in", {"cutter": "a", "car": "b"}, True)
    assert abs(event.start_us - CHANGES_AT * STEP_US) <= 2 * STEP_US
    assert (event.end_us, event.places) == (event.start_us, (("lane", "e_0"),))


def test_the_same_change_with_room_enough_is_none() -> None:
    assert events_of({"a": along(ahead(30), change()), "b": along(CAR_M, 0.0)}) == []


def test_a_gap_of_about_a_second_does_not_count() -> None:
    (event,) = events_of({"a": along(ahead(20), change()), "b": along(CAR_M, 0.0)})
    assert event.why_not_countable == "the time gap is about 1 s"


def test_squeezing_into_slow_traffic_is_none() -> None:
    slow_m = 100 + 5.0 * np.arange(STEPS) * STEP_US / 1e6
    assert events_of({"a": along(slow_m + 6.0, change()), "b": along(slow_m, 0.0)}) == []


def test_only_the_next_one_behind_is_cut_in_on() -> None:
    drives = {"a": along(ahead(8), change()), "b": along(CAR_M, 0.0), "c": along(CAR_M - 9.0, 0.0)}
    assert [event.vehicles for event in events_of(drives)] == [("a", "b")]


def test_driving_ahead_in_one_lane_is_none() -> None:
    assert events_of({"a": along(ahead(10), 0.0), "b": along(CAR_M, 0.0)}) == []


def test_touching_the_other_lane_for_a_moment_is_none() -> None:
    y_m = np.full(STEPS, 3.5)
    y_m[100:103] = 1.0
    assert [event.vehicles for event in events_of({"a": along(ahead(10), y_m), "b": along(CAR_M, 0.0)})] == []


@pytest.mark.parametrize("name", ["a", "b"])
def test_a_hidden_vehicle_leaves_it_out_of_the_count(name: str) -> None:
    drives = {"a": along(ahead(10), change()), "b": along(CAR_M, 0.0)}
    drives[name] = Drive(drives[name].centre_m, unseen=slice(95, 97))
    (event,) = events_of(drives)
    role = {"a": "cutter", "b": "car"}[name]
    assert event.why_not_countable == f"the {role} is not in view from 1 s before to 1 s after the event"


@pytest.mark.parametrize("seed", range(6))
def test_random_changes_agree_with_the_plain_rule(seed: int) -> None:
    rng = np.random.default_rng(seed)
    bumper_m = float(rng.uniform(2, 40))
    speed_mps = float(rng.uniform(5, 30))
    x_m = 100 + speed_mps * np.arange(STEPS) * STEP_US / 1e6
    events = events_of({"a": along(x_m + 4 + bumper_m, change()), "b": along(x_m, 0.0)})
    assert bool(events and events[0].countable) == (bumper_m / speed_mps < 0.9 and speed_mps > 30 / 3.6 + 0.5)
