"""What does it cost when many cars are lost at once? Ten lanes of cars that nobody sees for two seconds.

All but one of them go in one frame and come back in one frame under other names, as when the picture of a whole
motorway is lost: every new track has to be compared with every lost car. The one that stays makes time go on, so where
the others were meanwhile is found for many moments. Nothing is simulated; each lane has a speed of its own.
"""

from __future__ import annotations

import numpy as np

from benchmarks.lost_tracks import STEP_US, Case, Place, lose_tracks
from data_gen.outputs.trajectories import NoisyTracks, TrueRows
from gis.roads.lanes import Lane
from gis.roads.road_network import RoadNetwork

LANES, LANE_M, SPEED_LIMIT_MPS = 10, 3.5, 30.0
APART_M, SLOWEST_MPS, FASTER_MPS = 20.0, 15.0, 1.0
"""From car to car in a lane; speed of the first lane, and how much faster each next one is."""
LENGTH_M, WIDTH_M = 4.5, 1.8
SEEN_US, HIDDEN_US = 3_000_000, 2_000_000
"""How long the crowd is seen before and after, and for how long it is hidden."""


def crowd_network(cars: int) -> RoadNetwork:
    """Lay ten lanes side by side, five each way, long enough for a crowd.

    Parameters
    ----------
    cars : how many drive on them.
    """
    ends_m = (-200.0, APART_M * cars / LANES + 400.0)
    return RoadNetwork([_lane(number, ends_m) for number in range(LANES)])


def crowd_tracks(cars: int, *, seed: int) -> NoisyTracks:
    """Let a crowd drive, and hide all but one of it at once.

    Parameters
    ----------
    cars : a multiple of `LANES`. seed : of the noise.

    Returns
    -------
    The tracks, sorted by time.
    """
    steps_us = np.arange(0, 2 * SEEN_US + HIDDEN_US, STEP_US)
    lane, place = np.arange(cars) % LANES, np.arange(cars) // LANES
    t_us, car = np.repeat(steps_us, cars), np.tile(np.arange(cars), len(steps_us))
    is_seen = (t_us < SEEN_US) | (t_us >= SEEN_US + HIDDEN_US) | (car == 0)
    t_us, car = t_us[is_seen], car[is_seen]
    speed_mps = (SLOWEST_MPS + FASTER_MPS * lane)[car]
    driven_m = APART_M * place[car] + speed_mps * t_us * 1e-6
    goes_back = (lane >= LANES // 2)[car]
    values = np.column_stack(
        (
            np.where(goes_back, APART_M * cars / LANES - driven_m, driven_m),
            LANE_M * (lane[car] + 0.5),
            np.where(goes_back, np.pi, 0.0),
            speed_mps,
            np.full(len(car), LENGTH_M),
            np.full(len(car), WIDTH_M),
        )
    )
    truth = TrueRows(t_us, tuple(f"c{one}" for one in car.tolist()), values)
    return lose_tracks(truth, Case(), Place(0.0, 0.0, is_disc=False), seed=seed)


def _lane(number: int, ends_m: tuple[float, float]) -> Lane:
    """Make a lane, counted from the south; the northern half runs west, its outermost lane is the last."""
    goes_back = number >= LANES // 2
    edge, index = ("west", LANES - 1 - number) if goes_back else ("east", number)
    line_m = np.array([[x_m, LANE_M * (number + 0.5)] for x_m in (reversed(ends_m) if goes_back else ends_m)])
    return Lane(f"{edge}_{index}", edge, index, "road", -1 if goes_back else +1, line_m, LANE_M, SPEED_LIMIT_MPS)
