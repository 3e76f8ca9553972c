"""Overlaps in junctions, which never count."""

import numpy as np

from data_gen.truth.event import TruthEvent
from data_gen.truth.events import find_junction_passes
from tests.data_gen.truth_support import STEP_US, Drive, along, crossroads, tables_of

STEPS = 120
X_M = -60 + 10.0 * np.arange(STEPS) * STEP_US / 1e6


def events_of(drives: dict[str, Drive]) -> list[TruthEvent]:
    return list(find_junction_passes(tables_of(drives, crossroads())))


def waiting(x_m: float, y_m: float) -> Drive:
    return Drive(np.tile([x_m, y_m], (STEPS, 1)), heading_rad=np.zeros(STEPS))


def test_driving_past_one_who_waits_in_the_junction_is_a_pass_that_does_not_count() -> None:
    (event,) = events_of({"a": along(X_M, -2.0), "b": waiting(0.0, 1.0)})
    assert (event.type, event.vehicles, event.countable) == ("pass", ("a", "b"), False)
    middle_us = int(np.argmin(np.abs(X_M))) * STEP_US
    assert event.start_us < middle_us < event.end_us


def test_on_the_road_it_is_left_to_others() -> None:
    assert events_of({"a": along(X_M, -2.0), "b": waiting(-40.0, -3.5)}) == []


def test_crossing_traffic_is_not_passed() -> None:
    crossing = Drive(np.column_stack((np.zeros(STEPS), X_M)))
    assert events_of({"a": along(X_M, -2.0), "b": crossing}) == []


def test_an_overlap_that_begins_on_the_road_and_ends_in_the_junction_may_be_anything() -> None:
    events = events_of({"a": along(X_M, -2.0), "b": along(-25 + 0.3 * np.arange(STEPS), -3.5)})
    assert {event.type for event in events} == {"pass", "overtake", "aborted_overtake"}
    assert not any(event.countable for event in events)
