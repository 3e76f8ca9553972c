"""Who departs when, in which vehicle? Draws a scenario's traffic and writes it as SUMO routes."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from xml.etree import ElementTree

import numpy as np

from data_gen.scenario import Flow, RoadsideStop, Scenario, VehicleKind

_SECOND_US = 1_000_000
_PLATOON_GAP_S = 2.5


@dataclass(frozen=True, slots=True)
class Departure:
    """One vehicle of the demand, fixed before the simulation starts."""

    id: str
    depart_us: int
    """On the simulator's own clock, 0 = start of the warm-up."""
    flow: Flow
    kind: VehicleKind
    length_m: float
    width_m: float
    appearance: int
    """Seed of the vehicle's looks."""
    stop: RoadsideStop | None = None


def draw_departures(scenario: Scenario, *, until_us: int, rng: np.random.Generator) -> tuple[Departure, ...]:
    """Draw the vehicles of a scenario, with exponential gaps in each flow.

    Parameters
    ----------
    scenario : whose flows, stops and vehicle kinds are used.
    until_us : departures lie in [0, until_us).
    rng : source of every choice; each flow gets a generator of its own, and so does each stop.

    Returns
    -------
    Departures in order of time, named "sim1", "sim2", ... in that order.
    """
    drawn = [
        item
        for flow, flow_rng in zip(scenario.flows, rng.spawn(len(scenario.flows)), strict=True)
        for item in _draw_flow(flow, flow.kinds or scenario.kinds, until_us, flow_rng)
    ]
    for stop, stop_rng in zip(scenario.stops, rng.spawn(len(scenario.stops)), strict=True):
        depart_us = scenario.warm_up_us + stop.depart_us
        if 0 <= depart_us < until_us:
            flow = Flow(stop.edge, stop.edge, rate_hz=0.0)
            drawn.append(replace(draw_vehicle(flow, stop.kind, depart_us, stop_rng), stop=stop))
    drawn.sort(key=lambda item: item.depart_us)
    return tuple(replace(item, id=f"sim{number}") for number, item in enumerate(drawn, start=1))


def draw_vehicle(flow: Flow, kind: VehicleKind, depart_us: int, rng: np.random.Generator) -> Departure:
    """Draw size and looks of one vehicle.

    Parameters
    ----------
    flow, kind, depart_us : kept as they are.
    rng : source of the choices.

    Returns
    -------
    The departure, still without a name.
    """
    return Departure(
        id="",
        depart_us=depart_us,
        flow=flow,
        kind=kind,
        # Two decimals, as written to the route file: the truth has the very size that was simulated.
        length_m=round(rng.uniform(*kind.length_m), 2),
        width_m=round(rng.uniform(*kind.width_m), 2),
        appearance=int(rng.integers(2**31)),
    )


def routes_xml(departures: tuple[Departure, ...]) -> str:
    """Write departures as a SUMO route file.

    Parameters
    ----------
    departures : in order of time, as SUMO requires.

    Returns
    -------
    XML text; each vehicle has a type of its own, since sizes differ.
    """
    routes = ElementTree.Element("routes")
    for item in departures:
        kind, flow, stop = f"type_{item.id}", item.flow, item.stop
        size = {"length": f"{item.length_m:.2f}", "width": f"{item.width_m:.2f}"}
        ElementTree.SubElement(routes, "vType", {"id": kind, **size, **dict(item.kind.driver)})
        way = {"depart": _seconds(item.depart_us), "from": flow.from_edge, "to": flow.to_edge}
        trip = ElementTree.SubElement(routes, "trip", {"id": item.id, "type": kind, **way, **dict(flow.depart)})
        if stop is not None:
            place = {"lane": stop.lane, "endPos": f"{stop.front_m:.2f}"}
            ElementTree.SubElement(trip, "stop", {**place, "duration": _seconds(stop.stand_us)})
    return ElementTree.tostring(routes, encoding="unicode")


def _seconds(time_us: int) -> str:
    return f"{time_us / _SECOND_US:.3f}"


def _draw_flow(
    flow: Flow, kinds: Sequence[VehicleKind], until_us: int, rng: np.random.Generator
) -> Iterator[Departure]:
    """Draw one vehicle after the other: a longer clip begins with the very vehicles of a shorter one."""
    time_s = _gap_s(flow, rng)
    while time_s * _SECOND_US < until_us:
        for place in range(flow.platoon):
            kind = kinds[int(rng.choice(len(kinds), p=[kind.share for kind in kinds]))]
            # SUMO keeps milliseconds.
            depart_us = int((time_s + place * _PLATOON_GAP_S) * 1000) * 1000
            if depart_us < until_us:
                yield draw_vehicle(flow, kinds[0] if place == 0 and flow.platoon > 1 else kind, depart_us, rng)
        time_s += flow.platoon * (_PLATOON_GAP_S if flow.platoon > 1 else 0.0) + _gap_s(flow, rng)


def _gap_s(flow: Flow, rng: np.random.Generator) -> float:
    """Draw the time to the next departure, or to the next platoon after the last one has gone."""
    mean_s = flow.platoon / flow.rate_hz - (flow.platoon * _PLATOON_GAP_S if flow.platoon > 1 else 0.0)
    return flow.shortest_gap_s + float(rng.exponential(mean_s - flow.shortest_gap_s))
