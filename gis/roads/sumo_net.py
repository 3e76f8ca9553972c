"""Which lanes, roads and junctions does a SUMO network file describe?

Reads `.net.xml` (or `.net.xml.gz`) as netconvert writes it, without SUMO. Coordinates are taken as they stand in the
file. Lanes inside junctions (edges with a `function`) and lanes without motor traffic (pavements, rails) are no roads;
those of the former that a connection leads over make its line.

Two opposite edges become one road if a lane of one names a lane of the other as its `neigh`, or if they join the same
two nodes and their nearest lanes lie side by side. The road carries the id of the edge that comes first in
alphabetical order, and its reference line runs in that edge's direction; an id with a leading minus comes last, since
SUMO writes `-E1` for the way back of `E1`.
"""

import gzip
import zlib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from xml.etree import ElementTree

import numpy as np

from gis.errors import GisError
from gis.polyline import FloatArray
from gis.roads.lanes import Connection, Junction, Lane, border_gap
from gis.roads.road_network import RoadNetwork

# SUMO's default where a lane says nothing.
_LANE_WIDTH_M = 3.2
# The carriageways of one road may lie this far apart; past it there is a verge, and they are two roads.
_BORDER_GAP_M = 1.0
# fmt: off
_MOTOR_CLASSES = frozenset((
    "all", "private", "emergency", "authority", "army", "vip", "passenger", "hov", "taxi", "bus",
    "coach", "delivery", "truck", "trailer", "motorcycle", "moped", "evehicle", "custom1", "custom2", "ignoring",
))
# fmt: on


@dataclass(frozen=True, slots=True)
class _Edge:
    id: str
    from_node: str
    to_node: str
    lanes: tuple[Lane, ...]
    opposite_lanes: tuple[str, ...]


def read_sumo_net(path: str | Path) -> RoadNetwork:
    """Read a road network from a SUMO network file.

    Parameters
    ----------
    path : `.net.xml`, or the same packed with gzip and ending in `.gz`.

    Returns
    -------
    Lanes, roads, junctions and connections in the order of the file.

    Raises
    ------
    GisError
        If the file is missing, is not XML, is not a SUMO network, or an element lacks what is needed.
    """
    path = Path(path)
    root = _parse(path)
    try:
        return _network(root)
    except GisError as error:
        raise GisError(f"{path}: {error}") from error


def _network(root: ElementTree.Element) -> RoadNetwork:
    edges = [edge for element in root.iter("edge") if (edge := _read_edge(element)) is not None]
    if not edges:
        raise GisError("expected at least one edge with a lane for motor traffic, got none")
    road_of = _pair_edges(edges)
    lanes = [_lane_on_road(lane, edge, road_of[edge.id]) for edge in edges for lane in edge.lanes]
    junctions = [junction for element in root.iter("junction") if (junction := _read_junction(element))]
    return RoadNetwork(lanes, junctions=junctions, connections=list(_connections(root, edges)))


def _parse(path: Path) -> ElementTree.Element:
    try:
        data = gzip.decompress(path.read_bytes()) if path.suffix == ".gz" else path.read_bytes()
        root = ElementTree.fromstring(data)
    except OSError as error:
        raise GisError(f"{path}: expected a readable SUMO network file, got {error!s}") from error
    except (ElementTree.ParseError, EOFError, zlib.error) as error:
        raise GisError(f"{path}: expected XML, got {error!s}") from error
    if root.tag != "net":
        raise GisError(f"{path}: expected the root element 'net' of a SUMO network, got {root.tag!r}")
    return root


def _read_edge(element: ElementTree.Element) -> _Edge | None:
    if element.get("function", "normal") != "normal":
        return None
    edge_id = _attribute(element, "id")
    carriageway = [lane for lane in element.iter("lane") if _has_motor_traffic(lane)]
    if not carriageway:
        return None
    lanes = tuple(_read_lane(lane, edge_id) for lane in carriageway)
    opposite = tuple(_attribute(neigh, "lane") for lane in carriageway for neigh in lane.iter("neigh"))
    return _Edge(edge_id, _attribute(element, "from"), _attribute(element, "to"), lanes, opposite)


def _has_motor_traffic(lane: ElementTree.Element) -> bool:
    if "allow" in lane.attrib:
        return not _MOTOR_CLASSES.isdisjoint(lane.attrib["allow"].split())
    return lane.get("disallow") != "all"


def _read_lane(element: ElementTree.Element, edge: str) -> Lane:
    lane_id = _attribute(element, "id")
    index = int(_number(element, "index"))
    width_m = _number(element, "width", default=_LANE_WIDTH_M)
    return Lane(lane_id, edge, index, edge, +1, _shape(element), width_m, _number(element, "speed"))


def _read_junction(element: ElementTree.Element) -> Junction | None:
    if element.get("type") == "internal" or not element.get("shape"):
        return None
    outline_m = _shape(element)
    # Dead ends have a line for a shape.
    if len(np.unique(outline_m, axis=0)) < 3:
        return None
    return Junction(_attribute(element, "id"), outline_m)


