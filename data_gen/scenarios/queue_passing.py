"""Who passes a queue? Traffic in the left lane drives past one that stands and creeps in the right lane.

The right lane leads to a turn with 14 s of green in 45 s, at 1.6 m/s at most: whoever drives past passes somebody who
stands or nearly does. That is a pass and never an overtake.
"""

from data_gen.scenario import Flow, OptionValues, Scenario, View, shipped_network
from data_gen.scenarios.kinds import bus, car, motorcycle, truck, van

_DRIVER = (("speedFactor", "1"), ("speedDev", "0"), ("sigma", "0.2"))


def queue_passing(options: OptionValues) -> Scenario:
    """Describe the queue and those who pass it.

    Parameters
    ----------
    options : none are known.

    Returns
    -------
    The scenario; the camera covers 180 m up to the light.
    """
    del options
    kinds = (
        car(0.8, _DRIVER),
        van(0.1, _DRIVER),
        truck(0.04, _DRIVER),
        bus(0.02, _DRIVER),
        motorcycle(0.04, _DRIVER),
    )
    return Scenario(
        name="queue_passing",
        network_file=shipped_network("queue_passing"),
        kinds=kinds,
        flows=(
            Flow("approach", "turn", 0.1, shortest_gap_s=5.0, depart=(("departSpeed", "max"), ("departLane", "0"))),
            Flow("approach", "onward", 0.15, shortest_gap_s=2.0, depart=(("departSpeed", "max"), ("departLane", "1"))),
        ),
        view=View(centre_m=(-20.0, 0.0), width_m=180.0),
        # At 1.6 m/s the queue needs 230 s from end to end.
        warm_up_us=300_000_000,
    )
