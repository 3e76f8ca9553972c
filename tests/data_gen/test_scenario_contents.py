"""Each scenario holds what it is made for, and the hard negatives nothing else."""

import itertools

import numpy as np
import pytest

from data_gen.scenarios.catalogue import scenario_named
from data_gen.simulation.demand import draw_departures
from data_gen.simulation.states import VehicleStates
from tests.data_gen.scenario_clips import Clip, clip, lane_changes, lane_sequences, moving, order_flips, tracks

ARMS = ("north", "east", "south", "west")


def gaps_ahead_m(step: VehicleStates) -> list[float]:
    """Distance between centres of each pair with the same heading on a straight road, neighbours only."""
    gaps: list[float] = []
    for sign in (1, -1):
        along_m = np.sort([step.centre_m[row, 0] for row in moving(step) if np.cos(step.heading_rad[row]) * sign > 0])
        gaps += np.diff(along_m).tolist()
    return gaps


def attempts_given_up(played: Clip) -> int:
    """Count who comes beside the rear of a slower one from behind, out of its lane, and is behind again later."""
    columns = {name: column for column, name in enumerate(tracks(played.states))}
    place_m = np.full((len(played.states), len(columns), 2), np.nan)
    length_m = np.zeros(len(columns))
    for number, step in enumerate(played.states):
        for row in moving(step):
            if np.cos(step.heading_rad[row]) > 0:
                place_m[number, columns[step.ids[row]]] = step.centre_m[row]
                length_m[columns[step.ids[row]]] = step.length_m[row]
    count = 0
    for a, b in itertools.permutations(range(len(columns)), 2):
        ahead_m, left_m = np.moveaxis(place_m[:, b] - place_m[:, a], 1, 0)
        reach_m = (length_m[a] + length_m[b]) / 2
        beside = np.flatnonzero((ahead_m > 0) & (ahead_m < reach_m) & (np.abs(left_m) > 2))
        behind = (ahead_m > reach_m + 2) & (np.abs(left_m) < 1)
        if len(beside) and not (ahead_m < 0).any():
            count += int(behind[: beside[0]].any() and behind[beside[-1] :].any())
    return count


@pytest.mark.long
def test_blocked_drivers_follow_and_do_not_overtake() -> None:
    played = clip("rural_overtaking", {"blocked": "1"}, seconds=60)
    assert order_flips(played) == []
    assert np.mean([sum(gap_m < 40 for gap_m in gaps_ahead_m(step)) for step in played.states]) > 5


@pytest.mark.long
def test_aborted_overtakes_go_beside_the_other_and_back() -> None:
    assert attempts_given_up(clip("rural_overtaking", {"aborted": "1"}, seconds=90, seed=3)) >= 3


@pytest.mark.long
def test_nobody_gives_up_unless_asked_to() -> None:
    assert attempts_given_up(clip("rural_overtaking", {}, seconds=60, seed=3)) == 0


def test_platoons_depart_together_behind_a_slow_vehicle() -> None:
    scenario = scenario_named("rural_overtaking", {"platoons": "1"})
    departures = draw_departures(scenario, until_us=3_600_000_000, rng=np.random.default_rng(1))
    eastbound = [item for item in departures if item.flow.from_edge == "eastbound"]
    assert len(eastbound) == pytest.approx(0.18 * 3600, rel=0.15)
    for first in range(0, len(eastbound) - 4, 4):
        platoon = eastbound[first : first + 4]
        assert platoon[0].kind.name == "slow car"
        gaps_us = np.diff([item.depart_us for item in platoon])
        assert gaps_us == pytest.approx(2_500_000, abs=1000)


@pytest.mark.long
def test_following_only_has_followers_and_no_change_of_order() -> None:
    played = clip("following_only", {}, seconds=60)
    assert order_flips(played) == []
    assert np.mean([sum(gap_m < 60 for gap_m in gaps_ahead_m(step)) for step in played.states]) > 5


@pytest.mark.long
def test_meeting_only_has_meetings_and_neither_followers_nor_changes_of_order() -> None:
    played = clip("meeting_only", {}, seconds=60)
    assert order_flips(played) == []
    assert min(gap_m for step in played.states for gap_m in gaps_ahead_m(step)) > 50
    assert meetings(played) >= 20


def meetings(played: Clip) -> int:
    """Count pairs of opposite heading whose order along the road changes."""
    first, last = played.states[0], played.states[-1]
    at_end = {name: row for row, name in enumerate(last.ids)}
    rows = [(row, at_end[name]) for row, name in enumerate(first.ids) if name in at_end]
    east = [pair for pair in rows if np.cos(first.heading_rad[pair[0]]) > 0]
    west = [pair for pair in rows if np.cos(first.heading_rad[pair[0]]) < 0]
    return sum(
        first.centre_m[a[0], 0] < first.centre_m[b[0], 0] and last.centre_m[a[1], 0] > last.centre_m[b[1], 0]
        for a in east
        for b in west
    )


@pytest.mark.long
def test_parked_cars_are_passed_and_nobody_else_is() -> None:
    played = clip("parked_car", {}, seconds=120)
    flips = order_flips(played)
    assert len(flips) >= 5
    assert max(flip.passed_mps for flip in flips) < 0.1
    stood = [name for name, track in tracks(played.states).items() if (track[:, 4] < 0.1).sum() > 600]
    assert {flip.passed for flip in flips} <= set(stood)


