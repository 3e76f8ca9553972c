"""How far is it along the lanes from where a car was lost to where a track begins?"""

import numpy as np

from anchoring.linking.ways import Looks, Routes
from anchoring.observations import BoolArray, FloatArray, LongArray
from gis.lane_graph import LaneGraph, LanePlaces, Route
from gis.road_network import RoadNetwork


class LaneRoutes:
    """Look up ways along the lanes of a network.

    Parameters
    ----------
    network : no ways are known without one, or of one that `LaneGraph.of` makes no graph of.
    """

    __slots__ = ("_changing", "_keeping", "_network")

    def __init__(self, network: RoadNetwork | None) -> None:
        self._network = network
        self._keeping = None if network is None else LaneGraph.of(network, keep_lanes=True)
        self._changing = None if network is None else LaneGraph.of(network)

    def between(self, starts: Looks, ends: Looks) -> Routes:
        """Make ready to measure the ways from ends to starts."""
        keeping, changing, places = self._keeping, self._changing, self._places(ends, starts)
        if keeping is None or changing is None or places is None:
            return no_routes
        is_placed, first = places.lane[:, 0] >= 0, len(ends.t_us)

        def measure(row: LongArray, column: LongArray) -> tuple[FloatArray, BoolArray]:
            """Keep to the lanes if that leads there, and change them else."""
            pairs = np.stack([column, first + row])
            kept_m = keeping.gaps_m(places, pairs)[0]
            changes = np.isinf(kept_m)
            route_m = np.where(changes, changing.gaps_m(places, pairs)[0], kept_m)
            return np.where(is_placed[pairs].all(axis=0), route_m, np.nan), changes

        return measure

    def route(self, end: Looks, start: Looks) -> Route | None:
        """Draw the way from one end to one start; None where lanes tell nothing."""
        places = self._places(end, start)
        if self._keeping is None or self._changing is None or places is None:
            return None
        ends = places.take([0]), places.take([1])
        return self._keeping.route(*ends) or self._changing.route(*ends)

    def _places(self, ends: Looks, starts: Looks) -> LanePlaces | None:
        """Find on which lanes ends are, and after them starts."""
        if self._network is None or self._keeping is None:
            return None
        centre_m = np.concatenate([ends.centre_m, starts.centre_m])
        heading_rad = np.concatenate([ends.heading_rad, starts.heading_rad])
        return self._keeping.project(centre_m, heading_rad, self._network.locate(centre_m))


def no_routes(row: LongArray, column: LongArray) -> tuple[FloatArray, BoolArray]:
    """Tell that nothing is known of lanes."""
    return np.full(len(row), np.nan), np.zeros(len(row), np.bool_)
