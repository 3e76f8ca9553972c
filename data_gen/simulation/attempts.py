"""Who begins to overtake and gives up? Adds such attempts to traffic in which nobody gives up.

SUMO plans an overtake before it starts and never aborts one. Here a driver who follows a slower vehicle pulls out,
draws level with its rear, sees somebody coming, brakes, falls back and returns to the old place. As the vehicle is at
its old place again, nobody behind it had to know: the attempt is a smooth detour laid over what SUMO drove.

An attempt is only made where the detour touches no other body and is driven with bounded accelerations, and where
oncoming traffic soon after explains it. That looks into the simulated future, as a driver looks up the road.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from data_gen.scenario import Attempts
from data_gen.simulation.demand import Departure
from data_gen.simulation.states import Cells, FloatArray, FrontStates

_GAP_M = (5.0, 30.0)
"""Between the bumpers as the attempt starts."""
_DEPTH_M = (1.0, 3.0)
"""How far the front passes the rear of the other vehicle."""
_LEVEL_S = (0.3, 1.2)
"""Time side by side before the driver brakes."""
_CHANGE_S = 2.8
"""Time across to the other lane."""
_FORWARD_MPS2, _BACKWARD_MPS2 = 2.3, 2.8
"""Largest acceleration of the detour, out and back."""
_ACCELERATION_MPS2 = (-4.5, 3.5)
"""Of the vehicle as drawn, SUMO's own included."""
_CLEARANCE_M = (2.0, 0.4)
"""To every other body, along the road and across."""
_ONCOMING_S = 6.0
"""So soon after the return somebody comes the other way."""
_LOOK_EVERY_US = 500_000
_FOLLOWING_MPS = 1.5
_SLOWEST_MPS = 4.0


@dataclass(slots=True, eq=False)
class _Tables:
    """Front bumpers over all steps; nan and -1 where a vehicle is absent. Attempts are written into them."""

    step_s: float
    front_m: FloatArray
    """(steps, vehicles, 2)."""
    heading_rad: FloatArray
    speed_mps: FloatArray
    lane: FloatArray
    """Number of the SUMO lane."""
    length_m: FloatArray
    """(vehicles,)."""
    width_m: FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class _Detour:
    """Metres ahead of and left of the old place, and m/s faster, at each step of an attempt."""

    ahead_m: FloatArray
    left_m: FloatArray
    faster_mps: FloatArray
    back_step: int
    """When the vehicle is on the way back to its lane."""


def add_attempts(
    steps: Sequence[FrontStates], vehicles: Mapping[str, Departure], attempts: Attempts, rng: np.random.Generator
) -> tuple[FrontStates, ...]:
    """Lay attempts to overtake over simulated traffic.

    Parameters
    ----------
    steps : evenly spaced, on roads without sharp bends. Whether an attempt starts depends on 25 s that follow, so none
        starts within the last ones.
    vehicles : by id.
    attempts : who tries, and how far it is to the oncoming lane.
    rng : draws depth and length of each attempt.

    Returns
    -------
    The steps, with the attempting vehicles moved.
    """
    if len(steps) < 2:
        return tuple(steps)
    ids = tuple(dict.fromkeys(name for step in steps for name in step.ids))
    tables = _tabulate(steps, ids, vehicles)
    trying = np.array([vehicles[name].kind.name == attempts.kind for name in ids])
    free_from_us = np.full(len(ids), steps[0].t_us)
    every = max(1, round(_LOOK_EVERY_US / 1e6 / tables.step_s))
    for row in range(0, len(steps), every):
        ready = trying & (free_from_us <= steps[row].t_us)
        for follower, leader, gap_m in _followers(tables, row, ready):
            detour = _draw_detour(gap_m, attempts.shift_m, tables.step_s, rng)
            if _is_possible(tables, row, follower, leader, detour):
                _drive(tables, row, follower, detour)
                end_us = steps[row].t_us + round(len(detour.ahead_m) * tables.step_s * 1e6)
                free_from_us[follower] = end_us + attempts.pause_us
    return _steps_of(tables, steps, ids)


