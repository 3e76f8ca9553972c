"""What happens in a scenario's clip? Slow, plain measurements that share nothing with the truth code."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import shapely

from data_gen.drawing.view import corners_m
from data_gen.scenario import Scenario
from data_gen.scenarios.catalogue import scenario_named
from data_gen.simulation.simulate import simulate
from data_gen.simulation.states import FloatArray, VehicleStates
from gis.roads.sumo_net import read_sumo_net

STEP_S = 0.1


@dataclass(frozen=True, slots=True)
class Clip:
    scenario: Scenario
    states: tuple[VehicleStates, ...]


@dataclass(frozen=True, slots=True)
class Flip:
    """Two vehicles on one road and in one direction that changed their order."""

    t_us: int
    passer: str
    passed: str
    passed_mps: float


def clip(name: str, options: Mapping[str, str], *, seconds: int, seed: int = 1) -> Clip:
    scenario = scenario_named(name, options)
    rng = np.random.default_rng(seed)
    states = simulate(scenario, seed=seed, rng=rng, duration_us=seconds * 1_000_000, step_us=100_000)
    return Clip(scenario, states)


def moving(step: VehicleStates) -> list[int]:
    """Rows of all vehicles but those that are parked all the time."""
    return [row for row, name in enumerate(step.ids) if not name.startswith("parked")]


def touching_pairs(step: VehicleStates) -> int:
    """Count pairs of bodies that overlap, parked pairs left out."""
    if not step.ids:
        return 0
    bodies = shapely.polygons(corners_m(step))
    first, second = shapely.STRtree(bodies).query(bodies, predicate="intersects")
    rows = set(moving(step))
    return sum(1 for a, b in zip(first.tolist(), second.tolist(), strict=True) if a < b and (a in rows or b in rows))


def tracks(states: tuple[VehicleStates, ...]) -> dict[str, FloatArray]:
    """Give t_s, x, y, heading, speed at each step, (n, 5) a vehicle; nobody ever leaves and comes back."""
    rows: dict[str, list[tuple[float, ...]]] = {}
    for step in states:
        for row in moving(step):
            x_m, y_m = step.centre_m[row].tolist()
            values = (step.t_us / 1e6, x_m, y_m, float(step.heading_rad[row]), float(step.speed_mps[row]))
            rows.setdefault(step.ids[row], []).append(values)
    return {name: np.array(values) for name, values in rows.items()}


def order_flips(played: Clip) -> list[Flip]:
    """Find every change of order, step by step and pair by pair."""
    steps = [dict(placed) for placed in _placed(played)]
    flips: list[Flip] = []
    for before, now, step in zip(steps, steps[1:], played.states[1:], strict=False):
        stay = [one for one in now if one in before]
        for a in stay:
            for b in stay:
                if a == b or now[a][1] < now[b][1]:
                    continue
                same_road = len({before[a][0], before[b][0], now[a][0], now[b][0]}) == 1
                if same_road and before[a][1] < before[b][1] and now[a][1] >= now[b][1]:
                    flips.append(Flip(step.t_us, a, b, now[b][2]))
    return flips


def _placed(played: Clip) -> Iterator[Iterator[tuple[str, tuple[tuple[int, int], float, float]]]]:
    """For each step: name, (road and direction), metres along it in that direction, speed."""
    network = read_sumo_net(played.scenario.network_file)
    for step in played.states:
        at = network.locate(step.centre_m)
        yield (
            (
                step.ids[row],
                (
                    (int(at.road[row]), direction),
                    direction * float(at.along_m[row]),
                    float(step.speed_mps[row]),
                ),
            )
            for row in moving(step)
            if at.road[row] >= 0
            for direction in [1 if np.cos(step.heading_rad[row] - at.tangent_rad[row]) >= 0 else -1]
        )


def lane_sequences(states: tuple[VehicleStates, ...]) -> dict[str, list[str]]:
    """List the lanes of each vehicle in the order it used them, internal ones left out."""
    sequences: dict[str, list[str]] = {}
    for step in states:
        for row in moving(step):
            lane, lanes = step.lanes[row], sequences.setdefault(step.ids[row], [])
            if not lane.startswith(":") and (not lanes or lanes[-1] != lane):
                lanes.append(lane)
    return sequences


def lane_changes(states: tuple[VehicleStates, ...]) -> int:
    """Count moves from one lane of an edge to another one of the same edge."""
    return sum(
        before.rsplit("_", 1)[0] == after.rsplit("_", 1)[0]
        for lanes in lane_sequences(states).values()
        for before, after in pairwise(lanes)
    )
