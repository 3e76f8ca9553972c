"""How does the traffic of a scenario move? Runs SUMO inside the process and returns the states of each step.

SUMO moves points (front bumpers) along lanes and turns a vehicle by up to 8 degrees from one step to the next when a
lane change starts. A body does not: here the front bumper drags it like a trailer, the rear axle following (a
tractrix). Heading and centre stay smooth, and a car in a bend cuts the corner as real ones do.

libsumo is one simulation per process; it is closed on every way out.
"""

import math
import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path

import libsumo
import numpy as np

from data_gen.demand import Departure, draw_departures, routes_xml
from data_gen.errors import DataGenError
from data_gen.scenario import Scenario
from data_gen.states import VehicleStates

_REAR_AXLE = 0.8
"""Rear axle's distance behind the front bumper, as a part of the vehicle's length."""

_LARGEST_SEED = 2**31 - 1


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
    if libsumo.isLoaded():
        raise DataGenError("libsumo: expected no running simulation in this process, got one")
    departures = draw_departures(scenario, until_us=scenario.warm_up_us + duration_us, rng=rng)
    with tempfile.TemporaryDirectory(prefix="data_gen_") as folder:
        route_file = Path(folder) / "traffic.rou.xml"
        route_file.write_text(routes_xml(departures), encoding="utf-8")
        try:
            libsumo.start(_command(scenario, route_file, seed, step_us))
            return _run(scenario, departures, duration_us, step_us)
        except (libsumo.TraCIException, libsumo.FatalTraCIError) as error:
            raise DataGenError(f"scenario {scenario.name!r}: expected SUMO to run it, got {error!r}") from error
        finally:
            libsumo.close()


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


def _run(
    scenario: Scenario, departures: Sequence[Departure], duration_us: int, step_us: int
) -> tuple[VehicleStates, ...]:
    by_id = {departure.id: departure for departure in departures}
    rear_m: dict[str, tuple[float, float]] = {}
    warm_up_steps = scenario.warm_up_us // step_us
    steps = -(-duration_us // step_us)
    states: list[VehicleStates] = []
    for step in range(-warm_up_steps, steps):
        libsumo.simulationStep()
        # The warm-up's last second settles the dragged bodies; before that nobody looks.
        if step * step_us >= -1_000_000:
            states.append(_read_states(step * step_us, by_id, rear_m))
    return tuple(item for item in states if item.t_us >= 0)


def _read_states(t_us: int, by_id: Mapping[str, Departure], rear_m: dict[str, tuple[float, float]]) -> VehicleStates:
    vehicle = libsumo.vehicle
    ids = tuple(vehicle.getIDList())
    known = [by_id[vehicle_id] for vehicle_id in ids]
    poses = np.array([_drag(item, rear_m) for item in known], dtype=np.float64).reshape(-1, 3)
    return VehicleStates(
        t_us=t_us,
        ids=ids,
        classes=tuple(item.kind.vehicle_class for item in known),
        lanes=tuple(vehicle.getLaneID(vehicle_id) for vehicle_id in ids),
        centre_m=poses[:, :2],
        heading_rad=poses[:, 2],
        speed_mps=np.array([vehicle.getSpeed(vehicle_id) for vehicle_id in ids], dtype=np.float64),
        length_m=np.array([item.length_m for item in known], dtype=np.float64),
        width_m=np.array([item.width_m for item in known], dtype=np.float64),
        appearance=np.array([item.appearance for item in known], dtype=np.int64),
    )


def _drag(item: Departure, rear_m: dict[str, tuple[float, float]]) -> tuple[float, float, float]:
    """Pull the vehicle's rear axle after its front bumper; returns centre x, y and heading."""
    x_m, y_m = libsumo.vehicle.getPosition(item.id)
    axle_m = _REAR_AXLE * item.length_m
    if item.id in rear_m:
        heading_rad = math.atan2(y_m - rear_m[item.id][1], x_m - rear_m[item.id][0])
    else:
        # SUMO's angle: degrees clockwise from north.
        heading_rad = math.radians(90.0 - libsumo.vehicle.getAngle(item.id))
    east, north = math.cos(heading_rad), math.sin(heading_rad)
    rear_m[item.id] = (x_m - axle_m * east, y_m - axle_m * north)
    half_m = item.length_m / 2
    # 0.0 + turns -0.0 into 0.0, for which atan2 gives pi and not -pi.
    return x_m - half_m * east, y_m - half_m * north, math.atan2(0.0 + north, east)
