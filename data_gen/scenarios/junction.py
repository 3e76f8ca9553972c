"""Who drives at a signalised junction, so that queues build up at red and all turns occur?

Four arms of 260 m, two lanes of 3.3 m each way: right and straight on from the outer lane, straight on and left from
the inner one. Each axis has green for 26 s, then its left turns alone, out of 80 s; left turns also go through gaps in
the oncoming traffic. The demand fills some five places in each lane at red and clears them nearly always.
"""

from data_gen.scenario import Flow, OptionValues, Scenario, ScenarioOption, VehicleKind, View, shipped_network
from data_gen.scenarios.kinds import Driver, bus, car, motorcycle, truck, van

JUNCTION_OPTIONS = (
    ScenarioOption("lights", "program of the traffic light", ("fixed", "actuated")),
    ScenarioOption("demand", "how much traffic there is", ("normal", "low", "high")),
)
_ARMS = ("north", "east", "south", "west")
"""Clockwise: from an arm the next one is to the left, the one before to the right."""
_DEMAND = {"low": 0.5, "normal": 1.0, "high": 1.25}
_STRAIGHT_HZ, _RIGHT_HZ, _LEFT_HZ = 0.1, 0.035, 0.025
_TOWN_DRIVER = (
    *(("speedFactor", "normc(0.95,0.08,0.75,1.1)"), ("sigma", "0.3")),
    # A car moves sideways at a fifth of its speed at most: without it some turn across both lanes of a queue.
    *(("lcMaxSpeedLatStanding", "0"), ("lcMaxSpeedLatFactor", "0.2")),
)


def junction(options: OptionValues) -> Scenario:
    """Describe the signalised junction.

    Parameters
    ----------
    options : `lights` (fixed, actuated) and `demand` (low, normal, high).

    Returns
    -------
    The scenario; the camera covers 180 m around the middle.
    """
    factor = _DEMAND[options.choice("demand")]
    return Scenario(
        name="junction",
        network_file=shipped_network("junction"),
        kinds=_kinds(_TOWN_DRIVER),
        flows=_flows(factor),
        view=View(centre_m=(0.0, 0.0), width_m=180.0),
        # Two rounds of the lights.
        warm_up_us=160_000_000,
        simulator_options=("--lanechange.duration", "2.5"),
        solid_line_m=100.0,
        light_programs=(("centre", options.choice("lights")),),
    )


def _flows(factor: float) -> tuple[Flow, ...]:
    # Who turns stays in the lane for it; the corner to the right is too tight for the long ones.
    driver = (*_TOWN_DRIVER, ("lcSpeedGain", "0"), ("lcKeepRight", "0"), ("lcCooperative", "0"))
    turning_right = (car(0.83, driver), van(0.13, driver), motorcycle(0.04, driver))
    turns = ((1, _LEFT_HZ, _kinds(driver)), (2, _STRAIGHT_HZ, ()), (3, _RIGHT_HZ, turning_right))
    return tuple(
        Flow(f"{arm}_in", f"{_ARMS[(place + turn) % 4]}_out", rate_hz * factor, kinds=kinds, shortest_gap_s=1.0)
        for place, arm in enumerate(_ARMS)
        for turn, rate_hz, kinds in turns
    )


def _kinds(driver: Driver) -> tuple[VehicleKind, ...]:
    return (
        car(0.78, driver),
        van(0.12, driver),
        truck(0.03, driver),
        bus(0.03, driver),
        motorcycle(0.04, driver),
    )
