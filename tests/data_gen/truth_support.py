"""Builders for tests of the truth of events: hand-made motion on small networks, laid out as truth tables."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from data_gen.drawing.view import CameraView
from data_gen.simulation.states import FloatArray, VehicleStates
from data_gen.truth.motion import Motion, TruthTables, tabulate, truth_tables
from gis.roads.lanes import Junction, Lane
from gis.roads.road_network import RoadNetwork

STEP_US = 100_000


@dataclass(frozen=True)
class Drive:
    """One vehicle's centre (steps, 2), nan where it is absent; heading and speed follow unless they are given."""

    centre_m: FloatArray
    length_m: float = 4.0
    width_m: float = 1.8
    heading_rad: FloatArray | None = None
    unseen: slice | None = None

    @cached_property
    def velocity_mps(self) -> FloatArray:
        return np.asarray(np.gradient(self.centre_m, STEP_US / 1e6, axis=0), dtype=np.float64)

    @cached_property
    def headings_rad(self) -> FloatArray:
        """That of the nearest step at which it moves, unless told."""
        if self.heading_rad is not None:
            return self.heading_rad
        moving = np.flatnonzero(np.hypot(*self.velocity_mps.T) > 0.2)
        steps = np.arange(len(self.centre_m))
        if not len(moving):
            return np.zeros(len(steps))
        known = moving[np.abs(moving[None, :] - steps[:, None]).argmin(axis=1)]
        return np.asarray(np.arctan2(self.velocity_mps[known, 1], self.velocity_mps[known, 0]), dtype=np.float64)


def along(x_m: FloatArray, y_m: float | FloatArray, **how: float) -> Drive:
    """Drive along the x axis."""
    return Drive(np.column_stack((x_m, np.broadcast_to(y_m, x_m.shape))), **how)  # type: ignore[arg-type]  # sizes


def motorway() -> RoadNetwork:
    """Give 3 km of one-way road along the x axis, lanes of 3.5 m at y = 0 (right) and y = 3.5 (left)."""
    lanes = [
        Lane(f"e_{number}", "e", number, "e", +1, np.array([[0.0, 3.5 * number], [3000.0, 3.5 * number]]), 3.5, 30.0)
        for number in (0, 1)
    ]
    return RoadNetwork(lanes)


def crossroads() -> RoadNetwork:
    """Give four arms of 100 m, a lane each way at 2 m from the middle, around a junction of 20 m by 20 m."""
    ways = {"west": np.pi, "north": np.pi / 2, "east": 0.0, "south": -np.pi / 2}
    lanes: list[Lane] = []
    for name, out_rad in ways.items():
        out = np.array([np.cos(out_rad), np.sin(out_rad)])
        right = np.array([out[1], -out[0]]) * 2.0
        away = np.array([out * 10 + right, out * 110 + right])
        lanes.append(Lane(f"{name}_out_0", f"{name}_out", 0, name, +1, away, 4.0, 14.0))
        back = np.array([out * 110 - right, out * 10 - right])
        lanes.append(Lane(f"{name}_in_0", f"{name}_in", 0, name, -1, back, 4.0, 14.0))
    outline_m = np.array([[-10.0, -10.0], [10.0, -10.0], [10.0, 10.0], [-10.0, 10.0]])
    return RoadNetwork(lanes, junctions=[Junction("x", outline_m)])


def tables_of(drives: Mapping[str, Drive], network: RoadNetwork) -> TruthTables:
    """Lay out vehicles; the front bumper decides in which lane SUMO has them."""
    steps = len(next(iter(drives.values())).centre_m)
    states = [_state(drives, network, step) for step in range(steps)]
    motion = tabulate(states, network)
    seen = np.zeros(motion.road.shape, dtype=np.bool_)
    for column, name in enumerate(motion.ids):
        seen[:, column] = np.isfinite(drives[name].centre_m[:, 0])
        if (unseen := drives[name].unseen) is not None:
            seen[unseen, column] = False
    return truth_tables(states, network, seen, motion)


def _state(drives: Mapping[str, Drive], network: RoadNetwork, step: int) -> VehicleStates:
    here = {name: drive for name, drive in drives.items() if np.isfinite(drive.centre_m[step, 0])}
    heading_rad = np.array([drive.headings_rad[step] for drive in here.values()], dtype=np.float64)
    centre_m = np.array([drive.centre_m[step] for drive in here.values()], dtype=np.float64).reshape(-1, 2)
    length_m = np.array([drive.length_m for drive in here.values()], dtype=np.float64)
    front_m = centre_m + length_m[:, None] / 2 * np.column_stack((np.cos(heading_rad), np.sin(heading_rad)))
    lane = network.locate(front_m).lane
    return VehicleStates(
        t_us=step * STEP_US,
        ids=tuple(here),
        classes=("car",) * len(here),
        lanes=tuple(network.lanes[number].id if number >= 0 else ":x_0_0" for number in lane.tolist()),
        centre_m=centre_m,
        heading_rad=heading_rad,
        speed_mps=np.array([np.hypot(*drive.velocity_mps[step]) for drive in here.values()], dtype=np.float64),
        length_m=length_m,
        width_m=np.array([drive.width_m for drive in here.values()], dtype=np.float64),
        appearance=np.zeros(len(here), dtype=np.int64),
    )


def centres_in_view(
    motion: Motion, states: Sequence[VehicleStates], view: CameraView | Sequence[CameraView]
) -> NDArray[np.bool_]:
    """Tell at which steps each vehicle's centre is in the image.

    Parameters
    ----------
    motion, states : of the same clip.
    view : of the camera; one for each step if it moves.

    Returns
    -------
    (steps, vehicles); False where a vehicle is absent.
    """
    column = {vehicle_id: place for place, vehicle_id in enumerate(motion.ids)}
    in_view = np.zeros(motion.road.shape, dtype=np.bool_)
    views = (view,) * len(states) if isinstance(view, CameraView) else view
    for row, (step, seen) in enumerate(zip(states, views, strict=True)):
        in_view[row, [column[vehicle_id] for vehicle_id in step.ids]] = seen.contains(step.centre_m)
    return in_view
