"""Who nearly collided with whom? Hand-made approaches, and contact times against small steps of two rectangles."""

import numpy as np
import pytest
import shapely
from shapely import affinity

from data_gen.simulation.states import FloatArray
from data_gen.truth.event import TruthEvent
from data_gen.truth.near_miss import _Bodies, contact_s, find_near_misses
from tests.cases import for_each
from tests.data_gen.truth_support import STEP_US, Drive, along, crossroads, motorway, tables_of

STEPS = 120
TIME_S = np.arange(STEPS) * STEP_US / 1e6


def events_of(drives: dict[str, Drive]) -> list[TruthEvent]:
    return list(find_near_misses(tables_of(drives, motorway())))


def braking_behind(gap_m: float, *, braking_mps2: float) -> FloatArray:
    """Come up from behind at 30 m/s to a car at 10 m/s, until 5 s, then brake to its speed."""
    speed_mps = np.clip(30.0 - braking_mps2 * np.maximum(TIME_S - 5.0, 0.0), 10.0, 30.0)
    driven_m = np.concatenate(([0.0], np.cumsum((speed_mps[1:] + speed_mps[:-1]) / 2 * STEP_US / 1e6)))
    return driven_m - driven_m[50] + (500.0 + 50.0 - 4.0 - gap_m)


AHEAD = along(500.0 + 10.0 * TIME_S, 0.0)


def test_braking_at_the_last_moment_is_a_near_miss() -> None:
    (event,) = events_of({"a": AHEAD, "b": along(braking_behind(26.0, braking_mps2=9.0), 0.0)})
    assert (event.type, event.vehicles, event.countable) == ("near_miss", ("a", "b"), True)
    # 26 m at a closing speed of 20 m/s are 1.3 s: 1.5 s were left 0.2 s earlier.
    assert event.start_us == pytest.approx(4_800_000, abs=STEP_US)
    assert 5_500_000 < event.end_us < 7_500_000


def test_braking_in_time_is_none() -> None:
    assert events_of({"a": AHEAD, "b": along(braking_behind(90.0, braking_mps2=3.0), 0.0)}) == []


def test_passing_in_the_next_lane_is_none() -> None:
    assert events_of({"a": AHEAD, "b": along(braking_behind(26.0, braking_mps2=0.0), 3.5)}) == []


def test_a_near_miss_out_of_view_does_not_count() -> None:
    unseen = along(braking_behind(26.0, braking_mps2=9.0), 0.0, unseen=slice(60, STEPS))  # type: ignore[arg-type]
    assert [event.countable for event in events_of({"a": AHEAD, "b": unseen})] == [False]


def test_about_a_second_and_a_half_does_not_count() -> None:
    events = events_of({"a": AHEAD, "b": along(braking_behind(30.0, braking_mps2=9.0), 0.0)})
    assert [event.why_not_countable for event in events] == [
        "the time to contact or the braking is near to what decides"
    ]


def test_two_that_nearly_meet_in_a_junction() -> None:
    """Both cross at 15 m/s, one 1 s after the other has stopped 3 m short of its way."""
    x_m = -60.0 + 15.0 * TIME_S
    y_m = np.where(TIME_S < 3.0, -60.0 + 15.0 * TIME_S, -15.0 + 15.0 * np.minimum(TIME_S - 3.0, 0.2))
    crossing = {
        "a": Drive(np.column_stack((x_m, np.full(STEPS, -2.0)))),
        "b": Drive(np.column_stack((np.full(STEPS, 2.0), y_m))),
    }
    events = list(find_near_misses(tables_of(crossing, crossroads())))
    assert [set(event.vehicles) for event in events] == [{"a", "b"}]


@pytest.mark.long
@for_each("seed", range(20))
def test_contact_is_when_two_rectangles_first_touch(seed: int) -> None:
    rng = np.random.default_rng(seed)

    def body() -> _Bodies:
        low, high = [-15.0, -15.0, -np.pi, -12.0, -12.0, 2.0, 1.0], [15.0, 15.0, np.pi, 12.0, 12.0, 12.0, 3.0]
        return _Bodies(*(np.array([value]) for value in rng.uniform(low, high)))

    def at(one: _Bodies, t_s: float) -> shapely.Geometry:
        half_m = float(one.length_m[0]) / 2, float(one.width_m[0]) / 2
        box = affinity.rotate(
            shapely.box(-half_m[0], -half_m[1], *half_m), float(one.heading_rad[0]), (0, 0), use_radians=True
        )
        return affinity.translate(box, float(one.x_m[0] + t_s * one.vx_mps[0]), float(one.y_m[0] + t_s * one.vy_mps[0]))

    a, b = body(), body()
    times_s = np.arange(0.0, 4.0, 0.01)
    touching = [t_s for t_s in times_s if at(a, t_s).intersects(at(b, t_s))]
    contact = float(contact_s(a, b)[0])
    assert (contact < 3.985) == bool(touching)
    assert contact == pytest.approx(touching[0], abs=0.011) if touching else contact > 3.98
