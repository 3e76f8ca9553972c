"""Who drives on a motorway, so that they pass, cut in and keep right?

1.8 km in a gentle bend, three lanes of 3.6 m each way, 4 m of central reserve. Speeds differ widely: trucks at 24 m/s,
drivers who take their time, and some who are in a hurry. `lcKeepRight` makes them return to the right after each pass,
as they must; drivers in a hurry (`lcAssertive`) take small gaps, so cut-ins occur.
"""

from data_gen.scenario import (
    DEMAND,
    Driver,
    Flow,
    OptionValues,
    RoadsideStop,
    Scenario,
    ScenarioOption,
    View,
    kind_of,
    shipped_network,
)

MOTORWAY_NETWORK = shipped_network("motorway")
MOTORWAY_VIEW = View(centre_m=(900.0, 148.0), width_m=400.0)
MOTORWAY_OPTIONS = (
    ScenarioOption("carriageways", "how many of them carry traffic", ("2", "1")),
    DEMAND,
    ScenarioOption("jam", "eastbound traffic stands, behind three who stopped abreast"),
)
_RATES_HZ = {"low": 0.2, "normal": 0.4, "high": 0.6}
_JAM_HZ, _JAM_FRONT_M = 1.0, 1080.0
_JAM_BEGINS_US, _JAM_LASTS_US = -150_000_000, 300_000_000
"""When those who stop set out, and how long they stand; the queue is 250 m long when the clip begins, and grows."""
_KEEP_RIGHT = (("lcKeepRight", "8"), ("sigma", "0.3"))
_HURRY = (
    *(("maxSpeed", "42"), ("speedFactor", "normc(1.2,0.05,1.1,1.3)"), ("lcAssertive", "1.5"), ("tau", "0.8")),
    *_KEEP_RIGHT,
)


def motorway(options: OptionValues) -> Scenario:
    """Describe the motorway.

    Parameters
    ----------
    options : `carriageways` (2, 1: eastbound alone), `demand` (low, normal, high) and `jam` (a flag).

    Returns
    -------
    The scenario; the camera covers 400 m around the top of the bend.
    """
    edges = ("eastbound", "westbound") if options["carriageways"] == "2" else ("eastbound",)
    rate_hz, has_jam = _RATES_HZ[options["demand"]], options["jam"] == "1"
    return Scenario(
        name="motorway",
        network_file=MOTORWAY_NETWORK,
        kinds=(
            kind_of("car", 0.3, _cruise("28", "normc(0.9,0.06,0.75,1.05)"), name="calm car"),
            kind_of("car", 0.32, _cruise("36", "normc(1.02,0.06,0.9,1.15)")),
            kind_of("car", 0.12, _HURRY, name="hurried car"),
            kind_of("van", 0.08, _cruise("31", "normc(0.95,0.06,0.8,1.1)")),
            kind_of("truck", 0.13, _cruise("24", "normc(0.8,0.03,0.7,0.9)")),
            kind_of("bus", 0.02, _cruise("27", "0.88")),
            kind_of("motorcycle", 0.03, _HURRY),
        ),
        flows=tuple(
            Flow(edge, edge, _JAM_HZ if has_jam and edge == "eastbound" else rate_hz, shortest_gap_s=0.8)
            for edge in edges
        ),
        stops=tuple(_stop(lane) for lane in range(3)) if has_jam else (),
        view=MOTORWAY_VIEW,
        # A truck needs 77 s from end to end.
        warm_up_us=160_000_000 if has_jam else 90_000_000,
        simulator_options=("--lanechange.duration", "3"),
    )


def _stop(lane: int) -> RoadsideStop:
    """Let a van stop in one of the lanes."""
    return RoadsideStop(
        edge="eastbound",
        kind=kind_of("van", 1.0, _cruise("28", "1")),
        depart_us=_JAM_BEGINS_US,
        lane=f"eastbound_{lane}",
        front_m=_JAM_FRONT_M,
        stand_us=_JAM_LASTS_US,
        right_m=0.0,
    )


def _cruise(fastest_mps: str, speed_factor: str) -> Driver:
    return (("maxSpeed", fastest_mps), ("speedFactor", speed_factor), *_KEEP_RIGHT)
