"""Truth events on hand-made trajectories, and against a step-by-step oracle on random ones."""

import numpy as np
import pytest

from data_gen.drawing.view import BoolArray
from data_gen.simulation.states import FloatArray
from data_gen.truth.event import TruthEvent
from data_gen.truth.events import find_events
from data_gen.truth.motion import Motion
from tests.data_gen.support import STEP_US, Track, motion_of

# 4 m cars: overlapping while the centres are at most 4 m apart along the road.
STEPS = 200
B_M = np.linspace(0.0, 100.0, STEPS)


def gap(*corners_m: float) -> FloatArray:
    """Give a's lead over b at each step, running evenly from corner to corner."""
    places = np.linspace(0, STEPS - 1, len(corners_m))
    return np.interp(np.arange(STEPS), places, corners_m)


def everywhere(motion: Motion) -> BoolArray:
    return np.ones(motion.road.shape, dtype=np.bool_)


def events_of(gap_m: FloatArray, *, b: Track | None = None, visible: BoolArray | None = None) -> tuple[TruthEvent, ...]:
    motion = motion_of({"a": Track(B_M + gap_m), "b": b if b is not None else Track(B_M)})
    return find_events(motion, everywhere(motion) if visible is None else visible)


def test_a_pair_that_swaps_places_is_one_countable_overtake_and_pass() -> None:
    gap_m = gap(-20, 20)
    event, passing = events_of(gap_m)
    assert (passing.type, passing.start_us, passing.end_us) == ("pass", event.start_us, event.end_us)
    assert passing.roles == {"passer": "a", "passed": "b"}
    assert (event.type, event.actor, event.other, event.countable) == ("overtake", "a", "b", True)
    assert event.start_us == int(np.argmax(gap_m >= -4)) * STEP_US
    assert event.end_us == int(np.argmax(gap_m > 4)) * STEP_US


def test_falling_back_out_of_the_overlap_is_an_aborted_overtake() -> None:
    (event,) = events_of(gap(-20, 0, -20))
    assert (event.type, event.actor, event.other) == ("aborted_overtake", "a", "b")


def test_wavering_inside_the_overlap_does_not_split_an_overtake() -> None:
    assert [event.type for event in events_of(gap(-20, 3, -3, 20))] == ["overtake", "pass"]


def test_driving_behind_is_no_event() -> None:
    assert events_of(gap(-20, -5, -20)) == ()


def test_meeting_oncoming_traffic_is_no_event() -> None:
    assert events_of(gap(-20, 20), b=Track(B_M, direction=-1)) == ()


def test_a_standing_vehicle_is_passed_not_overtaken() -> None:
    (event,) = events_of(gap(-20, 20), b=Track(B_M, speed_mps=1.5))
    assert (event.type, event.countable) == ("pass", True)


def test_creeping_past_a_queue_is_nothing() -> None:
    motion = motion_of({"a": Track(B_M + gap(-20, 20), speed_mps=1.0), "b": Track(B_M, speed_mps=1.0)})
    assert find_events(motion, everywhere(motion)) == ()


def test_an_overtaken_at_about_the_speed_of_standing_leaves_the_overtake_open() -> None:
    overtake, passing = events_of(gap(-20, 20), b=Track(B_M, speed_mps=2.3))
    assert (overtake.type, overtake.why_not_countable) == ("overtake", "the overtaken is at about 2 m/s")
    assert (passing.type, passing.countable) == ("pass", True)


def test_two_overtakes_of_one_pair_are_both_found() -> None:
    events = events_of(gap(-20, 20, -20, 20))
    overtakes = [event for event in events if event.type != "pass"]
    assert [(event.type, event.actor) for event in overtakes] == [
        ("overtake", "a"),
        ("overtake", "b"),
        ("overtake", "a"),
    ]


@pytest.mark.parametrize(
    ("gap_m", "actor", "reason"),
    [
        pytest.param(gap(0, 40), "a", "the clip starts during the overlap", id="overlapping-at-clip-start"),
        pytest.param(gap(-40, 0), "a", "the clip ends during the overlap", id="overlapping-at-clip-end"),
        pytest.param(gap(40, 0), "b", "the clip ends during the overlap", id="overtaken-at-clip-end"),
        pytest.param(gap(-6, 40), "a", "the clip starts less than 1 s before the core", id="late-start"),
        pytest.param(gap(-40, 6), "a", "the clip ends less than 1 s after the core", id="early-end"),
    ],
)
def test_a_core_cut_by_the_clip_does_not_count(gap_m: FloatArray, actor: str, reason: str) -> None:
    event, _ = events_of(gap_m)
    assert (event.type, event.actor, event.countable) == ("overtake", actor, False)
    assert event.why_not_countable == reason