@pytest.mark.long
def test_a_stopping_car_arrives_and_draws_to_the_side() -> None:
    played = clip("parked_car", {}, seconds=60)
    arriving = [
        track for track in tracks(played.states).values() if track[0, 4] > 5 and (track[:, 4] < 0.01).sum() > 50
    ]
    assert len(arriving) == 1
    assert arriving[0][-1, 2] == pytest.approx(-1.75 - 0.8, abs=0.1)


@pytest.mark.long
def test_lane_change_only_has_lane_changes_and_no_change_of_order() -> None:
    played = clip("lane_change_only", {}, seconds=60)
    assert order_flips(played) == []
    assert lane_changes(played.states) >= 20


@pytest.mark.long
def test_queue_passing_has_passes_of_those_who_stand_or_creep_alone() -> None:
    flips = order_flips(clip("queue_passing", {}, seconds=60))
    assert len(flips) >= 20
    assert max(flip.passed_mps for flip in flips) <= 2.0
    assert sum(flip.passed_mps < 0.1 for flip in flips) >= 5


@pytest.mark.long
@pytest.mark.parametrize(("lights", "demand"), [("fixed", "normal"), ("actuated", "high")])
def test_every_arm_of_the_junction_has_a_queue_at_red(lights: str, demand: str) -> None:
    played = clip("junction", {"lights": lights, "demand": demand}, seconds=90)
    standing = dict.fromkeys(ARMS, 0)
    for step in played.states:
        for arm in ARMS:
            count = sum(
                lane.startswith(f"{arm}_in") and speed_mps < 0.1
                for lane, speed_mps in zip(step.lanes, step.speed_mps.tolist(), strict=True)
            )
            standing[arm] = max(standing[arm], count)
    assert min(standing.values()) >= 4, standing


@pytest.mark.long
def test_all_turns_occur_at_the_junction() -> None:
    turns = {
        (ARMS.index(out.split("_")[0]) - ARMS.index(inward.split("_")[0])) % 4
        for lanes in lane_sequences(clip("junction", {}, seconds=60).states).values()
        for inward, out in itertools.pairwise(lanes)
        if "_in_" in inward and "_out_" in out
    }
    assert turns == {1, 2, 3}


@pytest.mark.long
def test_the_motorway_has_passes_and_drivers_who_return_to_the_right() -> None:
    played = clip("motorway", {}, seconds=60)
    to_the_right = sum(
        int(before[-1]) > int(after[-1])
        for lanes in lane_sequences(played.states).values()
        for before, after in itertools.pairwise(lanes)
    )
    assert len(order_flips(played)) >= 20
    assert to_the_right >= 5


@pytest.mark.long
def test_a_jam_stands_on_one_carriageway_and_the_other_flows() -> None:
    first = clip("motorway", {"jam": "1"}, seconds=2).states[0]
    near = np.abs(first.centre_m[:, 0] - 980.0) < 100
    eastbound = np.array([lane.startswith("eastbound") for lane in first.lanes])
    assert (near & eastbound & (first.speed_mps < 1.0)).sum() >= 30
    assert first.speed_mps[~eastbound].min() > 15


@pytest.mark.long
def test_cars_park_beside_the_country_road_and_the_junction_if_asked_for() -> None:
    for scenario in ("rural_overtaking", "junction"):
        names = clip(scenario, {"parked": "1"}, seconds=1).states[0].ids
        assert sum(name.startswith("parked") for name in names) >= 15


def test_one_carriageway_of_the_motorway_can_be_empty() -> None:
    lanes = {lane for step in clip("motorway", {"carriageways": "1"}, seconds=10).states for lane in step.lanes}
    assert all(lane.startswith("eastbound") for lane in lanes)


@pytest.mark.long
def test_the_roundabout_is_driven_counter_clockwise_and_some_wait() -> None:
    played = clip("roundabout", {"demand": "high"}, seconds=60)
    for step in played.states:
        on_ring = [row for row in moving(step) if step.lanes[row].startswith("ring_")]
        for row in on_ring:
            x_m, y_m = step.centre_m[row]
            assert x_m * np.sin(step.heading_rad[row]) - y_m * np.cos(step.heading_rad[row]) > 0
    waiting = {
        step.ids[row]
        for step in played.states
        for row in moving(step)
        if "_in_" in step.lanes[row] and step.speed_mps[row] < 0.1
    }
    assert len(waiting) >= 3


@pytest.mark.long
def test_parked_cars_of_the_town_stand_still_beside_the_road() -> None:
    played = clip("urban_grid", {}, seconds=5)
    first, last = played.states[0], played.states[-1]
    parked = [row for row, name in enumerate(first.ids) if name.startswith("parked")]
    at_end = [last.ids.index(first.ids[row]) for row in parked]
    assert len(parked) >= 15
    np.testing.assert_array_equal(first.centre_m[parked], last.centre_m[at_end])
    without = clip("urban_grid", {"parked": "0"}, seconds=1)
    assert not any(name.startswith("parked") for name in without.states[0].ids)
