"""How did the vehicles move along their roads, and which pairs shared one? Tables over all steps of a clip."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from data_gen.simulation.states import FloatArray, IntArray, VehicleStates
from gis.road_network import RoadNetwork

IndexArray = NDArray[np.int32]


@dataclass(frozen=True, slots=True, eq=False)
class Motion:
    """Tables of (steps, vehicles); where a vehicle is absent or off every road, `road` is -1."""

    t_us: IntArray
    """(steps,), rising."""
    ids: tuple[str, ...]
    road: IndexArray
    direction: IndexArray
    """+1 along the road's reference line, -1 against it, by the vehicle's own heading; 0 where absent."""
    along_m: FloatArray
    """Centre along the road in the direction of travel, so that it grows as the vehicle drives."""
    lane: IndexArray
    """Lane under the centre, -1 where there is none."""
    speed_mps: FloatArray
    length_m: FloatArray
    """(vehicles,)."""


@dataclass(frozen=True, slots=True, eq=False)
class PairRun:
    """Steps without a gap in which two vehicles are on one road in one direction."""

    a: int
    b: int
    first_step: int
    gap_m: FloatArray
    """s_a - s_b at each step."""
    reach_m: float
    """Half the sum of the lengths: bodies overlap along the road while |gap| is at most this."""


def tabulate(states: Sequence[VehicleStates], network: RoadNetwork) -> Motion:
    """Lay the states of a clip out as tables.

    Parameters
    ----------
    states : at least one, in order of time.
    network : gives road, lane and the coordinate along the road.

    Returns
    -------
    The tables; vehicles in order of first appearance.
    """
    ids = tuple(dict.fromkeys(vehicle_id for step in states for vehicle_id in step.ids))
    column = {vehicle_id: place for place, vehicle_id in enumerate(ids)}
    rows = np.concatenate([np.full(len(step.ids), number) for number, step in enumerate(states)])
    columns = np.array([column[vehicle_id] for step in states for vehicle_id in step.ids], dtype=np.int64)
    positions = network.locate(np.concatenate([step.centre_m for step in states]))
    heading_rad = np.concatenate([step.heading_rad for step in states])
    direction = np.where(np.cos(heading_rad - np.nan_to_num(positions.tangent_rad)) >= 0, 1, -1)
    shape = (len(states), len(ids))
    length_m = np.zeros(len(ids))
    length_m[columns] = np.concatenate([step.length_m for step in states])

    def table(values: FloatArray, empty: float) -> FloatArray:
        """Spread the values over (steps, vehicles), with `empty` elsewhere."""
        filled = np.full(shape, empty)
        filled[rows, columns] = values
        return filled

    return Motion(
        t_us=np.array([step.t_us for step in states], dtype=np.int64),
        ids=ids,
        road=table(positions.road.astype(np.float64), -1).astype(np.int32),
        direction=table(direction.astype(np.float64), 0).astype(np.int32),
        along_m=table(direction * positions.along_m, np.nan),
        lane=table(positions.lane.astype(np.float64), -1).astype(np.int32),
        speed_mps=table(np.concatenate([step.speed_mps for step in states]), np.nan),
        length_m=length_m,
    )


def pair_runs(motion: Motion) -> Iterator[PairRun]:
    """Give each unordered pair's stretches of common travel.

    Parameters
    ----------
    motion : of the clip.

    Yields
    ------
    Runs by pair and time; a pair that parts and meets again gives several.
    """
    for a in range(len(motion.ids)):
        for b in range(a + 1, len(motion.ids)):
            together = (
                (motion.road[:, a] >= 0)
                & (motion.road[:, a] == motion.road[:, b])
                & (motion.direction[:, a] == motion.direction[:, b])
            )
            edges = np.flatnonzero(np.diff(together.astype(np.int8), prepend=0, append=0))
            for start, end in edges.reshape(-1, 2).tolist():
                gap_m = motion.along_m[start:end, a] - motion.along_m[start:end, b]
                yield PairRun(a, b, start, gap_m, float(motion.length_m[a] + motion.length_m[b]) / 2)
