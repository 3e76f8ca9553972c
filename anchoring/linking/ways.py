"""Which way would a lost car have driven to the place where a track begins, and could it?

On one road, along it. Between roads, along the lanes where the map has connections; else along an arc, so that the
chord between two places halves the angle between the headings there.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, fields, replace

import numpy as np

from anchoring.observations import BoolArray, FloatArray, IntArray, LongArray
from anchoring.settings import AnchoringSettings


@dataclass(frozen=True, slots=True)
class Looks:
    """Hold what is compared, of n bodies when each was seen.

    Attributes
    ----------
    t_us : (n,).
    centre_m, velocity_mps : (n, 2).
    heading_rad, length_m, width_m : (n,).
    has_front : (n,) False where the front may as well be the other end.
    is_whole : (n,) False where the size was never seen in full.
    road : (n,) -1 for none; along_m, across_m, tangent_rad : (n,).
    """

    t_us: LongArray
    centre_m: FloatArray
    velocity_mps: FloatArray
    heading_rad: FloatArray
    has_front: BoolArray
    length_m: FloatArray
    width_m: FloatArray
    is_whole: BoolArray
    road: IntArray
    along_m: FloatArray
    across_m: FloatArray
    tangent_rad: FloatArray

    def take(self, rows: LongArray) -> "Looks":
        """Lay out some of the bodies, one or more times each."""
        return Looks(*(getattr(self, one.name).take(rows, axis=0) for one in fields(self)))

    def turned_rad(self, end: "Looks") -> FloatArray:
        """Tell by how much each, (n,), has turned since the end in the same row."""
        return _wrapped(front_as(self.heading_rad, end.heading_rad, ~self.has_front) - end.heading_rad)

    @property
    def speed_mps(self) -> FloatArray:
        """The speed of each, (n,)."""
        speed_mps: FloatArray = np.hypot(self.velocity_mps[:, 0], self.velocity_mps[:, 1])
        return speed_mps

    @property
    def sense(self) -> FloatArray:
        """Which way each goes along its road, (n,): 1 along it, -1 against it."""
        return np.where(np.cos(self.heading_rad - self.tangent_rad) < 0.0, -1.0, 1.0)


# Of pairs of a row of starts and a row of ends, (p,) and (p,): how long the way along lanes is, nan where lanes tell
# nothing and inf where none leads; and whether it needs a change of lanes.
Routes = Callable[[LongArray, LongArray], tuple[FloatArray, BoolArray]]


@dataclass(frozen=True, slots=True)
class Ways:
    """Hold the way of each pair of a start and an end, (p,).

    Attributes
    ----------
    length_m : below 0 where the start lies behind the end.
    aside_m : how far the start is from where the way leads, to the side.
    on_road : both are on one road.
    changes_lane : the way leads between roads and from one lane to another.
    is_possible : nobody would have to turn on the spot, or to drive where no way leads.
    """

    length_m: FloatArray
    aside_m: FloatArray
    on_road: BoolArray
    changes_lane: BoolArray
    is_possible: BoolArray

    def along_lanes(self, route_m: FloatArray, changes_lane: BoolArray) -> "Ways":
        """Take the ways along lanes, (p,) each as `Routes` gives them, where the two are not on one road."""
        has_route = ~np.isnan(route_m) & ~self.on_road
        leads = np.isfinite(route_m)
        return replace(
            self,
            length_m=np.where(has_route & leads, route_m, self.length_m),
            aside_m=np.where(has_route, 0.0, self.aside_m),
            changes_lane=has_route & changes_lane,
            is_possible=np.where(has_route, leads, self.is_possible),
        )


def ways(start: Looks, end: Looks, gap_s: FloatArray, settings: AnchoringSettings) -> Ways:
    """Measure the way from each end to the start in the same row, by roads and arcs.

    Parameters
    ----------
    start, end : p bodies each.
    gap_s : (p,) between them.
    settings : how fast a car can turn.
    """
    apart_m = start.centre_m - end.centre_m
    chord_m = np.hypot(apart_m[:, 0], apart_m[:, 1])
    turn_rad = start.turned_rad(end)
    half_rad = np.abs(turn_rad) / 2
    bent_rad = _wrapped(np.arctan2(apart_m[:, 1], apart_m[:, 0]) - end.heading_rad - turn_rad / 2)
    # Whoever drove straight on before or after the arc is off by less than half the turn.
    excess_rad = np.maximum(np.abs(bent_rad) - half_rad, 0.0)
    arc_m = chord_m / np.sinc(half_rad / math.pi) * np.cos(excess_rad)
    on_road = (start.road == end.road) & (end.road >= 0)
    length_m = np.where(on_road, (start.along_m - end.along_m) * end.sense, arc_m)
    aside_m = np.where(on_road, start.across_m - end.across_m, chord_m * np.sin(excess_rad))
    # Tyres hold so much: the faster on average, the less turned.
    most_rad = settings.turn_slack_rad + settings.sideways_mps2 * gap_s**2 / np.maximum(np.abs(length_m), 1e-3)
    most_rad = np.minimum(most_rad, settings.back_rad)
    return Ways(length_m, aside_m, on_road, np.zeros(len(gap_s), np.bool_), np.abs(turn_rad) <= most_rad)


def front_as(heading_rad: FloatArray, known_rad: FloatArray, is_guess: BoolArray) -> FloatArray:
    """Turn headings, (k,), that are guesses of which end is the front round where it is known to be the other one."""
    is_rear = is_guess & (np.cos(heading_rad - known_rad) < 0.0)
    return np.where(is_rear, heading_rad - np.copysign(math.pi, heading_rad), heading_rad)


def _wrapped(angle_rad: FloatArray) -> FloatArray:
    wrapped: FloatArray = (angle_rad + math.pi) % (2 * math.pi) - math.pi
    return wrapped