def _tabulate(steps: Sequence[FrontStates], ids: Sequence[str], vehicles: Mapping[str, Departure]) -> _Tables:
    cells = Cells(steps, ids)
    lane_numbers = {lane: number for number, lane in enumerate(sorted({lane for step in steps for lane in step.lanes}))}
    return _Tables(
        step_s=(steps[1].t_us - steps[0].t_us) / 1e6,
        front_m=cells.numbers(np.concatenate([step.front_m for step in steps])),
        heading_rad=cells.numbers(np.concatenate([step.lane_heading_rad for step in steps])),
        speed_mps=cells.numbers(np.concatenate([step.speed_mps for step in steps])),
        lane=cells.spread(np.array([float(lane_numbers[lane]) for step in steps for lane in step.lanes]), -1),
        length_m=np.array([vehicles[name].length_m for name in ids]),
        width_m=np.array([vehicles[name].width_m for name in ids]),
    )


def _followers(tables: _Tables, row: int, ready: np.ndarray) -> Iterator[tuple[int, int, float]]:
    """Give each driver who may try, the vehicle in front, and the gap between them."""
    for follower in np.flatnonzero(ready & (tables.lane[row] >= 0)).tolist():
        forward = _forward(tables.heading_rad[row, follower])
        ahead_m = (tables.front_m[row] - tables.front_m[row, follower]) @ forward
        in_front = np.flatnonzero((tables.lane[row] == tables.lane[row, follower]) & (ahead_m > 0))
        if not len(in_front):
            continue
        leader = int(in_front[np.argmin(ahead_m[in_front])])
        gap_m = float(ahead_m[leader] - tables.length_m[leader])
        speeds_mps = tables.speed_mps[row, [follower, leader]]
        is_following = np.ptp(speeds_mps) < _FOLLOWING_MPS and speeds_mps[1] > _SLOWEST_MPS
        if is_following and _GAP_M[0] < gap_m < _GAP_M[1]:
            yield follower, leader, gap_m


def _draw_detour(gap_m: float, shift_m: float, step_s: float, rng: np.random.Generator) -> _Detour:
    reach_m = gap_m + float(rng.uniform(*_DEPTH_M))
    level_s = float(rng.uniform(*_LEVEL_S))
    # 5.77: largest second derivative of the smooth step.
    out_s, back_s = (math.sqrt(5.77 * reach_m / limit) for limit in (_FORWARD_MPS2, _BACKWARD_MPS2))
    return_s = out_s + level_s + 0.75 * back_s
    time_s = np.arange(0.0, max(return_s + _CHANGE_S, out_s + level_s + back_s) + step_s, step_s)
    ahead_m = reach_m * (_smooth_step(time_s / out_s) - _smooth_step((time_s - out_s - level_s) / back_s))
    return _Detour(
        ahead_m=ahead_m,
        left_m=shift_m * (_smooth_step(time_s / _CHANGE_S) - _smooth_step((time_s - return_s) / _CHANGE_S)),
        faster_mps=np.gradient(ahead_m, step_s),
        back_step=round((return_s + _CHANGE_S / 2) / step_s),
    )


def _smooth_step(part: FloatArray) -> FloatArray:
    """Rise from 0 to 1 with no jerk at the ends (minimum-jerk polynomial)."""
    at = np.clip(part, 0.0, 1.0)
    return np.asarray(at**3 * (10 - 15 * at + 6 * at**2), dtype=np.float64)


