"""Who drove through a junction, and which way? Turns from SUMO's edges and the vehicles' own headings.

A vehicle goes through a junction while its centre is in the junction's outline: a `crossing`. If its front came from
one edge and went on to another one, the change of its heading from 0.5 s before the junction to 1 s after it says how
it turned: more than 45 degrees to the left is `turn_left`, to the right `turn_right`, less `drive_straight`, more than
150 `u_turn`; so is every way back onto the road that it came from.
"""

import math
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from data_gen.truth.event import TruthEvent
from data_gen.truth.motion import TruthTables, stretches

STRAIGHT_RAD = math.radians(45.0)
BACK_RAD = math.radians(150.0)
NEARLY_RAD = math.radians(12.0)
"""A turn that comes so near to the angle that decides leaves open what an observer calls it."""
SHORTEST_US = 500_000
"""Who is in a junction for a shorter time may only have touched its outline."""

_BEFORE_US, _AFTER_US = 500_000, 1_000_000


def find_turns(tables: TruthTables) -> Iterator[TruthEvent]:
    """Find every way through a junction of which at least a part is in view.

    Parameters
    ----------
    tables : of the clip.

    Yields
    ------
    A `crossing` for each, and what kind of turn it is where both edges are known; two kinds if it is between them.
    """
    for vehicle in range(len(tables.ids)):
        junction = tables.junction[:, vehicle]
        for start, end in stretches(junction >= 0):
            if start > 0 and end < len(junction) and len(set(junction[start:end].tolist())) == 1:
                yield from _ways(tables, vehicle, start, end)


def _ways(tables: TruthTables, vehicle: int, start: int, end: int) -> Iterator[TruthEvent]:
    core_us = tables.span_us(start, end)
    is_there = tables.present[[start - 1, end], vehicle].all()
    if not (is_there and tables.seen_around([vehicle], core_us).any()):
        return
    reasons = tables.doubts_of_view("crossing", [vehicle], core_us)
    if core_us[1] - core_us[0] < SHORTEST_US:
        reasons.append("the car is in the junction for less than 0.5 s")
    junction = ("junction", tables.network.junctions[int(tables.junction[start, vehicle])].id)
    crossing = tables.event("crossing", [vehicle], core_us, reasons, places=(junction,))
    yield crossing
    lanes = _lanes_around(tables, vehicle, start, end)
    if lanes is not None:
        turn_rad = _turn_rad(tables, vehicle, core_us)
        from_road, to_road = (tables.network.lanes[lane].road for lane in lanes)
        yield from _turns(crossing, turn_rad, from_road, to_road)


def _turns(crossing: TruthEvent, turn_rad: float, from_road: str, to_road: str) -> Iterator[TruthEvent]:
    """Name the turn; one that is near to another kind is told as either, and neither counts."""
    same_road = from_road == to_road
    kinds = {
        turn_type(turn_rad + nearly_rad, same_road=same_road): None for nearly_rad in (0.0, -NEARLY_RAD, NEARLY_RAD)
    }
    reasons = [crossing.why_not_countable] if crossing.why_not_countable else []
    if len(kinds) > 1:
        reasons.append(f"the car turns by {math.degrees(turn_rad):.0f} degrees, near to where kinds of turn part")
    for event_type in kinds:
        roads = (("road", from_road),) if event_type == "u_turn" else (("from", from_road), ("to", to_road))
        yield replace(
            crossing,
            type=event_type,
            why_not_countable="; ".join(reasons) or None,
            places=(*crossing.places, *roads),
        )


def turn_type(turn_rad: float, *, same_road: bool) -> str:
    """Name a turn.

    Parameters
    ----------
    turn_rad : change of heading, positive to the left; not wrapped.
    same_road : whether it leads back onto the road that it came from.

    Examples
    --------
    >>> turn_type(1.5, same_road=False), turn_type(-0.2, same_road=False), turn_type(3.0, same_road=True)
    ('turn_left', 'drive_straight', 'u_turn')
    """
    if same_road or abs(turn_rad) >= BACK_RAD:
        return "u_turn"
    if abs(turn_rad) <= STRAIGHT_RAD:
        return "drive_straight"
    return "turn_left" if turn_rad > 0 else "turn_right"


def _lanes_around(tables: TruthTables, vehicle: int, start: int, end: int) -> tuple[int, int] | None:
    """Find the last lane before the junction and the first one after it, by the front bumper; they differ in edge."""
    lane = tables.front_lane[:, vehicle]
    # The front is in the junction before the centre is, and out of it before the centre.
    middle = (start + end) // 2
    before, after = np.flatnonzero(lane[:middle] >= 0), np.flatnonzero(lane[middle:] >= 0)
    if not len(before) or not len(after):
        return None
    first, second = int(lane[before[-1]]), int(lane[middle + after[0]])
    lanes = tables.network.lanes
    return (first, second) if lanes[first].edge != lanes[second].edge else None


def _turn_rad(tables: TruthTables, vehicle: int, core_us: tuple[int, int]) -> float:
    """Add up how the heading changes, as far as the clip goes and the vehicle is there."""
    t_us = tables.t_us
    first, last = np.searchsorted(t_us, (core_us[0] - _BEFORE_US, core_us[1] + _AFTER_US)).tolist()
    headings_rad = tables.heading_rad[first : last + 1, vehicle]
    unwrapped = np.unwrap(headings_rad[np.isfinite(headings_rad)])
    return float(unwrapped[-1] - unwrapped[0])
