"""`dyknow site`: from points in a picture to a site file, and what is said of it."""

from __future__ import annotations

import json
import re
from pathlib import Path

import cv2
import numpy as np
import pytest
from pyproj import Transformer

from gis.cameras.camera import GroundCamera
from gis.cameras.lens import Lens
from gis.frames import LocalFrame
from service.cli.app import run
from service.runs.inputs.sites.new_site import read_marks
from service.runs.inputs.sites.site import load_site
from tests.vision.support import write_video

SIZE_PX = (320, 240)
CAMERA = GroundCamera.from_homography([[0.1, 0.0, -16.0], [0.0, -0.1, 30.0], [0.0, 0.002, 1.0]], Lens(SIZE_PX, -0.2))
PIXELS = [
    (20, 30),
    (300, 24),
    (160, 40),
    (24, 220),
    (296, 214),
    (150, 230),
    (60, 120),
    (250, 130),
    (160, 150),
    (90, 60),
]
GROUND_M = CAMERA.to_ground(PIXELS)
FRAME = LocalFrame(58.4, 15.6)


@pytest.fixture(scope="module")
def clip(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("clip") / "clip.mp4"
    write_video(path, [np.full(SIZE_PX[::-1], grey, np.uint8) for grey in (120, 140, 160)])
    return path


def table(path: Path, header: str, rows: list[tuple[object, ...]]) -> Path:
    path.write_text("\n".join([header, *(",".join(map(str, row)) for row in rows)]), encoding="utf-8")
    return path


def metres(path: Path, count: int = len(PIXELS)) -> Path:
    rows = [(*pixel, *ground) for pixel, ground in zip(PIXELS, GROUND_M.tolist(), strict=True)]
    return table(path, "u_px,v_px,x_m,y_m", rows[:count])  # type: ignore[arg-type]


def test_points_make_a_site_whose_camera_and_lens_are_those_of_the_points(clip: Path, tmp_path: Path) -> None:
    out = tmp_path / "site.toml"
    assert run(["site", "new", str(clip), "--points", str(metres(tmp_path / "points.csv")), "--out", str(out)]) == 0
    site = load_site(out)
    assert site.size_px == SIZE_PX
    assert site.camera is not None
    assert site.camera.lens is not None
    assert site.camera.lens.radial == pytest.approx(-0.2, abs=1e-3)
    np.testing.assert_allclose(site.camera.to_ground(PIXELS), GROUND_M, atol=0.01)


def test_degrees_and_a_grid_give_the_camera_of_metres_up_to_a_shift(tmp_path: Path) -> None:
    lonlat = FRAME.to_wgs84(GROUND_M)
    grid = np.column_stack(Transformer.from_crs(4326, 32633, always_xy=True).transform(*lonlat.T))
    degrees = [(*pixel, lat, lon) for pixel, (lon, lat) in zip(PIXELS, lonlat.tolist(), strict=True)]
    on_grid = [(*pixel, east, north, 32633) for pixel, (east, north) in zip(PIXELS, grid.tolist(), strict=True)]
    files = [
        table(tmp_path / "degrees.csv", "u_px,v_px,lat,lon", degrees),  # type: ignore[arg-type]
        table(tmp_path / "grid.csv", "u_px,v_px,east_m,north_m,epsg", on_grid),  # type: ignore[arg-type]
    ]
    for file in files:
        marks = read_marks(file, SIZE_PX)
        assert marks.frame is not None
        moved_m = marks.points[:, 2:] - GROUND_M
        np.testing.assert_allclose(moved_m, np.broadcast_to(moved_m[0], moved_m.shape), atol=0.002)
        np.testing.assert_allclose(marks.frame.to_wgs84(marks.points[:, 2:]), lonlat, atol=1e-8)


def test_lanes_in_pixels_lie_on_the_ground_and_are_led_out_of_the_picture(clip: Path, tmp_path: Path) -> None:
    rows: list[tuple[object, ...]] = [("a", 100, 235), ("a", 110, 120), ("a", 120, 60)]
    lanes = table(tmp_path / "lanes.csv", "lane,u_px,v_px", rows)
    out, points = tmp_path / "site.toml", metres(tmp_path / "points.csv")
    assert run(["site", "new", str(clip), "--points", str(points), "--lanes", str(lanes), "--out", str(out)]) == 0
    network = load_site(out).network
    assert network is not None
    line_m = network.lanes[0].centre_line_m
    np.testing.assert_allclose(line_m[1:], CAMERA.to_ground([[100, 235], [110, 120], [120, 60]]), atol=0.01)
    assert np.hypot(*(line_m[1] - line_m[0])) == pytest.approx(25.0)


def test_check_draws_and_warns(clip: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    rows: list[tuple[object, ...]] = [("a", 30, 60), ("a", 40, 120), ("a", 30, 235)]
    lanes = table(tmp_path / "lanes.csv", "lane,u_px,v_px", rows)
    near = [(*pixel, *ground) for pixel, ground in zip(PIXELS, GROUND_M.tolist(), strict=True) if pixel[0] > 140]
    points = table(tmp_path / "points.csv", "u_px,v_px,x_m,y_m", near)  # type: ignore[arg-type]
    site, picture = tmp_path / "site.toml", tmp_path / "check.png"
    new = ["site", "new", str(clip), "--points", str(points), "--lanes", str(lanes), "--out", str(site)]
    assert run(new) == 0
    capsys.readouterr()
    assert run(["site", "check", str(site), "--clip", str(clip), "--out", str(picture), "--json"]) == 0
    warnings = json.loads(capsys.readouterr().out)["warnings"]
    beyond, ends = warnings
    assert re.search(r"extrapolated: a \d\d m$", beyond)
    assert ends.endswith("a at (30, 60)")
    drawn = cv2.imread(str(picture))
    assert drawn is not None
    assert drawn.shape[1] == 1280
    assert drawn.shape[0] > 960


@pytest.mark.long
def test_a_still_alone_and_a_check_of_it(clip: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    still, site = tmp_path / "still.png", tmp_path / "site.toml"
    points = metres(tmp_path / "points.csv")
    assert run(["site", "new", str(clip), "--still", str(still)]) == 0
    assert run(["site", "new", str(clip), "--points", str(points), "--out", str(site)]) == 0
    assert run(["site", "check", str(site), "--image", str(still), "--out", str(tmp_path / "check.jpg")]) == 0
    cv2.imwrite(str(tmp_path / "half.png"), np.zeros((120, 160, 3), np.uint8))
    assert (
        run(["site", "check", str(site), "--image", str(tmp_path / "half.png"), "--out", str(tmp_path / "a.png")]) == 3
    )
    assert run(["site", "check", str(site), "--image", str(still), "--out", str(still)]) == 3
    assert run(["site", "check", str(site), "--image", str(site), "--out", str(tmp_path / "a.png")]) == 3
    said = capsys.readouterr().err
    assert "still.png: expected a new file, got one that is being read" in said
    assert "site.toml: expected a picture that OpenCV can read, got another file or none" in said
    assert "camera.size_px: expected half.png to be 320 x 240 px as the site's picture, got 160 x 120 px" in said
    assert "all pixels of the site times 0.5 would fit" in said


@pytest.mark.long
def test_a_site_says_of_which_picture_its_points_are(clip: Path, tmp_path: Path) -> None:
    site, points = tmp_path / "site.toml", metres(tmp_path / "points.csv")
    new = ["site", "new", str(clip), "--points", str(points), "--out", str(site)]
    assert run(new) == 0
    assert "measured_at_s" not in site.read_text()
    assert run([*new, "--force", "--at", "0.05s"]) == 0
    assert "measured_at_s = 0.08\n" in site.read_text()
    assert load_site(site).measured_at_us == 80_000
    check = ["site", "check", str(site), "--clip", str(clip), "--out"]
    for name, more in (("same.png", ["--at", "0.08s"]), ("usual.png", [])):
        assert run([*check, str(tmp_path / name), *more]) == 0
    assert (tmp_path / "usual.png").read_bytes() == (tmp_path / "same.png").read_bytes()


def test_nothing_is_written_over_without_force(clip: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out, points = tmp_path / "site.toml", metres(tmp_path / "points.csv")
    out.write_text("mine", encoding="utf-8")
    new = ["site", "new", str(clip), "--points", str(points), "--out", str(out)]
    assert (run(new), out.read_text(encoding="utf-8")) == (3, "mine")
    assert "or --force to write over it" in capsys.readouterr().err
    assert run([*new, "--force"]) == 0
    assert load_site(out).camera is not None
    assert run(["site", "new", str(clip), "--still", str(clip), "--force"]) == 3


HEAD = "u_px,v_px,x_m,y_m"
LINE = "\n10,10,0,0\n20,20,1,1\n30,30,2,2\n40,40,3,3\n"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "points.csv:1: expected the columns u_px,v_px,x_m,y_m or u_px,v_px,east_m,north_m,epsg or u_px"),
        ("u,v,x_m,y_m\n", "points.csv:1: expected the columns"),
        ("u_px,v_px,x_m,y_m,lat,lon\n", "got 'u_px,v_px,x_m,y_m,lat,lon'"),
        ("u_px,v_px,east_m,north_m\n", "got 'u_px,v_px,east_m,north_m'"),
        (f"{HEAD}\n1,2,3,4\n", "points.csv: expected at least 4 points, better 8, spread over the road; got 1"),
        (f"{HEAD}\n1,2,3\n", "points.csv:2: expected 4 fields, got"),
        (f"{HEAD}\n1,2,3,4,5\n", "points.csv:2: expected 4 fields, got"),
        (f"{HEAD}\n1,2,3,four\n", "points.csv:2: y_m: expected a number, got 'four'"),
        (f"{HEAD}\n1,2,3,nan\n", "points.csv:2: y_m: expected a number, got 'nan'"),
        (f"{HEAD}\n1,2,3,4\n5,6,7,8\n900,6,7,8\n9,9,9,9\n", "points.csv:4: expected u_px and v_px inside the picture"),
        (
            "u_px,v_px,lat,lon\n1,2,158.4,15.6\n",
            "lat: expected a number from -89 to 89, got '158.4'; are lat and lon sw",
        ),
        ("u_px,v_px,lat,lon\n1,2,58.4,195.6\n", "lon: expected a number from -180 to 180, got '195.6'"),
        (
            "u_px,v_px,east_m,north_m,epsg" + "\n1,2,3,4,77777777" * 4,
            "epsg: expected a code such as 32633 (UTM zone 33",
        ),
        (
            "u_px,v_px,east_m,north_m,epsg" + "\n1,2,500000,6e6,32633" * 3 + "\n1,2,500000,6e6,32632",
            "epsg: expected one code for all points, got [32632, 32633]",
        ),
        (f"{HEAD}{LINE}", "site.toml: camera.point: camera: expected ground points that spread over an area"),
    ],
)
def test_bad_points_are_refused_with_their_place(
    clip: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], text: str, message: str
) -> None:
    points, out = tmp_path / "points.csv", tmp_path / "site.toml"
    points.write_text(text, encoding="utf-8")
    assert run(["site", "new", str(clip), "--points", str(points), "--out", str(out)]) == 3
    said = capsys.readouterr().err
    assert message in said
    assert not out.exists()


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("lane,u_px\n", "lanes.csv:1: expected the columns lane,u_px,v_px, got 'lane,u_px'"),
        ("lane,u_px,v_px\na,1,x\n", "lanes.csv:2: v_px: expected a number, got 'x'"),
        ("lane,u_px,v_px\na,1,2\n", "network.lane[1]: lane 'a'"),
        ("lane,u_px,v_px,width_m\na,50,200,-1\na,50,100,\n", "network.lane[1]: lane 'a': width_m must be > 0"),
    ],
)
def test_bad_lanes_are_refused_with_their_place(
    clip: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], text: str, message: str
) -> None:
    lanes, points = tmp_path / "lanes.csv", metres(tmp_path / "points.csv")
    lanes.write_text(text, encoding="utf-8")
    new = ["site", "new", str(clip), "--points", str(points), "--lanes", str(lanes)]
    assert run([*new, "--out", str(tmp_path / "site.toml")]) == 3
    assert message in capsys.readouterr().err


