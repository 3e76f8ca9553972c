"""The truth at the frames' times: joined by time, cut at the border, stops found."""

from pathlib import Path

import numpy as np
import pytest

from gis.cameras.camera import GroundCamera
from gis.cameras.camera_pose import CameraPose, CameraTrack
from service.errors import TruthError
from service.questions.scoring.scene_view import SceneView
from service.questions.scoring.truth_rows import EDGE_M, TruthTable, load_truth_table, nearest_times
from tests.cases import for_each

HEADER = "t_us,id,class,x_m,y_m,heading_rad,speed_mps,length_m,width_m,road,lane,visible"
STEP_US = 40_000

# Ten pixels a metre, north up: 64 m x 36 m from the origin.
VIEW = SceneView((640, 360), GroundCamera.from_homography([[0.1, 0.0, 0.0], [0.0, -0.1, 36.0], [0.0, 0.0, 1.0]]))


def write_truth(folder: Path, *rows: str) -> Path:
    (folder / "truth.csv").write_text("\n".join([HEADER, *rows, ""]), encoding="utf-8")
    return folder


def row(t_us: int, name: str = "a", x_m: float = 30.0, *, speed_mps: float = 10.0, visible: int = 1) -> str:
    return f"{t_us},{name},car,{x_m},18.0,0.0,{speed_mps},4.0,2.0,r,r_0,{visible}"


def table(tmp_path: Path, *rows: str) -> TruthTable:
    return load_truth_table(write_truth(tmp_path, *rows))


def test_frame_takes_the_nearest_time_and_no_farther_than_half_a_step(tmp_path: Path) -> None:
    truth = table(tmp_path, *(row(k * STEP_US, x_m=float(k)) for k in range(4)))
    frames_us = np.array([19_999, 61_000, 141_000])
    rows = truth.rows_at(frames_us, None)
    assert rows.frame.tolist() == [0, 1]
    assert rows.centre_m[:, 0].tolist() == [0.0, 2.0]
    assert truth.knows(frames_us).tolist() == [True, True, False]


def test_dropped_frames_are_not_asked_for_and_repeated_ones_twice(tmp_path: Path) -> None:
    truth = table(tmp_path, *(row(k * STEP_US, name, float(k)) for k in range(4) for name in "ab"))
    rows = truth.rows_at(np.array([0, 10, 3 * STEP_US]), None)
    assert rows.frame.tolist() == [0, 0, 1, 1, 2, 2]
    assert rows.name.tolist() == ["a", "b"] * 3
    assert rows.centre_m[:, 0].tolist() == [0, 0, 0, 0, 3, 3]


@for_each("seed", range(10))
def test_nearest_times_are_those_of_a_plain_search(seed: int) -> None:
    rng = np.random.default_rng(seed)
    times_us = np.unique(rng.integers(0, 1000, 30))
    step_us = float(np.median(np.diff(times_us)))
    for frame_us, place in enumerate(nearest_times(np.arange(1000), times_us).tolist()):
        distance_us = np.abs(times_us - frame_us)
        expected = int(np.argmin(distance_us))
        assert place == (expected if distance_us[expected] <= step_us / 2 else -1)


def test_hidden_vehicle_is_border(tmp_path: Path) -> None:
    assert table(tmp_path, row(0), row(0, "b", visible=0)).rows_at(np.array([0]), VIEW).is_border.tolist() == [
        False,
        True,
    ]


@pytest.mark.parametrize(
    ("x_m", "is_border"), [(2.0 + EDGE_M, False), (1.9 + EDGE_M, True), (61.1, True), (60.5, False)]
)
def test_vehicle_counts_when_it_is_wholly_in_the_picture(tmp_path: Path, x_m: float, is_border: bool) -> None:
    rows = table(tmp_path, row(0, x_m=x_m)).rows_at(np.array([0]), VIEW)
    assert rows.is_border.tolist() == [is_border]
    assert table(tmp_path, row(0, x_m=x_m)).rows_at(np.array([0]), None).is_border.tolist() == [False]


def test_image_box_is_drawn_round_the_footprint(tmp_path: Path) -> None:
    rows = table(tmp_path, row(0)).rows_at(np.array([0]), VIEW)
    assert rows.box_px is not None
    assert rows.box_px.tolist() == [[280.0, 170.0, 40.0, 20.0]]


def test_picture_of_a_moving_camera_moves(tmp_path: Path) -> None:
    truth = table(tmp_path, row(0, x_m=30.0), row(STEP_US, x_m=30.0))
    poses = tuple(CameraPose(x_m, 18.0, 100.0, np.pi / 2, -np.pi / 2, 0.0, 1000.0) for x_m in (30.0, 90.0))
    view = SceneView((640, 360), CameraTrack(np.array([0, STEP_US]), poses))
    assert truth.rows_at(np.array([0, STEP_US]), view).is_border.tolist() == [False, True]


def test_poses_that_end_too_early_are_an_error(tmp_path: Path) -> None:
    pose = CameraPose(30.0, 18.0, 100.0, 0.0, -np.pi / 2, 0.0, 1000.0)
    view = SceneView((640, 360), CameraTrack(np.array([0]), (pose,)))
    with pytest.raises(TruthError, match="expected a pose within"):
        table(tmp_path, row(9_000_000)).rows_at(np.array([9_000_000]), view)


def test_stop_counts_from_two_seconds_on(tmp_path: Path) -> None:
    long = [row(k * 1_000_000, "a", speed_mps=0.0 if 1 <= k <= 3 else 5.0) for k in range(5)]
    short = [row(k * 1_000_000, "b", speed_mps=0.0 if 1 <= k <= 2 else 5.0) for k in range(5)]
    rows = table(tmp_path, *long, *short).rows_at(np.arange(5) * 1_000_000, None)
    assert rows.is_standing[rows.name == "a"].tolist() == [False, True, True, True, False]
    assert not rows.is_standing[rows.name == "b"].any()


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("t_us,id", "expected columns t_us, id, class, .*, got no 'class'"),
        (HEADER, "expected at least one row, got none"),
        (
            f"{HEADER}\n{row(0)}\n0,a,car",
            r"truth\.csv:3: expected t_us, .* with a whole t_us and finite numbers, got '0,a,car'",
        ),
        (f"{HEADER}\n{row(0).replace('30.0', 'far')}", r"truth\.csv:2: expected .* got '0,a,car,far"),
    ],
)
def test_wrong_truth_is_an_error_that_says_where(tmp_path: Path, text: str, message: str) -> None:
    (tmp_path / "truth.csv").write_text(text, encoding="utf-8")
    with pytest.raises(TruthError, match=message):
        load_truth_table(tmp_path)


def test_missing_truth_is_an_error(tmp_path: Path) -> None:
    with pytest.raises(TruthError, match=r"expected a truth folder with truth\.csv, got none there"):
        load_truth_table(tmp_path)


@pytest.mark.parametrize("wrong", [row(0, x_m=float("nan")), row(0, x_m=float("inf")), row(10**20)])
def test_numbers_that_nothing_can_be_done_with_are_an_error(tmp_path: Path, wrong: str) -> None:
    with pytest.raises(TruthError, match=r"truth\.csv:3: expected t_us, .* with a whole t_us and finite numbers"):
        table(tmp_path, row(0), wrong)
