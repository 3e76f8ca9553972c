"""A pose maps ground to pixels as a pinhole does, and a file of poses comes back as it was."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from gis.cameras.camera_pose import COLUMNS, CameraPose, CameraTrack, read_camera_track, write_camera_track
from gis.errors import GisError

SIZE_PX = (1280, 720)
POSE = CameraPose(30.0, -40.0, 90.0, 0.4, -0.8, 0.0, 1000.0)


def turned_about(axis: np.ndarray, vector: np.ndarray, angle_rad: float) -> np.ndarray:
    """Rodrigues' formula."""
    return (
        vector * math.cos(angle_rad)
        + np.cross(axis, vector) * math.sin(angle_rad)
        + axis * (axis @ vector) * (1 - math.cos(angle_rad))
    )


def slow_pixel(pose: CameraPose, point_m: np.ndarray) -> np.ndarray:
    """Trace one point the long way: start level and facing east, then yaw, pitch and roll as rotations in space."""
    forward, left, up = np.eye(3)
    z_axis = np.array([0.0, 0.0, 1.0])
    forward, left = turned_about(z_axis, forward, pose.yaw_rad), turned_about(z_axis, left, pose.yaw_rad)
    forward, up = turned_about(left, forward, -pose.pitch_rad), turned_about(left, up, -pose.pitch_rad)
    left, up = turned_about(forward, left, pose.roll_rad), turned_about(forward, up, pose.roll_rad)
    seen = point_m - np.array([pose.x_m, pose.y_m, pose.height_m])
    depth_m = seen @ forward
    return np.array(
        [
            (SIZE_PX[0] - 1) / 2 - pose.focal_px * (seen @ left) / depth_m,
            (SIZE_PX[1] - 1) / 2 - pose.focal_px * (seen @ up) / depth_m,
        ]
    )


angles = st.floats(-math.pi, math.pi)
poses = st.builds(
    CameraPose,
    x_m=st.floats(-500, 500),
    y_m=st.floats(-500, 500),
    height_m=st.floats(20, 300),
    yaw_rad=angles,
    pitch_rad=st.floats(-math.pi / 2, -0.4),
    roll_rad=st.floats(-0.3, 0.3),
    focal_px=st.floats(600, 3000),
)


@given(poses, st.floats(0, SIZE_PX[0] - 1), st.floats(SIZE_PX[1] / 2, SIZE_PX[1] - 1))
def test_ground_and_pixel_belong_together_as_traced_by_hand(pose: CameraPose, x_px: float, y_px: float) -> None:
    camera = pose.camera(*SIZE_PX)
    ground_m = camera.to_ground([[x_px, y_px]])[0]
    if np.isfinite(ground_m).all() and np.hypot(*(ground_m - (pose.x_m, pose.y_m))) < 3000:
        assert slow_pixel(pose, np.array([*ground_m, 0.0])) == pytest.approx([x_px, y_px], abs=1e-3)


@given(poses, st.floats(-15, 15), st.floats(-15, 15), st.floats(0, 8))
def test_points_above_the_ground_project_as_traced_by_hand(
    pose: CameraPose, east_m: float, north_m: float, height_m: float
) -> None:
    # Points about the place the line of sight meets, so that they lie in front of the camera.
    reach_m = pose.height_m / math.tan(-pose.pitch_rad)
    foot_m = (pose.x_m + reach_m * math.cos(pose.yaw_rad), pose.y_m + reach_m * math.sin(pose.yaw_rad))
    point_m = np.array([foot_m[0] + east_m, foot_m[1] + north_m, height_m])
    x, y, depth_m = pose.projection(*SIZE_PX) @ np.array([*point_m, 1.0])
    assert depth_m > 0
    assert np.array([x, y]) / depth_m == pytest.approx(slow_pixel(pose, point_m), abs=1e-6)


def test_looking_down_yaw_is_the_direction_of_image_up() -> None:
    camera = CameraPose(0.0, 0.0, 100.0, math.pi, -math.pi / 2, 0.0, 100.0).camera(101, 101)
    up_m = camera.to_ground([[50.0, 40.0]])[0]
    assert up_m == pytest.approx([-10.0, 0.0])


def test_roll_turns_the_right_side_of_the_image_down_on_the_ground_behind() -> None:
    level, rolled = POSE.camera(*SIZE_PX), replace(POSE, roll_rad=0.1).camera(*SIZE_PX)
    # A camera that leans to the right sees the right half of the scene higher in its image.
    point_m = level.to_ground([[900.0, 359.5]])
    assert rolled.to_pixels(point_m)[0, 1] < 359.5


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"height_m": 0.0}, r"height_m must be > 0, got 0\.0"),
        ({"focal_px": -5.0}, r"focal_px must be > 0, got -5\.0"),
        ({"yaw_rad": math.nan}, "yaw_rad must be finite, got nan"),
        ({"pitch_rad": 2.0}, r"pitch_rad must be in \[-pi/2, pi/2\], got 2\.0"),
    ],
    ids=["height", "focal", "nan", "pitch"],
)
def test_an_impossible_pose_is_refused(change: dict[str, float], message: str) -> None:
    with pytest.raises(GisError, match=message):
        replace(POSE, **change)  # type: ignore[arg-type]  # one field, by name


