"""What does SUMO itself do? Runs it inside the process and reads every front bumper at every step.

libsumo is one simulation per process; it is closed on every way out.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import libsumo
import numpy as np

from data_gen.errors import DataGenError
from data_gen.scenario import Scenario
from data_gen.simulation.bodies import FrontStates
from data_gen.simulation.states import FloatArray

_STAY_S = 5.0
"""For as long a driver who changed lane for no reason stays there at least."""

_ONLY_AS_TOLD = 0b11_0000_0000
"""SUMO's lane change mode: no changes of its own; respects the gaps of others and does not adapt its speed."""

_AS_SUMO_LIKES = 0b110_0101_0101
"""SUMO's usual lane change mode."""


@dataclass(frozen=True, slots=True, eq=False)
class SumoRun:
    """What a simulation gave."""

    steps: tuple[FrontStates, ...]
    lane_lines_m: Mapping[str, FloatArray]
    """Centre line (k, 2) of each lane along which something is parked or stops."""


def run_sumo(
    scenario: Scenario,
    route_file: Path,
    *,
    seed: int,
    rng: np.random.Generator,
    times_us: range,
    first_kept_us: int,
) -> SumoRun:
    """Run SUMO over a scenario.

    Parameters
    ----------
    scenario : network, lights, random lane changes, further options.
    route_file : the traffic.
    seed : SUMO's own.
    rng : draws lane changes.
    times_us : of the steps, from the start of the warm-up to the end.
    first_kept_us : earlier steps are simulated and not read.

    Returns
    -------
    The steps that were kept, and lane geometry.

    Raises
    ------
    DataGenError
        If another simulation runs in this process or SUMO fails.
    """
    if libsumo.isLoaded():
        raise DataGenError("libsumo: expected no running simulation in this process, got one")
    try:
        libsumo.start(_command(scenario, route_file, seed, times_us.step))
        return _run(scenario, rng, times_us, first_kept_us)
    except (libsumo.TraCIException, libsumo.FatalTraCIError) as error:
        raise DataGenError(f"scenario {scenario.name!r}: expected SUMO to run it, got {str(error)!r}") from error
    finally:
        libsumo.close()


def _command(scenario: Scenario, route_file: Path, seed: int, step_us: int) -> list[str]:
    return [
        "sumo",
        *("--net-file", str(scenario.network_file)),
        *("--route-files", str(route_file)),
        *("--step-length", f"{step_us / 1_000_000:.3f}"),
        *("--seed", str(seed)),
        *("--time-to-teleport", "-1"),
        *("--no-step-log", "true"),
        *("--no-warnings", "true"),
        *("--duration-log.disable", "true"),
        # SUMO would fetch the schema from the web.
        *("--xml-validation", "never"),
        *scenario.simulator_options,
    ]


def _run(scenario: Scenario, rng: np.random.Generator, times_us: range, first_kept_us: int) -> SumoRun:
    for light, program in scenario.light_programs:
        libsumo.trafficlight.setProgram(light, program)
    lanes = {stop.lane for stop in scenario.stops} | {strip.lane for strip in scenario.parking}
    lines_m = {lane: np.array(libsumo.lane.getShape(lane), dtype=np.float64) for lane in sorted(lanes)}
    steps: list[FrontStates] = []
    kept_on: dict[str, str] = {}
    for t_us in times_us:
        libsumo.simulationStep()
        if scenario.lane_change_rate_hz > 0.0:
            _change_lanes(scenario.lane_change_rate_hz * times_us.step / 1_000_000, rng)
        if scenario.solid_line_m > 0.0:
            _keep_lanes(scenario.solid_line_m, kept_on)
        if t_us >= first_kept_us:
            steps.append(_read(t_us))
    return SumoRun(tuple(steps), lines_m)


def _change_lanes(chance: float, rng: np.random.Generator) -> None:
    """Let each driver, with some chance, move to a lane beside the own one."""
    for vehicle_id in libsumo.vehicle.getIDList():
        if rng.random() < chance:
            lane = libsumo.vehicle.getLaneIndex(vehicle_id) + int(rng.choice((-1, 1)))
            if 0 <= lane < libsumo.edge.getLaneNumber(libsumo.vehicle.getRoadID(vehicle_id)):
                libsumo.vehicle.setLaneChangeMode(vehicle_id, _ONLY_AS_TOLD)
                libsumo.vehicle.changeLane(vehicle_id, lane, _STAY_S)


def _keep_lanes(solid_line_m: float, kept_on: dict[str, str]) -> None:
    """Forbid lane changes before the end of an edge and allow them again after it; `kept_on` holds where."""
    vehicle = libsumo.vehicle
    for vehicle_id in vehicle.getIDList():
        edge = vehicle.getRoadID(vehicle_id)
        if vehicle_id in kept_on:
            if not edge.startswith(":") and edge != kept_on[vehicle_id]:
                vehicle.setLaneChangeMode(vehicle_id, _AS_SUMO_LIKES)
                del kept_on[vehicle_id]
        elif not edge.startswith(":") and _to_the_end_m(vehicle_id) < solid_line_m:
            vehicle.setLaneChangeMode(vehicle_id, _ONLY_AS_TOLD)
            kept_on[vehicle_id] = edge


def _to_the_end_m(vehicle_id: str) -> float:
    length_m = libsumo.lane.getLength(libsumo.vehicle.getLaneID(vehicle_id))
    return float(length_m - libsumo.vehicle.getLanePosition(vehicle_id))


def _read(t_us: int) -> FrontStates:
    vehicle = libsumo.vehicle
    ids = tuple(vehicle.getIDList())
    return FrontStates(
        t_us=t_us,
        ids=ids,
        lanes=tuple(vehicle.getLaneID(vehicle_id) for vehicle_id in ids),
        front_m=np.array([vehicle.getPosition(vehicle_id) for vehicle_id in ids], dtype=np.float64).reshape(-1, 2),
        # SUMO's angle: degrees clockwise from north.
        lane_heading_rad=np.array([math.radians(90.0 - vehicle.getAngle(vehicle_id)) for vehicle_id in ids]),
        speed_mps=np.array([vehicle.getSpeed(vehicle_id) for vehicle_id in ids], dtype=np.float64),
    )
