"""Detectors chosen on the command line and in the site file, from input to event log."""

from __future__ import annotations

from pathlib import Path
from typing import get_args

import numpy as np
import onnxruntime
import pytest

from service.cli.app import run
from service.errors import InputError, SiteError
from service.records.runs import RunRecord
from service.runs.inputs.detectors import (
    AutoChoice,
    DetectionDetails,
    FileChoice,
    MotionChoice,
    OnnxChoice,
    choose_detector,
)
from service.runs.inputs.input_kind import Asked
from service.runs.inputs.opening import open_input
from service.runs.inputs.sites.site import load_site
from service.runs.inputs.video_input import VideoInput
from service.store.log import open_log
from tests.vision.onnx_file import blob_finder
from tests.vision.support import draw_boxes, make_boxes, top_view, write_video
from vision.networks.onnx.settings import Layout

SIZE_PX, METRES_PER_PIXEL, FRAMES = (256, 64), 0.25, 61
SPEED_MPS, NORTH_M = 12.0, 8.0
SITE = """
name = "Test road"
start_utc = 2026-05-01T08:00:00Z

[[network.lane]]
id = "east"
centre_line_m = [[0.0, 8.0], [64.0, 8.0]]
width_m = 6.0
speed_limit_mps = 22.2

[camera]
homography = [[0.25, 0.0, 0.0], [0.0, -0.25, 15.75], [0.0, 0.0, 1.0]]
"""
NETWORK = 'layout = "yolo"\nclasses = { "0" = "car" }\nscore_threshold = 0.8\nnms_threshold = 0.05\n'


def east_m(frame: int) -> float:
    return 8.0 + SPEED_MPS * frame / 25


def make_video(path: Path, level: float = 250.0) -> Path:
    """A bright car that drives east over a dark road."""
    pictures = []
    for frame in range(FRAMES):
        car = make_boxes([(east_m(frame), NORTH_M, 0.0, 4.5, 2.25)])
        camera = top_view(SIZE_PX, METRES_PER_PIXEL)
        pictures.append(np.rint(draw_boxes(SIZE_PX, car, [level], camera, ground=70.0)).astype(np.uint8))
    write_video(path, pictures)
    return path


def make_site(folder: Path, extra: str = "") -> Path:
    path = folder / "site.toml"
    path.write_text(SITE + extra, encoding="utf-8")
    return path


def make_network(folder: Path, layout: str = "yolo", extra: str = "") -> Path:
    (folder / "net.toml").write_text(NETWORK.replace("yolo", layout) + extra, encoding="utf-8")
    path = folder / "net.onnx"
    path.write_bytes(blob_finder(SIZE_PX, box_px=(18.0, 9.0), layout=layout))
    return path


def mot_line(frame: int) -> str:
    left_px, top_px = (east_m(frame) - 2.25) / METRES_PER_PIXEL, (15.75 - NORTH_M - 1.125) / METRES_PER_PIXEL
    return f"{frame + 1},-1,{left_px + 1.5:.2f},{top_px + 1.5:.2f},18,9,0.95,-1,-1,-1\n"


def make_mot(folder: Path, frames: range = range(FRAMES)) -> Path:
    path = folder / "found.txt"
    path.write_text("".join(mot_line(frame) for frame in frames), encoding="utf-8")
    return path


def make_ground_csv(folder: Path) -> Path:
    path = folder / "found.csv"
    rows = "".join(f"{40_000 * frame},{east_m(frame):.3f},{NORTH_M}\n" for frame in range(FRAMES))
    path.write_text("t_us,x_m,y_m\n" + rows, encoding="utf-8")
    return path


def last_states(log: Path) -> tuple[RunRecord, list[tuple[float, float]]]:
    """The run's record, and where its cars were in the last frame."""
    with open_log(str(log)) as opened:
        record = opened.run(None)
        states = list(opened.states(record.id))
    end_us = max(state.t_us for state in states)
    return record, [(state.x_m, state.y_m) for state in states if state.t_us == end_us]


@pytest.mark.long
@pytest.mark.parametrize("layout", get_args(Layout))
def test_network_of_each_layout_runs_from_the_command_line_and_the_log_says_so(tmp_path: Path, layout: str) -> None:
    video, site, log = make_video(tmp_path / "video.mp4"), make_site(tmp_path), tmp_path / "log.db"
    detector = f"onnx:{make_network(tmp_path, layout)}"
    assert run(["process", str(video), "--site", str(site), "--log", str(log), "--detector", detector]) == 0
    record, [car] = last_states(log)
    assert car == pytest.approx((east_m(FRAMES - 1), NORTH_M), abs=0.8)
    assert record.detector.startswith("onnx:net.onnx (ONNX Runtime ")


