"""Builders for data_gen tests: motion tables, states and a short straight road."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from data_gen.simulation.states import FloatArray, VehicleStates
from data_gen.truth.motion import Motion
from gis.roads.lanes import Lane
from gis.roads.road_network import RoadNetwork

STEP_US = 40_000


@dataclass(frozen=True, slots=True)
class Track:
    """One vehicle's movement: its coordinate along the road at each step, nan where it is absent."""

    along_m: FloatArray
    lane: int = 0
    length_m: float = 4.0
    direction: int = 1
    speed_mps: float = 15.0


def motion_of(tracks: Mapping[str, Track]) -> Motion:
    along_m = np.column_stack([track.along_m for track in tracks.values()])
    present = np.isfinite(along_m)

    def table(values: Sequence[float], empty: float) -> FloatArray:
        return np.where(present, np.array(values, dtype=np.float64), empty)

    return Motion(
        t_us=np.arange(len(along_m), dtype=np.int64) * STEP_US,
        ids=tuple(tracks),
        road=table([0] * len(tracks), -1).astype(np.int32),
        direction=table([track.direction for track in tracks.values()], 0).astype(np.int32),
        along_m=along_m,
        lane=table([track.lane for track in tracks.values()], -1).astype(np.int32),
        speed_mps=table([track.speed_mps for track in tracks.values()], np.nan),
        length_m=np.array([track.length_m for track in tracks.values()]),
    )


def straight_road() -> RoadNetwork:
    """Give 1000 m of two-way road along the x axis, one lane of 3.5 m each way."""
    east = Lane("east_0", "east", 0, "east", +1, np.array([[0.0, -1.75], [1000.0, -1.75]]), 3.5, 25.0)
    west = Lane("west_0", "west", 0, "east", -1, np.array([[1000.0, 1.75], [0.0, 1.75]]), 3.5, 25.0)
    return RoadNetwork([east, west])


def states_of(
    *vehicles: tuple[str, float, float, float], t_us: int = 0, truck: bool = False, appearance: int = 5
) -> VehicleStates:
    """Give the states of vehicles written as (id, x_m, y_m, heading_rad)."""
    count = len(vehicles)
    return VehicleStates(
        t_us=t_us,
        ids=tuple(vehicle[0] for vehicle in vehicles),
        classes=("truck" if truck else "car",) * count,
        lanes=("east_0",) * count,
        centre_m=np.array([vehicle[1:3] for vehicle in vehicles], dtype=np.float64).reshape(-1, 2),
        heading_rad=np.array([vehicle[3] for vehicle in vehicles], dtype=np.float64),
        speed_mps=np.full(count, 15.0),
        length_m=np.full(count, 10.0 if truck else 4.5),
        width_m=np.full(count, 2.5 if truck else 1.8),
        appearance=np.full(count, appearance, dtype=np.int64),
    )
