"""Site files: both forms of everything, and every mistake with its place."""

from __future__ import annotations

import re
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import pytest

from anchoring.settings import AnchoringSettings
from gis.frames import LocalFrame
from gis.roads.sumo_net import read_sumo_net
from qsr.settings import RelationSettings
from service.errors import ServiceError, SiteError
from service.runs.inputs.sites.site import Site, SiteFile, load_site
from service.runs.processing import RunRequest, process
from service.store.log import open_log
from service.texts.toml_tables import tables_of
from tests.gis.support import CROSSING_NET, write_geojson
from tests.service.tracks import write_tracks

HEAD = 'name = "crossing"\nstart_utc = 2026-05-01T10:00:00+02:00\n'
LANE = 'id = "a"\ncentre_line_m = [[0, 0], [50, 0]]\nwidth_m = 3.5\nspeed_limit_mps = 20\n'
POINTS = """
[[camera.point]]
pixel = [100, 100]
ground_m = [0, 30]
[[camera.point]]
pixel = [500, 100]
ground_m = [40, 30]
[[camera.point]]
pixel = [500, 400]
ground_m = [40, 0]
[[camera.point]]
pixel = [100, 400]
ground_m = [0, 0]
"""
HOMOGRAPHY = "[camera]\nhomography = [[0.1, 0, 0], [0, -0.1, 40], [0, 0, 1]]\n"
PIXEL_LANE = (
    '[[network.lane]]\nid = "a"\ncentre_line_px = [[300, 50], [320, 350]]\nwidth_m = 3.5\nspeed_limit_mps = 20\n'
)
SKY = "[camera]\nhomography = [[-0.1, 0, 32], [0, 0, -40], [0, -0.01, 1]]\nsize_px = [640, 480]\n"
FRAME = "[frame]\norigin_lat_deg = 58.4\norigin_lon_deg = 15.6\n"
DOCS = Path(__file__).parents[5] / "docs" / "site_file.md"


def load(tmp_path: Path, text: str) -> Site:
    path = tmp_path / "site.toml"
    path.write_text(text, encoding="utf-8")
    return load_site(path)


def test_a_site_of_name_and_start_alone_has_no_network_and_no_camera(tmp_path: Path) -> None:
    site = load(tmp_path, HEAD)
    assert (site.name, site.start_utc) == ("crossing", datetime(2026, 5, 1, 8, tzinfo=UTC))
    assert (site.network, site.camera, site.road_mask) == (None, None, None)
    assert site.path == tmp_path / "site.toml"


def test_a_sumo_network_is_found_beside_the_site_file(tmp_path: Path) -> None:
    (tmp_path / "network.net.xml").write_bytes(CROSSING_NET.read_bytes())
    site = load(tmp_path, HEAD + '[network]\nsumo = "network.net.xml"\n')
    assert site.network is not None
    assert len(site.network.lanes) == 16


def test_a_geojson_network_is_placed_by_the_frame(tmp_path: Path) -> None:
    write_geojson(read_sumo_net(CROSSING_NET), tmp_path / "roads.geojson", LocalFrame(58.4, 15.6))
    site = load(tmp_path, HEAD + FRAME + '[network]\ngeojson = "roads.geojson"\n')
    assert site.network is not None
    assert site.network.locate([[0.0, 100.0]]).road.tolist() == [[road.id for road in site.network.roads].index("cn")]


def test_lanes_written_out_form_roads(tmp_path: Path) -> None:
    back = (
        LANE.replace('"a"', '"b"').replace("[[0, 0], [50, 0]]", "[[50, 3.5], [0, 3.5]]") + 'road = "a"\ndirection = -1'
    )
    site = load(tmp_path, HEAD + f"[[network.lane]]\n{LANE}[[network.lane]]\n{back}\n")
    assert site.network is not None
    assert [(lane.id, lane.edge, lane.road, lane.direction) for lane in site.network.lanes] == [
        ("a", "a", "a", 1),
        ("b", "-a", "a", -1),
    ]
    assert site.network.roads[0].reference_line_m.tolist() == [[0.0, 1.75], [50.0, 1.75]]


@pytest.mark.parametrize("camera", [HOMOGRAPHY, POINTS], ids=["homography", "points"])
def test_both_forms_of_camera_are_read(tmp_path: Path, camera: str) -> None:
    site = load(tmp_path, HEAD + camera)
    assert site.camera is not None
    at_m = [10.0 if camera == HOMOGRAPHY else 0.0, 30.0]
    np.testing.assert_allclose(site.camera.to_ground([[100.0, 100.0]]), [at_m], atol=1e-9)


