"""Scenes for the tests of anchoring."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from anchoring.anchorer import Anchorer
from anchoring.observations import Cars, LinkChange, Observations
from gis.roads.lanes import Junction, Lane
from gis.roads.road_network import RoadNetwork


@dataclass(frozen=True)
class Seen:
    """One vision object in one frame."""

    x_m: float
    y_m: float = 0.0
    speed_mps: float = 10.0
    heading_rad: float = 0.0
    length_m: float = 4.5
    width_m: float = 1.8
    observed: bool = True
    clipped: bool = False


def observations(t_us: int, seen: Mapping[str, Seen]) -> Observations:
    """Lay out the vision objects of one frame."""
    rows = list(seen.values())
    heading_rad = np.array([row.heading_rad for row in rows], dtype=np.float64)
    speed_mps = np.array([row.speed_mps for row in rows], dtype=np.float64)
    return Observations(
        t_us=t_us,
        ids=tuple(seen),
        centre_m=np.array([[row.x_m, row.y_m] for row in rows], dtype=np.float64).reshape(len(rows), 2),
        velocity_mps=np.stack([speed_mps * np.cos(heading_rad), speed_mps * np.sin(heading_rad)], axis=1),
        heading_rad=heading_rad,
        length_m=np.array([row.length_m for row in rows], dtype=np.float64),
        width_m=np.array([row.width_m for row in rows], dtype=np.float64),
        observed=np.array([row.observed for row in rows], dtype=np.bool_),
        clipped=np.array([row.clipped for row in rows], dtype=np.bool_),
    )


def run(anchorer: Anchorer, frames: Sequence[tuple[int, Mapping[str, Seen]]]) -> tuple[list[Cars], list[LinkChange]]:
    """Feed frames and gather everything that comes out."""
    cars, changes = [], list[LinkChange]()
    for t_us, seen in frames:
        now, made = anchorer.observe(observations(t_us, seen))
        cars.append(now)
        changes += made
    return cars, changes


def straight_road(length_m: float = 1000.0) -> RoadNetwork:
    """Make a two-way road along the x axis, eastwards at y = -1.75."""
    east = Lane("we_0", "we", 0, "we", +1, np.array([[0.0, -1.75], [length_m, -1.75]]), 3.5, 25.0)
    west = Lane("ew_0", "ew", 0, "we", -1, np.array([[length_m, 1.75], [0.0, 1.75]]), 3.5, 25.0)
    return RoadNetwork([east, west])


BEND_RADIUS_M = 50.0


def bend() -> RoadNetwork:
    """Make a two-way road that starts at the origin eastwards and turns left in half a circle; a junction follows."""
    angle = np.linspace(0.0, math.pi, 61)

    def arc(radius_m: float) -> np.ndarray:
        return np.stack([radius_m * np.sin(angle), BEND_RADIUS_M - radius_m * np.cos(angle)], axis=1)

    right = Lane("b_0", "b", 0, "b", +1, arc(BEND_RADIUS_M + 1.75), 3.5, 25.0)
    left = Lane("-b_0", "-b", 0, "b", -1, arc(BEND_RADIUS_M - 1.75)[::-1], 3.5, 25.0)
    outline_m = np.array([[-20.0, 94.0], [0.0, 94.0], [0.0, 106.0], [-20.0, 106.0]])
    return RoadNetwork([right, left], junctions=[Junction("end", outline_m)])
