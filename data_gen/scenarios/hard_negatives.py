"""Who drives so that a careless recogniser sees overtakes where there are none?

Each scenario has plenty of one thing and no overtake at all. They use the networks of the rural road and the motorway.
"""

from data_gen.scenario import Flow, OptionValues, RoadsideStop, Scenario, VehicleKind, View
from data_gen.scenarios.kinds import bus, car, motorcycle, truck, van
from data_gen.scenarios.motorway import MOTORWAY_NETWORK
from data_gen.scenarios.rural_overtaking import RURAL_NETWORK

_PATIENT = (("speedFactor", "1"), ("speedDev", "0"), ("sigma", "0.2"), ("lcOpposite", "0"))
_RURAL_VIEW = View(centre_m=(500.0, 0.0), width_m=400.0)
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
    del options
    kinds = (
        truck(0.1, (("maxSpeed", "14"), *_PATIENT)),
        car(0.6, (("maxSpeed", "22"), *_PATIENT)),
        van(0.15, (("maxSpeed", "20"), *_PATIENT)),
        bus(0.05, (("maxSpeed", "16"), *_PATIENT)),
        motorcycle(0.1, (("maxSpeed", "22"), *_PATIENT)),
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
    del options
    driver = (("maxSpeed", "18"), *_PATIENT)
    return Scenario(
        name="meeting_only",
        network_file=RURAL_NETWORK,
        kinds=(car(0.7, driver), van(0.1, driver), truck(0.1, driver), motorcycle(0.1, driver)),
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
    del options
    return Scenario(
        name="parked_car",
        network_file=RURAL_NETWORK,
        kinds=(car(0.85, _EVEN_DRIVER), van(0.15, _EVEN_DRIVER)),
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
    rounds = range(-90, 3600, 180)
    cars = tuple(_stop(car(1.0, _EVEN_DRIVER), depart_s=start_s, front_m=420.0, stand_s=140) for start_s in rounds)
    vans = tuple(_stop(van(1.0, _EVEN_DRIVER), depart_s=start_s + 60, front_m=610.0, stand_s=95) for start_s in rounds)
    return (*cars, *vans)


def _stop(kind: VehicleKind, *, depart_s: int, front_m: float, stand_s: int) -> RoadsideStop:
    return RoadsideStop(
        from_edge="eastbound",
        to_edge="eastbound",
        kind=kind,
        depart_us=depart_s * _SECOND_US,
        lane="eastbound_0",
        front_m=front_m,
        stand_us=stand_s * _SECOND_US,
        right_m=0.8,
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
    del options
    driver = (
        *(("maxSpeed", "25"), ("speedFactor", "1"), ("speedDev", "0"), ("sigma", "0")),
        *(("lcSpeedGain", "0"), ("lcKeepRight", "0"), ("lcCooperative", "0")),
    )
    return Scenario(
        name="lane_change_only",
        network_file=MOTORWAY_NETWORK,
        kinds=(car(0.7, driver), van(0.1, driver), truck(0.1, driver), motorcycle(0.1, driver)),
        flows=tuple(
            Flow(
                edge,
                edge,
                0.2,
                shortest_gap_s=3.0,
                depart=(("departSpeed", "desired"), ("departLane", "random")),
            )
            for edge in ("eastbound", "westbound")
        ),
        view=View(centre_m=(900.0, 148.0), width_m=400.0),
        warm_up_us=80 * _SECOND_US,
        simulator_options=("--lanechange.duration", "3"),
        lane_change_rate_hz=0.06,
    )
