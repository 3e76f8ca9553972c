"""Who drives on a straight two-way rural road, so that fast cars overtake slow ones through the oncoming lane?

1800 m, one lane of 3.5 m each way. What the numbers were chosen for (seeds 1 to 5, 240 s each, all countable
overtakes together and the hardest braking anywhere):

* The oncoming flow is the sensitive one: twice as much, and next to nobody finds a gap. `blocked` makes use of that.
* A fifth of slow cars, which keep 2 s apart: with more of them, or closer together, platoons form that nobody can
  leave half way, and somebody brakes at 9 m/s2 in front of an oncoming car.
* `lcKeepRight` makes drivers return soon after the slow car, as people do; without it they stay in the oncoming lane
  for hundreds of metres.
* `lanechange.duration` spreads the lane change over 2.5 s; without it vehicles jump 3.5 m sideways between frames.
"""

from data_gen.scenario import (
    Attempts,
    Driver,
    Flow,
    OptionValues,
    ParkingStrip,
    Scenario,
    ScenarioOption,
    VehicleKind,
    View,
    kind_of,
    shipped_network,
)

RURAL_NETWORK = shipped_network("rural_overtaking")
RURAL_OPTIONS = (
    ScenarioOption("blocked", "so much oncoming traffic that hardly anybody can overtake"),
    ScenarioOption("aborted", "some drivers begin to overtake and give up"),
    ScenarioOption("platoons", "a slow vehicle and three behind it depart together"),
    ScenarioOption("parked", "rows of parked cars beside the road"),
)
_OVERTAKING_DRIVER = (("lcOpposite", "1"), ("lcSpeedGain", "3"), ("lcAssertive", "1"), ("lcKeepRight", "30"))
_LANE_M = 3.5


def _car(name: str, share: float, driver: Driver) -> VehicleKind:
    return VehicleKind(name, "car", share, (4.1, 4.9), (1.75, 1.9), driver)


_SLOW_CAR = _car("slow car", 0.2, (("maxSpeed", "11"), ("accel", "3"), ("tau", "2"), *_OVERTAKING_DRIVER))
_TRUCK_DRIVER = (("maxSpeed", "13"), ("accel", "1.2"), *_OVERTAKING_DRIVER)
_TRUCK = VehicleKind("truck", "truck", 0.1, (9.0, 11.0), (2.45, 2.55), _TRUCK_DRIVER)
_HESITANT_CAR = _car("hesitant car", 0.4, (("maxSpeed", "25"), ("accel", "3"), ("sigma", "0.2"), ("lcOpposite", "0")))
"""Who never overtakes in SUMO; its attempts are added afterwards."""
_PATIENT_CAR = _car(
    "patient car",
    1.0,
    (("maxSpeed", "20"), ("speedFactor", "1"), ("speedDev", "0"), ("sigma", "0.2"), ("lcOpposite", "0")),
)
"""The oncoming traffic that leaves no gap: all alike, and none overtakes."""


def rural_overtaking(options: OptionValues) -> Scenario:
    """Describe the rural overtaking road.

    Parameters
    ----------
    options : `blocked`, `aborted`, `platoons`, `parked` (flags).

    Returns
    -------
    The scenario; the camera covers x 200 to 800 m of the 1800 m.
    """
    aborted = options["aborted"] == "1"
    return Scenario(
        name="rural_overtaking",
        network_file=RURAL_NETWORK,
        kinds=_kinds(aborted=aborted),
        flows=_flows(options),
        view=View(centre_m=(500.0, 0.0), width_m=600.0),
        # A slow car needs 164 s from end to end.
        warm_up_us=160_000_000,
        simulator_options=("--lanechange.duration", "2.5"),
        parking=_parking() if options["parked"] == "1" else (),
        attempts=Attempts(_HESITANT_CAR.name, shift_m=_LANE_M, pause_us=12_000_000) if aborted else None,
    )


def _parking() -> tuple[ParkingStrip, ...]:
    """Park on both verges, where a low camera about the middle of the view sees it."""
    return tuple(
        ParkingStrip(lane, start_m, start_m + 90.0, right_m=3.1, kind=kind_of("car", 1.0), filled=0.7)
        for lane, start_m in (("eastbound_0", 380.0), ("eastbound_0", 560.0), ("westbound_0", 1290.0))
    )


def _flows(options: OptionValues) -> tuple[Flow, ...]:
    eastbound = Flow("eastbound", "eastbound", 0.18, platoon=4 if options["platoons"] == "1" else 1)
    if options["blocked"] == "1":
        # A car every 4 s, never much more: nobody finds a gap of the 15 s that an overtake needs.
        return eastbound, Flow("westbound", "westbound", 0.25, kinds=(_PATIENT_CAR,), shortest_gap_s=3.0)
    return eastbound, Flow("westbound", "westbound", 0.05 if options["aborted"] == "1" else 0.025)


def _kinds(*, aborted: bool) -> tuple[VehicleKind, ...]:
    fast = _car("fast car", 0.3 if aborted else 0.7, (("maxSpeed", "27"), ("accel", "3"), *_OVERTAKING_DRIVER))
    return (_SLOW_CAR, fast, _TRUCK, _HESITANT_CAR) if aborted else (_SLOW_CAR, fast, _TRUCK)