def _is_possible(tables: _Tables, row: int, follower: int, leader: int, detour: _Detour) -> bool:
    end = row + len(detour.ahead_m)
    look = end + round(_ONCOMING_S / tables.step_s)
    if look > len(tables.lane) or not _keep_their_lane(tables, slice(row, end), follower, leader):
        return False
    speed_mps = tables.speed_mps[row:end, follower] + detour.faster_mps
    acceleration_mps2 = np.diff(speed_mps) / tables.step_s
    if acceleration_mps2.min() < _ACCELERATION_MPS2[0] or acceleration_mps2.max() > _ACCELERATION_MPS2[1]:
        return False
    forward = _forward(tables.heading_rad[row, follower])
    front_m = _moved(tables, row, follower, detour)
    depth_m = (front_m - tables.front_m[row:end, leader]) @ forward + tables.length_m[leader]
    # Beside the rear of the other one, and never past its middle.
    if not 0.5 < depth_m.max() < tables.length_m[leader] / 2 + tables.length_m[follower] / 2:
        return False
    return _is_clear(tables, slice(row, end), follower, front_m) and _somebody_comes(
        tables, slice(row + detour.back_step, look), follower
    )


def _keep_their_lane(tables: _Tables, window: slice, follower: int, leader: int) -> bool:
    lanes = tables.lane[window][:, [follower, leader]]
    return bool((lanes == lanes[0, 0]).all() and lanes[0, 0] >= 0)


def _is_clear(tables: _Tables, window: slice, follower: int, front_m: FloatArray) -> bool:
    """Tell whether the moved body keeps clear of all others; a straight road is assumed within a few metres."""
    forward = _forward(tables.heading_rad[window.start, follower])
    left = np.array((-forward[1], forward[0]))
    # Centres, with bodies along the road.
    centres_m = tables.front_m[window] - tables.length_m[:, None] / 2 * _forward(tables.heading_rad[window])
    own_m = front_m - tables.length_m[follower] / 2 * forward
    apart_m = centres_m - own_m[:, None]
    along_m = np.abs(apart_m @ forward) - (tables.length_m + tables.length_m[follower]) / 2
    across_m = np.abs(apart_m @ left) - (tables.width_m + tables.width_m[follower]) / 2
    touching = (along_m < _CLEARANCE_M[0]) & (across_m < _CLEARANCE_M[1])
    touching[:, follower] = False
    return not touching.any()


def _somebody_comes(tables: _Tables, window: slice, follower: int) -> bool:
    """Tell whether a vehicle from the other side is met within the window."""
    forward = _forward(tables.heading_rad[window.start, follower])
    ahead_m = (tables.front_m[window] - tables.front_m[window, follower][:, None]) @ forward
    oncoming = np.cos(tables.heading_rad[window] - tables.heading_rad[window.start, follower]) < -0.8
    meets = (ahead_m[:-1] > 0) & (ahead_m[1:] <= 0) & oncoming[1:]
    return bool(meets.any())


def _moved(tables: _Tables, row: int, follower: int, detour: _Detour) -> FloatArray:
    window = slice(row, row + len(detour.ahead_m))
    forward = _forward(tables.heading_rad[window, follower])
    left = np.stack((-forward[:, 1], forward[:, 0]), axis=1)
    moved_m = tables.front_m[window, follower] + detour.ahead_m[:, None] * forward + detour.left_m[:, None] * left
    return np.asarray(moved_m, dtype=np.float64)


def _drive(tables: _Tables, row: int, follower: int, detour: _Detour) -> None:
    window = slice(row, row + len(detour.ahead_m))
    tables.front_m[window, follower] = _moved(tables, row, follower, detour)
    tables.speed_mps[window, follower] += detour.faster_mps


def _steps_of(tables: _Tables, steps: Sequence[FrontStates], ids: Sequence[str]) -> tuple[FrontStates, ...]:
    column = {name: place for place, name in enumerate(ids)}
    return tuple(
        replace(step, front_m=tables.front_m[row, columns], speed_mps=tables.speed_mps[row, columns])
        for row, step in enumerate(steps)
        for columns in [[column[name] for name in step.ids]]
    )


def _forward(heading_rad: FloatArray) -> FloatArray:
    return np.stack((np.cos(heading_rad), np.sin(heading_rad)), axis=-1)
