"""What the tracker saw, and where a moving camera looked: written, read back, and drawn."""

from pathlib import Path

import numpy as np
import pytest

from chronicles import load
from chronicles.execution.unfit_events import UnfitCounter
from dyknow.sample import Sample
from service.export.draw_video import picture_at
from service.records.seen import SeenObject, ViewRecord
from service.runs.graph.recording import Recorder
from service.store.log import EventLog, open_log
from tests.service.logs import CAMERA, run, state
from tests.vision.support import write_video
from vision.objects import VisionObjects

STEP_US = 40_000
MAP = np.array(CAMERA.pixel_from_ground).reshape(3, 3)


def seen(t_us: int, name: str = "v1", x_m: float = 1.5) -> SeenObject:
    return SeenObject(t_us, name, x_m, 2.25, 0.5, 4.5, 1.8, True, False)


def write(path: Path, objects: list[SeenObject], views: list[ViewRecord]) -> EventLog:
    with open_log(str(path), "w") as log:
        writer = log.begin_run(run())
        writer.append(objects)
        writer.append(views)
        writer.finish("finished")
    return open_log(str(path))


def test_objects_and_views_are_read_back_in_the_order_of_time(tmp_path: Path) -> None:
    objects = [seen(0), seen(0, "v2"), seen(STEP_US, x_m=2.5)]
    views = [ViewRecord(0, CAMERA.pixel_from_ground), ViewRecord(STEP_US, ())]
    with write(tmp_path / "log.db", objects, views) as log:
        assert list(log.objects("r1")) == objects
        assert list(log.views("r1")) == views
        assert list(log.objects("r2")) == []


def test_repeated_run_replaces_its_objects(tmp_path: Path) -> None:
    write(tmp_path / "log.db", [seen(0), seen(0, "v2")], [ViewRecord(0, ())]).close()
    with write(tmp_path / "log.db", [seen(STEP_US)], []) as log:
        assert list(log.objects("r1")) == [seen(STEP_US)]
        assert list(log.views("r1")) == []


def objects_at(t_us: int, *, pixel_from_ground: np.ndarray | None = None) -> VisionObjects:
    return VisionObjects(
        t_us=t_us,
        ids=("v1",),
        centre_m=np.array([[1.5, 2.25]]),
        velocity_mps=np.zeros((1, 2)),
        heading_rad=np.array([0.5]),
        length_m=np.array([4.5]),
        width_m=np.array([1.8]),
        observed=np.array([True]),
        clipped=np.array([False]),
        pixel_from_ground=pixel_from_ground,
    )


@pytest.mark.parametrize(
    ("frames", "views"),
    [
        ([objects_at(0)], []),
        (
            [objects_at(0, pixel_from_ground=MAP), VisionObjects.lost(STEP_US)],
            [ViewRecord(0, CAMERA.pixel_from_ground), ViewRecord(STEP_US, ())],
        ),
    ],
    ids=["fixed", "moving"],
)
def test_recorder_writes_what_vision_says(tmp_path: Path, frames: list[VisionObjects], views: list[ViewRecord]) -> None:
    with open_log(str(tmp_path / "log.db"), "w") as log:
        writer = log.begin_run(run())
        recorder = Recorder(writer, None, UnfitCounter(load("message m[]")), history_us=0)
        for objects in frames:
            recorder._record_objects(Sample(objects.t_us, objects.t_us, objects))
        writer.finish("finished")
        assert list(log.objects("r1")) == [seen(0)]
        assert list(log.views("r1")) == views


def test_moving_view_is_drawn_where_it_was(tmp_path: Path) -> None:
    """A car that stands, seen by a camera that moves on by ten metres and then is lost."""
    moved = MAP.copy()
    moved[0, 2] -= 100.0
    with open_log(str(tmp_path / "log.db"), "w") as log:
        writer = log.begin_run(run())
        for k in range(3):
            writer.append_frames([k * STEP_US])
            writer.append_states([state(k * STEP_US, "car1", 20.0, 5.0)])
        maps = (tuple(MAP.ravel().tolist()), tuple(moved.ravel().tolist()), ())
        writer.append([ViewRecord(k * STEP_US, numbers) for k, numbers in enumerate(maps)])
        writer.finish("finished")
    write_video(tmp_path / "video.mp4", [np.full((360, 640), 90, np.uint8)] * 3)
    boxes = [drawn_columns(tmp_path, k * STEP_US) for k in range(3)]
    assert boxes[0] == pytest.approx(278, abs=3)  # 100 px + 20 m * 10 px/m, less half a length
    assert boxes[1] == pytest.approx(178, abs=3)
    assert boxes[2] is None


def drawn_columns(folder: Path, at_us: int) -> float | None:
    """Return the first coloured column of the drawn frame; grey is the video, white a caption."""
    with open_log(str(folder / "log.db")) as log:
        picture = picture_at(log, log.run(None), folder / "video.mp4", at_us).astype(int)
    columns = np.flatnonzero((picture.max(axis=-1) - picture.min(axis=-1) > 60).any(axis=0))
    return float(columns[0]) if len(columns) else None
