"""A whole scene: files, their agreement with each other, and byte-for-byte repeatability."""

import csv
import json
import tomllib
from pathlib import Path

import av
import numpy as np
import pytest

from data_gen.drawing.degrade import parse_degradation
from data_gen.errors import DataGenError
from data_gen.outputs.scene import GeneratedScene, generate
from data_gen.outputs.trajectories import read_truth_rows
from data_gen.truth.clip import COLUMNS, SHOWN_COLUMNS
from gis.cameras.camera import GroundCamera
from gis.cameras.camera_pose import read_camera_track
from gis.roads.sumo_net import read_sumo_net


def make(folder: Path, *, seconds: int, seed: int) -> GeneratedScene:
    return generate(
        "rural_overtaking", seed=seed, duration_us=seconds * 1_000_000, out_dir=folder, width_px=320, height_px=180
    )


@pytest.fixture(scope="module")
def scene(tmp_path_factory: pytest.TempPathFactory) -> GeneratedScene:
    return make(tmp_path_factory.mktemp("scene") / "new" / "folder", seconds=10, seed=3)


def truth_rows(scene: GeneratedScene) -> list[dict[str, str]]:
    with scene.truth.open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


@pytest.mark.long
def test_the_same_seed_gives_the_same_bytes_and_another_one_others(tmp_path: Path) -> None:
    first, second, other = (
        make(tmp_path / name, seconds=1, seed=seed) for name, seed in (("a", 1), ("b", 1), ("c", 2))
    )
    for name in ("video", "site", "network", "truth", "truth_events"):
        assert getattr(first, name).read_bytes() == getattr(second, name).read_bytes(), name
    assert first.truth.read_bytes() != other.truth.read_bytes()
    assert first.video.read_bytes() != other.video.read_bytes()


def test_truth_has_the_promised_columns_and_rows_in_view(scene: GeneratedScene) -> None:
    rows = truth_rows(scene)
    assert tuple(rows[0]) == COLUMNS
    assert {int(row["t_us"]) for row in rows} == set(range(0, 10_000_000, 40_000))
    assert all(194 < float(row["x_m"]) < 806 for row in rows)
    assert {row["visible"] for row in rows} == {"0", "1"}
    assert all((row["visible"] == "1") == (200 <= float(row["x_m"]) <= 800) for row in rows)


def test_truth_names_roads_and_lanes_of_the_network(scene: GeneratedScene) -> None:
    network = read_sumo_net(scene.network)
    rows = truth_rows(scene)
    assert {row["road"] for row in rows} == {road.id for road in network.roads}
    assert {row["lane"] for row in rows} <= {lane.id for lane in network.lanes}


def test_the_site_file_leads_to_the_network_and_the_road(scene: GeneratedScene) -> None:
    site = tomllib.loads(scene.site.read_text(encoding="utf-8"))
    assert set(site) == {"name", "start_utc", "frame", "network", "camera"}
    assert site["name"] == "rural_overtaking seed 3"
    assert (scene.site.parent / site["network"]["sumo"]).samefile(scene.network)
    camera = GroundCamera.from_homography(site["camera"]["homography"])
    assert camera.to_ground(np.array([[159.5, 89.5]])) == pytest.approx(np.array([[500.0, 0.0]]))


def test_events_are_written_as_one_json_object_a_line(scene: GeneratedScene) -> None:
    lines = [json.loads(line) for line in scene.truth_events.read_text(encoding="utf-8").splitlines()]
    assert len(lines) == len(scene.events) >= 2
    overtakes = [line for line in lines if line["type"] == "overtake" and line["countable"]]
    assert len(overtakes) >= 2
    seen = {row["id"] for row in truth_rows(scene)}
    for line in overtakes:
        assert set(line["roles"]) == {"overtaker", "overtaken"}
        assert set(line["roles"].values()) <= seen
        assert 0 < line["start_us"] < line["end_us"] < 20_000_000
        assert line["why_not_countable"] is None


@pytest.mark.long
def test_progress_counts_every_frame(tmp_path: Path) -> None:
    calls: list[tuple[int, int]] = []
    generate(
        "rural_overtaking",
        seed=1,
        duration_us=200_000,
        out_dir=tmp_path,
        width_px=64,
        height_px=64,
        progress=lambda done, total: calls.append((done, total)),
    )
    assert calls == [(1, 5), (2, 5), (3, 5), (4, 5), (5, 5)]


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"scenario": "moon"}, "scenario: expected one of .*, rural_overtaking, .*, got 'moon'"),
        ({"seed": -1}, "seed: expected 0 to 2147483647, got -1"),
        ({"rate_hz": 30}, "rate: expected a divisor of 1000 from 10 up, in frames per second, got 30"),
        ({"width_px": 641}, "image width: expected an even number of pixels from 64 to 8192, got 641"),
        ({"camera": "moon"}, "camera: expected one of vertical, oblique, uav, mast, got 'moon'"),
        ({"weather": "snow"}, "weather: expected one of sunny, clouds, overcast, got 'snow'"),
        ({"occluders": ["wall"]}, "occluders: expected none, all or some of trees, bridge, gantry, got 'wall'"),
        ({"duration_us": 0}, "duration: expected at least one step of 40000 us, got 0 us"),
    ],
    ids=["scenario", "seed", "rate", "width", "camera", "weather", "occluders", "duration"],
)
def test_bad_arguments_are_refused_before_anything_is_written(
    tmp_path: Path, change: dict[str, object], message: str
) -> None:
    arguments: dict[str, object] = {"scenario": "rural_overtaking", "seed": 1, "duration_us": 1_000_000, **change}
    with pytest.raises(DataGenError, match=message):
        generate(out_dir=tmp_path / "scene", **arguments)  # type: ignore[arg-type]  # one case is one bad argument
    assert not (tmp_path / "scene").exists()


