"""Who drove past waiting vehicles and got in before them? Hand-made queues on a road with two lanes one way."""

import numpy as np
import pytest

from data_gen.truth.event import TruthEvent
from data_gen.truth.events import find_events
from data_gen.truth.queue_jump import find_queue_jumps
from tests.data_gen.truth_support import STEP_US, along, motorway, tables_of

STEPS = 200
TIME_S = np.arange(STEPS) * STEP_US / 1e6
JUMPER_M = 400 + 10.0 * TIME_S  # beside a queue that ends at 480 m from 7.6 s on


def jumps(*queue_m: float, lane_at_s: float = 11.0, queue_mps: float = 0.0) -> list[TruthEvent]:
    """Let a car pass the queue in the left lane and come into the right one about a time."""
    y_m = np.interp(TIME_S, [lane_at_s - 1.0, lane_at_s + 1.0], [3.5, 0.0])
    queue = {f"q{place}": along(x_m + queue_mps * TIME_S, 0.0) for place, x_m in enumerate(queue_m)}
    tables = tables_of({"j": along(JUMPER_M, y_m)} | queue, motorway())
    return list(find_queue_jumps(tables, find_events(tables, tables.seen)))


def test_who_passes_two_that_wait_and_gets_in_before_them_jumps_the_queue() -> None:
    (event,) = jumps(480.0, 487.0)
    assert event.roles == {"jumper": "j", "last": "q0", "first": "q1"}
    assert (event.type, event.countable, event.places) == ("queue_jump", True, (("lane", "e_0"),))
    assert event.start_us == pytest.approx(7_600_000, abs=STEP_US)
    assert event.end_us == pytest.approx(11_000_000, abs=2 * STEP_US)


def test_of_a_longer_queue_the_last_two_passed_count() -> None:
    assert [event.vehicles for event in jumps(473.0, 480.0, 487.0)] == [("j", "q2", "q1")]


@pytest.mark.parametrize(
    ("queue_m", "lane_at_s", "queue_mps"),
    [((487.0,), 11.0, 0.0), ((480.0, 487.0), 25.0, 0.0), ((450.0, 457.0), 13.0, 4.0), ((430.0, 487.0), 11.0, 0.0)],
    ids=["a single standing car", "staying in the other lane", "cars that drive", "two that stand far apart"],
)
def test_what_is_no_queue_jump(queue_m: tuple[float, ...], lane_at_s: float, queue_mps: float) -> None:
    assert jumps(*queue_m, lane_at_s=lane_at_s, queue_mps=queue_mps) == []


def test_a_queue_that_creeps_at_about_two_metres_a_second_does_not_count() -> None:
    (event,) = jumps(460.0, 467.0, lane_at_s=13.0, queue_mps=1.8)
    assert not event.countable
    assert "a car of the queue is at about 2 m/s" in (event.why_not_countable or "")
