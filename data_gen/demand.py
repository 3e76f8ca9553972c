"""Who departs when, in which vehicle? Draws a scenario's traffic and writes it as SUMO routes."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from xml.sax.saxutils import quoteattr

import numpy as np

from data_gen.scenario import Flow, Scenario, VehicleKind

_SECOND_US = 1_000_000


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


def draw_departures(scenario: Scenario, *, until_us: int, rng: np.random.Generator) -> tuple[Departure, ...]:
    """Draw the vehicles of a scenario, with exponential gaps in each flow.

    Parameters
    ----------
    scenario : whose flows and vehicle kinds are used.
    until_us : departures lie in [0, until_us).
    rng : source of every choice; each flow gets a generator of its own.

    Returns
    -------
    Departures in order of time, named "sim1", "sim2", ... in that order.
    """
    drawn = [
        item
        for flow, flow_rng in zip(scenario.flows, rng.spawn(len(scenario.flows)), strict=True)
        for item in _draw_flow(flow, scenario.kinds, until_us, flow_rng)
    ]
    drawn.sort(key=lambda item: item.depart_us)
    return tuple(replace(item, id=f"sim{number}") for number, item in enumerate(drawn, start=1))


def routes_xml(departures: tuple[Departure, ...]) -> str:
    """Write departures as a SUMO route file.

    Parameters
    ----------
    departures : in order of time, as SUMO requires.

    Returns
    -------
    XML text; each vehicle has a type of its own, since sizes differ.
    """
    lines = ["<routes>"]
    for item in departures:
        driver = " ".join(f"{name}={quoteattr(value)}" for name, value in item.kind.driver)
        lines.append(
            f'<vType id="type_{item.id}" length="{item.length_m:.2f}" width="{item.width_m:.2f}" {driver}/>'
            f'<trip id="{item.id}" type="type_{item.id}" depart="{item.depart_us / _SECOND_US:.3f}" '
            f"from={quoteattr(item.flow.from_edge)} to={quoteattr(item.flow.to_edge)} "
            'departSpeed="desired" departLane="best"/>'
        )
    lines.append("</routes>")
    return "\n".join(lines)


def _draw_flow(
    flow: Flow, kinds: Sequence[VehicleKind], until_us: int, rng: np.random.Generator
) -> Iterator[Departure]:
    """Draw one vehicle after the other: a longer clip begins with the very vehicles of a shorter one."""
    time_s = rng.exponential(1 / flow.rate_hz)
    while time_s * _SECOND_US < until_us:
        kind = kinds[int(rng.choice(len(kinds), p=[kind.share for kind in kinds]))]
        yield Departure(
            id="",
            # SUMO keeps milliseconds.
            depart_us=int(time_s * 1000) * 1000,
            flow=flow,
            kind=kind,
            # Two decimals, as written to the route file: the truth has the very size that was simulated.
            length_m=round(rng.uniform(*kind.length_m), 2),
            width_m=round(rng.uniform(*kind.width_m), 2),
            appearance=int(rng.integers(2**31)),
        )
        time_s += rng.exponential(1 / flow.rate_hz)