def test_provider_that_is_passed_over_is_warned_of(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(onnxruntime, "get_available_providers", lambda: ["CPUExecutionProvider"])
    video, site = make_video(tmp_path / "video.mp4"), load_site(make_site(tmp_path))
    network = make_network(tmp_path, extra='providers = ["cuda", "cpu"]\n')
    opened = open_input(Asked(video, site, detector=f"onnx:{network}"))
    version = f"ONNX Runtime {onnxruntime.__version__}"
    assert opened.warnings == (f"net.onnx: {version} lacks cuda here: cpu computes",)
    assert opened.detector == f"onnx:net.onnx ({version}, cpu)"


@pytest.mark.long
def test_mot_file_is_joined_to_a_video_that_shows_nothing(tmp_path: Path) -> None:
    video = make_video(tmp_path / "video.mp4", level=70.0)
    site, log, found = make_site(tmp_path), tmp_path / "log.db", make_mot(tmp_path)
    assert run(["process", str(video), "--site", str(site), "--log", str(log), "--detections", str(found)]) == 0
    record, [car] = last_states(log)
    assert car == pytest.approx((east_m(FRAMES - 1), NORTH_M), abs=0.2)
    assert record.detector == "file:found.txt"


@pytest.mark.long
@pytest.mark.parametrize("kind", ["mot", "metres"])
def test_file_of_detections_stands_alone(tmp_path: Path, kind: str) -> None:
    site = make_site(tmp_path, "[detector]\nfile_rate_hz = 25\nsize_px = [256, 64]\n" if kind == "mot" else "")
    found = make_mot(tmp_path) if kind == "mot" else make_ground_csv(tmp_path)
    log = tmp_path / "log.db"
    assert run(["process", "--detections", str(found), "--site", str(site), "--log", str(log)]) == 0
    record, [car] = last_states(log)
    assert car == pytest.approx((east_m(FRAMES - 1), NORTH_M), abs=0.2)
    assert (record.input_kind, record.source) == ("detections", found.name)


def test_site_file_chooses_the_detector_and_the_command_line_overrules_it(tmp_path: Path) -> None:
    video = make_video(tmp_path / "video.mp4")
    make_mot(tmp_path)
    site = load_site(make_site(tmp_path, '[detector]\nuse = "file:found.txt"\n'))
    named = [open_input(Asked(video, site, detector=wanted)).detector for wanted in (None, "motion")]
    assert named == ["file:found.txt", "motion"]


# 6 m high, 11 degrees down, over the beginning of a road to the north.
LOW_SITE = SITE.replace("[[0.0, 8.0], [64.0, 8.0]]", "[[0.0, 5.0], [0.0, 120.0]]").replace(
    "[[0.25, 0.0, 0.0], [0.0, -0.25, 15.75], [0.0, 0.0, 1.0]]",
    "[[0.22795103, 0.0, -29.06375685], [0.0, -0.04349511, 68.49897538], [0.0, 0.03729382, 1.0]]",
)


def test_from_low_above_the_road_the_network_for_such_views_looks_unless_told_otherwise(tmp_path: Path) -> None:
    video, above, low = make_video(tmp_path / "video.mp4"), tmp_path / "above.toml", tmp_path / "low.toml"
    above.write_text(SITE, encoding="utf-8")
    low.write_text(LOW_SITE, encoding="utf-8")
    named = [open_input(Asked(video, load_site(site))).detector for site in (above, low)]
    assert named[0] == "motion"
    assert named[1].startswith("onnx:low.onnx (ONNX Runtime ")
    assert open_input(Asked(video, load_site(low), detector="motion")).detector == "motion"


def test_detections_past_the_end_of_the_video_are_warned_of_or_refused(tmp_path: Path) -> None:
    video, site = make_video(tmp_path / "video.mp4"), load_site(make_site(tmp_path))
    some = open_input(Asked(video, site, detector=f"file:{make_mot(tmp_path, range(FRAMES - 2, FRAMES + 3))}"))
    assert some.warnings == ("found.txt: 3 of 5 detections lie past the video's end",)
    with pytest.raises(InputError, match=r"expected detections in the 61 frames of the video, got all of them later"):
        open_input(Asked(video, site, detector=f"file:{make_mot(tmp_path, range(FRAMES, FRAMES + 3))}"))


THERMAL = """
[camera.thermal]
video = "thermal.mp4"
homography = [[0.25, 0.0, 0.0], [0.0, -0.25, 15.75], [0.0, 0.0, 1.0]]
"""


@pytest.mark.parametrize(
    ("wanted", "path", "has_second"),
    [(None, "video.mp4", False), ("motion:both", "video.mp4", True), ("motion:thermal", "thermal.mp4", False)],
)
def test_channels_of_a_site_with_a_thermal_video(tmp_path: Path, wanted: str, path: str, has_second: bool) -> None:
    video = make_video(tmp_path / "video.mp4", level=70.0)
    make_video(tmp_path / "thermal.mp4")
    source = open_input(Asked(video, load_site(make_site(tmp_path, THERMAL)), detector=wanted))
    assert isinstance(source, VideoInput)
    assert (source.path.name, source.sensor.thermal is not None) == (path, has_second)
    assert source.detector == (wanted or "motion")


@pytest.mark.long
def test_car_that_only_the_thermal_camera_sees_is_in_the_log(tmp_path: Path) -> None:
    video = make_video(tmp_path / "video.mp4", level=70.0)
    make_video(tmp_path / "thermal.mp4")
    log = tmp_path / "log.db"
    site = make_site(tmp_path, THERMAL)
    assert run(["process", str(video), "--site", str(site), "--log", str(log), "--detector", "motion:both"]) == 0
    record, [car] = last_states(log)
    assert car == pytest.approx((east_m(FRAMES - 1), NORTH_M), abs=0.5)
    assert record.detector == "motion:both"


def test_detectors_are_chosen_by_their_words(tmp_path: Path) -> None:
    network, found = make_network(tmp_path), make_mot(tmp_path)
    details = DetectionDetails(use="onnx:net.onnx")
    assert choose_detector(None, folder=tmp_path) == AutoChoice()
    assert choose_detector("auto", details, folder=tmp_path) == AutoChoice()
    assert choose_detector("motion", details, folder=tmp_path) == MotionChoice()
    assert isinstance(choose_detector(None, details, folder=tmp_path), OnnxChoice)
    assert isinstance(choose_detector(f"onnx:{network}", folder=Path()), OnnxChoice)
    assert isinstance(choose_detector(f"file:{found}", details, folder=tmp_path), FileChoice)


@pytest.mark.parametrize("wanted", ["yolo", "motion:", "motion:night", "onnx:", "file", ""])
def test_unknown_detectors_are_refused(tmp_path: Path, wanted: str) -> None:
    with pytest.raises(InputError, match=r"--detector: expected auto, motion, .* or file:PATH, got '"):
        choose_detector(wanted, folder=tmp_path)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ([], "expected INPUT, or --detections alone; got neither"),
        (["video.mp4", "--detector", "file:none.txt"], "--detector: expected the path of a file, got 'none.txt'"),
        (["video.mp4", "--detector", "motion:thermal"], "expected a [camera.thermal] in the site file"),
        (["video.mp4", "--detector", "motion", "--detections", "a.csv"], "one of --detector and --detections"),
        (["--detections", "found.txt"], "expected file_rate_hz in [detector] for detections by frame without a video"),
        (["net.onnx", "--detector", "onnx:net.onnx"], "net.onnx"),  # the decoder says what it met
    ],
    ids=["nothing", "no file", "no thermal", "two", "no rate", "no video"],
)
def test_wrong_requests_end_before_a_log_is_written(
    tmp_path: Path,
    arguments: list[str],
    message: str,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    make_video(tmp_path / "video.mp4")
    make_mot(tmp_path)
    make_network(tmp_path)
    site = make_site(tmp_path, "[detector]\nsize_px = [256, 64]\n")
    assert run(["process", *arguments, "--site", str(site), "--log", "log.db"]) != 0
    said = " ".join(capsys.readouterr().err.replace("│", " ").split())
    assert message in said
    assert not (tmp_path / "log.db").exists()


@pytest.mark.parametrize(
    ("table", "message"),
    [
        ("use = 3", r"detector.use: expected a text that is not empty, got 3"),
        ("file_rate_hz = 0", r"detector.file_rate_hz: expected frames a second from 0.1 to 1000, got 0"),
        ("size_px = [1280.5, 720]", r"detector.size_px: expected width and height in whole pixels"),
        ('classes = { "1" = "horse" }', r"detector.classes: expected a table such as .*, got 1 = 'horse'"),
        ("treshold = 1", r"detector.treshold: expected one of use, .*; did you mean score_threshold"),
    ],
)
def test_wrong_fields_of_the_site_table_are_told(tmp_path: Path, table: str, message: str) -> None:
    with pytest.raises(SiteError, match=message):
        load_site(make_site(tmp_path, f"[detector]\n{table}\n"))
