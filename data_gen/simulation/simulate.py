"""How does the traffic of a scenario move? Runs SUMO inside the process and returns the states of each step.

`run_sumo` drives (libsumo is one simulation per process); `roadside` and `attempts` add what SUMO does not do.

SUMO moves points (front bumpers) along lanes and turns a vehicle by up to 8 degrees from one step to the next when a
lane change starts. A body does not: `drag_bodies` lets the front bumper drag it like a trailer, the rear axle following
(a tractrix). Heading and centre stay smooth, and a car in a bend cuts the corner as real ones do.
"""

import math
import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path

import libsumo
import numpy as np

from data_gen.errors import DataGenError
from data_gen.scenario import Scenario
from data_gen.simulation.attempts import add_attempts
from data_gen.simulation.demand import Departure, draw_departures, routes_xml
from data_gen.simulation.roadside import append_parked, draw_to_the_side
from data_gen.simulation.states import FloatArray, FrontStates, VehicleStates, states_of

_LARGEST_SEED = 2**31 - 1

SETTLING_US = 10_000_000
"""Before the clip starts; a body that begins in the middle of a turn needs some metres to lie as it should."""

LOOK_AHEAD_US = 30_000_000
"""Simulated past the clip's end where drivers give overtakes up: whether one may try depends on what comes."""
_STAY_S = 5.0
"""For as long a driver who changed lane for no reason stays there at least."""

_ONLY_AS_TOLD = 0b11_0000_0000
"""SUMO's lane change mode: no changes of its own; respects the gaps of others and does not adapt its speed."""

_AS_SUMO_LIKES = 0b110_0101_0101
"""SUMO's usual lane change mode."""
Run = tuple[tuple[FrontStates, ...], Mapping[str, FloatArray]]
"""The steps, and the centre line (k, 2) of each lane along which something is parked or stops."""

_REAR_AXLE = 0.8
"""Rear axle's distance behind the front bumper, as a part of the vehicle's length."""


def simulate(
    scenario: Scenario, *, seed: int, rng: np.random.Generator, duration_us: int, step_us: int
) -> tuple[VehicleStates, ...]:
    """Simulate a scenario's traffic.

    Parameters
    ----------
    scenario : network, traffic and warm-up.
    seed : SUMO's own seed, 0 to 2**31 - 1.
    rng : draws the demand.
    duration_us : length of the clip; the warm-up comes on top and is not returned.
    step_us : time between two states, whole milliseconds (SUMO's resolution), at most 100 ms.

    Returns
    -------
    One entry a step, at 0, step_us, ... < duration_us.

    Raises
    ------
    DataGenError
        If an argument is out of range, another simulation runs in this process, or SUMO fails.
    """
    check_seed(seed)
    _check_times(duration_us, step_us)
    end_us = duration_us + (LOOK_AHEAD_US if scenario.attempts is not None else 0)
    departures = draw_departures(scenario, until_us=scenario.warm_up_us + end_us, rng=rng)
    parking_rng, lane_rng, attempt_rng = rng.spawn(3)
    with tempfile.TemporaryDirectory(prefix="data_gen_") as folder:
        route_file = Path(folder) / "traffic.rou.xml"
        route_file.write_text(routes_xml(departures), encoding="utf-8")
        times_us = range(-(scenario.warm_up_us // step_us) * step_us, end_us, step_us)
        fronts, lane_lines_m = run_sumo(
            scenario, route_file, seed=seed, rng=lane_rng, times_us=times_us, first_kept_us=-SETTLING_US
        )
    vehicles = {departure.id: departure for departure in departures}
    steps = draw_to_the_side(fronts, vehicles, lane_lines_m)
    if scenario.attempts is not None:
        steps = add_attempts(steps, vehicles, scenario.attempts, attempt_rng)
    moving = drag_bodies([step for step in steps if step.t_us < duration_us], vehicles)
    return append_parked([item for item in moving if item.t_us >= 0], scenario, lane_lines_m, parking_rng)


def check_seed(seed: int) -> None:
    """Refuse, with a DataGenError, a seed that SUMO cannot take."""
    if not 0 <= seed <= _LARGEST_SEED:
        raise DataGenError(f"seed: expected 0 to {_LARGEST_SEED}, got {seed!r}")


def _check_times(duration_us: int, step_us: int) -> None:
    if duration_us < step_us:
        raise DataGenError(f"duration: expected at least one step of {step_us} us, got {duration_us!r} us")
    # 100 ms: no vehicle may jump over another between two states, or an overtake would have no overlap.
    if step_us % 1000 or not 1000 <= step_us <= 100_000:
        raise DataGenError(f"step: expected whole milliseconds from 1 to 100, got {step_us!r} us")


def run_sumo(
    scenario: Scenario,
    route_file: Path,
    *,
    seed: int,
    rng: np.random.Generator,
    times_us: range,
    first_kept_us: int,
) -> Run:
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


def _run(scenario: Scenario, rng: np.random.Generator, times_us: range, first_kept_us: int) -> Run:
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
    return tuple(steps), lines_m


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
    return states_of(known, t_us=step.t_us, lanes=step.lanes, poses=poses, speed_mps=step.speed_mps)


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
