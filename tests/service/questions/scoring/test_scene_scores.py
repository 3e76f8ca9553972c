"""From a log, or a file of tracks, and a truth folder to figures."""

from pathlib import Path

import numpy as np
import pytest

from benchmarks.pooled_scores import pooled
from gis.cameras.camera import GroundCamera
from gis.cameras.camera_pose import CameraPose, CameraTrack, write_camera_track
from service.errors import InputError, LogError
from service.questions.scoring.scene_scores import (
    CARS,
    OBJECTS,
    TRACKS,
    compare_log,
    compare_tracks,
    load_tracks,
    score_scene,
)
from service.questions.scoring.scene_view import SceneView, load_scene_view
from service.records.seen import SeenObject
from service.store.log import open_log
from tests.service.logs import run, state
from tests.service.questions.scoring.test_truth_rows import STEP_US, row, write_truth
from tests.vision.support import write_video

FRAMES = 10
SITE = """name = "test"
start_utc = 2026-05-01T08:00:00Z
[camera]
homography = [[0.1, 0.0, 0.0], [0.0, -0.1, 36.0], [0.0, 0.0, 1.0]]
"""


def seen(t_us: int, name: str, x_m: float, *, observed: bool = True, clipped: bool = False) -> SeenObject:
    return SeenObject(t_us, name, x_m, 18.0, 0.0, 4.0, 2.0, observed, clipped)


def write_run(path: Path, *, objects: bool = True) -> str:
    """Write a run of ten frames: one vehicle whose track is lost half way, one car that goes on, one false object."""
    url = f"sqlite:///{path / 'log.db'}"
    with open_log(url, "w") as log:
        writer = log.begin_run(run(camera=None))
        for frame in range(FRAMES):
            t_us, x_m = frame * STEP_US, 30.0 + frame
            writer.append_frames([t_us])
            if objects:
                name = "v1" if frame < FRAMES // 2 else "v2"
                writer.append([seen(t_us, name, x_m + 0.5, observed=frame != 3), seen(t_us, "v9", 500.0)])
            writer.append_states([state(t_us, "car1", x_m + 0.5, 18.0, linked=frame != 3)])
        writer.finish("finished")
    return url


def write_scene(folder: Path) -> Path:
    return write_truth(folder, *(row(frame * STEP_US, x_m=30.0 + frame) for frame in range(FRAMES)))


def test_log_is_scored_before_and_after_anchoring(tmp_path: Path) -> None:
    score = score_scene(compare_log(write_run(tmp_path), write_scene(tmp_path)))
    detection = score.detection
    assert score.seen_by == OBJECTS
    assert (detection.right, detection.wrong, detection.missed) == (FRAMES - 1, FRAMES, 1)  # a prediction is no sight
    assert detection.mean_error_m == pytest.approx(0.5)
    assert (score.tracks[OBJECTS].id_switches, score.tracks[CARS].id_switches) == (1, 0)
    assert score.tracks[CARS].idf1 == pytest.approx((FRAMES - 1) / (FRAMES - 0.5))


def test_run_without_vision_is_scored_by_its_cars(tmp_path: Path) -> None:
    score = score_scene(compare_log(write_run(tmp_path, objects=False), write_scene(tmp_path)))
    assert (score.seen_by, list(score.tracks)) == (CARS, [CARS])
    assert score.detection.precision == 1.0


def test_run_without_frames_cannot_be_scored(tmp_path: Path) -> None:
    url = f"sqlite:///{tmp_path / 'log.db'}"
    with open_log(url, "w") as log:
        log.begin_run(run()).finish("finished")
    with pytest.raises(LogError, match="expected frames to compare with the truth, got none"):
        compare_log(url, write_scene(tmp_path))


def test_several_scenes_are_pooled_row_by_row(tmp_path: Path) -> None:
    scene = compare_log(write_run(tmp_path), write_scene(tmp_path))
    one, two = score_scene(scene), score_scene(pooled([scene, scene]))
    assert two.detection.right == 2 * one.detection.right
    assert two.tracks[OBJECTS].id_switches == 2
    assert two.tracks[OBJECTS].hota == pytest.approx(one.tracks[OBJECTS].hota)


def write_csv(path: Path, *rows: str) -> Path:
    path.write_text(
        "\n".join(["t_us,id,x_m,y_m,heading_rad,speed_mps,length_m,width_m,visible", *rows, ""]), encoding="utf-8"
    )
    return path


def test_track_file_is_scored_and_its_hidden_rows_are_not(tmp_path: Path) -> None:
    rows = [f"{k * STEP_US},t1,{30 + k},18,0,10,4,2,{int(k != 3)}" for k in range(FRAMES)]
    score = score_scene(compare_tracks(write_csv(tmp_path / "tracks.csv", *rows), write_scene(tmp_path)))
    assert list(score.tracks) == [TRACKS]
    assert (score.detection.right, score.detection.wrong, score.detection.missed) == (FRAMES - 1, 0, 1)


def test_frames_that_a_track_file_leaves_out_are_missed(tmp_path: Path) -> None:
    rows = [f"{k * STEP_US},t1,{30 + k},18,0,10,4,2,1" for k in (2, 3, 4, 8)]
    score = score_scene(compare_tracks(write_csv(tmp_path / "tracks.csv", *rows), write_scene(tmp_path)))
    assert (score.detection.right, score.detection.missed) == (4, FRAMES - 4)


