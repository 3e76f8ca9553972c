"""Where is a vehicle's body, if its front bumper moves like this?

SUMO moves points (front bumpers) along lanes and turns a vehicle by up to 8 degrees from one step to the next when a
lane change starts. A body does not: here the front bumper drags it like a trailer, the rear axle following (a
tractrix). Heading and centre stay smooth, and a car in a bend cuts the corner as real ones do.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from data_gen.simulation.demand import Departure
from data_gen.simulation.states import FloatArray, VehicleStates

_REAR_AXLE = 0.8
"""Rear axle's distance behind the front bumper, as a part of the vehicle's length."""


@dataclass(frozen=True, slots=True, eq=False)
class FrontStates:
    """The front bumpers of all n vehicles at one step, as SUMO moves them."""

    t_us: int
    ids: tuple[str, ...]
    lanes: tuple[str, ...]
    front_m: FloatArray
    """(n, 2)."""
    lane_heading_rad: FloatArray
    """SUMO's own angle; it jumps where a lane change starts."""
    speed_mps: FloatArray


def drag_bodies(steps: Sequence[FrontStates], vehicles: Mapping[str, Departure]) -> list[VehicleStates]:
    """Pull each vehicle's body after its front bumper.

    Parameters
    ----------
    steps : in order of time; the first ones only settle the bodies.
    vehicles : by id, with their sizes.

    Returns
    -------
    One entry a step.
    """
    rear_m: dict[str, tuple[float, float]] = {}
    return [_dragged(step, vehicles, rear_m) for step in steps]


def _dragged(
    step: FrontStates, vehicles: Mapping[str, Departure], rear_m: dict[str, tuple[float, float]]
) -> VehicleStates:
    known = [vehicles[vehicle_id] for vehicle_id in step.ids]
    fronts_m, headings_rad = step.front_m.tolist(), step.lane_heading_rad.tolist()
    poses = np.array(
        [
            _drag(item, (x_m, y_m), heading_rad, rear_m)
            for item, (x_m, y_m), heading_rad in zip(known, fronts_m, headings_rad, strict=True)
        ],
        dtype=np.float64,
    ).reshape(-1, 3)
    return VehicleStates(
        t_us=step.t_us,
        ids=step.ids,
        classes=tuple(item.kind.vehicle_class for item in known),
        lanes=step.lanes,
        centre_m=poses[:, :2],
        heading_rad=poses[:, 2],
        speed_mps=step.speed_mps,
        length_m=np.array([item.length_m for item in known], dtype=np.float64),
        width_m=np.array([item.width_m for item in known], dtype=np.float64),
        appearance=np.array([item.appearance for item in known], dtype=np.int64),
    )


def _drag(
    item: Departure, front_m: tuple[float, float], first_heading_rad: float, rear_m: dict[str, tuple[float, float]]
) -> tuple[float, float, float]:
    """Pull the rear axle after the front bumper; returns centre x, y and heading."""
    x_m, y_m = front_m
    axle_m = _REAR_AXLE * item.length_m
    heading_rad = first_heading_rad
    if item.id in rear_m:
        heading_rad = math.atan2(y_m - rear_m[item.id][1], x_m - rear_m[item.id][0])
    east, north = math.cos(heading_rad), math.sin(heading_rad)
    rear_m[item.id] = (x_m - axle_m * east, y_m - axle_m * north)
    half_m = item.length_m / 2
    # 0.0 + turns -0.0 into 0.0, for which atan2 gives pi and not -pi.
    return x_m - half_m * east, y_m - half_m * north, math.atan2(0.0 + north, east)
