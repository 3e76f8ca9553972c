"""How far is it along the lanes from where a car was lost to where a track begins?"""

import numpy as np

from anchoring.linking.ways import Looks, Routes
from anchoring.observations import BoolArray, FloatArray, LongArray
from gis.roads.lane_graph import LaneGraph, LanePlaces, Route
from gis.roads.road_network import RoadNetwork


class LaneRoutes:
    """Look up ways along the lanes of a network.

    Parameters
    ----------
    network : no ways are known without one, or of one that `LaneGraph.of` makes no graph of.
    """

    def __init__(self, network: RoadNetwork | None) -> None:
        self._network = network
        graphs = () if network is None else (LaneGraph.of(network, keep_lanes=True), LaneGraph.of(network))
        self._graphs = [graph for graph in graphs if graph is not None]

    def between(self, starts: Looks, ends: Looks) -> Routes:
        """Make ready to measure the ways from ends to starts."""
        places = self._places(ends, starts)
        if places is None:
            return no_routes
        (keeping, changing), is_placed, first = self._graphs, places.lane[:, 0] >= 0, len(ends.t_us)

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
        if places is None:
            return None
        ends = places.take([0]), places.take([1])
        return next((route for graph in self._graphs if (route := graph.route(*ends))), None)

    def _places(self, ends: Looks, starts: Looks) -> LanePlaces | None:
        """Find on which lanes ends are, and after them starts."""
        if self._network is None or not self._graphs:
            return None
        centre_m = np.concatenate([ends.centre_m, starts.centre_m])
        heading_rad = np.concatenate([ends.heading_rad, starts.heading_rad])
        return self._graphs[0].project(centre_m, heading_rad, self._network.locate(centre_m))


def no_routes(row: LongArray, column: LongArray) -> tuple[FloatArray, BoolArray]:
    """Tell that nothing is known of lanes."""
    return np.full(len(row), np.nan), np.zeros(len(row), np.bool_)
