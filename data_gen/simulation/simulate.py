"""How does the traffic of a scenario move? Runs SUMO inside the process and returns the states of each step.

SUMO drives (and `sumo_run` steps it); `roadside` and `attempts` add what it does not do; `bodies` drags each body after
its front bumper.
"""

import tempfile
from pathlib import Path

import numpy as np

from data_gen.errors import DataGenError
from data_gen.scenario import Scenario
from data_gen.simulation.attempts import add_attempts
from data_gen.simulation.bodies import drag_bodies
from data_gen.simulation.demand import draw_departures, routes_xml
from data_gen.simulation.roadside import append_parked, draw_to_the_side
from data_gen.simulation.states import VehicleStates
from data_gen.simulation.sumo_run import run_sumo

_LARGEST_SEED = 2**31 - 1

SETTLING_US = 10_000_000
"""Before the clip starts; a body that begins in the middle of a turn needs some metres to lie as it should."""

LOOK_AHEAD_US = 30_000_000
"""Simulated past the clip's end where drivers give overtakes up: whether one may try depends on what comes."""


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
        run = run_sumo(scenario, route_file, seed=seed, rng=lane_rng, times_us=times_us, first_kept_us=-SETTLING_US)
    vehicles = {departure.id: departure for departure in departures}
    steps = draw_to_the_side(run.steps, vehicles, run.lane_lines_m)
    if scenario.attempts is not None:
        steps = add_attempts(steps, vehicles, scenario.attempts, attempt_rng)
    moving = drag_bodies([step for step in steps if step.t_us < duration_us], vehicles)
    return append_parked([item for item in moving if item.t_us >= 0], scenario, run.lane_lines_m, parking_rng)


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
