"""Who drives round a roundabout, so that some wait to enter and all leave in different directions?

A ring of 20 m radius with one lane of 5 m, four arms of 200 m with one lane of 3.5 m each way; the ring goes first.
"""

from data_gen.scenario import Flow, OptionValues, Scenario, ScenarioOption, View, shipped_network
from data_gen.scenarios.kinds import bus, car, motorcycle, truck, van

ROUNDABOUT_OPTIONS = (ScenarioOption("demand", "how much traffic there is", ("normal", "low", "high")),)
_ARMS = ("east", "north", "west", "south")
"""Counter-clockwise, as the ring is driven."""
_DEMAND = {"low": 0.5, "normal": 1.0, "high": 1.3}
_EXITS_HZ = ((1, 0.035), (2, 0.05), (3, 0.03))
"""Exits onward from the own arm, and how many vehicles a second take them."""
_DRIVER = (("speedFactor", "normc(0.95,0.08,0.75,1.1)"), ("sigma", "0.3"))


def roundabout(options: OptionValues) -> Scenario:
    """Describe the roundabout.

    Parameters
    ----------
    options : `demand` (low, normal, high).

    Returns
    -------
    The scenario; the camera covers 160 m around the island.
    """
    factor = _DEMAND[options.choice("demand")]
    return Scenario(
        name="roundabout",
        network_file=shipped_network("roundabout"),
        kinds=(
            car(0.78, _DRIVER),
            van(0.12, _DRIVER),
            truck(0.03, _DRIVER),
            bus(0.03, _DRIVER),
            motorcycle(0.04, _DRIVER),
        ),
        flows=tuple(
            Flow(f"{arm}_in", f"{_ARMS[(place + onward) % 4]}_out", rate_hz * factor, shortest_gap_s=1.5)
            for place, arm in enumerate(_ARMS)
            for onward, rate_hz in _EXITS_HZ
        ),
        view=View(centre_m=(0.0, 0.0), width_m=160.0),
        warm_up_us=80_000_000,
    )
