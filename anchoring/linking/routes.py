"""How far is it along the lanes from where a car was lost to where a track begins?"""

import numpy as np

from anchoring.linking.ways import Looks, Routes
from anchoring.observations import BoolArray, FloatArray, LongArray
from gis.lane_graph import LaneGraph
from gis.road_network import RoadNetwork

# The graph keeps the distances between all lanes: 32 MB for so many. Larger maps are driven by arcs.
_MOST_LANES = 2000


class LaneRoutes:
    """Look up ways along the lanes of a network.

    Parameters
    ----------
    network : without connections, or with very many lanes, no ways are known.
    """

    __slots__ = ("_changing", "_keeping", "_network")

    def __init__(self, network: RoadNetwork) -> None:
        self._network = network
        is_known = len(network.connections) > 0 and len(network.lanes) + len(network.connections) <= _MOST_LANES
        self._keeping = LaneGraph(network, keep_lanes=True) if is_known else None
        self._changing = LaneGraph(network) if is_known else None

    def between(self, starts: Looks, ends: Looks) -> Routes:
        """Make ready to measure the ways from ends to starts."""
        keeping, changing = self._keeping, self._changing
        if keeping is None or changing is None:
            return no_routes
        centre_m = np.concatenate([ends.centre_m, starts.centre_m])
        heading_rad = np.concatenate([ends.heading_rad, starts.heading_rad])
        places = keeping.project(centre_m, heading_rad, self._network.locate(centre_m))
        is_placed, first = places.lane[:, 0] >= 0, len(ends.t_us)

        def measure(row: LongArray, column: LongArray) -> tuple[FloatArray, BoolArray]:
            pairs = np.stack([column, first + row])
            kept_m = keeping.gaps_m(places, pairs)[0]
            changes = np.isinf(kept_m)
            route_m = np.where(changes, changing.gaps_m(places, pairs)[0], kept_m)
            return np.where(is_placed[pairs].all(axis=0), route_m, np.nan), changes

        return measure


def no_routes(row: LongArray, column: LongArray) -> tuple[FloatArray, BoolArray]:
    """Tell that nothing is known of lanes."""
    return np.full(len(row), np.nan), np.zeros(len(row), np.bool_)