def test_an_overlap_without_a_seen_end_is_nobodys_overtake() -> None:
    assert events_of(gap(-1, 1)) == ()


def test_a_pair_in_view_only_during_the_core_does_not_count() -> None:
    gap_m = gap(-20, 20)
    visible = np.column_stack((np.abs(gap_m) <= 4, np.ones(STEPS, dtype=np.bool_)))
    event, _ = events_of(gap_m, visible=visible)
    assert not event.countable
    assert event.why_not_countable == "the overtaker is not in view from 1 s before to 1 s after the core"


def test_what_happens_out_of_view_is_left_out() -> None:
    assert events_of(gap(-20, 20), visible=np.zeros((STEPS, 2), dtype=np.bool_)) == ()


def test_a_car_that_turns_off_beside_another_has_not_been_overtaken() -> None:
    along_m = B_M.copy()
    gap_m = gap(-20, 20)
    along_m[np.abs(gap_m) < 1] = np.nan
    along_m[gap_m >= 1] = np.nan
    assert events_of(gap_m, b=Track(along_m)) == ()


def test_the_manoeuvre_runs_from_leaving_the_lane_to_being_back() -> None:
    gap_m = gap(-20, 20)
    motion = motion_of({"a": Track(B_M + gap_m), "b": Track(B_M)})
    motion.lane[50:170, 0] = 1
    event, _ = find_events(motion, everywhere(motion))
    assert (event.manoeuvre_start_us, event.manoeuvre_end_us) == (50 * STEP_US, 170 * STEP_US)


def test_a_manoeuvre_that_began_before_the_clip_has_no_start() -> None:
    motion = motion_of({"a": Track(B_M + gap(-20, 20)), "b": Track(B_M)})
    motion.lane[:, 0] = 1
    event, _ = find_events(motion, everywhere(motion))
    assert (event.manoeuvre_start_us, event.manoeuvre_end_us) == (None, None)


def oracle(motion: Motion) -> set[tuple[str, str, str, int, int]]:
    """Walk each ordered pair step by step, remembering where a was before the overlap and when it began."""
    found: set[tuple[str, str, str, int, int]] = set()
    for a in range(len(motion.ids)):
        for b in range(len(motion.ids)):
            if a != b:
                found |= _oracle_pair(motion, a, b)
    return found


def _oracle_pair(motion: Motion, a: int, b: int) -> set[tuple[str, str, str, int, int]]:
    found: set[tuple[str, str, str, int, int]] = set()
    was_behind, start, standing = False, -1, False
    for step in range(len(motion.t_us)):
        gap_m = motion.along_m[step, a] - motion.along_m[step, b]
        together = motion.road[step, a] == motion.road[step, b] >= 0
        together &= motion.direction[step, a] == motion.direction[step, b]
        if not together:
            was_behind, start = False, -1
        elif abs(gap_m) <= (motion.length_m[a] + motion.length_m[b]) / 2:
            if was_behind and start < 0:
                start, standing = step, False
            standing |= motion.speed_mps[step, b] <= 2
        else:
            if start >= 0:
                kinds = ["aborted_overtake"] if gap_m < 0 else ["pass", "overtake"]
                if standing:
                    kinds = [kind for kind in kinds if kind == "pass"]
                if motion.speed_mps[step, a] <= 2:
                    kinds = []
                core_us = (start * STEP_US, step * STEP_US)
                found |= {(kind, motion.ids[a], motion.ids[b], *core_us) for kind in kinds}
            was_behind, start = gap_m < 0, -1
    return found


@pytest.mark.parametrize("seed", range(8))
def test_random_trajectories_give_the_events_of_the_oracle(seed: int) -> None:
    rng = np.random.default_rng(seed)
    tracks: dict[str, Track] = {}
    for number in range(8):
        along_m = np.cumsum(rng.normal(0, 1.2, 600)) + rng.normal(0, 8)
        away = int(rng.integers(600))
        along_m[away : away + int(rng.integers(80))] = np.nan
        speed_mps = float(rng.choice((1.0, 15.0)))
        length_m = float(rng.uniform(3, 10))
        direction = int(rng.choice((1, 1, -1)))
        tracks[f"v{number}"] = Track(along_m, length_m=length_m, direction=direction, speed_mps=speed_mps)
    motion = motion_of(tracks)
    complete = [
        event
        for event in find_events(motion, everywhere(motion))
        if "during the overlap" not in (event.why_not_countable or "")
    ]
    found = {(event.type, event.actor, event.other, event.start_us, event.end_us) for event in complete}
    assert found == oracle(motion)
    assert len(found) == len(complete)
    assert len(found) > 20