def _connections(root: ElementTree.Element, edges: Sequence[_Edge]) -> Iterator[Connection]:
    """Read the ways from lane to lane; those that lead on inside a junction are part of them."""
    lanes = {lane.id: lane for edge in edges for lane in edge.lanes}
    node_of = {edge.id: edge.to_node for edge in edges}
    inner_lanes = {_attribute(lane, "id"): lane for edge in root.iter("edge") for lane in edge.iter("lane")}
    elements = {_lane_end(element, "from"): element for element in root.iter("connection")}
    for element in root.iter("connection"):
        start, end = _lane_end(element, "from"), _lane_end(element, "to")
        if start in lanes and end in lanes:
            vias = [inner_lanes[via] for via in _vias(element, elements, inner_lanes)]
            via_m = np.vstack([_shape(via) for via in vias]) if vias else None
            speed_mps = min((_number(via, "speed") for via in vias), default=lanes[end].speed_limit_mps)
            yield Connection(start, end, node_of[lanes[start].edge], via_m, speed_mps)


def _lane_end(connection: ElementTree.Element, end: str) -> str:
    """Name a lane of a connection; by the format its name is that of the edge, a low line and the index."""
    return f"{_attribute(connection, end)}_{_attribute(connection, end + 'Lane')}"


def _vias(
    connection: ElementTree.Element,
    elements: Mapping[str, ElementTree.Element],
    inner_lanes: Mapping[str, ElementTree.Element],
) -> list[str]:
    """List the lanes inside the junction that a connection leads over: each names the next one."""
    vias: list[str] = []
    via = connection.get("via")
    while via is not None and via not in vias:
        if via not in inner_lanes:
            where = f"connection {_lane_end(connection, 'from')!r} to {_lane_end(connection, 'to')!r}"
            raise GisError(f"{where}: expected 'via' to name a lane, got {via!r}")
        vias.append(via)
        via = elements[via].get("via") if via in elements else None
    return vias


def _pair_edges(edges: Sequence[_Edge]) -> dict[str, str]:
    """Map each edge to the id of its road."""
    road_of: dict[str, str] = {}
    for edge, other in [*_named_opposites(edges), *_side_by_side(edges)]:
        if edge not in road_of and other not in road_of:
            road_of[edge] = road_of[other] = min(edge, other, key=_naming_order)
    for one_way in edges:
        road_of.setdefault(one_way.id, one_way.id)
    return road_of


def _naming_order(edge_id: str) -> tuple[bool, str]:
    return edge_id.startswith("-"), edge_id


def _named_opposites(edges: Sequence[_Edge]) -> list[tuple[str, str]]:
    edge_of_lane = {lane.id: edge.id for edge in edges for lane in edge.lanes}
    named = [(edge.id, edge_of_lane.get(lane, edge.id)) for edge in edges for lane in edge.opposite_lanes]
    return [(edge, other) for edge, other in named if edge != other]


def _side_by_side(edges: Sequence[_Edge]) -> list[tuple[str, str]]:
    """Pair edges that join the same two nodes in opposite directions, the nearest first."""
    by_ends: dict[tuple[str, str], list[_Edge]] = {}
    for edge in edges:
        by_ends.setdefault((edge.from_node, edge.to_node), []).append(edge)
    gaps = [
        (border_gap(edge.lanes, other.lanes), edge.id, other.id)
        for edge in edges
        for other in by_ends.get((edge.to_node, edge.from_node), [])
        if edge.id < other.id
    ]
    return [(edge, other) for gap_m, edge, other in sorted(gaps) if gap_m <= _BORDER_GAP_M]


def _lane_on_road(lane: Lane, edge: _Edge, road: str) -> Lane:
    direction = 1 if edge.id == road else -1
    return Lane(lane.id, lane.edge, lane.index, road, direction, lane.centre_line_m, lane.width_m, lane.speed_limit_mps)


def _attribute(element: ElementTree.Element, name: str) -> str:
    value = element.get(name)
    if value is None:
        known_as = element.get("id", element.get("from"))  # connections have no id
        raise GisError(f"{element.tag} {known_as!r}: expected the attribute {name!r}, got none")
    return value


def _number(element: ElementTree.Element, name: str, *, default: float | None = None) -> float:
    if default is not None and name not in element.attrib:
        return default
    text = _attribute(element, name)
    try:
        return float(text)
    except ValueError as error:
        raise GisError(f"{element.tag} {element.get('id')!r}: expected a number in {name!r}, got {text!r}") from error


def _shape(element: ElementTree.Element) -> FloatArray:
    text = _attribute(element, "shape")
    try:
        # Points may carry a height as a third number.
        return np.array([[float(number) for number in point.split(",")[:2]] for point in text.split()]).reshape(-1, 2)
    except ValueError as error:
        raise GisError(
            f"{element.tag} {element.get('id')!r}: expected 'x,y x,y ...' in 'shape', got {text!r}"
        ) from error
