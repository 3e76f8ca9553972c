"""Where are the painted lines of a road? Derived from lanes alone, as strips on the ground."""

from collections.abc import Iterator
from typing import Literal

import numpy as np
import shapely
from shapely.ops import substring

from data_gen.simulation.states import FloatArray
from gis.lanes import Lane
from gis.polyline import offset
from gis.road_network import RoadNetwork

_LINE_WIDTH_M = 0.2
_EDGE_INSET_M = 0.15
_DASH_M = 3.0
_GAP_M = 9.0
_PROBE_M = 0.3
_DOUBLE_M = 0.4

Side = Literal["left", "right"]


def road_markings(network: RoadNetwork) -> tuple[shapely.Polygon, ...]:
    """Lay out edge lines and dashed lines between lanes.

    Parameters
    ----------
    network : whose lanes are marked. A border with another lane beyond it gets dashes of 3 m every 12 m, one
        between two directions of several lanes each a double line, a border with nothing beyond it an unbroken edge
        line.

    Returns
    -------
    Strips on the ground, none twice.
    """
    return tuple(
        shape
        for index, lane in enumerate(network.lanes)
        for side in ("left", "right")
        for shape in _border_strips(network, index, lane, "left" if side == "left" else "right")
    )


def _border_strips(network: RoadNetwork, index: int, lane: Lane, side: Side) -> Iterator[shapely.Polygon]:
    outward = 1 if side == "left" else -1
    neighbour = _lane_beyond(network, lane, outward)
    if neighbour < 0:
        yield _strip(offset(lane.centre_line_m, outward * (lane.width_m / 2 - _EDGE_INSET_M)))
    elif index < neighbour:
        border = shapely.LineString(offset(lane.centre_line_m, outward * lane.width_m / 2))
        if _is_double(network, lane, network.lanes[neighbour]):
            for side_m in (-_DOUBLE_M / 2, _DOUBLE_M / 2):
                yield _strip(offset(np.asarray(border.coords), side_m))
            return
        for start_m in np.arange(_GAP_M / 2, border.length - _DASH_M, _DASH_M + _GAP_M):
            dash = substring(border, start_m, start_m + _DASH_M)
            yield _strip(np.asarray(dash.coords))


def _is_double(network: RoadNetwork, lane: Lane, other: Lane) -> bool:
    """Tell whether the border between two lanes parts two directions of a road with several lanes each way."""
    lanes = [candidate for candidate in network.lanes if candidate.road == lane.road]
    one_way = sum(candidate.direction == lane.direction for candidate in lanes)
    return lane.road == other.road and lane.direction != other.direction and min(one_way, len(lanes) - one_way) > 1


def _lane_beyond(network: RoadNetwork, lane: Lane, outward: int) -> int:
    beside_m = offset(lane.centre_line_m, outward * (lane.width_m / 2 + _PROBE_M))
    middle = shapely.LineString(beside_m).interpolate(0.5, normalized=True)
    return int(network.locate(np.array([[middle.x, middle.y]])).lane[0])


def _strip(line_m: FloatArray) -> shapely.Polygon:
    strip = shapely.LineString(line_m).buffer(_LINE_WIDTH_M / 2, cap_style="flat", join_style="mitre")
    assert isinstance(strip, shapely.Polygon)
    return strip
