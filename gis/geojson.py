"""How is a road network kept as GeoJSON, so that any map tool can draw or edit it?

GeoJSON (RFC 7946) is longitude and latitude on WGS84, so a `LocalFrame` goes with every file. Each LineString is the
centre line of a lane in driving direction, each Polygon the outline of a junction; anything else is an error.

Properties of a lane: `id`, `width_m` and `speed_limit_mps` are needed; `road` (default: the id), `direction`
(+1 or -1, default +1), `edge` and `index` may be left out. A junction needs `id`. Other properties are ignored.
"""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from gis.errors import GisError
from gis.frames import LocalFrame
from gis.lanes import Junction, Lane, edge_name
from gis.polyline import FloatArray
from gis.road_network import RoadNetwork

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
    features = _features(path)
    lanes: list[Lane] = []
    junctions: list[Junction] = []
    lanes_of_edge: Counter[str] = Counter()
    for place, feature in enumerate(features, start=1):
        reader = _FeatureReader(feature, f"{path}: feature {place}", frame)
        if reader.kind == "LineString":
            lanes.append(reader.lane(lanes_of_edge))
        else:
            junctions.append(reader.junction())
    if not lanes:
        raise GisError(f"{path}: expected at least one LineString, the centre line of a lane, got none")
    try:
        return RoadNetwork(lanes, junctions=junctions)
    except GisError as error:
        raise GisError(f"{path}: {error}") from error


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


class _FeatureReader:
    """One feature of a file, with the words to say where an error is."""

    def __init__(self, feature: Feature, where: str, frame: LocalFrame) -> None:
        self._properties = _mapping(feature, "properties", where)
        self._geometry = _mapping(feature, "geometry", where)
        self._where = where
        self._frame = frame
        self.kind = self._geometry.get("type")
        if self.kind not in ("LineString", "Polygon"):
            raise GisError(f"{where}: expected a LineString (lane) or a Polygon (junction), got {self.kind!r}")
        self._id = self._text("id")
        self._where = f"{where} ({self._id!r})"

    def lane(self, lanes_of_edge: Counter[str]) -> Lane:
        """Read a lane; `lanes_of_edge` counts them and gives the default index."""
        road = self._text("road", default=self._id)
        direction = self._integer("direction", default=1)
        edge = self._text("edge", default=edge_name(road, direction))
        index = self._integer("index", default=lanes_of_edge[edge])
        lanes_of_edge[edge] += 1
        line_m = self._points(self._geometry.get("coordinates"))
        width_m, speed_mps = self._number("width_m"), self._number("speed_limit_mps")
        try:
            return Lane(self._id, edge, index, road, direction, line_m, width_m, speed_mps)
        except GisError as error:
            raise GisError(f"{self._where}: {error}") from error

    def junction(self) -> Junction:
        """Read a junction; holes in its area are left out."""
        rings = self._geometry.get("coordinates")
        outline_m = self._points(rings[0] if isinstance(rings, list) and rings else rings)
        try:
            return Junction(self._id, outline_m)
        except GisError as error:
            raise GisError(f"{self._where}: {error}") from error

    def _text(self, name: str, *, default: str | None = None) -> str:
        value = self._properties.get(name, default)
        # Map tools like to write identifiers as numbers.
        if isinstance(value, str | int) and not isinstance(value, bool):
            return str(value)
        raise GisError(f"{self._where}: expected a text in the property {name!r}, got {value!r}")

    def _number(self, name: str, *, default: float | None = None) -> float:
        value = self._properties.get(name, default)
        if isinstance(value, int | float) and not isinstance(value, bool):
            return float(value)
        raise GisError(f"{self._where}: expected a number in the property {name!r}, got {value!r}")

    def _integer(self, name: str, *, default: int) -> int:
        value = self._number(name, default=default)
        if value.is_integer():
            return int(value)
        raise GisError(f"{self._where}: expected a whole number in the property {name!r}, got {value!r}")

    def _points(self, coordinates: Json) -> FloatArray:
        try:
            # A position may carry a height as a third number.
            lonlat_deg = np.array([[float(number) for number in position[:2]] for position in coordinates])
        except (TypeError, ValueError) as error:
            raise GisError(f"{self._where}: expected coordinates [[lon, lat], ...], got {coordinates!r}") from error
        try:
            return self._frame.from_wgs84(lonlat_deg)
        except GisError as error:
            raise GisError(f"{self._where}: {error}") from error


def _mapping(feature: Feature, name: str, where: str) -> Feature:
    value = feature.get(name)
    if isinstance(value, dict):
        return value
    raise GisError(f"{where}: expected an object in {name!r}, got {value!r}")
