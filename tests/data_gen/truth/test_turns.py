"""Who drove through the junction, and which way? Hand-made ways over a crossing."""

import math

import numpy as np
import pytest

from data_gen.simulation.states import FloatArray
from data_gen.truth.event import TruthEvent
from data_gen.truth.turns import find_turns, turn_type
from tests.data_gen.truth_support import STEP_US, Drive, crossroads, tables_of

ARMS = {"west": math.pi, "north": math.pi / 2, "east": 0.0, "south": -math.pi / 2}


def way(start: str, end: str, *, speed_mps: float = 8.0, far_m: float = 60.0) -> FloatArray:
    """Drive from one arm to another: straight to the junction, along a curve through it, and on."""
    corners: list[FloatArray] = []
    for name, sign in ((start, -1.0), (end, 1.0)):
        out = np.array([math.cos(ARMS[name]), math.sin(ARMS[name])])
        lane = sign * np.array([out[1], -out[0]]) * 2.0
        corners += [lane + out * far_m, lane + out * 10.0]
    first, enter, last, leave = corners
    share = np.linspace(0, 1, 40)[:, None]
    # A quadratic curve, bent towards where the two lanes would meet, or the middle where they never do.
    bend = np.array([enter[0], leave[1]]) if start in {"north", "south"} else np.array([leave[0], enter[1]])
    curve = (1 - share) ** 2 * enter + 2 * share * (1 - share) * bend + share**2 * leave
    points = np.vstack((first, curve, last))
    reached_m = np.concatenate(([0.0], np.cumsum(np.hypot(*np.diff(points, axis=0).T))))
    at_m = np.arange(0.0, reached_m[-1], speed_mps * STEP_US / 1e6)
    return np.column_stack([np.interp(at_m, reached_m, points[:, axis]) for axis in (0, 1)])


def turns_of(drive: Drive) -> list[TruthEvent]:
    return list(find_turns(tables_of({"a": drive}, crossroads())))


@pytest.mark.parametrize(
    ("start", "end", "expected"),
    [
        ("west", "east", "drive_straight"),
        ("north", "south", "drive_straight"),
        ("west", "north", "turn_left"),
        ("west", "south", "turn_right"),
        ("south", "west", "turn_left"),
        ("east", "north", "turn_right"),
        ("north", "west", "turn_right"),
        ("north", "east", "turn_left"),
    ],
)
def test_a_way_over_the_crossing_is_a_crossing_and_a_turn(start: str, end: str, expected: str) -> None:
    crossing, turn = turns_of(Drive(way(start, end)))
    assert (crossing.type, turn.type, crossing.countable, turn.countable) == ("crossing", expected, True, True)
    assert dict(turn.places) == {"junction": "x", "from": start, "to": end}


def test_the_core_is_while_the_centre_is_in_the_junction() -> None:
    centre_m = way("west", "east")
    _, turn = turns_of(Drive(centre_m))
    inside = np.flatnonzero((np.abs(centre_m) <= 10.0).all(axis=1))
    assert (turn.start_us, turn.end_us) == (inside[0] * STEP_US, (inside[-1] + 1) * STEP_US)


def test_coming_back_onto_the_same_road_is_a_u_turn() -> None:
    into, back = way("west", "east")[:120], way("east", "west")[-120:]
    into = into[into[:, 0] < 0]
    back = back[back[:, 0] < 0]
    turn_rad = np.linspace(-math.pi / 2, math.pi / 2, 12)
    round_m = np.column_stack((2.0 * np.cos(turn_rad), 2.0 * np.sin(turn_rad)))
    crossing, turn = turns_of(Drive(np.vstack((into, round_m, back))))
    assert (crossing.type, turn.type, turn.roles) == ("crossing", "u_turn", {"car": "a"})
    assert dict(turn.places) == {"junction": "x", "road": "west"}


@pytest.mark.parametrize(
    ("unseen", "is_told"),
    [pytest.param(slice(60, 62), True, id="hidden-in-the-junction"), pytest.param(slice(0, None), False, id="never")],
)
def test_a_turn_that_is_not_seen_throughout_does_not_count(unseen: slice, is_told: bool) -> None:
    events = turns_of(Drive(way("west", "east", speed_mps=8.0), unseen=unseen))
    assert bool(events) == is_told
    assert not any(event.countable for event in events)
    reason = "the car is not in view from 1 s before to 1 s after the event"
    assert all(event.why_not_countable == reason for event in events)


def test_a_clip_that_ends_right_after_the_junction_leaves_the_turn_out_of_the_count() -> None:
    centre_m = way("west", "north")
    inside = np.flatnonzero((np.abs(centre_m) <= 10.0).all(axis=1))
    crossing, turn = turns_of(Drive(centre_m[: inside[-1] + 6]))
    assert (crossing.countable, turn.countable) == (False, False)
    assert crossing.why_not_countable == "the clip ends less than 1 s after the event"


def test_who_stops_in_the_junction_for_ever_has_not_turned() -> None:
    centre_m = way("west", "east")
    stop = int(np.argmax(centre_m[:, 0] > 0))
    assert turns_of(Drive(np.vstack((centre_m[:stop], np.repeat(centre_m[stop : stop + 1], 50, axis=0))))) == []


def test_a_vehicle_that_vanishes_in_the_junction_has_not_turned() -> None:
    centre_m = way("west", "east")
    centre_m[int(np.argmax(centre_m[:, 0] > 0)) :] = np.nan
    other = Drive(np.full((len(centre_m), 2), 50.0))
    assert list(find_turns(tables_of({"a": Drive(centre_m), "b": other}, crossroads()))) == []


@pytest.mark.parametrize(("degrees", "expected"), [(44, "drive_straight"), (46, "turn_left"), (-151, "u_turn")])
def test_turns_part_at_45_and_150_degrees(degrees: int, expected: str) -> None:
    assert turn_type(math.radians(degrees), same_road=False) == expected