@pytest.mark.parametrize("words", [["--lanes", "a.csv"], []], ids=["lanes", "nothing"])
def test_what_to_make_must_be_said(clip: Path, words: list[str]) -> None:
    assert run(["site", "new", str(clip), *words]) == 2


def test_a_file_that_is_no_table_is_refused(clip: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["site", "new", str(clip), "--points", str(clip), "--out", str(clip.parent / "a.toml")]) == 3
    assert "expected UTF-8 text, got byte 0x" in capsys.readouterr().err
    assert run(["site", "new", str(clip), "--points", "nowhere.csv", "--out", str(clip.parent / "a.toml")]) == 3
    assert "nowhere.csv: expected a readable CSV file of points, got No such file" in capsys.readouterr().err


@pytest.mark.long
def test_a_lens_goes_through_a_run_and_its_boxes(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    found = ["frame,id,left,top,width,height"]
    site, boxes, log = tmp_path / "site.toml", tmp_path / "found.csv", str(tmp_path / "a.db")
    rows = "".join(f"  {row},\n" for row in CAMERA.ground_from_pixel.tolist())
    site.write_text(
        f'name = "bent"\n[camera]\nsize_px = {list(SIZE_PX)}\nradial = -0.2\nhomography = [\n{rows}]\n'
        f"[detector]\nfile_rate_hz = 10\nsize_px = {list(SIZE_PX)}\n",
        encoding="utf-8",
    )
    way_px = np.linspace((30.0, 40.0), (290.0, 60.0), 30)
    for frame, (x_px, y_px) in enumerate(way_px, start=1):
        found.append(f"{frame},-1,{x_px - 20:.1f},{y_px - 9:.1f},40,18,1")
    boxes.write_text("\n".join(found[1:]), encoding="utf-8")
    boxes = boxes.rename(tmp_path / "found.txt")
    assert run(["process", "--detections", str(boxes), "--site", str(site), "--log", log]) == 0
    capsys.readouterr()
    assert run(["tracks", log, "--format", "mot"]) == 0
    told = np.array([line.split(",")[:6] for line in capsys.readouterr().out.splitlines()], float)
    assert len(told) > 15
    middle_px = told[:, 2:4] - 1.5 + told[:, 4:6] / 2
    off_px = np.hypot(*(middle_px - way_px[told[:, 0].astype(int) - 1]).T)
    assert off_px.max() < 5.0
    straight = GroundCamera.from_homography(CAMERA.ground_from_pixel)
    assert np.hypot(*(straight.to_pixels(CAMERA.to_ground(way_px[:1])) - way_px[:1]).T)[0] > 10.0