def test_a_road_mask_is_found_beside_the_site_file(tmp_path: Path) -> None:
    (tmp_path / "mask.png").write_bytes(b"")
    assert load(tmp_path, HEAD + HOMOGRAPHY + 'road_mask = "mask.png"\n').road_mask == tmp_path / "mask.png"


def test_the_example_of_the_documentation_loads(tmp_path: Path) -> None:
    example = re.search(r"```toml\n(.*?)```", DOCS.read_text(encoding="utf-8"), re.DOTALL)
    assert example is not None
    site = load(tmp_path, example.group(1))
    assert site.network is not None
    assert site.camera is not None
    middle_m = site.camera.to_ground([[650.0, 365.0]])
    at = site.network.locate(middle_m)
    assert (at.along_m[0], at.across_m[0]) == pytest.approx((55.0, 0.0), abs=1e-6)


def test_the_errors_of_the_documentation_are_what_comes(tmp_path: Path) -> None:
    texts = (f"{HEAD}[camera]\nhomograpy = 1\n", "name = 'a'\nstart_utc = '1 May'\n")
    came = []
    for text in texts:
        with pytest.raises(SiteError) as caught:
            load(tmp_path, text)
        came.append(str(caught.value).replace(f"{tmp_path}/", "    "))
    shown = [line for line in DOCS.read_text(encoding="utf-8").splitlines() if line.startswith("    site.toml: ")]
    assert came == shown


