"""Who drives on a straight two-way rural road, so that fast cars overtake slow ones through the oncoming lane?

1800 m, one lane of 3.5 m each way. What the numbers were chosen for (seeds 1 to 5, 240 s each, all countable
overtakes together and the hardest braking anywhere):

* The oncoming flow is the sensitive one: twice as much, and next to nobody finds a gap.
* A fifth of slow cars, which keep 2 s apart: with more of them, or closer together, platoons form that nobody can
  leave half way, and somebody brakes at 9 m/s2 in front of an oncoming car.
* `lcKeepRight` makes drivers return soon after the slow car, as people do; without it they stay in the oncoming lane
  for hundreds of metres.
* `lanechange.duration` spreads the lane change over 2.5 s; without it vehicles jump 3.5 m sideways between frames.
"""

from pathlib import Path

from data_gen.scenario import Flow, Scenario, VehicleKind, View

_OVERTAKING_DRIVER = (("lcOpposite", "1"), ("lcSpeedGain", "3"), ("lcAssertive", "1"), ("lcKeepRight", "30"))
_CAR_LENGTH_M = (4.1, 4.9)
_CAR_WIDTH_M = (1.75, 1.9)


def rural_overtaking() -> Scenario:
    """Describe the rural overtaking road.

    Returns
    -------
    The scenario; the camera covers x 200 to 800 m of the 1800 m.
    """
    return Scenario(
        name="rural_overtaking",
        network_file=Path(__file__).parent / "network.net.xml",
        kinds=(_slow_car(), _fast_car(), _truck()),
        flows=(Flow("eastbound", "eastbound", 0.18), Flow("westbound", "westbound", 0.025)),
        view=View(centre_m=(500.0, 0.0), width_m=600.0),
        # A slow car needs 164 s from end to end.
        warm_up_us=160_000_000,
        simulator_options=("--lanechange.duration", "2.5"),
    )


def _slow_car() -> VehicleKind:
    return VehicleKind(
        name="slow car",
        vehicle_class="car",
        share=0.2,
        length_m=_CAR_LENGTH_M,
        width_m=_CAR_WIDTH_M,
        driver=(("maxSpeed", "11"), ("accel", "3"), ("tau", "2"), *_OVERTAKING_DRIVER),
    )


def _fast_car() -> VehicleKind:
    return VehicleKind(
        name="fast car",
        vehicle_class="car",
        share=0.7,
        length_m=_CAR_LENGTH_M,
        width_m=_CAR_WIDTH_M,
        driver=(("maxSpeed", "27"), ("accel", "3"), *_OVERTAKING_DRIVER),
    )


def _truck() -> VehicleKind:
    return VehicleKind(
        name="truck",
        vehicle_class="truck",
        share=0.1,
        length_m=(9.0, 11.0),
        width_m=(2.45, 2.55),
        driver=(("maxSpeed", "13"), ("accel", "1.2"), *_OVERTAKING_DRIVER),
    )
