"""Where was every vehicle at every step, seen from roads, lanes and junctions? Tables over all steps of a clip."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from data_gen.simulation.states import BoolArray, FloatArray, IndexArray, IntArray, VehicleStates
from gis.road_network import RoadNetwork

_Cell = TypeVar("_Cell", bound=np.generic)


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


@dataclass(frozen=True, slots=True, eq=False)
class TruthTables:
    """What the truth of events is derived from: tables of (steps, vehicles), and the network."""

    motion: Motion
    network: RoadNetwork
    seen: BoolArray
    """In view and not hidden; False where absent."""
    present: BoolArray
    x_m: FloatArray
    y_m: FloatArray
    heading_rad: FloatArray
    across_m: FloatArray
    """Centre to the left of the road's reference line, looking in driving direction; nan off the roads."""
    junction: IndexArray
    """Junction under the centre, -1 outside of all."""
    front_lane: IndexArray
    """Lane of the network in which SUMO has the front bumper; -1 inside junctions and where absent."""
    width_m: FloatArray
    """(vehicles,)."""


class _Cells:
    """The cells of a table of (steps, vehicles) in which somebody is, in the order of the states."""

    def __init__(self, states: Sequence[VehicleStates], ids: Sequence[str]) -> None:
        column = {vehicle_id: place for place, vehicle_id in enumerate(ids)}
        self._shape = len(states), len(ids)
        self._rows = np.concatenate([np.full(len(step.ids), number) for number, step in enumerate(states)])
        self._columns = np.array([column[vehicle_id] for step in states for vehicle_id in step.ids], dtype=np.int64)

    def spread(self, values: NDArray[_Cell], empty: float) -> NDArray[_Cell]:
        """Fill a table with values, and with `empty` where nobody is."""
        filled = np.full(self._shape, empty, dtype=values.dtype)
        filled[self._rows, self._columns] = values
        return filled

    def numbers(self, values: FloatArray) -> FloatArray:
        return self.spread(values, np.nan)

    def indices(self, values: IndexArray) -> IndexArray:
        return self.spread(values, -1)

    def by_vehicle(self, values: FloatArray) -> FloatArray:
        """Give one value a vehicle, the last one that it had."""
        filled = np.zeros(self._shape[1])
        filled[self._columns] = values
        return filled


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
    cells = _Cells(states, ids)
    positions = network.locate(np.concatenate([step.centre_m for step in states]))
    heading_rad = np.concatenate([step.heading_rad for step in states])
    direction = np.where(np.cos(heading_rad - np.nan_to_num(positions.tangent_rad)) >= 0, 1, -1)
    return Motion(
        t_us=np.array([step.t_us for step in states], dtype=np.int64),
        ids=ids,
        road=cells.indices(positions.road),
        direction=cells.spread(direction.astype(np.int32), 0),
        along_m=cells.numbers(direction * positions.along_m),
        lane=cells.indices(positions.lane),
        speed_mps=cells.numbers(np.concatenate([step.speed_mps for step in states])),
        length_m=cells.by_vehicle(np.concatenate([step.length_m for step in states])),
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


def truth_tables(states: Sequence[VehicleStates], network: RoadNetwork, seen: BoolArray, motion: Motion) -> TruthTables:
    """Lay out a clip for the truth of events.

    Parameters
    ----------
    states : at least one step, in order of time.
    network : the road network.
    seen : (steps, vehicles), True where a vehicle is in view and not hidden, columns as in `motion.ids`.
    motion : of the same clip.

    Returns
    -------
    The tables.

    Examples
    --------
    >>> from gis.lanes import Lane
    >>> lane = Lane("e_0", "e", 0, "e", +1, np.array([[0.0, 0.0], [100.0, 0.0]]), 3.5, 25.0)
    >>> step = VehicleStates(
    ...     t_us=0, ids=("a",), classes=("car",), lanes=("e_0",), centre_m=np.array([[10.0, 0.0]]),
    ...     heading_rad=np.zeros(1), speed_mps=np.ones(1), length_m=np.array([4.0]), width_m=np.array([1.8]),
    ...     appearance=np.zeros(1, dtype=np.int64),
    ... )
    >>> network = RoadNetwork([lane])
    >>> tables = truth_tables([step], network, np.ones((1, 1), dtype=np.bool_), tabulate([step], network))
    >>> tables.across_m.tolist(), tables.front_lane.tolist(), tables.junction.tolist()
    ([[-1.75]], [[0]], [[-1]])
    """
    cells = _Cells(states, motion.ids)
    centre_m = np.concatenate([step.centre_m for step in states])
    positions = network.locate(centre_m)
    lane_of = {lane.id: number for number, lane in enumerate(network.lanes)}
    front_lane = np.array([lane_of.get(lane, -1) for step in states for lane in step.lanes], dtype=np.int32)
    return TruthTables(
        motion=motion,
        network=network,
        seen=seen,
        present=cells.spread(np.ones(len(centre_m), dtype=np.bool_), False),
        x_m=cells.numbers(centre_m[:, 0]),
        y_m=cells.numbers(centre_m[:, 1]),
        heading_rad=cells.numbers(np.concatenate([step.heading_rad for step in states])),
        across_m=cells.numbers(positions.across_m) * motion.direction,
        junction=cells.indices(positions.junction),
        front_lane=cells.indices(front_lane),
        width_m=cells.by_vehicle(np.concatenate([step.width_m for step in states])),
    )


def stretches(holds: BoolArray) -> Iterator[tuple[int, int]]:
    """Give each stretch of True as (first, one past the last).

    Examples
    --------
    >>> list(stretches(np.array([True, False, True, True])))
    [(0, 1), (2, 4)]
    """
    edges = np.flatnonzero(np.diff(holds.astype(np.int8), prepend=0, append=0))
    yield from zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True)