def test_the_documentation_names_every_field() -> None:
    text = DOCS.read_text(encoding="utf-8")
    tables = dict(tables_of(SiteFile))
    assert {"anchoring", "relations", "camera.thermal"} < set(tables)
    engines = ("anchoring", "relations", "vision")  # their numbers are told elsewhere
    ours = [names for place, names in tables.items() if place.partition(".")[0] not in engines]
    assert {name for names in ours for name in names if name not in text} == set()


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "name: expected a text that is not empty, got no such field"),
        ("name = 3", "name: expected a text that is not empty, got 3"),
        ('name = ""', "name: expected a text that is not empty, got ''"),
        (
            'name = "a"\nstart_utc = "1 May"',
            "start_utc: expected a date and time with its zone and no quotes, as 2026-05-01T08:00:00Z, got '1 May'",
        ),
        (
            'name = "a"\nstart_utc = 2026-05-01T08:00:00',
            (
                "start_utc: expected a date and time with its zone and no quotes, as 2026-05-01T08:00:00Z, "
                "got datetime.datetime(2026, 5, 1, 8, 0)"
            ),
        ),
        (
            HEAD + "[camara]\n",
            (
                "camara: expected one of name, start_utc, network, frame, camera, detector, anchoring, "
                "relations, vision, chronicles; got an unknown field; did you mean camera?"
            ),
        ),
        (
            'road_mask = "mask.png"\n' + HEAD,
            (
                "road_mask: expected one of name, start_utc, network, frame, camera, detector, anchoring, "
                "relations, vision, chronicles; got an unknown field; road_mask belongs in [camera]"
            ),
        ),
        (
            HEAD + '[network]\nname = "x"\n',
            (
                "network.name: expected one of sumo, geojson, lane; got an unknown field; "
                "name belongs at the top of the file"
            ),
        ),
        (HEAD + "[chronicles]\nmost_waiting = 0\n", "chronicles: limits: most_waiting must be 1 or more, got 0"),
        (
            HEAD + "[camera]\nwind = 3\n",
            (
                "camera.wind: expected one of homography, point, size_px, radial, road_mask, moving, rate_hz, poses, "
                "reach_m, measured_at_s, thermal; "
                "got an unknown field"
            ),
        ),
        (HEAD + "camera = 3\n", "camera: expected a table [camera], got 3"),
        (HEAD + "[network]\n", "network: expected exactly one of sumo, geojson, lane; got none of them"),
        (
            HEAD + '[network]\nsumo = "site.toml"\ngeojson = "site.toml"\n',
            "network: expected exactly one of sumo, geojson, lane; got sumo and geojson",
        ),
        (HEAD + "[network]\nsumo = 1\n", "network.sumo: expected a text that is not empty, got 1"),
        (
            HEAD + '[network]\nsumo = "none.xml"\n',
            "network.sumo: expected the path of a file, got 'none.xml', and there is no {folder}/none.xml",
        ),
        (
            HEAD + '[network]\nsumo = "site.toml"\n',
            "network.sumo: {folder}/site.toml: expected XML, got syntax error: line 1, column 0",
        ),
        (
            HEAD + '[network]\ngeojson = "site.toml"\n',
            "network.geojson: expected a [frame] table beside it, which places its degrees; got none",
        ),
        (
            HEAD + FRAME + '[network]\ngeojson = "site.toml"\n',
            "network.geojson: {folder}/site.toml: expected JSON, got Expecting value: line 1 column 1 (char 0)",
        ),
        (HEAD + "[network]\nlane = 5\n", "network.lane: expected tables [[network.lane]], got 5"),
        (
            HEAD + "[network]\nlane = []\n",
            "network.lane: road network: expected at least one lane, got none",
        ),
        (HEAD + "[[network.lane]]\n", "network.lane[1].id: expected a text that is not empty, got no such field"),
        (
            HEAD + f"[[network.lane]]\n{LANE}widht_m = 3\n",
            (
                "network.lane[1].widht_m: expected one of id, road, direction, centre_line_m, "
                "centre_line_px, width_m, speed_limit_mps; got an unknown field; did you mean width_m?"
            ),
        ),
        (
            HEAD + f"[[network.lane]]\n{LANE}[[network.lane]]\n{LANE}",
            "network.lane: road network: expected every lane id once, got 'a' twice",
        ),
        (
            HEAD + f"[[network.lane]]\n{LANE}direction = 0.5\n",
            "network.lane[1].direction: expected 1 or -1, got 0.5",
        ),
        (
            HEAD + "[[network.lane]]\n" + LANE.replace("3.5", "-3.5"),
            "network.lane[1]: lane 'a': width_m must be > 0 metres, got -3.5",
        ),
        (
            HEAD + "[[network.lane]]\n" + LANE.replace("3.5", "true"),
            "network.lane[1].width_m: expected a number, got True",
        ),
        (
            HEAD + "[[network.lane]]\n" + LANE.replace("3.5", "nan"),
            "network.lane[1].width_m: expected a number, got nan",
        ),
        (
            HEAD + "[[network.lane]]\n" + LANE.replace("[50, 0]", "[50]"),
            "network.lane[1].centre_line_m: expected points [[x, y], [x, y], ...], got [[0, 0], [50]]",
        ),
        (
            HEAD + "[[network.lane]]\n" + LANE.replace("[50, 0]", '[50, "x"]'),
            "network.lane[1].centre_line_m: expected points [[x, y], [x, y], ...], got [[0, 0], [50, 'x']]",
        ),
        (
            HEAD + "[[network.lane]]\n" + LANE.replace("[50, 0]", "[0, 0]"),
            "network.lane[1]: lane 'a': expected a line of at least 2 different points, got [[0.0, 0.0]]",
        ),
        (HEAD + "[frame]\norigin_lat_deg = 1\n", "frame.origin_lon_deg: expected a number, got no such field"),
        (
            HEAD + FRAME.replace("58.4", "99"),
            "frame: local frame: origin_lat_deg must lie within (-89, 89), got 99.0",
        ),
        (
            HEAD + HOMOGRAPHY + "radial = 0.1\n",
            "camera.radial: expected size_px of a camera that stands beside it, got none",
        ),
        (
            HEAD + HOMOGRAPHY + "radial = 0.1\nsize_px = [640, 480]\nmoving = true\n",
            "camera.radial: expected size_px of a camera that stands beside it, got a camera that moves",
        ),
        (
            HEAD + HOMOGRAPHY + "radial = 1.5\nsize_px = [640, 480]\n",
            "camera.radial: lens: expected a radial of -0.8 to 0.8, got 1.5",
        ),
        (
            HEAD + HOMOGRAPHY + "size_px = [640]\n",
            "camera.size_px: expected width and height of the picture, two whole numbers above 1, got [640]",
        ),
        (
            HEAD + PIXEL_LANE,
            (
                "network.lane[1].centre_line_px: expected a [camera] that stands, with size_px, beside lines in "
                "pixels; got none"
            ),
        ),
        (
            HEAD + SKY + PIXEL_LANE,
            "network.lane[1].centre_line_px: expected pixels below the horizon, got [300.0, 50.0] above it",
        ),
        (
            HEAD + HOMOGRAPHY + f"size_px = [640, 480]\n{PIXEL_LANE}centre_line_m = [[0, 0], [9, 9]]\n",
            (
                "network.lane[1]: expected exactly one of centre_line_m, centre_line_px; "
                "got centre_line_m and centre_line_px"
            ),
        ),
        (HEAD + "[camera]\n", "camera: expected exactly one of homography, point; got none of them"),
        (
            HEAD + HOMOGRAPHY + POINTS,
            "camera: expected exactly one of homography, point; got homography and point",
        ),
        (
            HEAD + "[camera]\nhomography = [[1, 0, 0], [0, 1, 0]]\n",
            "camera.homography: expected 3 rows of 3 numbers, got [[1, 0, 0], [0, 1, 0]]",
        ),
        (
            HEAD + "[camera]\nhomography = [[1, 0, 0], [1, 0, 0], [0, 0, 1]]\n",
            (
                "camera.homography: camera: expected a finite, invertible homography, "
                "got [[1.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]"
            ),
        ),
        (
            HEAD + POINTS.replace("[500, 100]", "[500]"),
            "camera.point[2].pixel: expected a point [x, y] of two numbers, got [500]",
        ),
        (
            HEAD + POINTS.replace("ground_m = [40, 0]\n", ""),
            "camera.point[3].ground_m: expected a point [x, y] of two numbers, got no such field",
        ),
        (
            HEAD + POINTS.replace("ground_m", "ground"),
            "camera.point[1].ground: expected one of pixel, ground_m; got an unknown field; did you mean ground_m?",
        ),
        (
            HEAD + POINTS[: POINTS.rindex("[[camera")],
            "camera.point: camera: expected at least 4 pairs of points, got 3 pixels and 3 ground points",
        ),
        (
            HEAD + HOMOGRAPHY + 'road_mask = "none.png"\n',
            "camera.road_mask: expected the path of a file, got 'none.png', and there is no {folder}/none.png",
        ),
    ],
)
def test_every_wrong_field_is_named_with_what_was_expected_and_what_came(
    tmp_path: Path, text: str, message: str
) -> None:
    with pytest.raises(SiteError) as caught:
        load(tmp_path, text)
    assert str(caught.value) == f"{tmp_path}/site.toml: " + message.replace("{folder}", str(tmp_path))


