"""Which overtakes put others at risk? Hand-made overtakes on a road with a lane each way."""

import numpy as np
import pytest

from data_gen.simulation.states import FloatArray
from data_gen.truth.event import TruthEvent
from data_gen.truth.events import find_events
from data_gen.truth.reckless import find_reckless
from gis.roads.lanes import Lane
from gis.roads.road_network import RoadNetwork
from tests.data_gen.truth_support import STEP_US, Drive, along, tables_of

STEPS = 200
TIME_S = np.arange(STEPS) * STEP_US / 1e6
OVERTAKEN_M = 500 + 15.0 * TIME_S
OVERTAKER_M = 450 + 20.0 * TIME_S  # level at 10 s, past it at 10.8 s
PAST_AT_S = 10.8
OUT_TO_S = 13.0


def two_way_road() -> RoadNetwork:
    """Give 2 km of road along the x axis, a lane each way; eastbound traffic at y = -1.75."""
    east, west = np.array([[0.0, -1.75], [2000.0, -1.75]]), np.array([[2000.0, 1.75], [0.0, 1.75]])
    return RoadNetwork(
        [Lane("e_0", "e", 0, "road", +1, east, 3.5, 25.0), Lane("w_0", "w", 0, "road", -1, west, 3.5, 25.0)]
    )


def lateral(out_to_s: float) -> FloatArray:
    return np.interp(TIME_S, [6.0, 8.0, out_to_s, out_to_s + 1.0], [-1.75, 1.75, 1.75, -1.75])


def reckless(*, oncoming_in_s: float, out_to_s: float = OUT_TO_S) -> list[TruthEvent]:
    """Let somebody come at 25 m/s who would be met so many seconds after the overtake."""
    past_m = 450 + 20.0 * PAST_AT_S + 4.0
    oncoming_m = past_m + oncoming_in_s * 45.0 - 25.0 * (TIME_S - PAST_AT_S)
    drives: dict[str, Drive] = {
        "a": along(OVERTAKER_M, lateral(out_to_s)),
        "b": along(OVERTAKEN_M, -1.75),
        "c": along(oncoming_m, 1.75),
    }
    tables = tables_of(drives, two_way_road())
    return list(find_reckless(tables, find_events(tables, tables.seen)))


def test_an_overtake_two_seconds_before_an_oncoming_car_is_reckless() -> None:
    (event,) = reckless(oncoming_in_s=2.0)
    assert event.roles == {"overtaker": "a", "overtaken": "b", "danger": "c"}
    assert (event.type, event.countable) == ("reckless_overtake", True)
    assert event.end_us == pytest.approx(PAST_AT_S * 1e6, abs=STEP_US)


@pytest.mark.parametrize("oncoming_in_s", [4.0, -1.0], ids=["four seconds away", "already met"])
def test_an_overtake_with_room_enough_is_not(oncoming_in_s: float) -> None:
    assert reckless(oncoming_in_s=oncoming_in_s) == []


def test_about_three_seconds_do_not_count() -> None:
    (event,) = reckless(oncoming_in_s=2.9)
    assert event.why_not_countable == "the two meet in about 3 s, or are about 150 m apart"


def test_who_is_back_in_its_lane_by_then_is_not_reckless() -> None:
    assert reckless(oncoming_in_s=2.0, out_to_s=9.0) == []
