"""How far has one object to drive until it is where another one is now?"""

from dataclasses import dataclass
from typing import Self

import numpy as np

from gis.roads.lane_graph import LaneGraph, LanePlaces
from gis.roads.road_network import RoadPositions
from qsr.measuring.footprints import BoolArray, FloatArray, Footprints, LongArray


@dataclass(frozen=True, slots=True, eq=False)
class Routes:
    """Know the ways between the objects of one frame.

    Attributes
    ----------
    graph : of the lanes.
    places : (n,) of the objects on it.
    is_astray : (n,) whether the object is beside the lane of its place: it drives in the oncoming one.
    """

    graph: LaneGraph
    places: LanePlaces
    is_astray: BoolArray

    @classmethod
    def of(cls, graph: LaneGraph, footprints: Footprints, order: LongArray) -> Self:
        """Find the places of objects, and put them into an order."""
        now = footprints
        at = RoadPositions(now.road, now.along_m, now.across_m, now.lane, now.junction, now.tangent_rad)
        places = graph.project(now.centre_m, now.heading_rad, at)
        is_astray = (now.lane >= 0) & (now.lane != places.lane[:, 0])
        return cls(graph, places.take(order), is_astray.take(order))

    def ways_m(self, columns: LongArray) -> FloatArray:
        """Measure pairs of objects: (2, pairs) from the first to the second and back; inf where no way leads there."""
        return self.graph.gaps_m(self.places, columns)

    def facing_m(self, columns: LongArray) -> FloatArray:
        """Measure the way between those, (pairs,), who drive towards each other; inf for all others."""
        return self.graph.facing_m(self.places, columns)

    def aside_m(self, columns: LongArray, widest_m: float) -> FloatArray:
        """Say how far apart sideways, (pairs,), those are of which one will come to where the other is."""
        return np.where(self.is_astray.take(columns).any(axis=0), widest_m, 0.0)
