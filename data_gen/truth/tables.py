"""Where was every vehicle at every step, seen from roads, lanes and junctions? Tables for the truth of events."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from data_gen.drawing.view import BoolArray
from data_gen.simulation.states import FloatArray, VehicleStates
from data_gen.truth.motion import IndexArray, Motion
from gis.road_network import RoadNetwork


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
    >>> from data_gen.truth.motion import tabulate
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
    column = {vehicle_id: place for place, vehicle_id in enumerate(motion.ids)}
    rows = np.concatenate([np.full(len(step.ids), number) for number, step in enumerate(states)])
    columns = np.array([column[vehicle_id] for step in states for vehicle_id in step.ids], dtype=np.int64)
    centre_m = np.concatenate([step.centre_m for step in states])
    positions = network.locate(centre_m)
    lane_of = {lane.id: number for number, lane in enumerate(network.lanes)}
    front_lane = np.array([lane_of.get(lane, -1) for step in states for lane in step.lanes], dtype=np.int32)
    shape = motion.road.shape
    width_m = np.zeros(len(motion.ids))
    width_m[columns] = np.concatenate([step.width_m for step in states])
    present = np.zeros(shape, dtype=np.bool_)
    present[rows, columns] = True

    def table(values: FloatArray) -> FloatArray:
        filled = np.full(shape, np.nan)
        filled[rows, columns] = values
        return filled

    def indices(values: IndexArray) -> IndexArray:
        filled = np.full(shape, -1, dtype=np.int32)
        filled[rows, columns] = values
        return filled

    return TruthTables(
        motion=motion,
        network=network,
        seen=seen,
        present=present,
        x_m=table(centre_m[:, 0]),
        y_m=table(centre_m[:, 1]),
        heading_rad=table(np.concatenate([step.heading_rad for step in states])),
        across_m=table(positions.across_m) * motion.direction,
        junction=indices(positions.junction),
        front_lane=indices(front_lane),
        width_m=width_m,
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
