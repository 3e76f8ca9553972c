"""How is a road network kept as GeoJSON, so that any map tool can draw or edit it?

GeoJSON (RFC 7946) is longitude and latitude on WGS84, so a `LocalFrame` goes with every file. Each LineString is the
centre line of a lane in driving direction, each Polygon the outline of a junction; anything else is an error.

Properties of a lane: `id`, `width_m` and `speed_limit_mps` are needed; `road` (default: the id), `direction`
(+1 or -1, default +1), `edge` and `index` may be left out. A junction needs `id`. Other properties are ignored.
"""

import json
from collections import Counter
from collections.abc import Generator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from gis.errors import GisError
from gis.frames import LocalFrame
from gis.polyline import FloatArray
from gis.roads.lanes import Junction, Lane, edge_name
from gis.roads.road_network import RoadNetwork

# JSON values are checked where they are used.
Json = Any
Feature = Mapping[str, Json]


def read_geojson(path: str | Path, frame: LocalFrame) -> RoadNetwork:
    """Read a road network from a GeoJSON file.

    Parameters
    ----------
    path : a FeatureCollection.
    frame : says where the local frame lies.

    Returns
    -------
    Lanes and junctions in the order of the file.

    Raises
    ------
    GisError
        If the file is missing or no GeoJSON, or a feature lacks what is needed; the message names the feature.
    """
    path = Path(path)
    lanes: list[Lane] = []
    junctions: list[Junction] = []
    lanes_of_edge: Counter[str] = Counter()
    for place, feature in enumerate(_features(path), start=1):
        with _told_of(f"{path}: feature {place}"):
            properties, geometry = _mapping(feature, "properties"), _mapping(feature, "geometry")
            kind, coordinates = geometry.get("type"), geometry.get("coordinates")
            if kind not in ("LineString", "Polygon"):
                raise GisError(f"expected a LineString (lane) or a Polygon (junction), got {kind!r}")
            name = _text(properties, "id")
        with _told_of(f"{path}: feature {place} ({name!r})"):
            if kind == "LineString":
                lanes.append(_lane(name, properties, _points(coordinates, frame), lanes_of_edge))
            else:  # holes in the area are left out
                outline = coordinates[0] if isinstance(coordinates, list) and coordinates else coordinates
                junctions.append(Junction(name, _points(outline, frame)))
    if not lanes:
        raise GisError(f"{path}: expected at least one LineString, the centre line of a lane, got none")
    with _told_of(str(path)):
        return RoadNetwork(lanes, junctions=junctions)


@contextmanager
def _told_of(where: str) -> Generator[None, None, None]:
    """Put before an error where it is."""
    try:
        yield
    except GisError as error:
        raise GisError(f"{where}: {error}") from error


def _features(path: Path) -> Sequence[Feature]:
    try:
        data = json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise GisError(f"{path}: expected a readable GeoJSON file, got {error!s}") from error
    except ValueError as error:
        raise GisError(f"{path}: expected JSON, got {error!s}") from error
    if not isinstance(data, dict) or data.get("type") != "FeatureCollection":
        came = data.get("type") if isinstance(data, dict) else type(data).__name__
        raise GisError(f"{path}: expected a GeoJSON FeatureCollection, got {came!r}")
    features = data.get("features")
    if not isinstance(features, list) or not all(isinstance(feature, dict) for feature in features):
        raise GisError(f"{path}: expected a list of objects in 'features', got {features!r}")
    return features


def _lane(name: str, properties: Feature, line_m: FloatArray, lanes_of_edge: Counter[str]) -> Lane:
    """Make a lane; `lanes_of_edge` counts them and gives the default index."""
    road = _text(properties, "road", default=name)
    direction = _integer(properties, "direction", default=1)
    edge = _text(properties, "edge", default=edge_name(road, direction))
    index = _integer(properties, "index", default=lanes_of_edge[edge])
    lanes_of_edge[edge] += 1
    width_m, speed_mps = _number(properties, "width_m"), _number(properties, "speed_limit_mps")
    return Lane(name, edge, index, road, direction, line_m, width_m, speed_mps)


def _mapping(feature: Feature, name: str) -> Feature:
    value = feature.get(name)
    if isinstance(value, dict):
        return value
    raise GisError(f"expected an object in {name!r}, got {value!r}")


def _text(properties: Feature, name: str, *, default: str | None = None) -> str:
    value = properties.get(name, default)
    # Map tools like to write identifiers as numbers.
    if isinstance(value, str | int) and not isinstance(value, bool):
        return str(value)
    raise GisError(f"expected a text in the property {name!r}, got {value!r}")


def _number(properties: Feature, name: str, *, default: float | None = None) -> float:
    value = properties.get(name, default)
    if isinstance(value, int | float) and not isinstance(value, bool):
        return float(value)
    raise GisError(f"expected a number in the property {name!r}, got {value!r}")


def _integer(properties: Feature, name: str, *, default: int) -> int:
    value = _number(properties, name, default=default)
    if value.is_integer():
        return int(value)
    raise GisError(f"expected a whole number in the property {name!r}, got {value!r}")


def _points(coordinates: Json, frame: LocalFrame) -> FloatArray:
    try:
        # A position may carry a height as a third number.
        lonlat_deg = np.array([[float(number) for number in position[:2]] for position in coordinates])
    except (TypeError, ValueError) as error:
        raise GisError(f"expected coordinates [[lon, lat], ...], got {coordinates!r}") from error
    return frame.from_wgs84(lonlat_deg)
