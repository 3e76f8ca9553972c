"""Where was every vehicle at every step, seen from roads, lanes and junctions? Tables over all steps of a clip."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, fields

import numpy as np

from data_gen.simulation.states import BoolArray, Cells, FloatArray, IndexArray, IntArray, VehicleStates
from data_gen.truth.event import ROLES, TruthEvent, reasons_cut_by_clip, reasons_out_of_view, rows_around
from gis.roads.road_network import RoadNetwork

NOMINAL, STRICT, LOOSE = 0, 1, 2
"""Columns of a condition that is asked three times: as it stands, strictly and loosely."""


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

    def span_us(self, start: int, end: int) -> tuple[int, int]:
        """Give the interval of steps from `start` to before `end`, as far as the clip goes."""
        return int(self.t_us[start]), int(self.t_us[min(end, len(self.t_us) - 1)])

    def steps(self, start_us: int, end_us: int) -> slice:
        """Give the steps in [start, end)."""
        return slice(*np.searchsorted(self.t_us, (start_us, end_us)).tolist())

    def event(
        self,
        event_type: str,
        vehicles: Sequence[int],
        core_us: tuple[int, int],
        reasons: Iterable[str],
        *,
        places: tuple[tuple[str, str], ...] = (),
    ) -> TruthEvent:
        """Make an event of columns of the tables; `reasons` say why it does not count, if any do."""
        ids = tuple(self.ids[vehicle] for vehicle in vehicles)
        return TruthEvent(event_type, ids, *core_us, "; ".join(reasons) or None, places=places)


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
class TruthTables(Motion):
    """What the truth of events is derived from: more tables of (steps, vehicles), and the network."""

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

    def seen_around(self, vehicles: Sequence[int], core_us: tuple[int, int]) -> BoolArray:
        """Tell when vehicles are seen from 1 s before to 1 s after an interval: (steps, vehicles)."""
        return self.seen[rows_around(self.t_us, *core_us), :][:, list(vehicles)]

    def doubts_of_view(self, event_type: str, vehicles: Sequence[int], core_us: tuple[int, int]) -> list[str]:
        """Say where the clip or the view does not hold all from 1 s before to 1 s after an event."""
        seen = self.seen_around(vehicles, core_us)
        return [*reasons_cut_by_clip(self.t_us, *core_us), *reasons_out_of_view(seen, ROLES[event_type])]

    def is_against_lane(self, steps: slice, vehicle: int) -> BoolArray:
        """Tell at which steps a vehicle drives against the direction of the lane under its centre."""
        lane_way = np.array([lane.direction for lane in self.network.lanes] + [0])
        lane = self.lane[steps, vehicle]
        return np.asarray((lane >= 0) & (lane_way[lane] == -self.direction[steps, vehicle]), dtype=np.bool_)

    def agreed_us(self, levels: BoolArray, first: int, *, within_us: int, least_us: int = 0) -> tuple[int, int] | None:
        """Give when a condition holds nominally, if it holds for about as long strictly and loosely.

        Parameters
        ----------
        levels : (steps, 3), where it holds nominally and strictly; loosely it does at all of them.
        first : step of the clip at which they begin.
        within_us : the strict interval starts and ends so near to the whole one.
        least_us : the strict interval is at least so long.

        Returns
        -------
        The interval; None if it or the strict one is not whole, or the strict one is too short.
        """
        found = [list(stretches(levels[:, level])) for level in (STRICT, NOMINAL)]
        if any(len(one) != 1 for one in found):
            return None
        strict_us, nominal_us = (self.span_us(first + start, first + end) for [(start, end)] in found)
        loose_us = self.span_us(first, first + len(levels))
        if strict_us[1] - strict_us[0] < least_us:
            return None
        if any(abs(one - other) > within_us for one, other in zip(strict_us, loose_us, strict=True)):
            return None
        return nominal_us


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
    cells = Cells(states, ids)
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
            for start, end in stretches(together):
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
    >>> from gis.roads.lanes import Lane
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
    cells = Cells(states, motion.ids)
    centre_m = np.concatenate([step.centre_m for step in states])
    positions = network.locate(centre_m)
    lane_of = {lane.id: number for number, lane in enumerate(network.lanes)}
    front_lane = np.array([lane_of.get(lane, -1) for step in states for lane in step.lanes], dtype=np.int32)
    return TruthTables(
        **{field.name: getattr(motion, field.name) for field in fields(motion)},
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