def test_slow_track_file_is_asked_for_its_own_frames_only(tmp_path: Path) -> None:
    rows = [f"{k * STEP_US},t1,{30 + k},18,0,10,4,2,1" for k in (0, 5)]
    score = score_scene(compare_tracks(write_csv(tmp_path / "tracks.csv", *rows), write_scene(tmp_path)))
    assert (score.detection.right, score.detection.missed) == (2, 0)


def write_scene_with_video(folder: Path) -> Path:
    (folder / "site.toml").write_text(SITE, encoding="utf-8")
    write_video(folder / "video.mp4", [np.full((360, 640), 90, np.uint8)] * FRAMES)
    return write_scene(folder)


def test_mot_text_is_scored_by_overlap_in_the_image(tmp_path: Path) -> None:
    scene = write_scene_with_video(tmp_path)
    # The truth's boxes, 1-based in MOT, and a second object that nobody knows.
    boxes = [f"{k + 1},7,{281.5 + 10 * k},171.5,40,20,1,-1,-1,-1" for k in range(FRAMES)]
    (tmp_path / "tracks.txt").write_text("\n".join([*boxes, "1,8,100,100,40,20,1"]), encoding="utf-8")
    score = score_scene(compare_tracks(tmp_path / "tracks.txt", scene))
    assert (score.detection.right, score.detection.wrong, score.detection.missed) == (FRAMES, 1, 0)
    assert score.detection.most_error_m == pytest.approx(0.0, abs=1e-6)
    assert score.tracks[TRACKS].loc_a == pytest.approx(1.0)


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("1,7,nan,10,4,4", r"tracks\.txt:1: expected a box within 1000000 pixels, its sides not below 0"),
        ("1,7,10,10,-4,4", r"tracks\.txt:1: expected a box within 1000000 pixels, its sides not below 0"),
        ("1,7,10,10,4,4\n1,7,90,90,4,4", r"tracks\.txt:2: expected each id once in a frame, got '7' again"),
        ("1,7,10,10", r"tracks\.txt:1: expected frame, id, left, top, width, height, got '1,7,10,10'"),
        ("x,7,10,10,4,4", "expected frame, id"),
        ("11,7,10,10,4,4", "expected a frame from 1 to 10, got 11"),
    ],
)
def test_wrong_mot_text_is_an_error_that_says_where(tmp_path: Path, line: str, message: str) -> None:
    scene = write_scene_with_video(tmp_path)
    (tmp_path / "tracks.txt").write_text(line, encoding="utf-8")
    with pytest.raises(InputError, match=message):
        compare_tracks(tmp_path / "tracks.txt", scene)


def test_mot_text_needs_a_camera(tmp_path: Path) -> None:
    (tmp_path / "tracks.txt").write_text("1,7,10,10,4,4", encoding="utf-8")
    with pytest.raises(InputError, match=r"expected a truth folder with site\.toml and video\.mp4 for MOT"):
        load_tracks(tmp_path / "tracks.txt", span_us=(0, 1), frame_us=np.arange(1), view=None)


LANE = """[[network.lane]]
id = "a"
centre_line_m = [[0, 20], [200, 20]]
width_m = 5.0
speed_limit_mps = 20
"""


def test_who_is_parked_beside_the_roads_of_the_scene_is_not_asked_for(tmp_path: Path) -> None:
    scene, log = write_scene(tmp_path), write_run(tmp_path)
    lines = (scene / "truth.csv").read_text(encoding="utf-8")
    parked = [row(frame * STEP_US, "parked1", speed_mps=0).replace("18.0", "9.0") for frame in range(FRAMES)]
    (scene / "truth.csv").write_text("\n".join([lines.rstrip(), *parked, ""]), encoding="utf-8")
    assert score_scene(compare_log(log, scene)).detection.missed == 1 + FRAMES
    (scene / "site.toml").write_text(SITE.partition("[camera]")[0] + LANE, encoding="utf-8")
    score = score_scene(compare_log(log, scene)).detection
    assert (score.right, score.missed, score.standing_missed) == (FRAMES - 1, 1, 0)


def test_view_comes_from_the_scene_before_the_run(tmp_path: Path) -> None:
    camera = run().camera
    assert load_scene_view(tmp_path) is None
    from_run = load_scene_view(tmp_path, camera)
    from_scene = load_scene_view(write_scene_with_video(tmp_path), camera)
    assert isinstance(from_run, SceneView)
    assert isinstance(from_scene, SceneView)
    assert camera is not None
    assert from_run.size_px == (camera.width_px, camera.height_px)
    assert isinstance(from_scene.camera, GroundCamera)
    assert from_scene.camera.to_pixels([[30.0, 18.0]]) == pytest.approx(np.array([[300.0, 180.0]]))


def test_first_view_of_a_moving_camera_says_nothing_of_the_others(tmp_path: Path) -> None:
    scene = write_scene_with_video(tmp_path)
    (scene / "site.toml").write_text(SITE + "moving = true\n", encoding="utf-8")
    assert load_scene_view(scene) is None
    pose = CameraPose(30.0, 18.0, 100.0, np.pi / 2, -np.pi / 2, 0.0, 1000.0)
    write_camera_track(scene / "camera.csv", CameraTrack(np.array([0, STEP_US]), (pose, pose)))
    view = load_scene_view(scene)
    assert view is not None
    assert isinstance(view.camera, CameraTrack)
    (scene / "camera.csv").rename(scene / "poses.csv")
    (scene / "site.toml").write_text(SITE + 'moving = true\nposes = "poses.csv"\n', encoding="utf-8")
    view = load_scene_view(scene)
    assert view is not None
    assert isinstance(view.camera, CameraTrack)
