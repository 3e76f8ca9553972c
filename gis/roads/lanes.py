"""What is a road network made of?

A *lane* is a strip along a centre line. A *road* is one physical road: the two opposite edges that share a border,
with all their lanes, or one one-way edge. A *junction* is an area where roads meet, and a *connection* a way over it
that the map allows, from the end of one lane to the start of another one. All lines are in the local east/north frame,
in metres.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from gis.errors import GisError
from gis.polyline import FloatArray, across, as_polyline, as_ring, offset


@dataclass(frozen=True, slots=True, eq=False)
class Lane:
    """One lane, checked and read-only.

    Attributes
    ----------
    id : unique in the network.
    edge : the lanes that share an edge run side by side in one direction.
    index : place within the edge, 0 at the outer side of the road.
    road : id of the road it belongs to.
    direction : +1 if it is driven along the road's reference line, -1 if against it.
    centre_line_m : (n, 2) in driving direction.
    width_m : full width.
    speed_limit_mps : finite, > 0.

    Raises
    ------
    GisError
        If a value is out of range.
    """

    id: str
    edge: str
    index: int
    road: str
    direction: int
    centre_line_m: FloatArray
    width_m: float
    speed_limit_mps: float

    def __post_init__(self) -> None:
        where = f"lane {self.id!r}"
        if self.direction not in (1, -1):
            raise GisError(f"{where}: direction must be +1 or -1, got {self.direction!r}")
        if not (math.isfinite(self.width_m) and self.width_m > 0):
            raise GisError(f"{where}: width_m must be > 0 metres, got {self.width_m!r}")
        if not (math.isfinite(self.speed_limit_mps) and self.speed_limit_mps > 0):
            raise GisError(f"{where}: speed_limit_mps must be > 0 m/s, got {self.speed_limit_mps!r}")
        object.__setattr__(self, "centre_line_m", as_polyline(self.centre_line_m, where=where))


@dataclass(frozen=True, slots=True, eq=False)
class Road:
    """One physical road, checked and read-only.

    Attributes
    ----------
    id : unique in the network.
    reference_line_m : (n, 2) in driving direction of the lanes with direction +1. Between the two directions of a
        two-way road it is their shared border, on a one-way road the left border of the leftmost lane.
    lanes : ids of its lanes.
    """

    id: str
    reference_line_m: FloatArray
    lanes: tuple[str, ...]

    def __post_init__(self) -> None:
        object.__setattr__(
            self, "reference_line_m", as_polyline(self.reference_line_m, where=f"road {self.id!r}, reference line")
        )


@dataclass(frozen=True, slots=True, eq=False)
class Junction:
    """An area where roads meet, checked and read-only.

    Attributes
    ----------
    id : unique in the network.
    outline_m : (n, 2), n >= 3, open ring.
    """

    id: str
    outline_m: FloatArray

    def __post_init__(self) -> None:
        object.__setattr__(self, "outline_m", as_ring(self.outline_m, where=f"junction {self.id!r}"))


@dataclass(frozen=True, slots=True, eq=False)
class Connection:
    """One way on from a lane to another one, checked and read-only.

    Attributes
    ----------
    from_lane, to_lane : ids.
    junction : id of the junction that it leads over; a network need not have an area of that name.
    via_m : (n, 2) centre line in driving direction of the lanes inside the junction; None where the map has none: the
        way is then straight.
    speed_limit_mps : on the way, finite, > 0.

    Raises
    ------
    GisError
        If a value is out of range.
    """

    from_lane: str
    to_lane: str
    junction: str
    via_m: FloatArray | None
    speed_limit_mps: float

    def __post_init__(self) -> None:
        where = f"connection {self.from_lane!r} to {self.to_lane!r}"
        if not (math.isfinite(self.speed_limit_mps) and self.speed_limit_mps > 0):
            raise GisError(f"{where}: speed_limit_mps must be > 0 m/s, got {self.speed_limit_mps!r}")
        if self.via_m is not None:
            object.__setattr__(self, "via_m", as_polyline(self.via_m, where=where))


def edge_name(road: str, direction: int) -> str:
    """Name the edge of a lane that was given without one: the road's id, with a minus for the way back."""
    return road if direction > 0 else f"-{road}"


def roads_of(lanes: Sequence[Lane]) -> tuple[Road, ...]:
    """Gather lanes into roads, drawing each road's reference line from its lanes.

    Parameters
    ----------
    lanes : every lane says which road it belongs to and in which direction it is driven. The lanes of one road
        run side by side over its whole length.

    Returns
    -------
    One road for each road id, in the order in which the ids first come.

    Examples
    --------
    >>> east = Lane("we_0", "we", 0, "we", +1, np.array([[0.0, -1.75], [100.0, -1.75]]), 3.5, 25.0)
    >>> west = Lane("ew_0", "ew", 0, "we", -1, np.array([[100.0, 1.75], [0.0, 1.75]]), 3.5, 25.0)
    >>> (road,) = roads_of([west, east])
    >>> road.reference_line_m.tolist()
    [[0.0, 0.0], [100.0, 0.0]]
    """
    by_road: dict[str, list[Lane]] = {}
    for lane in lanes:
        by_road.setdefault(lane.road, []).append(lane)
    return tuple(
        Road(road, _reference_line(members), tuple(lane.id for lane in members)) for road, members in by_road.items()
    )


def border_gap(lanes: Sequence[Lane], others: Sequence[Lane]) -> float:
    """Measure the free strip between two bundles of lanes that run side by side.

    Parameters
    ----------
    lanes, others : at least one each; the directions do not matter.

    Returns
    -------
    Metres between the borders of the two lanes that are nearest to each other, negative if they overlap. It is a
    median over the length of the lanes.
    """
    lane, other, across_m = _nearest_lanes(lanes, others)
    return abs(across_m) - (lane.width_m + other.width_m) / 2


def _reference_line(lanes: Sequence[Lane]) -> FloatArray:
    along = [lane for lane in lanes if lane.direction > 0]
    against = [lane for lane in lanes if lane.direction < 0]
    if along and against:
        return _shared_border(along, against)
    if along:
        return _left_border(along)
    return _left_border(against)[::-1]


def _shared_border(along: Sequence[Lane], against: Sequence[Lane]) -> FloatArray:
    # Not the left border of the leftmost lane: where traffic keeps left, the border is on the right-hand side.
    lane, _, across_m = _nearest_lanes(along, against)
    left_m = lane.width_m / 2 + border_gap(along, against) / 2
    return offset(lane.centre_line_m, math.copysign(left_m, across_m))


def _left_border(lanes: Sequence[Lane]) -> FloatArray:
    leftmost = max(lanes, key=lambda lane: _across_m(lanes[0], lane))
    return offset(leftmost.centre_line_m, leftmost.width_m / 2)


def _nearest_lanes(lanes: Sequence[Lane], others: Sequence[Lane]) -> tuple[Lane, Lane, float]:
    pairs = [(lane, other, _across_m(lane, other)) for lane in lanes for other in others]
    return min(pairs, key=lambda pair: abs(pair[2]))


def _across_m(lane: Lane, other: Lane) -> float:
    """Distance between two centre lines, positive if the other runs to the left."""
    return float(np.median(across(lane.centre_line_m, other.centre_line_m)))
