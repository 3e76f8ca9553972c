"""From states to tables along the road."""

import math

import numpy as np

from data_gen.drawing.view import camera_over
from data_gen.scenario import View
from data_gen.truth.motion import pair_runs, tabulate
from tests.data_gen.support import STEP_US, Track, motion_of, states_of, straight_road
from tests.data_gen.truth_support import centres_in_view


def test_driving_west_counts_along_the_road_in_the_direction_of_travel() -> None:
    states = [states_of(("w", 300.0 - step, 1.75, math.pi), t_us=step * STEP_US) for step in range(3)]
    motion = tabulate(states, straight_road())
    assert motion.direction[:, 0].tolist() == [-1, -1, -1]
    assert np.diff(motion.along_m[:, 0]).round(6).tolist() == [1.0, 1.0]


def test_the_coordinate_runs_on_in_the_oncoming_lane() -> None:
    states = [
        states_of(("a", 100.0, -1.75, 0.0)),
        states_of(("a", 101.0, 0.5, 0.1), t_us=STEP_US),
        states_of(("a", 102.0, 1.75, 0.0), t_us=2 * STEP_US),
    ]
    motion = tabulate(states, straight_road())
    assert motion.along_m[:, 0].round(6).tolist() == [100.0, 101.0, 102.0]
    assert motion.lane[:, 0].tolist() == [0, 1, 1]
    assert motion.direction[:, 0].tolist() == [1, 1, 1]


def test_an_absent_vehicle_is_on_no_road() -> None:
    states = [states_of(("a", 100.0, -1.75, 0.0)), states_of(("b", 100.0, -1.75, 0.0), t_us=STEP_US)]
    motion = tabulate(states, straight_road())
    assert motion.road.tolist() == [[0, -1], [-1, 0]]
    assert list(pair_runs(motion)) == []


def test_a_pair_that_parts_and_meets_again_gives_two_runs() -> None:
    along_m = np.arange(10.0)
    gone_m = along_m.copy()
    gone_m[4:6] = np.nan
    runs = list(pair_runs(motion_of({"a": Track(along_m), "b": Track(gone_m)})))
    assert [(run.first_step, len(run.gap_m)) for run in runs] == [(0, 4), (6, 4)]


def test_an_absent_vehicle_is_not_in_view() -> None:
    states = [states_of(("a", 100.0, -1.75, 0.0)), states_of(("b", 180.0, -1.75, 0.0), t_us=STEP_US)]
    view = camera_over(View(centre_m=(100.0, 0.0), width_m=100.0), (640, 360))
    in_view = centres_in_view(tabulate(states, straight_road()), states, view)
    assert in_view.tolist() == [[True, False], [False, False]]