@pytest.fixture(scope="module")
def flight(tmp_path_factory: pytest.TempPathFactory) -> GeneratedScene:
    return drone(tmp_path_factory.mktemp("flight"))


def drone(folder: Path) -> GeneratedScene:
    return generate(
        "rural_overtaking",
        seed=2,
        duration_us=1_200_000,
        out_dir=folder,
        width_px=320,
        height_px=180,
        camera="uav",
        poses=True,
        thermal=True,
        weather="clouds",
        occluders=["all"],
        degradation=parse_degradation("noise=2,drop=0.2,duplicate=0.2,gap=0.6+0.2,crf=30"),
    )


def frame_times_us(video: Path) -> list[int]:
    with av.open(str(video)) as container:
        stream = container.streams.video[0]
        return [round(frame.pts * stream.time_base * 1_000_000) for frame in container.decode(stream)]


@pytest.mark.long
def test_a_scene_with_everything_is_the_same_to_the_byte(flight: GeneratedScene, tmp_path: Path) -> None:
    again = drone(tmp_path)
    for name in ("video", "thermal", "site", "camera", "truth", "truth_events"):
        assert getattr(flight, name).read_bytes() == getattr(again, name).read_bytes(), name


@pytest.mark.long
def test_lost_frames_leave_holes_in_the_time_stamps_of_both_videos(flight: GeneratedScene) -> None:
    times_us = frame_times_us(flight.video)
    assert len(times_us) == flight.frame_count < 25
    assert set(times_us) < set(range(0, 1_200_000, 40_000))
    assert not any(600_000 <= t_us < 800_000 for t_us in times_us)
    assert frame_times_us(flight.thermal) == times_us


@pytest.mark.long
def test_truth_stays_on_all_simulated_times(flight: GeneratedScene) -> None:
    assert {int(row["t_us"]) for row in truth_rows(flight)} == set(range(0, 1_200_000, 40_000))


@pytest.mark.long
def test_a_moving_camera_is_told_by_its_first_frame_and_its_poses(flight: GeneratedScene) -> None:
    site = tomllib.loads(flight.site.read_text(encoding="utf-8"))["camera"]
    assert (site["moving"], site["poses"], site["thermal"]["video"]) == (True, "camera.csv", "thermal.mp4")
    told = GroundCamera.from_homography(site["homography"])
    first = read_camera_track(flight.camera).at(0).camera(320, 180)
    corners_px = [[0, 0], [319, 0], [319, 179], [0, 179]]
    assert told.to_ground(corners_px) == pytest.approx(first.to_ground(corners_px), abs=1e-6)


@pytest.mark.long
def test_without_poses_the_site_file_keeps_silent_about_them(tmp_path: Path) -> None:
    scene = generate(
        "rural_overtaking", seed=1, duration_us=80_000, out_dir=tmp_path, width_px=64, height_px=64, camera="oblique"
    )
    camera = tomllib.loads(scene.site.read_text(encoding="utf-8"))["camera"]
    assert set(camera) == {"homography"}
    assert len(read_camera_track(scene.camera).poses) == 2
    generate("rural_overtaking", seed=1, duration_us=80_000, out_dir=tmp_path, width_px=64, height_px=64)
    assert not scene.camera.exists()  # another camera leaves no file of the one before


@pytest.fixture(scope="module")
def mast(tmp_path_factory: pytest.TempPathFactory) -> GeneratedScene:
    folder = tmp_path_factory.mktemp("mast")
    size = {"width_px": 320, "height_px": 180}
    return generate("rural_overtaking", seed=1, duration_us=1_000_000, out_dir=folder, camera="mast", **size)


@pytest.mark.long
def test_the_truth_of_a_camera_with_a_pose_has_shares_and_boxes(mast: GeneratedScene) -> None:
    rows = truth_rows(mast)
    assert tuple(rows[0]) == (*COLUMNS, *SHOWN_COLUMNS)
    boxed = [row for row in rows if row["left_px"]]
    edges = np.array([[float(row[edge]) for edge in SHOWN_COLUMNS[1:]] for row in boxed])
    assert len(boxed) > 25
    assert ((edges >= -0.5) & (edges <= (319.5, 179.5, 319.5, 179.5))).all()
    assert (edges[:, :2] < edges[:, 2:]).all()
    assert all(float(row["visible_share"]) >= 0.5 for row in rows if row["visible"] == "1")


@pytest.mark.long
def test_readers_of_the_old_columns_still_read_the_truth(mast: GeneratedScene) -> None:
    assert len(read_truth_rows(mast.truth).vehicles) == sum(row["visible"] == "1" for row in truth_rows(mast))


@pytest.mark.parametrize(
    ("change", "message"),
    [({"occluders": ["bridge"]}, "no occluders, got bridge"), ({"thermal": True}, "no thermal camera, got one")],
    ids=["occluders", "thermal"],
)
def test_a_mast_refuses_what_it_cannot_draw(tmp_path: Path, change: dict[str, object], message: str) -> None:
    with pytest.raises(DataGenError, match=f"camera 'mast': expected {message}"):
        generate("rural_overtaking", seed=1, duration_us=100_000, out_dir=tmp_path, camera="mast", **change)  # type: ignore[arg-type]  # of a table
    assert not list(tmp_path.iterdir())
