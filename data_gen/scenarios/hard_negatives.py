"""Who drives so that a careless recogniser sees overtakes where there are none?

Each scenario has plenty of one thing and no overtake at all. Most use the networks of the rural road and the
motorway.
"""

from collections.abc import Mapping

from data_gen.scenario import (
    Flow,
    OptionValues,
    RoadsideStop,
    Scenario,
    VehicleClass,
    View,
    kind_of,
    mix,
    shipped_network,
)
from data_gen.scenarios.motorway import MOTORWAY_NETWORK, MOTORWAY_VIEW
from data_gen.scenarios.rural_overtaking import RURAL_NETWORK

_PATIENT = (("speedFactor", "1"), ("speedDev", "0"), ("sigma", "0.2"), ("lcOpposite", "0"))
_RURAL_VIEW = View(centre_m=(500.0, 0.0), width_m=400.0)
_EVEN_MIX: Mapping[VehicleClass, float] = {"car": 0.7, "van": 0.1, "truck": 0.1, "motorcycle": 0.1}
_SECOND_US = 1_000_000
# A driver who passes what stands, and has no reason to pass anybody else: all drive alike.
_EVEN_DRIVER = (
    *(("maxSpeed", "13.9"), ("speedFactor", "1"), ("speedDev", "0"), ("sigma", "0"), ("accel", "2.6")),
    *(("lcOpposite", "1"), ("lcKeepRight", "30"), ("lcSpeedGain", "1")),
)


def following_only(options: OptionValues) -> Scenario:
    """Describe platoons on the rural road that nobody leaves.

    Parameters
    ----------
    options : none are known.

    Returns
    -------
    The scenario; a slow vehicle leads each platoon, both ways.
    """
    kinds = (
        kind_of("truck", 0.1, (("maxSpeed", "14"), *_PATIENT)),
        kind_of("car", 0.6, (("maxSpeed", "22"), *_PATIENT)),
        kind_of("van", 0.15, (("maxSpeed", "20"), *_PATIENT)),
        kind_of("bus", 0.05, (("maxSpeed", "16"), *_PATIENT)),
        kind_of("motorcycle", 0.1, (("maxSpeed", "22"), *_PATIENT)),
    )
    return Scenario(
        name="following_only",
        network_file=RURAL_NETWORK,
        kinds=kinds,
        flows=(Flow("eastbound", "eastbound", 0.2, platoon=6), Flow("westbound", "westbound", 0.1, platoon=4)),
        view=_RURAL_VIEW,
        warm_up_us=130 * _SECOND_US,
    )


def meeting_only(options: OptionValues) -> Scenario:
    """Describe traffic both ways in which nobody comes near the one ahead.

    Parameters
    ----------
    options : none are known.

    Returns
    -------
    The scenario; all drive 18 m/s, at least 5 s apart.
    """
    return Scenario(
        name="meeting_only",
        network_file=RURAL_NETWORK,
        kinds=mix(_EVEN_MIX, (("maxSpeed", "18"), *_PATIENT)),
        flows=tuple(Flow(edge, edge, 0.12, shortest_gap_s=5.0) for edge in ("eastbound", "westbound")),
        view=_RURAL_VIEW,
        warm_up_us=100 * _SECOND_US,
    )


def parked_car(options: OptionValues) -> Scenario:
    """Describe cars that stop in their lane on the rural road, where all others pass them.

    Parameters
    ----------
    options : none are known.

    Returns
    -------
    The scenario; every 3 minutes a car and a van stop, and stand for a minute and a half to two and a half; one car
    stands before the clip begins.
    """
    return Scenario(
        name="parked_car",
        network_file=RURAL_NETWORK,
        kinds=mix({"car": 0.85, "van": 0.15}, _EVEN_DRIVER),
        flows=(
            Flow("eastbound", "eastbound", 0.13, shortest_gap_s=4.0),
            Flow("westbound", "westbound", 0.02, shortest_gap_s=4.0),
        ),
        view=_RURAL_VIEW,
        warm_up_us=140 * _SECOND_US,
        simulator_options=("--lanechange.duration", "2.5"),
        stops=_stops(),
    )


def _stops() -> tuple[RoadsideStop, ...]:
    """Lay out an hour of stops: the first vehicle stands already, the others pull up while the camera looks."""
    cars_and_vans: tuple[tuple[VehicleClass, int, float, int], ...] = (("car", 0, 420.0, 140), ("van", 60, 610.0, 95))
    return tuple(
        RoadsideStop(
            edge="eastbound",
            kind=kind_of(vehicle_class, 1.0, _EVEN_DRIVER),
            depart_us=(start_s + later_s) * _SECOND_US,
            lane="eastbound_0",
            front_m=front_m,
            stand_us=stand_s * _SECOND_US,
            right_m=0.8,
        )
        for vehicle_class, later_s, front_m, stand_s in cars_and_vans
        for start_s in range(-90, 3600, 180)
    )


def lane_change_only(options: OptionValues) -> Scenario:
    """Describe motorway drivers who change lanes for no reason and never pass each other.

    Parameters
    ----------
    options : none are known.

    Returns
    -------
    The scenario; all drive 25 m/s, at least 3 s apart whatever their lane.
    """
    driver = (
        *(("maxSpeed", "25"), ("speedFactor", "1"), ("speedDev", "0"), ("sigma", "0")),
        *(("lcSpeedGain", "0"), ("lcKeepRight", "0"), ("lcCooperative", "0")),
    )
    depart = (("departSpeed", "desired"), ("departLane", "random"))
    return Scenario(
        name="lane_change_only",
        network_file=MOTORWAY_NETWORK,
        kinds=mix(_EVEN_MIX, driver),
        flows=tuple(Flow(edge, edge, 0.2, shortest_gap_s=3.0, depart=depart) for edge in ("eastbound", "westbound")),
        view=MOTORWAY_VIEW,
        warm_up_us=80 * _SECOND_US,
        simulator_options=("--lanechange.duration", "3"),
        lane_change_rate_hz=0.06,
    )


def queue_passing(options: OptionValues) -> Scenario:
    """Describe a queue and those who pass it in the left lane.

    The right lane leads to a turn with 14 s of green in 45 s, at 1.6 m/s at most: whoever drives past passes somebody
    who stands or creeps. That is a pass and never an overtake.

    Parameters
    ----------
    options : none are known.

    Returns
    -------
    The scenario; the camera covers 180 m up to the light.
    """
    driver = (("speedFactor", "1"), ("speedDev", "0"), ("sigma", "0.2"))
    return Scenario(
        name="queue_passing",
        network_file=shipped_network("queue_passing"),
        kinds=mix({"car": 0.8, "van": 0.1, "truck": 0.04, "bus": 0.02, "motorcycle": 0.04}, driver),
        flows=(
            Flow("approach", "turn", 0.1, shortest_gap_s=5.0, depart=(("departSpeed", "max"), ("departLane", "0"))),
            Flow("approach", "onward", 0.15, shortest_gap_s=2.0, depart=(("departSpeed", "max"), ("departLane", "1"))),
        ),
        view=View(centre_m=(-20.0, 0.0), width_m=180.0),
        # At 1.6 m/s the queue needs 230 s from end to end.
        warm_up_us=300_000_000,
    )
