"""Traffic as SUMO drives it: smooth, possible, repeatable, and libsumo closed afterwards."""

import dataclasses
from pathlib import Path

import libsumo
import numpy as np
import pytest

from data_gen.errors import DataGenError
from data_gen.scenarios.catalogue import scenario_named
from data_gen.simulation.simulate import simulate
from data_gen.simulation.states import FloatArray, VehicleStates
from data_gen.truth.motion import Motion, tabulate
from gis.roads.sumo_net import read_sumo_net

SECOND_US = 1_000_000
STEP_US = 40_000
SCENARIO = scenario_named("rural_overtaking")


def run(seed: int, seconds: int) -> tuple[VehicleStates, ...]:
    rng = np.random.default_rng(seed)
    return simulate(SCENARIO, seed=seed, rng=rng, duration_us=seconds * SECOND_US, step_us=STEP_US)


@pytest.fixture(scope="module")
def minute() -> tuple[VehicleStates, ...]:
    return run(3, 60)


@pytest.fixture(scope="module")
def motion(minute: tuple[VehicleStates, ...]) -> Motion:
    return tabulate(minute, read_sumo_net(SCENARIO.network_file))


def per_vehicle(states: tuple[VehicleStates, ...], values: str) -> dict[str, FloatArray]:
    rows: dict[str, list[FloatArray]] = {}
    for step in states:
        for vehicle_id, value in zip(step.ids, getattr(step, values), strict=True):
            rows.setdefault(vehicle_id, []).append(value)
    return {vehicle_id: np.array(values) for vehicle_id, values in rows.items()}


def test_steps_are_evenly_spaced_from_zero(minute: tuple[VehicleStates, ...]) -> None:
    assert [step.t_us for step in minute] == list(range(0, 60 * SECOND_US, STEP_US))


def test_cars_are_in_view_from_the_first_step(minute: tuple[VehicleStates, ...]) -> None:
    in_view = np.abs(minute[0].centre_m[:, 0] - 500) < 300
    assert in_view.sum() >= 3


def test_nobody_jumps_sideways_or_turns_at_once(minute: tuple[VehicleStates, ...]) -> None:
    sideways_m = [np.abs(np.diff(track[:, 1])).max(initial=0) for track in per_vehicle(minute, "centre_m").values()]
    turns_rad = [
        np.abs(np.sin(np.diff(heading))).max(initial=0) for heading in per_vehicle(minute, "heading_rad").values()
    ]
    assert max(sideways_m) < 0.15
    assert np.degrees(max(turns_rad)) < 1.5


def test_bodies_point_where_they_drive(minute: tuple[VehicleStates, ...]) -> None:
    centres_m, headings_rad = per_vehicle(minute, "centre_m"), per_vehicle(minute, "heading_rad")
    for vehicle_id, track_m in centres_m.items():
        step_m = np.diff(track_m, axis=0)
        forward = np.column_stack((np.cos(headings_rad[vehicle_id]), np.sin(headings_rad[vehicle_id])))[1:]
        slip = step_m[:, 0] * forward[:, 1] - step_m[:, 1] * forward[:, 0]
        assert np.abs(slip).max(initial=0) < 0.1


def test_no_two_bodies_touch(minute: tuple[VehicleStates, ...]) -> None:
    for step in minute[::5]:
        gap_m = np.abs(step.centre_m[:, None] - step.centre_m[None]) - np.stack(
            [(size_m[:, None] + size_m[None]) / 2 for size_m in (step.length_m, step.width_m)], axis=2
        )
        assert (gap_m.max(axis=2) > 0)[~np.eye(len(step.ids), dtype=np.bool_)].all()


def test_nobody_brakes_as_in_an_emergency(motion: Motion) -> None:
    assert np.nanmin(np.diff(motion.speed_mps, axis=0)) / (STEP_US / SECOND_US) > -6.0


def test_everybody_stays_on_the_road(motion: Motion) -> None:
    assert ((motion.road >= 0) == np.isfinite(motion.speed_mps)).all()


@pytest.mark.long
def test_a_longer_clip_begins_with_the_shorter_one(minute: tuple[VehicleStates, ...]) -> None:
    short = run(3, 5)
    for step, same in zip(short, minute, strict=False):
        assert step.ids == same.ids
        np.testing.assert_array_equal(step.centre_m, same.centre_m)


def test_another_seed_gives_other_traffic(minute: tuple[VehicleStates, ...]) -> None:
    assert not np.array_equal(run(4, 1)[0].centre_m, minute[0].centre_m)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"seed": -1}, "seed: expected 0 to 2147483647, got -1"),
        ({"duration_us": 0}, "duration: expected at least one step of 40000 us, got 0 us"),
        ({"step_us": 40_500}, "step: expected whole milliseconds from 1 to 100, got 40500 us"),
        ({"step_us": 200_000}, "step: expected whole milliseconds from 1 to 100, got 200000 us"),
    ],
    ids=["seed", "duration", "fraction", "too-long"],
)
def test_bad_arguments_are_refused(change: dict[str, int], message: str) -> None:
    arguments = {"seed": 1, "duration_us": SECOND_US, "step_us": STEP_US} | change
    with pytest.raises(DataGenError, match=message):
        simulate(SCENARIO, rng=np.random.default_rng(1), **arguments)


@pytest.mark.long
def test_libsumo_is_closed_after_a_failure() -> None:
    broken = dataclasses.replace(SCENARIO, network_file=Path("missing.net.xml"))
    with pytest.raises(DataGenError, match="expected SUMO to run it"):
        simulate(broken, seed=1, rng=np.random.default_rng(1), duration_us=SECOND_US, step_us=STEP_US)
    assert not libsumo.isLoaded()
    run(1, 1)
    assert not libsumo.isLoaded()


def test_nothing_is_printed(capfd: pytest.CaptureFixture[str]) -> None:
    run(1, 1)
    assert capfd.readouterr() == ("", "")
