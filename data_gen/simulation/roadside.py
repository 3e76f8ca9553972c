"""Who stands at the roadside? Cars parked along kerbs, and those that pull up in their lane.

SUMO knows nothing of parked cars beside the lane, and stops a vehicle in the middle of it; both are added here.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

import numpy as np
import shapely

from data_gen.scenario import Flow, ParkingStrip, Scenario
from data_gen.simulation.demand import Departure, draw_vehicle
from data_gen.simulation.states import FloatArray, FrontStates, VehicleStates, states_of

_PULLING_UP_M = 25.0
"""Before and after its place a stopping vehicle draws to the side over this distance."""

_PLACE_SPREAD_M = 0.25
"""How unevenly people park: along the kerb, and a third of it across."""


def draw_to_the_side(
    steps: Sequence[FrontStates], vehicles: Mapping[str, Departure], lane_lines_m: Mapping[str, FloatArray]
) -> tuple[FrontStates, ...]:
    """Move vehicles that stop in their lane to its right, smoothly.

    Parameters
    ----------
    steps : as SUMO drives them.
    vehicles : by id; those with a stop are moved.
    lane_lines_m : centre lines (k, 2) of the lanes of the stops.

    Returns
    -------
    The steps, changed where a vehicle is near its place.
    """
    places = {
        name: (_place(lane_lines_m[item.stop.lane], item.stop.front_m)[0], item.stop.right_m)
        for name, item in vehicles.items()
        if item.stop is not None
    }
    return tuple(_beside(step, places) if not places.keys().isdisjoint(step.ids) else step for step in steps)


def _beside(step: FrontStates, places: Mapping[str, tuple[FloatArray, float]]) -> FrontStates:
    front_m = step.front_m.copy()
    for row, name in enumerate(step.ids):
        if name in places:
            place_m, right_m = places[name]
            near = max(0.0, 1.0 - float(np.hypot(*(front_m[row] - place_m))) / _PULLING_UP_M)
            heading_rad = step.lane_heading_rad[row]
            to_the_right = np.array((np.sin(heading_rad), -np.cos(heading_rad)))
            front_m[row] += right_m * near * near * (3 - 2 * near) * to_the_right
    return replace(step, front_m=front_m)


def append_parked(
    states: Sequence[VehicleStates],
    scenario: Scenario,
    lane_lines_m: Mapping[str, FloatArray],
    rng: np.random.Generator,
) -> tuple[VehicleStates, ...]:
    """Add the cars of a scenario's parking strips, named "parked1", "parked2", ..., to every step.

    Parameters
    ----------
    states : of the moving vehicles.
    scenario : whose strips are filled.
    lane_lines_m : centre lines (k, 2) of the lanes of the strips.
    rng : draws which places are taken, and by whom.

    Returns
    -------
    The states with the parked cars behind the moving ones.
    """
    drawn = [
        car
        for strip, strip_rng in zip(scenario.parking, rng.spawn(len(scenario.parking)), strict=True)
        for car in _draw_parked(strip, lane_lines_m[strip.lane], strip_rng)
    ]
    if not drawn:
        return tuple(states)
    parked = states_of(
        [replace(item, id=f"parked{number}") for number, (item, _, _) in enumerate(drawn, start=1)],
        t_us=0,
        lanes=("",) * len(drawn),
        poses=np.array([(*place_m, heading_rad) for _, place_m, heading_rad in drawn]),
        speed_mps=np.zeros(len(drawn)),
    )
    return tuple(item.joined(parked) for item in states)


def _draw_parked(
    strip: ParkingStrip, lane_line_m: FloatArray, rng: np.random.Generator
) -> Iterator[tuple[Departure, FloatArray, float]]:
    flow = Flow("", "", rate_hz=0.0)
    for along_m in np.arange(strip.first_m + strip.place_m / 2, strip.last_m - strip.place_m / 2 + 1e-6, strip.place_m):
        car = draw_vehicle(flow, strip.kind, 0, rng)
        along_off_m, across_off_m = rng.uniform(-_PLACE_SPREAD_M, _PLACE_SPREAD_M, 2)
        if rng.random() < strip.filled:
            place_m, heading_rad = _place(lane_line_m, along_m + along_off_m)
            right_m = strip.right_m + across_off_m / 3
            to_the_right = np.array((np.sin(heading_rad), -np.cos(heading_rad)))
            yield car, place_m + right_m * to_the_right, heading_rad


def _place(line_m: FloatArray, along_m: float) -> tuple[FloatArray, float]:
    """Find a point on a line, and the direction of the line there."""
    line = shapely.LineString(line_m)
    ends = shapely.get_coordinates(shapely.line_interpolate_point(line, [along_m - 0.5, along_m + 0.5]))
    east_m, north_m = ends[1] - ends[0]
    point = shapely.get_coordinates(shapely.line_interpolate_point(line, along_m))[0]
    return np.asarray(point, dtype=np.float64), float(np.arctan2(north_m, east_m))
