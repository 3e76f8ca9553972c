"""Are roads, cars and events where they are on Earth, and is it said where nobody knows?"""

from collections.abc import Iterator
from pathlib import Path

import msgspec
import numpy as np
import pytest

from gis.frames import LocalFrame
from gis.roads.geojson import read_geojson
from service.api.app import create_app
from service.records.runs import SiteRecord
from service.runs.inputs.input_kind import content_digest
from service.runs.inputs.sites.site import load_site
from service.runs.processing import process
from service.runs.requests import RunRequest
from service.store.log import open_log
from tests.service.http import Client
from tests.service.logs import SECOND_US, overtake, run, state

FRAME = LocalFrame(58.4, 15.6)
SITE = """\
name = "bend"
[frame]
origin_lat_deg = 58.4
origin_lon_deg = 15.6
[[network.lane]]
id = "a"
centre_line_m = [[0, 0], [50, 0], [100, 20]]
width_m = 3.5
speed_limit_mps = 13.9
[[network.lane]]
id = "b"
road = "a"
direction = -1
centre_line_m = [[100, 24], [50, 4], [0, 4]]
width_m = 3.5
speed_limit_mps = 13.9
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Where the site and the log lie."""
    return tmp_path_factory.mktemp("earth")


@pytest.fixture(scope="module")
def client(folder: Path) -> Iterator[Client]:
    """Run r1 has a place on Earth, r2 none; the site of r3 is another one now."""
    (folder / "site.toml").write_text(SITE)
    digest = content_digest(folder / "site.toml")
    with open_log(str(folder / "a.db"), "w") as log:
        for name, digest_then, origin_deg in (
            ("r1", digest, (58.4, 15.6)),
            ("r2", digest, None),
            ("r3", "other", None),
        ):
            site = SiteRecord(str(folder / "site.toml"), digest_then, origin_deg)
            writer = log.begin_run(run(name, site="bend", site_file=site))
            for number in range(3):
                writer.append_frames([number * SECOND_US])
                writer.append_states([state(number * SECOND_US, "car7", 10.0 * number, 5.0)])
            writer.append_states([state(2 * SECOND_US, "car8", 30.0, 5.0)])
            writer.append_events([overtake(), overtake(place=None)])
            writer.finish("finished")
        log.begin_run(run("r4", site="", site_file=None)).finish("finished")
    with Client(create_app(str(folder / "a.db"), shipped=())) as client:
        yield client


def test_roads_are_told_in_metres(client: Client, folder: Path) -> None:
    found = client.get("/api/v1/runs/r1/site").json()
    network = load_site(folder / "site.toml").network
    assert network is not None
    assert (found["run"], found["site"], found["origin_deg"]) == ("r1", "bend", [58.4, 15.6])
    assert [one["id"] for one in found["lanes"]] == [one.id for one in network.lanes]
    assert found["lanes"][1]["centre_line_m"] == network.lanes[1].centre_line_m.tolist()
    assert (found["lanes"][1]["edge"], found["junctions"]) == ("-a", [])
    assert client.get("/api/v1/runs/r2/site").json()["origin_deg"] is None


def test_roads_as_geojson_can_be_read_as_a_site(client: Client, folder: Path, tmp_path: Path) -> None:
    answer = client.get("/api/v1/runs/r1/site?format=geojson")
    assert answer.headers["content-type"] == "application/geo+json"
    (tmp_path / "roads.geojson").write_bytes(answer.content)
    again, network = read_geojson(tmp_path / "roads.geojson", FRAME), load_site(folder / "site.toml").network
    assert network is not None
    for one, other in zip(again.lanes, network.lanes, strict=True):
        assert (one.id, one.edge, one.index, one.road, one.direction, one.width_m, one.speed_limit_mps) == (
            *(other.id, other.edge, other.index, other.road, other.direction, other.width_m, other.speed_limit_mps),
        )
        assert np.abs(one.centre_line_m - other.centre_line_m).max() < 0.002


def test_cars_are_lines_with_times(client: Client) -> None:
    first, second = client.get("/api/v1/tracks?run=r1&from=0s&to=9s&format=geojson").json()["features"]
    assert (first["id"], first["geometry"]["type"]) == ("car7", "LineString")
    metres = FRAME.from_wgs84(first["geometry"]["coordinates"])
    assert np.abs(metres - [[0, 5], [10, 5], [20, 5]]).max() < 0.002
    assert first["properties"]["t_us"] == [0, SECOND_US, 2 * SECOND_US]
    assert (second["id"], second["geometry"]["type"], second["properties"]["linked"]) == ("car8", "Point", [True])
    [alone] = client.get("/api/v1/cars/car7/trajectory?run=r1&format=geojson").json()["features"]
    assert alone == first
    assert client.get("/api/v1/tracks?run=r1&from=5s&to=9s&format=geojson").json()["features"] == []


def test_events_are_points_and_those_without_a_place_on_earth_say_so(client: Client) -> None:
    answer = client.get("/api/v1/events/export?format=geojson")
    assert answer.headers["content-type"].startswith("application/geo+json")
    found = answer.json()
    events = [msgspec.json.decode(line) for line in client.get("/api/v1/events/export").content.splitlines()]
    assert [one["properties"] for one in found["features"]] == events
    placed = [one for one in found["features"] if one["geometry"]]
    assert [one["properties"]["run"] for one in placed] == ["r1"]
    metres = FRAME.from_wgs84([placed[0]["geometry"]["coordinates"]])
    assert np.abs(metres - [[10.5, -2.25]]).max() < 0.002
    assert client.get("/api/v1/events/export?format=geojson&type=none").json()["features"] == []


@pytest.mark.parametrize(
    ("path", "status", "told"),
    [
        ("runs/r2/site?format=geojson", 409, "expected a run whose site file said with [frame]"),
        ("tracks?run=r2&from=0s&to=9s&format=geojson", 409, "expected a run whose site file said with [frame]"),
        ("cars/car7/trajectory?run=r1&format=shp", 422, "format: expected 'json' or 'geojson', got 'shp'"),
        ("runs/r3/site", 409, "expected the site file of 'bend' as it was, to tell its roads, got another one"),
        ("runs/r4/site", 404, "expected one with roads"),
        ("runs/r9/site", 404, "expected a run 'r9'"),
    ],
)
def test_what_nobody_knows_is_refused(client: Client, folder: Path, path: str, status: int, told: str) -> None:
    answer = client.get(f"/api/v1/{path}")
    assert (answer.status_code, told in answer.json()["detail"]) == (status, True), answer.text
    assert str(folder / "site.toml") not in answer.text


def test_a_run_keeps_where_its_site_is_on_earth(tmp_path: Path) -> None:
    (tmp_path / "site.toml").write_text(SITE)
    rows = "".join(f"{number * 40_000},car1,car,{number},1,0,10,4.5,1.8\n" for number in range(5))
    (tmp_path / "a.csv").write_text(f"t_us,id,class,x_m,y_m,heading_rad,speed_mps,length_m,width_m\n{rows}")
    process(RunRequest(tmp_path / "a.csv", tmp_path / "site.toml", str(tmp_path / "b.db")))
    with open_log(str(tmp_path / "b.db")) as log:
        site = log.run().site_file
    assert site is not None
    assert site.origin_deg == (58.4, 15.6)
