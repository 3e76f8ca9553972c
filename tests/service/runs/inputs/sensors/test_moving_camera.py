"""Moving cameras in site files, and what vision is made for them."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from gis.cameras.camera import GroundCamera
from gis.cameras.camera_pose import CameraPose, CameraTrack, write_camera_track
from gis.errors import GisError
from service.errors import SiteError
from service.runs.inputs.sensors.moving_camera import StoredPoses, camera_at_start, first_camera, reach_m, watched_area
from service.runs.inputs.sites.site import Motion, Site, load_site
from tests.vision.moving_world import SIZE as WORLD_SIZE
from tests.vision.moving_world import MovingWorld, drift
from tests.vision.support import make_frame
from vision.registration.settings import RegistrationSettings
from vision.video.frame import Frame

SIZE = (320, 180)
HEAD = 'name = "drone"\nstart_utc = 2026-05-01T08:00:00Z\n'
MAP = "homography = [[0.5, 0, 0], [0, -0.5, 90], [0, 0, 1]]\n"
POSE = CameraPose(100.0, 50.0, 100.0, math.pi / 2, -math.pi / 2, 0.0, 200.0)


def load(tmp_path: Path, camera: str) -> Site:
    path = tmp_path / "site.toml"
    path.write_text(HEAD + "[camera]\n" + camera, encoding="utf-8")
    return load_site(path)


def track() -> CameraTrack:
    """A second of flight, 20 m to the east."""
    return CameraTrack(np.array([0, 1_000_000]), (POSE, replace(POSE, x_m=120.0)))


def test_a_camera_stands_still_unless_the_file_says_that_it_moves(tmp_path: Path) -> None:
    assert load(tmp_path, MAP).motion is None
    assert load(tmp_path, MAP + "moving = false\n").motion is None
    motion = load(tmp_path, MAP + "moving = true\nreach_m = 70\n").motion
    assert motion is not None
    assert (motion.poses, motion.reach_m) == (None, 70.0)


def test_poses_stand_in_for_the_map_and_belong_to_the_site(tmp_path: Path) -> None:
    write_camera_track(tmp_path / "camera.csv", track())
    site = load(tmp_path, 'moving = true\nposes = "camera.csv"\n')
    assert site.camera is None
    assert site.motion is not None
    assert site.motion.poses is not None
    assert site.motion.poses.poses == track().poses
    assert site.files == (tmp_path / "site.toml", tmp_path / "camera.csv")


@pytest.mark.parametrize(
    ("camera", "message"),
    [
        (MAP + 'moving = "yes"\n', "camera.moving: expected true, false or \"auto\", got 'yes'"),
        (MAP + "reach_m = 5\n", "camera.reach_m: expected moving = true beside reach_m, got 'auto'"),
        (MAP + "measured_at_s = -1\n", "camera.measured_at_s: expected seconds, not below 0, got -1"),
        (MAP + "measured_at_s = nan\n", "camera.measured_at_s: expected seconds, not below 0, got nan"),
        (MAP + "moving = true\nreach_m = -1\n", "camera.reach_m: expected metres, not below 0, got -1"),
        (MAP + 'moving = true\nposes = "no.csv"\n', "camera.poses: expected the path of a file, got 'no.csv'"),
        (MAP + 'moving = true\nposes = "site.toml"\n', "camera.poses: .*expected the columns t_us, x_m"),
        (MAP + 'moving = true\nroad_mask = "site.toml"\n', "camera.road_mask: expected a camera that stands still"),
        ("moving = true\n", "camera: expected homography, point or poses beside moving = true; got none of them"),
        (MAP + '[camera.thermal]\nvideo = "t.mp4"\n', "camera.thermal.video: expected the path of a file"),
        (MAP + "[camera.thermal]\nfilm = 1\n", "camera.thermal.film: expected one of video, homography"),
    ],
)
def test_mistakes_are_told_with_their_place(tmp_path: Path, camera: str, message: str) -> None:
    with pytest.raises(SiteError, match=message):
        load(tmp_path, camera)


def test_a_thermal_video_has_its_own_map(tmp_path: Path) -> None:
    (tmp_path / "thermal.mp4").write_bytes(b"")
    site = load(tmp_path, MAP + '[camera.thermal]\nvideo = "thermal.mp4"\n' + MAP.replace("0.5", "1.0"))
    assert site.thermal is not None
    assert site.thermal.camera.to_ground([[10.0, 0.0]]).tolist() == [[10.0, 90.0]]
    assert site.files[-1] == tmp_path / "thermal.mp4"


def test_stored_poses_give_the_map_of_the_time() -> None:
    motion = StoredPoses(track(), SIZE)
    found = motion.locate(make_frame(np.zeros(SIZE[::-1]), t_us=500_000), [])
    expected = replace(POSE, x_m=110.0).camera(*SIZE)
    assert found is not None
    points_m = np.array([[100.0, 50.0], [130.0, 60.0]])
    mapped = np.column_stack([points_m, np.ones(2)]) @ found.T
    assert np.allclose(mapped[:, :2] / mapped[:, 2:], expected.to_pixels(points_m))


def test_no_pose_near_in_time_is_a_lost_view() -> None:
    assert StoredPoses(track(), SIZE).locate(make_frame(np.zeros(SIZE[::-1]), t_us=3_000_000), []) is None


def test_reach_follows_the_poses_the_file_or_the_view() -> None:
    camera = GroundCamera.from_homography([[0.5, 0, 0], [0, -0.5, 90], [0, 0, 1]])
    first = first_camera(None, Motion(track(), None), SIZE)
    assert reach_m(first, Motion(track(), None), SIZE, has_roads=True) == pytest.approx(20.0)
    assert reach_m(camera, Motion(None, 33.0), SIZE, has_roads=True) == 33.0
    diagonal_m = math.hypot(160.0, 90.0)
    assert reach_m(camera, Motion(None, None), SIZE, has_roads=True) == pytest.approx(diagonal_m / 2)


def test_without_roads_all_ground_in_reach_is_watched() -> None:
    camera = GroundCamera.from_homography([[0.5, 0, 0], [0, -0.5, 90], [0, 0, 1]])
    (ring,) = watched_area(camera, None, None, SIZE, Motion(None, 10.0))
    assert np.ptp(ring, axis=0) == pytest.approx([180.0, 110.0])


def drifting(last: int) -> list[Frame]:
    """What a camera that drifts sees, at 25 frames a second."""
    world = MovingWorld()
    return [replace(world.frame(drift(k), k), t_us=k * 40_000) for k in range(0, last + 1, 3)]


def test_points_of_a_later_picture_are_taken_back_to_the_first_one() -> None:
    measured = GroundCamera.from_homography(np.linalg.inv(drift(90)))
    frames = drifting(120)  # 90 x 40 ms are 3.6 s
    first = camera_at_start(measured, frames, 3_600_000, WORLD_SIZE, RegistrationSettings())
    corners = [(0, 0), (WORLD_SIZE[0] - 1, 0), (0, WORLD_SIZE[1] - 1), (WORLD_SIZE[0] - 1, WORLD_SIZE[1] - 1)]
    true_m = GroundCamera.from_homography(np.linalg.inv(drift(0))).to_ground(corners)
    assert np.abs(measured.to_ground(corners) - true_m).max() > 5.0
    assert first.to_ground(corners) == pytest.approx(true_m, abs=0.5)


def test_points_of_a_picture_that_cannot_be_reached_are_refused() -> None:
    camera, frames = GroundCamera.from_homography(np.linalg.inv(drift(0))), drifting(30)
    with pytest.raises(GisError, match=r"measured_at_s: expected a time within the video, got 9 s"):
        camera_at_start(camera, frames, 9_000_000, WORLD_SIZE, RegistrationSettings())
    black = make_frame(np.zeros(WORLD_SIZE[::-1]), index=40, t_us=1_600_000)
    with pytest.raises(GisError, match=r"that shows ground of the first one, got 1.6 s: expected"):
        camera_at_start(camera, [*frames, black], 1_600_000, WORLD_SIZE, RegistrationSettings())
