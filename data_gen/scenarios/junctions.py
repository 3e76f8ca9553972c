"""Who drives where roads meet, so that queues build up, some wait to enter, and all turns occur?

*junction*: four arms of 260 m with lights, two lanes of 3.3 m each way: right and straight on from the outer lane,
straight on and left from the inner one. Each axis has green for 26 s, then its left turns alone, out of 80 s; left
turns also go through gaps in the oncoming traffic. The demand fills some five places in each lane at red and clears
them nearly always.

*roundabout*: a ring of 20 m radius with one lane of 5 m, four arms of 200 m with one lane of 3.5 m each way; the ring
goes first.
"""

from collections.abc import Mapping, Sequence

from data_gen.scenario import (
    DEMAND,
    Flow,
    OptionValues,
    ParkingStrip,
    Scenario,
    ScenarioOption,
    VehicleClass,
    VehicleKind,
    View,
    kind_of,
    mix,
    shipped_network,
)

JUNCTION_OPTIONS = (
    ScenarioOption("lights", "program of the traffic light", ("fixed", "actuated")),
    DEMAND,
    ScenarioOption("parked", "rows of parked cars beside the arms"),
)
_SHARES: Mapping[VehicleClass, float] = {"car": 0.78, "van": 0.12, "truck": 0.03, "bus": 0.03, "motorcycle": 0.04}
_CLOCKWISE = ("north", "east", "south", "west")
"""From an arm the next one is to the left, the one before to the right."""
_STRAIGHT_HZ, _RIGHT_HZ, _LEFT_HZ = 0.1, 0.035, 0.025
_COUNTER_CLOCKWISE = ("east", "north", "west", "south")
"""As the ring is driven."""
_EXITS_HZ = ((1, 0.035), (2, 0.05), (3, 0.03))
"""Exits onward from the own arm, and how many vehicles a second take them."""
_RING_DRIVER = (("speedFactor", "normc(0.95,0.08,0.75,1.1)"), ("sigma", "0.3"))
# A car moves sideways at a fifth of its speed at most: without it some turn across both lanes of a queue.
_TOWN_DRIVER = (*_RING_DRIVER, ("lcMaxSpeedLatStanding", "0"), ("lcMaxSpeedLatFactor", "0.2"))
# Who turns stays in the lane for it; the corner to the right is too tight for the long ones.
_TURNING_DRIVER = (*_TOWN_DRIVER, ("lcSpeedGain", "0"), ("lcKeepRight", "0"), ("lcCooperative", "0"))
_TURNING_RIGHT = mix({"car": 0.83, "van": 0.13, "motorcycle": 0.04}, _TURNING_DRIVER)


def junction(options: OptionValues) -> Scenario:
    """Describe the signalised junction.

    Parameters
    ----------
    options : `lights` (fixed, actuated), `demand` (low, normal, high) and `parked` (a flag).

    Returns
    -------
    The scenario; the camera covers 180 m around the middle.
    """
    factor = {"low": 0.5, "normal": 1.0, "high": 1.25}[options["demand"]]
    ways = (
        (1, _LEFT_HZ * factor, mix(_SHARES, _TURNING_DRIVER)),
        (2, _STRAIGHT_HZ * factor, ()),
        (3, _RIGHT_HZ * factor, _TURNING_RIGHT),
    )
    return Scenario(
        name="junction",
        network_file=shipped_network("junction"),
        kinds=mix(_SHARES, _TOWN_DRIVER),
        flows=_flows(_CLOCKWISE, ways, shortest_gap_s=1.0),
        view=View(centre_m=(0.0, 0.0), width_m=180.0),
        # Two rounds of the lights.
        warm_up_us=160_000_000,
        simulator_options=("--lanechange.duration", "2.5"),
        solid_line_m=100.0,
        light_programs=(("centre", options["lights"]),),
        parking=tuple(
            ParkingStrip(f"{arm}_out_0", 25.0, 115.0, right_m=2.8, kind=kind_of("car", 1.0), filled=0.7)
            for arm in (_CLOCKWISE if options["parked"] == "1" else ())
        ),
    )


def roundabout(options: OptionValues) -> Scenario:
    """Describe the roundabout.

    Parameters
    ----------
    options : `demand` (low, normal, high).

    Returns
    -------
    The scenario; the camera covers 160 m around the island.
    """
    factor = {"low": 0.5, "normal": 1.0, "high": 1.3}[options["demand"]]
    ways = [(onward, rate_hz * factor, ()) for onward, rate_hz in _EXITS_HZ]
    return Scenario(
        name="roundabout",
        network_file=shipped_network("roundabout"),
        kinds=mix(_SHARES, _RING_DRIVER),
        flows=_flows(_COUNTER_CLOCKWISE, ways, shortest_gap_s=1.5),
        view=View(centre_m=(0.0, 0.0), width_m=160.0),
        warm_up_us=80_000_000,
    )


def _flows(
    arms: Sequence[str], ways: Sequence[tuple[int, float, tuple[VehicleKind, ...]]], *, shortest_gap_s: float
) -> tuple[Flow, ...]:
    """Drive from each arm to those so many further on, so many vehicles a second, of these kinds."""
    return tuple(
        Flow(f"{arm}_in", f"{arms[(place + onward) % 4]}_out", rate_hz, kinds=kinds, shortest_gap_s=shortest_gap_s)
        for place, arm in enumerate(arms)
        for onward, rate_hz, kinds in ways
    )
