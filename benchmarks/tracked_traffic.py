"""What would detectors say of busy traffic? Made detections, with misses, noise, false alarms and hidden stretches.

Ten lanes, five each way, on a ring of which a part is in view. Cars keep their distance and change lanes now and then,
so no tracker's motion model is right. Everything is drawn from one seed.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
BoolArray = NDArray[np.bool_]

LANES, LANE_M = 10, 3.5
RING_M, VIEW_M = 700.0, 500.0
LENGTH_M, WIDTH_M = 4.5, 1.8
STEP_S = 0.04
HIDDEN_S = 2.0
HIDDEN_EVERY_S = 20.0
LANE_CHANGE_S = 4.0


@dataclass(frozen=True, slots=True)
class Difficulty:
    """Say how bad detections are.

    Attributes
    ----------
    miss_share : of all visible cars and frames. false_per_frame : mean number of detections of nothing.
    noise_m : standard deviation of a centre, along and across. frames_per_s : 25 divided by a whole number.
    """

    miss_share: float
    false_per_frame: float
    noise_m: float
    frames_per_s: int = 25


DIFFICULTIES = {
    "base": Difficulty(0.03, 1.0, 0.3),
    "hard": Difficulty(0.15, 5.0, 0.6),
    "5 fps": Difficulty(0.03, 1.0, 0.3, 5),
}


@dataclass(frozen=True, slots=True, eq=False)
class DetectedTraffic:
    """Hold the truth and the detections, each ordered by frame.

    Attributes
    ----------
    frames_per_s, frame_count : the clock; frame k is at k / frames_per_s.
    true_frame, true_car : (n,). true_m : (n, 2) centres of the cars in view and not hidden.
    found_frame : (m,). found_m : (m, 2). heading_rad : (m,) of the long axis, so modulo a half turn.
    length_m, width_m : (m,).
    """

    frames_per_s: int
    frame_count: int
    true_frame: IntArray
    true_car: IntArray
    true_m: FloatArray
    found_frame: IntArray
    found_m: FloatArray
    heading_rad: FloatArray
    length_m: FloatArray
    width_m: FloatArray


def make_traffic(difficulty: Difficulty, *, seed: int, seconds: int, cars: int = 50) -> DetectedTraffic:
    """Let cars drive, and detect them.

    Parameters
    ----------
    difficulty : of the detections. seed : of everything. seconds : how long. cars : on the whole ring.
    """
    rng = np.random.default_rng(seed)
    every = round(1 / STEP_S) // difficulty.frames_per_s
    positions = _drive(rng, steps=round(seconds / STEP_S), cars=cars)[::every]
    frames = len(positions)
    in_view = positions[..., 0] < VIEW_M
    # A car that comes round again is another one.
    entries = np.cumsum(np.diff(in_view.astype(np.int8), axis=0, prepend=0) == 1, axis=0)
    name = np.arange(cars) * 1000 + entries
    seen = in_view & ~_hidden(rng, frames, cars, difficulty.frames_per_s)
    frame, car = np.nonzero(seen)
    is_found = rng.random(len(frame)) >= difficulty.miss_share
    falses = rng.poisson(difficulty.false_per_frame, frames)
    false_m = rng.uniform((0.0, 0.0), (VIEW_M, LANES * LANE_M), (falses.sum(), 2))
    found_frame = np.concatenate((frame[is_found], np.repeat(np.arange(frames), falses)))
    noise_m = rng.normal(0, difficulty.noise_m, (int(is_found.sum()), 2))
    found_m = np.concatenate((positions[frame, car][is_found] + noise_m, false_m))
    order = np.argsort(found_frame, kind="stable")
    count = len(order)
    return DetectedTraffic(
        frames_per_s=difficulty.frames_per_s,
        frame_count=frames,
        true_frame=frame,
        true_car=np.unique(name[frame, car], return_inverse=True)[1],
        true_m=positions[frame, car],
        found_frame=found_frame[order],
        found_m=found_m[order],
        heading_rad=rng.normal(0, 0.05, count),
        length_m=np.clip(rng.normal(LENGTH_M, difficulty.noise_m, count), 2.0, None),
        width_m=np.clip(rng.normal(WIDTH_M, difficulty.noise_m / 2, count), 1.0, None),
    )


def _drive(rng: np.random.Generator, *, steps: int, cars: int) -> FloatArray:
    """Give (steps, cars, 2) positions on the ring; lanes of the upper half run backwards."""
    lane = np.arange(cars) % LANES
    along = np.empty(cars)
    for one in range(LANES):
        queue = np.flatnonzero(lane == one)
        along[queue] = np.linspace(0, RING_M, len(queue), endpoint=False) + rng.uniform(0, 20)
    wanted, push = rng.uniform(9, 30, cars), np.zeros(cars)
    speed, across = wanted.copy(), (lane + 0.5) * LANE_M
    places = np.empty((steps, cars, 2))
    for step in range(steps):
        push += (-push / 3.0) * STEP_S + 0.8 * np.sqrt(STEP_S) * rng.normal(size=cars)
        gap_m = _gaps(along, lane)
        lane = _change_lanes(rng, along, lane, gap_m)
        # Keep 1.2 s and two metres; speed follows within a second, as hard as brakes allow.
        target = np.minimum(wanted, np.clip((gap_m - LENGTH_M - 2) / 1.2, 0, None))
        speed = np.clip(speed + np.clip(target - speed + push, -6, 3) * STEP_S, 0, None)
        along = (along + speed * STEP_S) % RING_M
        across += np.clip((lane + 0.5) * LANE_M - across, *(np.array([-1, 1]) * LANE_M / LANE_CHANGE_S * STEP_S))
        backwards = lane >= LANES // 2
        places[step] = np.column_stack((np.where(backwards, VIEW_M - along, along) % RING_M, across))
    return places


def _gaps(along: FloatArray, lane: IntArray) -> FloatArray:
    """Measure from each car to the next one of its lane, centre to centre."""
    ahead = (along[None] - along[:, None]) % RING_M
    ahead[(lane[:, None] != lane[None]) | np.eye(len(lane), dtype=bool)] = RING_M
    return np.asarray(ahead.min(axis=1))


def _change_lanes(rng: np.random.Generator, along: FloatArray, lane: IntArray, gap_m: FloatArray) -> IntArray:
    """Let one car at a time, of those held up, go to a free lane of its direction beside it."""
    keen = np.flatnonzero((gap_m < 25) & (rng.random(len(lane)) < 0.02))
    if len(keen) == 0:
        return lane
    car = int(keen[0])
    beside = int(lane[car] + rng.choice((-1, 1)))
    if not 0 <= beside < LANES or (beside < LANES // 2) != (lane[car] < LANES // 2):
        return lane
    offset_m = np.abs((along[lane == beside] - along[car] + RING_M / 2) % RING_M - RING_M / 2)
    if (offset_m < 15).any():
        return lane
    changed = lane.copy()
    changed[car] = beside
    return changed


def _hidden(rng: np.random.Generator, frames: int, cars: int, frames_per_s: int) -> BoolArray:
    """Hide every car for two seconds out of twenty."""
    t_s = np.arange(frames)[:, None] / frames_per_s
    return np.asarray((t_s + rng.uniform(0, HIDDEN_EVERY_S, cars)) % HIDDEN_EVERY_S < HIDDEN_S)
