from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from service.errors import InputError
from service.runs.inputs.input_kind import Asked
from service.runs.inputs.sensors.first_look import first_look
from service.runs.inputs.sensors.guessed_ground import DoubtedVision
from service.runs.inputs.sites.site import load_site
from service.runs.inputs.video_input import VideoInput
from tests.vision.moving_world import SIZE, MovingWorld, view
from tests.vision.support import write_video
from vision.camera import Camera
from vision.objects import ByteArray, FloatArray, VisionObjects
from vision.settings import VisionSettings
from vision.video.frame import Frame
from vision.video.frames import open_video


def pictures(seconds: int, *, drift_mps: float) -> list[ByteArray]:
    world = MovingWorld()
    views = (view(east_m=drift_mps * max(k / 25 - 1, 0)) for k in range(25 * seconds))
    return [world.frame(matrix, k).luma for k, matrix in enumerate(views)]


@pytest.fixture(scope="module")
def clips(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two clips, of a camera that stands and of one that drifts, and site files that say nothing or the contrary."""
    folder = tmp_path_factory.mktemp("clips")
    write_video(folder / "stands.mp4", pictures(4, drift_mps=0.0))
    write_video(folder / "drifts.mp4", pictures(4, drift_mps=2.0))
    rows = np.linalg.inv(view()).tolist()
    for name, said in (("nothing", ""), ("auto", 'moving = "auto"\n'), ("stands", "moving = false\n")):
        (folder / f"{name}.toml").write_text(f'name = "here"\n[camera]\n{said}homography = {rows}\n')
    return folder


@pytest.mark.long
@pytest.mark.parametrize(("clip", "moves"), [("stands", False), ("drifts", True)])
def test_motion_is_noticed_before_the_start_up_ends(clips: Path, clip: str, moves: bool) -> None:
    look = first_look(open_video(clips / f"{clip}.mp4"), VisionSettings(), span_us=6_000_000, least_px=3.0)
    assert (look.moves_from_us is not None) == moves
    assert len(look.pictures) == 8


def test_pictures_for_the_scale_are_drawn_as_if_the_camera_stood(clips: Path) -> None:
    look = first_look(open_video(clips / "drifts.mp4"), VisionSettings(), span_us=6_000_000, least_px=3.0)
    apart = np.abs(np.array(look.pictures, np.float64) - look.pictures[0]).mean(axis=(1, 2))
    assert apart.max() < 5.0


@pytest.mark.parametrize(("site", "follows"), [("nothing", True), ("auto", True), ("stands", False)])
def test_camera_of_which_nothing_is_said_is_followed(clips: Path, site: str, follows: bool) -> None:
    opened = VideoInput.open(Asked(clips / "drifts.mp4", load_site(clips / f"{site}.toml")))
    assert (opened.sensor.motion is not None) == follows
    assert [("the camera moves, seen at" in warning) for warning in opened.warnings] == [True] * follows
    assert [("taken for that at 0 s" in warning) for warning in opened.warnings] == [True] * follows


@pytest.mark.long
def test_a_camera_measured_in_a_later_picture_is_taken_back_to_the_first_one(clips: Path, tmp_path: Path) -> None:
    (later := tmp_path / "later.toml").write_text(
        f'name = "here"\n[camera]\nmeasured_at_s = 3.0\nhomography = {np.linalg.inv(view(east_m=4.0)).tolist()}\n'
    )
    first = VideoInput.open(Asked(clips / "drifts.mp4", load_site(clips / "nothing.toml"))).sensor.ground_camera
    opened = VideoInput.open(Asked(clips / "drifts.mp4", load_site(later)))
    corners = [(0.0, 0.0), (SIZE[0] - 1.0, SIZE[1] - 1.0)]
    assert opened.sensor.ground_camera.to_ground(corners) == pytest.approx(first.to_ground(corners), abs=0.1)
    assert "taken for that at 3 s" in opened.warnings[0]
    stands = VideoInput.open(Asked(clips / "stands.mp4", load_site(later))).sensor.ground_camera
    assert stands.to_ground(corners) == pytest.approx(first.to_ground(corners) + np.array([4.0, 0.0]))


def test_camera_that_stands_is_not_warned_of(clips: Path) -> None:
    opened = VideoInput.open(Asked(clips / "stands.mp4", load_site(clips / "nothing.toml")))
    assert opened.sensor.motion is None
    assert opened.warnings == ()


class Finds(Camera[Frame]):
    """Finds the same things at every frame, but for those that move."""

    def __init__(self, centre_m: FloatArray, moving: int) -> None:
        self._centre_m, self._moving = centre_m, moving

    def observe(self, instant: Frame) -> list[VisionObjects]:
        count, t_us = len(self._centre_m), instant.t_us
        centre_m = self._centre_m + np.outer(np.arange(count) < self._moving, [t_us / 1e6 * 5, 0.0])
        nothing, falses = np.zeros(count), np.zeros(count, np.bool_)
        ids = tuple(f"v{i}" for i in range(count))
        sizes = nothing + 4.5, nothing + 1.8
        return [VisionObjects(t_us, ids, centre_m, np.zeros((count, 2)), nothing, *sizes, ~falses, falses)]


def look_at(count: int, *, moving: int, area_m2: float) -> int:
    """Look for ten seconds; returns the frames seen."""
    vision, seen = DoubtedVision(Finds(np.zeros((count, 2)), moving), area_m2, "clip.mp4"), 0
    blank = np.zeros(SIZE[::-1], np.uint8)
    for k in range(50):
        seen += len(list(vision.observe(Frame(k, 200_000 * k, blank, blank, blank))))
    return seen


def test_queue_of_which_some_drive_off_may_be_vehicles() -> None:
    assert look_at(60, moving=15, area_m2=4_000.0) == 50


def test_a_few_that_stand_may_be_vehicles() -> None:
    assert look_at(30, moving=0, area_m2=4_000.0) == 50


def test_more_than_fit_on_the_ground_cannot_be_vehicles() -> None:
    with pytest.raises(InputError, match=r"clip.mp4 at 0.00 s: expected vehicles, got 60 things that need 1500 m2"):
        look_at(60, moving=60, area_m2=1_000.0)


def test_crowd_that_never_moves_cannot_be_vehicles() -> None:
    with pytest.raises(InputError, match=r"at 5.00 s: expected vehicles, got 55 of 60 things that have not moved in 5"):
        look_at(60, moving=5, area_m2=4_000.0)
