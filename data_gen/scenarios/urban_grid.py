"""Who drives in a town of six junctions, past rows of parked cars?

Two streets cross three lanes, 90 by 70 m apart, one lane of 3.4 m each way; the middle crossings have lights, at the
others the streets go first. Cars are parked beside the streets and the lanes, off the carriageway.
"""

from data_gen.scenario import (
    DEMAND,
    Flow,
    OptionValues,
    ParkingStrip,
    Scenario,
    ScenarioOption,
    View,
    kind_of,
    mix,
    shipped_network,
)

URBAN_OPTIONS = (DEMAND, ScenarioOption("parked", "parked cars beside the streets", ("1", "0")))
_DEMAND = {"low": 0.5, "normal": 1.0, "high": 1.3}
_DRIVER = (("speedFactor", "normc(0.9,0.08,0.7,1.05)"), ("sigma", "0.3"))
_THROUGH_HZ, _SIDE_HZ, _TURN_HZ = 0.06, 0.025, 0.012
_WEST, _EAST = ("street0_0", "street1_0"), ("street0_3", "street1_3")
_SOUTH, _NORTH = ("lane0_0", "lane1_0", "lane2_0"), ("lane0_2", "lane1_2", "lane2_2")
_KERB_M = 1.7 + 0.2 + 0.95
"""From the lane's centre line to that of a parked car: half a lane, a hand's breadth, half a car."""
_CLEAR_OF_JUNCTION_M = 14.0
"""Nobody parks where a bus swings in."""


def urban_grid(options: OptionValues) -> Scenario:
    """Describe the town.

    Parameters
    ----------
    options : `demand` (low, normal, high) and `parked` (1, 0).

    Returns
    -------
    The scenario; the camera covers 240 m around the middle.
    """
    factor = _DEMAND[options["demand"]]
    return Scenario(
        name="urban_grid",
        network_file=shipped_network("urban_grid"),
        kinds=mix({"car": 0.8, "van": 0.12, "truck": 0.02, "bus": 0.02, "motorcycle": 0.04}, _DRIVER),
        flows=(*_through_flows(factor), *_turning_flows(factor)),
        view=View(centre_m=(0.0, 0.0), width_m=240.0),
        warm_up_us=120_000_000,
        parking=_parking() if options["parked"] == "1" else (),
    )


def _through_flows(factor: float) -> tuple[Flow, ...]:
    """Drive along the streets and lanes from end to end, both ways."""
    streets = [(west, east, _THROUGH_HZ) for west, east in zip(_WEST, _EAST, strict=True)]
    lanes = [(south, north, _SIDE_HZ) for south, north in zip(_SOUTH, _NORTH, strict=True)]
    return tuple(
        Flow(from_edge, to_edge, rate_hz * factor, shortest_gap_s=1.5)
        for start, end, rate_hz in (*streets, *lanes)
        for from_edge, to_edge in ((start, end), (f"-{end}", f"-{start}"))
    )


def _turning_flows(factor: float) -> tuple[Flow, ...]:
    """Turn from the streets into the lanes; buses and trucks do not, the corners are too tight for them."""
    kinds = mix({"car": 0.83, "van": 0.12, "motorcycle": 0.05}, _DRIVER)
    return tuple(
        Flow(_inward(street), _outward(lane), _TURN_HZ * factor, kinds=kinds, shortest_gap_s=1.5)
        for street in (*_WEST, *_EAST)
        for lane in (_SOUTH[1], _NORTH[0], _NORTH[2])
    )


def _inward(edge: str) -> str:
    """Name the edge into the town: roads are named from south and west, a minus turns them round."""
    return edge if edge in (*_WEST, *_SOUTH) else f"-{edge}"


def _outward(edge: str) -> str:
    return f"-{edge}" if edge in (*_WEST, *_SOUTH) else edge


def _parking() -> tuple[ParkingStrip, ...]:
    """Park along both sides of each block that the camera sees."""
    blocks = [(f"street{row}_{block}", 70.0) for row in (0, 1) for block in (1, 2)]
    blocks += [(f"lane{column}_1", 50.0) for column in (0, 1, 2)]
    return tuple(
        ParkingStrip(
            lane=f"{sign}{edge}_0",
            first_m=_CLEAR_OF_JUNCTION_M,
            last_m=length_m - _CLEAR_OF_JUNCTION_M,
            right_m=_KERB_M,
            kind=kind_of("car", 1.0),
            filled=0.6,
        )
        for edge, length_m in blocks
        for sign in ("", "-")
    )
