"""Road networks as GeoJSON: written, read back, refused with a reason."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gis.errors import GisError
from gis.frames import LocalFrame
from gis.roads.geojson import read_geojson
from gis.roads.sumo_net import read_sumo_net
from tests.gis.support import CROSSING_NET, write_geojson

FRAME = LocalFrame(58.4, 15.6)
LANE = {
    "type": "Feature",
    "properties": {"id": "we", "width_m": 3.5, "speed_limit_mps": 25},
    "geometry": {"type": "LineString", "coordinates": [[15.6, 58.4], [15.602, 58.4]]},
}
JUNCTION = {
    "type": "Feature",
    "properties": {"id": 7, "note": "drawn by hand"},
    "geometry": {
        "type": "Polygon",
        "coordinates": [[[15.602, 58.4], [15.603, 58.4], [15.603, 58.401], [15.602, 58.4]]],
    },
}


def changed(feature: dict[str, Any], part: str, name: str, value: object) -> dict[str, Any]:
    return feature | {part: feature[part] | {name: value}}


def write(tmp_path: Path, *features: object) -> Path:
    path = tmp_path / "roads.geojson"
    path.write_text(json.dumps({"type": "FeatureCollection", "features": features}))
    return path


def test_a_network_is_the_same_after_writing_and_reading(tmp_path: Path) -> None:
    before, path = read_sumo_net(CROSSING_NET), tmp_path / "roads.geojson"
    write_geojson(before, path, FRAME)
    after = read_geojson(path, FRAME)
    for old, new in zip(before.lanes, after.lanes, strict=True):
        assert (old.id, old.edge, old.index, old.road, old.direction) == (
            new.id, new.edge, new.index, new.road, new.direction
        )  # fmt: skip
        assert (old.width_m, old.speed_limit_mps) == (new.width_m, new.speed_limit_mps)
        np.testing.assert_allclose(old.centre_line_m, new.centre_line_m, atol=1e-3)
    for old_road, new_road in zip(before.roads, after.roads, strict=True):
        assert old_road.id == new_road.id
        np.testing.assert_allclose(old_road.reference_line_m, new_road.reference_line_m, atol=1e-3)
    assert [junction.id for junction in after.junctions] == ["c"]
    points_m = np.random.default_rng(5).uniform(-150.0, 150.0, (3000, 2))
    assert before.locate(points_m).lane.tolist() == after.locate(points_m).lane.tolist()


def test_an_id_that_comes_twice_is_an_error(tmp_path: Path) -> None:
    path = write(tmp_path, LANE, LANE)
    with pytest.raises(GisError) as caught:
        read_geojson(path, FRAME)
    assert str(caught.value) == f"{path}: road network: expected every lane id once, got 'we' twice"


def test_what_a_lane_leaves_out_gets_its_default(tmp_path: Path) -> None:
    back = changed(LANE, "properties", "road", "we") | {}
    back = changed(changed(back, "properties", "id", "back"), "properties", "direction", -1)
    network = read_geojson(write(tmp_path, LANE, back), FRAME)
    assert [(lane.id, lane.road, lane.edge, lane.index, lane.direction) for lane in network.lanes] == [
        ("we", "we", "we", 0, 1),
        ("back", "we", "-we", 0, -1),
    ]


def test_numbers_serve_as_ids_and_other_properties_are_ignored(tmp_path: Path) -> None:
    network = read_geojson(write(tmp_path, LANE, JUNCTION), FRAME)
    assert network.junctions[0].id == "7"


@pytest.mark.parametrize(
    ("feature", "message"),
    [
        (
            changed(LANE, "geometry", "type", "Point"),
            "expected a LineString (lane) or a Polygon (junction), got 'Point'",
        ),
        (LANE | {"geometry": None}, "expected an object in 'geometry', got None"),
        (LANE | {"properties": [1]}, "expected an object in 'properties', got [1]"),
        (changed(LANE, "properties", "id", None), "expected a text in the property 'id', got None"),
        (
            changed(LANE, "properties", "width_m", "3.5"),
            "('we'): expected a number in the property 'width_m', got '3.5'",
        ),
        (
            changed(LANE, "properties", "direction", 0.5),
            "('we'): expected a whole number in the property 'direction', got 0.5",
        ),
        (changed(LANE, "properties", "direction", 2), "('we'): lane 'we': direction must be +1 or -1, got 2"),
        (
            changed(LANE, "geometry", "coordinates", [15.6, 58.4]),
            "('we'): expected coordinates [[lon, lat], ...], got [15.6, 58.4]",
        ),
        (
            changed(LANE, "geometry", "coordinates", [[15.6, 99.0], [15.7, 58.4]]),
            "('we'): local frame: expected points near lon 15.6, lat 58.4, got [15.6, 99.0]",
        ),
        (
            changed(JUNCTION, "geometry", "coordinates", []),
            "('7'): local frame: expected points of shape (n, 2), got shape (0,)",
        ),
        (
            changed(JUNCTION, "geometry", "coordinates", [[[15.6, 58.4], [15.6, 58.4]]]),
            "('7'): junction '7': expected a line of at least 2 different points, got [[0.0, 0.0]]",
        ),
    ],
    ids=lambda value: None if isinstance(value, dict) else "",
)
def test_a_feature_that_lacks_something_is_an_error(tmp_path: Path, feature: object, message: str) -> None:
    path = write(tmp_path, LANE, feature)
    with pytest.raises(GisError) as caught:
        read_geojson(path, FRAME)
    separator = " " if message.startswith("(") else ": "
    assert str(caught.value) == f"{path}: feature 2{separator}{message}"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("{", "expected JSON, got Expecting property name"),
        ('{"type": "Feature"}', "expected a GeoJSON FeatureCollection, got 'Feature'"),
        ("[]", "expected a GeoJSON FeatureCollection, got 'list'"),
        ('{"type": "FeatureCollection", "features": [1]}', r"expected a list of objects in 'features', got \[1\]"),
        ('{"type": "FeatureCollection", "features": []}', "expected at least one LineString, .*, got none"),
    ],
)
def test_a_file_that_is_no_feature_collection_is_an_error(tmp_path: Path, text: str, message: str) -> None:
    path = tmp_path / "roads.geojson"
    path.write_text(text)
    with pytest.raises(GisError, match=message):
        read_geojson(path, FRAME)


def test_a_missing_file_is_an_error(tmp_path: Path) -> None:
    with pytest.raises(GisError, match="expected a readable GeoJSON file"):
        read_geojson(tmp_path / "none.geojson", FRAME)
