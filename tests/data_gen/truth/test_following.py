"""Who followed whom? Hand-made gaps, and a slow step-by-step oracle on random traffic."""

import numpy as np
import pytest

from data_gen.simulation.states import FloatArray
from data_gen.truth.event import TruthEvent
from data_gen.truth.following import find_following
from data_gen.truth.motion import TruthTables
from tests.data_gen.truth_support import STEP_US, Drive, along, motorway, tables_of

STEPS = 300
LEADER_M = 100 + 20.0 * np.arange(STEPS) * STEP_US / 1e6


def events_of(drives: dict[str, Drive]) -> list[TruthEvent]:
    return list(find_following(tables_of(drives, motorway())))


def behind(bumper_m: FloatArray | float) -> FloatArray:
    """Give a 4 m long vehicle's centre so far behind the leader, bumper to bumper."""
    return LEADER_M - 4.0 - bumper_m


def between(start: int, end: int, near_m: float, far_m: float) -> FloatArray:
    """Give a gap that is near from one step to another and quickly far elsewhere."""
    return np.interp(np.arange(STEPS), [start - 8, start, end, end + 8], [far_m, near_m, near_m, far_m])


def test_a_steady_gap_of_two_seconds_is_following() -> None:
    (event,) = events_of({"a": along(behind(between(50, 200, 40, 90)), 0.0), "b": along(LEADER_M, 0.0)})
    assert (event.type, event.roles, event.countable) == ("follow", {"follower": "a", "leader": "b"}, True)
    assert abs(event.start_us - 47 * STEP_US) < 700_000
    assert abs(event.end_us - 204 * STEP_US) < 700_000


def test_a_gap_below_a_second_is_tailgating_as_well() -> None:
    events = events_of({"a": along(behind(between(50, 200, 10, 90)), 0.0), "b": along(LEADER_M, 0.0)})
    assert [(event.type, event.countable) for event in events] == [("follow", True), ("tailgating", True)]


def test_the_next_lane_is_not_followed() -> None:
    assert events_of({"a": along(behind(30), 3.5), "b": along(LEADER_M, 0.0)}) == []


def test_somebody_in_between_is_followed_instead() -> None:
    drives = {"a": along(behind(40), 0.0), "b": along(LEADER_M, 0.0), "c": along(behind(15), 0.0)}
    pairs = {event.vehicles for event in events_of(drives) if event.type == "follow"}
    assert pairs == {("a", "c"), ("c", "b")}


@pytest.mark.parametrize(
    ("steps", "countable"), [pytest.param((50, 125), True, id="7 s"), pytest.param((50, 97), False, id="5 s")]
)
def test_what_lasts_about_five_seconds_does_not_count(steps: tuple[int, int], countable: bool) -> None:
    (event,) = events_of({"a": along(behind(between(*steps, 40, 200)), 0.0), "b": along(LEADER_M, 0.0)})
    assert event.countable == countable


def test_two_seconds_behind_are_no_following() -> None:
    assert events_of({"a": along(behind(between(50, 68, 40, 200)), 0.0), "b": along(LEADER_M, 0.0)}) == []


def test_a_gap_that_wavers_about_the_limit_does_not_count() -> None:
    wavering = between(50, 250, 60, 120)
    wavering[50:250] += 2 * np.sin(np.arange(200) / 30)
    (event,) = events_of({"a": along(behind(wavering), 0.0), "b": along(LEADER_M, 0.0)})
    assert event.why_not_countable == "the time gap, the speed or the lane is near to what decides"


def test_following_lasts_while_both_are_seen() -> None:
    follower = Drive(np.column_stack((behind(40), np.zeros(STEPS))), unseen=slice(0, 100))
    (event,) = events_of({"a": follower, "b": along(LEADER_M, 0.0)})
    assert event.start_us == 100 * STEP_US


def test_a_clip_that_ends_meanwhile_leaves_it_out_of_the_count() -> None:
    (event,) = events_of({"a": along(behind(between(50, 400, 40, 200)), 0.0), "b": along(LEADER_M, 0.0)})
    assert event.why_not_countable == "the clip ends less than 1 s after the event"


def oracle(tables: TruthTables, gap_s: float, least_mps: float) -> dict[tuple[str, str], set[int]]:
    """Steps at which a pair is short of gap: each vehicle alone, looking through all others."""
    motion = tables
    found: dict[tuple[str, str], set[int]] = {}
    for step in range(len(motion.t_us)):
        for a, name in enumerate(motion.ids):
            nearest, leader = np.inf, None
            for b, other in enumerate(motion.ids):
                if b != a and motion.lane[step, a] == motion.lane[step, b] >= 0:
                    free_m = motion.along_m[step, b] - motion.along_m[step, a] - 4.0
                    if -1.0 < free_m < nearest:
                        nearest, leader = free_m, other
            speed_mps = motion.speed_mps[step, a]
            if leader is not None and speed_mps > least_mps and nearest < gap_s * speed_mps:
                found.setdefault((name, leader), set()).add(step)
    return found


@pytest.mark.parametrize("seed", range(4))
def test_every_event_that_counts_is_one_of_the_oracle(seed: int) -> None:
    rng = np.random.default_rng(seed)
    drives: dict[str, Drive] = {}
    for number in range(7):
        speed_mps = 18 + np.cumsum(rng.normal(0, 0.15, STEPS))
        x_m = rng.uniform(50, 400) + np.cumsum(speed_mps) * STEP_US / 1e6
        drives[f"v{number}"] = along(x_m, 3.5 * int(rng.integers(2)))
    tables = tables_of(drives, motorway())
    short = oracle(tables, 3.0, 2.0)
    counted = [event for event in find_following(tables) if event.type == "follow"]
    told = {event.vehicles: set[int]() for event in counted}
    for event in counted:
        steps = set(range(event.start_us // STEP_US, event.end_us // STEP_US))
        told[event.vehicles] |= steps
        if event.countable:
            assert steps <= short[event.vehicles]
    long_runs = {
        pair: steps for pair, steps in short.items() if len(steps) > 60 and max(steps) - min(steps) < len(steps)
    }
    assert set(long_runs) <= set(told)
    assert counted
