"""Overtakes that are begun and given up: only where there is room and a reason."""

import numpy as np
import pytest

from data_gen.scenario import Attempts, Flow, VehicleKind
from data_gen.simulation.attempts import add_attempts
from data_gen.simulation.demand import Departure
from data_gen.simulation.states import FrontStates

STEP_US = 100_000
ATTEMPTS = Attempts("trying", shift_m=3.5, pause_us=60_000_000)
SPEED_MPS = 12.0
STEPS = 400


def vehicle(name: str, kind: str) -> Departure:
    made = VehicleKind(kind, "car", 1.0, (4.5, 4.5), (1.8, 1.8), ())
    return Departure(name, 0, Flow("a", "b", 1.0), made, 4.5, 1.8, 0)


def drive(*, oncoming_from_m: float | None, gap_m: float = 15.0, beside: bool = False) -> list[FrontStates]:
    """A slow car eastward, one behind it, and perhaps one that comes or one that drives beside them."""
    steps = []
    for number in range(STEPS):
        east_m = SPEED_MPS * number * STEP_US / 1e6
        rows = [("slow", "east_0", east_m, -1.75, 0.0), ("fast", "east_0", east_m - 4.5 - gap_m, -1.75, 0.0)]
        if oncoming_from_m is not None:
            rows.append(("oncoming", "west_0", oncoming_from_m - east_m, 1.75, np.pi))
        if beside:
            rows.append(("beside", "west_0", east_m - 10.0, 1.75, 0.0))
        names, lanes, x_m, y_m, heading_rad = zip(*rows, strict=True)
        steps.append(
            FrontStates(
                t_us=number * STEP_US,
                ids=names,
                lanes=lanes,
                front_m=np.column_stack((x_m, y_m)),
                lane_heading_rad=np.array(heading_rad),
                speed_mps=np.full(len(rows), SPEED_MPS),
            )
        )
    return steps


def moved(steps: list[FrontStates]) -> np.ndarray:
    """How far ahead and to the left of its old place the second car is, (steps, 2)."""
    names = ("slow", "fast", "oncoming", "beside")
    vehicles = {name: vehicle(name, "trying" if name == "fast" else "other") for name in names}
    after = add_attempts(steps, vehicles, ATTEMPTS, np.random.default_rng(1))
    return np.array([new.front_m[1] - old.front_m[1] for old, new in zip(steps, after, strict=True)])


def test_an_attempt_draws_level_and_returns_to_its_place() -> None:
    steps = drive(oncoming_from_m=480.0)
    detour_m = moved(steps)
    # 15 m to the rear bumper of the slow one, and 1 to 3 m beside it.
    assert 16.0 <= detour_m[:, 0].max() <= 18.0
    assert detour_m[:, 1].max() == pytest.approx(3.5, abs=0.01)
    np.testing.assert_allclose(detour_m[[0, -1]], 0.0, atol=1e-6)


def test_whoever_is_beside_the_other_one_is_in_the_other_lane() -> None:
    detour_m = moved(drive(oncoming_from_m=480.0))
    assert (detour_m[detour_m[:, 0] > 14.0, 1] > 2.5).all()


def test_an_attempt_is_driven_without_jerks() -> None:
    detour_m = moved(drive(oncoming_from_m=480.0))
    acceleration_mps2 = np.diff(detour_m[:, 0], n=2) / (STEP_US / 1e6) ** 2
    assert np.abs(acceleration_mps2).max() < 3.5


def test_the_speed_is_that_of_the_movement() -> None:
    steps = drive(oncoming_from_m=480.0)
    vehicles = {name: vehicle(name, "trying" if name == "fast" else "other") for name in ("slow", "fast", "oncoming")}
    after = add_attempts(steps, vehicles, ATTEMPTS, np.random.default_rng(1))
    driven_mps = np.diff([step.front_m[1, 0] for step in after]) / (STEP_US / 1e6)
    told_mps = np.array([step.speed_mps[1] for step in after])
    assert np.abs(driven_mps - (told_mps[1:] + told_mps[:-1]) / 2).max() < 0.1


@pytest.mark.parametrize(
    "steps",
    [
        drive(oncoming_from_m=None),
        drive(oncoming_from_m=2000.0),
        drive(oncoming_from_m=480.0, beside=True),
        drive(oncoming_from_m=480.0, gap_m=45.0),
    ],
    ids=["no-reason", "comes-too-late", "no-room", "too-far-behind"],
)
def test_nobody_tries_without_room_and_reason(steps: list[FrontStates]) -> None:
    assert not moved(steps).any()


@pytest.mark.long
def test_two_bodies_never_meet_in_the_other_lane() -> None:
    for oncoming_m in np.linspace(100.0, 700.0, 25):
        steps = drive(oncoming_from_m=float(oncoming_m))
        detour_m = moved(steps)
        for step, (ahead_m, left_m) in zip(steps, detour_m, strict=True):
            apart_m = abs((step.front_m[1, 0] + ahead_m - 2.25) - (step.front_m[2, 0] + 2.25))
            assert left_m < 1.3 or apart_m > 4.5