def test_numbers_of_engines_are_read_over_their_defaults(tmp_path: Path) -> None:
    site = load(tmp_path, HEAD + "[anchoring]\nsurvive_us = 9_000_000\n[relations]\nclose_m = 30\n")
    assert site.anchoring == AnchoringSettings(survive_us=9_000_000)
    assert site.relations == RelationSettings(close_m=30.0)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("[relations]\nclose = 3\n", r"relations.close: expected one of .*unknown field; did you mean close_m\?"),
        ("[anchoring]\nsurvive_us = 0.5\n", r"anchoring.survive_us: expected a whole number.*, got 0.5"),
        ("[anchoring]\nsurvive_us = 5\n", r"anchoring: .*survive_us must be at least predict_us \(.*\), got 5"),
        ("[relations]\nclose_m = nan\n", r"relations.*close_m.*a number.*, got nan"),
        ("[relations]\nbackdate_us = 10_000_001\n", r"backdate_us: expected 0 to 10000000 \(us\), got 10000001"),
        ("relations = 3\n", r"relations: expected a table \[relations\], got 3"),
    ],
)
def test_wrong_numbers_of_engines_are_named(tmp_path: Path, text: str, message: str) -> None:
    with pytest.raises(SiteError, match=message):
        load(tmp_path, HEAD + text)


def test_broken_toml_is_an_error_with_its_place(tmp_path: Path) -> None:
    with pytest.raises(SiteError, match=r"site.toml: expected TOML in UTF-8, got .*\(at line 1, column 8\)"):
        load(tmp_path, "name = \n")


def test_a_file_that_is_no_text_is_an_error(tmp_path: Path) -> None:
    path = tmp_path / "site.toml"
    path.write_bytes(b"\xff\xfe\x00")
    with pytest.raises(SiteError, match=r"site.toml: expected TOML in UTF-8, got .*can't decode byte 0xff"):
        load_site(path)


def test_a_missing_file_and_a_folder_are_errors(tmp_path: Path) -> None:
    with pytest.raises(ServiceError, match=r"none.toml: expected a readable site file, got No such file or directory"):
        load_site(tmp_path / "none.toml")
    with pytest.raises(ServiceError, match="expected a readable site file, got Is a directory"):
        load_site(tmp_path)


def test_numbers_of_the_site_reach_the_engines(tmp_path: Path) -> None:
    tracks, counts = write_tracks(tmp_path / "t.csv", frames=40), []
    for number, extra in enumerate(("", "[anchoring]\nestablish_us = 60_000_000\n")):
        path = tmp_path / f"{number}.toml"
        path.write_text(HEAD + extra, encoding="utf-8")
        url = str(tmp_path / f"{number}.db")
        process(RunRequest(tracks, path, url))
        with open_log(url) as log:
            counts.append(len(list(log.states(log.run(None).id))))
    assert counts[0] > 0
    assert counts[1] == 0