def test_between_two_samples_the_pose_is_linear_and_angles_go_the_short_way() -> None:
    first, second = replace(POSE, yaw_rad=3.1, x_m=0.0), replace(POSE, yaw_rad=-3.1, x_m=10.0)
    between = CameraTrack(np.array([0, 100_000]), (first, second)).at(25_000)
    assert between.x_m == pytest.approx(2.5)
    assert math.remainder(between.yaw_rad - math.pi, math.tau) == pytest.approx(3.1 - math.pi + 0.25 * 0.0832, abs=1e-4)


def test_a_sample_is_returned_as_it_is() -> None:
    track = CameraTrack(np.array([0, 40_000]), (POSE, replace(POSE, x_m=1.0)))
    assert track.at(40_000) is track.poses[1]


def test_outside_the_samples_the_nearest_counts_within_the_tolerance() -> None:
    track = CameraTrack(np.array([100_000, 200_000]), (POSE, replace(POSE, x_m=1.0)))
    assert track.at(250_000).x_m == 1.0
    assert track.at(0).x_m == 30.0
    with pytest.raises(GisError, match="expected a pose within 40000 us of 250000 us, the nearest is at 200000 us"):
        track.at(250_000, tolerance_us=40_000)


def test_a_hole_in_the_samples_is_not_bridged() -> None:
    track = CameraTrack(np.array([0, 10_000_000]), (POSE, POSE))
    with pytest.raises(GisError, match="expected a pose within 500000 us of 5000000 us, the nearest is at 0 us"):
        track.at(5_000_000)


@given(st.lists(poses, min_size=1, max_size=4))
def test_a_track_comes_back_from_its_file_without_loss(
    tmp_path_factory: pytest.TempPathFactory, drawn: list[CameraPose]
) -> None:
    path = tmp_path_factory.mktemp("track") / "camera.csv"
    track = CameraTrack(np.arange(len(drawn)) * 40_000, tuple(drawn))
    write_camera_track(path, track)
    read = read_camera_track(path)
    assert read.poses == track.poses
    assert read.t_us.tolist() == track.t_us.tolist()


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("t_us,x_m\n0,1\n", "camera.csv: expected the columns t_us, x_m, .*, got no 'y_m'"),
        (",".join(COLUMNS) + "\n0,1,2,3,4,5,six,7\n", "camera.csv, line 2: expected a whole t_us and seven numbers"),
        (",".join(COLUMNS) + "\n0,1,2,3,0,-1,0\n", "camera.csv, line 2: expected a whole t_us and seven numbers"),
        (",".join(COLUMNS) + "\n0,1,2,-3,0,-1,0,900\n", "camera.csv, line 2: camera pose: height_m must be > 0"),
        (",".join(COLUMNS) + "\n", "camera.csv: camera track: expected as many times as poses, at least one"),
        (
            ",".join(COLUMNS) + "\n40,1,2,3,0,-1,0,900\n40,1,2,3,0,-1,0,900\n",
            "camera.csv: camera track: times must rise, got 40 us before 40 us",
        ),
    ],
    ids=["column", "word", "short", "range", "empty", "order"],
)
def test_a_broken_file_is_refused_with_its_place(tmp_path: Path, text: str, message: str) -> None:
    path = tmp_path / "camera.csv"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(GisError, match=message):
        read_camera_track(path)


def test_a_missing_file_is_refused(tmp_path: Path) -> None:
    with pytest.raises(GisError, match="expected a readable CSV file of camera poses"):
        read_camera_track(tmp_path / "none.csv")


def test_a_time_beyond_64_bits_is_refused_with_its_line(tmp_path: Path) -> None:
    path = tmp_path / "camera.csv"
    path.write_text(",".join(COLUMNS) + f"\n{10**20},0,0,90,0,-1.5,0,900\n")
    with pytest.raises(GisError, match=r"camera\.csv, line 2: expected a whole t_us and seven numbers"):
        read_camera_track(path)


def test_a_mark_of_byte_order_is_read_over(tmp_path: Path) -> None:
    path = tmp_path / "camera.csv"
    path.write_text(",".join(COLUMNS) + "\n7,0,0,90,0,-1.5,0,900\n", encoding="utf-8-sig")
    assert read_camera_track(path).t_us.tolist() == [7]
