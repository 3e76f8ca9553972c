"""When does who meet whom, coming from the other side? The truth of `oncoming`, from where vehicles really drive.

Two vehicles *meet* when their bumpers are level, they drive against each other (within 45 degrees) and are less than
12 m apart sideways: four lanes, as on the widest road on which `oncoming` is told. No map is asked. How far apart they
are before is the sum of what both still drive until then, and how soon they meet is that by their speeds of the moment,
as `oncoming` means it: whether somebody will brake is another question than where somebody will drive.
"""

from collections import defaultdict
from collections.abc import Sequence
from itertools import pairwise
from math import sqrt

import numpy as np
from numpy.typing import NDArray

from qsr.measuring.footprints import Footprints

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]

SIDEWAYS_M = 12.0


class TrueMeetings:
    """Know all meetings of a simulation.

    Parameters
    ----------
    truth : all frames of it, of all vehicles.
    """

    def __init__(self, truth: Sequence[Footprints]) -> None:
        self._driven_m = _driven_m(truth)
        # Of each pair the times at which it meets, and what both together have driven then.
        self._meetings: dict[tuple[str, str], list[tuple[int, float]]] = defaultdict(list)
        for before, after in pairwise(truth):
            self._add(before, after)

    def distances_m(self, frame: Footprints) -> tuple[FloatArray, FloatArray]:
        """Measure how far those of a frame are from their next meeting.

        Returns
        -------
        (n, n) metres that the two have to drive in sum until their bumpers meet, inf if they do not meet any more as
        far as the truth goes; and (n, n) metres that the two drive in sum as far as the truth goes.
        """
        driven_m = [self._driven_m[one] for one in frame.ids]
        so_far_m = np.array([at_m[frame.t_us] for at_m in driven_m])
        left_m = np.array([max(at_m.values()) for at_m in driven_m]) - so_far_m
        distances_m = np.full((len(frame.ids), len(frame.ids)), np.inf)
        for row, one in enumerate(frame.ids):
            for column, other in enumerate(frame.ids):
                coming = [m for t_us, m in self._meetings.get((one, other), ()) if t_us > frame.t_us]
                if coming:
                    distances_m[row, column] = min(coming) - so_far_m[row] - so_far_m[column]
        return distances_m, left_m[:, None] + left_m

    def _add(self, before: Footprints, after: Footprints) -> None:
        common = [one for one in before.ids if one in after.ids]
        (from_m, were), (to_m, are) = (
            _bumpers_apart(frame.select([frame.ids.index(one) for one in common])) for frame in (before, after)
        )
        for row, column in np.argwhere(were & are & (from_m > 0) & (to_m <= 0)).tolist():
            pair = common[row], common[column]
            share = from_m[row, column] / (from_m[row, column] - to_m[row, column])
            from_sum_m, to_sum_m = (
                sum(self._driven_m[one][t_us] for one in pair) for t_us in (before.t_us, after.t_us)
            )
            meeting = after.t_us, from_sum_m + share * (to_sum_m - from_sum_m)
            self._meetings[pair].append(meeting)


def _driven_m(truth: Sequence[Footprints]) -> dict[str, dict[int, float]]:
    """Add up what each vehicle has driven at each time."""
    driven_m: dict[str, dict[int, float]] = defaultdict(dict)
    last: dict[str, tuple[float, FloatArray]] = {}
    for frame in truth:
        for one, at_m in zip(frame.ids, frame.centre_m, strict=True):
            so_far_m, was_m = last.get(one, (0.0, at_m))
            driven_m[one][frame.t_us] = so_far_m + float(np.hypot(*(at_m - was_m)))
            last[one] = driven_m[one][frame.t_us], at_m
    return driven_m


def _bumpers_apart(frame: Footprints) -> tuple[FloatArray, BoolArray]:
    """Measure (n, n) metres between the bumpers along both headings, and say who can meet whom."""
    east, north = np.cos(frame.heading_rad), np.sin(frame.heading_rad)
    way_east, way_north = east[:, None] - east, north[:, None] - north
    length = np.maximum(np.hypot(way_east, way_north), 1e-9)
    to_east_m, to_north_m = (axis_m - axis_m[:, None] for axis_m in frame.centre_m.T)
    ahead_m = (to_east_m * way_east + to_north_m * way_north) / length
    sideways_m = np.abs(to_east_m * way_north - to_north_m * way_east) / length
    is_against = east[:, None] * east + north[:, None] * north < -sqrt(0.5)
    half_m = frame.length_m / 2
    return ahead_m - half_m[:, None] - half_m, is_against & (sideways_m <= SIDEWAYS_M)
