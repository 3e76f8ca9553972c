"""How good is a run, or a file of tracks, at seeing and following the vehicles of a scene?

From a log come the objects of vision, named by their tracks (before anchoring), and the cars (after it). Positions that
are predicted and not seen are left out on both levels.
"""

import csv
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import numpy as np
import shapely
from numpy.typing import NDArray

from service.errors import InputError, LogError
from service.questions.scoring.detection import DetectionScore, score_detection, score_settled_tracks, settle
from service.questions.scoring.object_rows import ObjectRows
from service.questions.scoring.pairs import BoolArray, FloatArray, IntArray
from service.questions.scoring.scene_view import (
    SceneView,
    keep_to_roads,
    load_scene_roads,
    load_scene_view,
    scene_video,
)
from service.questions.scoring.tracks import TrackScore
from service.questions.scoring.truth_rows import TruthTable, load_truth_table
from service.records.runs import RunRecord
from service.records.seen import MOT_OFFSET_PX, CarState, SeenObject
from service.runs.inputs.trajectories import Trajectories, load_trajectories
from service.store.log import EventLog, open_log
from service.texts.chronicle_files import read_text

MOT_SUFFIXES = (".txt", ".mot")
MOT_FIELDS = 6
FARTHEST_PX = 1_000_000
OBJECTS, CARS, TRACKS = "vision objects", "cars", "tracks"
# Both sides of one scene by level (`OBJECTS`, `CARS`, `TRACKS`), in the order of processing: true and found rows.
Compared = dict[str, tuple[ObjectRows, ObjectRows]]


@dataclass(frozen=True, slots=True, eq=False)
class Found:
    """Hold what was found, and the frames in which it could have been.

    Attributes
    ----------
    frame_us : (f,) times of all frames, also of those in which nothing was found.
    rows : frame numbers count in `frame_us`.
    """

    frame_us: IntArray
    rows: ObjectRows


def found_objects(log: EventLog, run: RunRecord) -> Found | None:
    """Read the objects of vision; None for a run on trajectories, or one that did not record what vision saw."""
    objects = list(log.objects(run.id))
    if run.input_kind == "trajectory" or (not objects and log.cars(run.id)):
        return None
    return _of_log(log, run, [one for one in objects if one.observed])


def found_cars(log: EventLog, run: RunRecord) -> Found:
    """Read the cars of a run where they are linked to what is seen."""
    return _of_log(log, run, [state for state in log.states(run.id) if state.linked])


def load_tracks(path: Path, *, span_us: tuple[int, int], frame_us: IntArray, view: SceneView | None) -> Found:
    """Read a file of tracks.

    Parameters
    ----------
    path : CSV with the columns of a trajectory file (a column `visible` of 0 marks rows to leave out), or MOT text
        (`.txt`): frame from 1, id, left, top, width, height in pixels.
    span_us : first and last time of the truth; a CSV file says nothing of frames without objects, so its own step
        fills the time in which it has no rows.
    frame_us : times of the frames that MOT text numbers.
    view : maps MOT boxes to the ground.

    Raises
    ------
    InputError
        If the file cannot be read, or is MOT text and there is no view.
    """
    if path.suffix.lower() in MOT_SUFFIXES:
        if view is None:
            raise InputError(f"{path}: expected a truth folder with site.toml and video.mp4 for MOT text, got none")
        return Found(frame_us, _read_mot(path, frame_us, view))
    tracks = load_trajectories(path)
    frames = _fill(tracks.times_us, span_us)
    # In the order of time, as the rows of what is asked for.
    rows = _rows(np.searchsorted(frames, tracks.t_us), tracks.ids, tracks.values[:, [0, 1, 2, 4, 5]])
    return Found(frames, rows.select(_read_visible(path, tracks)))


def _of_log(log: EventLog, run: RunRecord, found: Sequence[SeenObject] | Sequence[CarState]) -> Found:
    frame_us = np.array([t_us for _, t_us in log.frames(run.id)], np.int64)
    frame_us = np.unique(np.concatenate((frame_us, [one.t_us for one in found]))).astype(np.int64)
    columns = np.array([(one.x_m, one.y_m, one.heading_rad, one.length_m, one.width_m) for one in found])
    names = [one.vision_id if isinstance(one, SeenObject) else one.car for one in found]
    clipped = [isinstance(one, SeenObject) and one.clipped for one in found]
    frame = np.searchsorted(frame_us, np.array([one.t_us for one in found], np.int64))
    rows = replace(_rows(frame, names, columns.reshape(-1, 5)), is_border=np.array(clipped, np.bool_))
    return Found(frame_us, rows.select(np.argsort(frame, kind="stable")))


def _rows(frame: NDArray[np.intp], names: Sequence[str], columns: FloatArray) -> ObjectRows:
    """Lay out rows; columns are x, y, heading, length, width."""
    return ObjectRows(
        frame=frame.astype(np.int64),
        name=np.array(names, np.str_),
        centre_m=columns[:, :2],
        heading_rad=columns[:, 2],
        length_m=columns[:, 3],
        width_m=columns[:, 4],
        is_border=np.zeros(len(frame), np.bool_),
        is_standing=np.zeros(len(frame), np.bool_),
        kind=np.full(len(frame), "", np.str_),
    )


def _fill(times_us: IntArray, span_us: tuple[int, int]) -> IntArray:
    """Add times at the file's own step wherever it leaves out more than one and a half of them."""
    step_us = round(float(np.median(np.diff(times_us)))) if len(times_us) > 1 else 0
    if step_us == 0:
        return times_us
    fence = np.concatenate(
        ([min(span_us[0] - step_us, times_us[0])], times_us, [max(span_us[1] + step_us, times_us[-1])])
    )
    gaps = np.flatnonzero(np.diff(fence) > 1.5 * step_us)
    filled = [np.arange(fence[gap] + step_us, fence[gap + 1] - step_us // 2, step_us) for gap in gaps.tolist()]
    return np.unique(np.concatenate((times_us, *filled))).astype(np.int64)


def _read_visible(path: Path, tracks: Trajectories) -> BoolArray:
    """Tell which rows of a trajectory file are seen: all, unless its column `visible` says otherwise."""
    with path.open(newline="", encoding="utf-8-sig") as file:
        reader = csv.DictReader(file)
        if "visible" not in (reader.fieldnames or ()):
            return np.ones(len(tracks.ids), np.bool_)
        rows = [
            (row["id"].strip(), float(row.get("t_us") or float(row["t_s"]) * 1e6), row["visible"]) for row in reader
        ]
    hidden = {(round(t_us), name) for name, t_us, visible in rows if visible.strip() == "0"}
    return np.array([(t_us, name) not in hidden for t_us, name in zip(tracks.t_us.tolist(), tracks.ids, strict=True)])


def _read_mot(path: Path, frame_us: IntArray, view: SceneView) -> ObjectRows:
    frames, names, boxes = [], [], []
    told: set[tuple[int, str]] = set()
    lines = [line for line in read_text(path, "MOT text").splitlines() if line.strip()]
    for number, line in enumerate(lines, start=1):
        fields = line.split(",")
        try:
            frame, left, top, width, height = int(fields[0]), *(float(text) for text in fields[2:MOT_FIELDS])
        except (ValueError, IndexError) as error:
            expected = "frame, id, left, top, width, height"
            raise InputError(f"{path}:{number}: expected {expected}, got {line!r}") from error
        if not 1 <= frame <= len(frame_us):
            raise InputError(f"{path}:{number}: expected a frame from 1 to {len(frame_us)}, got {frame}")
        if not (all(abs(value) <= FARTHEST_PX for value in (left, top, width, height)) and min(width, height) >= 0):
            expected = f"expected a box within {FARTHEST_PX} pixels, its sides not below 0"
            raise InputError(f"{path}:{number}: {expected}, got {line!r}")
        if (frame, fields[1].strip()) in told:
            raise InputError(f"{path}:{number}: expected each id once in a frame, got {fields[1].strip()!r} again")
        told.add((frame, fields[1].strip()))
        frames.append(frame - 1)
        names.append(fields[1].strip())
        boxes.append((left - MOT_OFFSET_PX, top - MOT_OFFSET_PX, width, height))
    box_px = np.array(boxes).reshape(-1, 4)
    frame_of = np.array(frames, np.intp)
    centre_m = view.to_ground(frame_us[frame_of], box_px[:, :2] + box_px[:, 2:] / 2)
    rows = replace(_rows(frame_of, names, np.column_stack((centre_m, np.zeros((len(frames), 3))))), box_px=box_px)
    rows = rows.select(np.argsort(frame_of, kind="stable"))
    return rows.select(np.asarray(np.isfinite(rows.centre_m).all(axis=1)))


@dataclass(frozen=True, slots=True)
class SceneScore:
    """Hold the figures.

    Attributes
    ----------
    detection : of the first level: what vision sees, if there is vision. seen_by : that level's name.
    tracks : by level.
    """

    seen_by: str
    detection: DetectionScore
    tracks: dict[str, TrackScore]

    def as_record(self) -> dict[str, object]:
        """Return the figures as plain data, for JSON."""
        return {
            "detection": {"of": self.seen_by, **self.detection.as_record()},
            "tracks": {level: asdict(score) for level, score in self.tracks.items()},
        }


def compare_log(url: str, truth_folder: Path, *, run: str | None = None) -> Compared:
    """Lay what a run saw beside the truth.

    Parameters
    ----------
    url : the event log. truth_folder : of the same scene. run : may be left out when the log holds only one.

    Raises
    ------
    ServiceError
        If the log, the run or the truth cannot be read.
    """
    table = load_truth_table(truth_folder)
    with open_log(url) as log:
        record = log.run(run)
        fixed = ((), record.camera.pixel_from_ground if record.camera else ())
        is_moving = any(view.pixel_from_ground not in fixed for view in log.views(record.id))
        view = load_scene_view(truth_folder, None if is_moving else record.camera)
        objects, cars = found_objects(log, record), found_cars(log, record)
    if len(cars.frame_us) == 0:
        raise LogError(f"run {record.id!r}: expected frames to compare with the truth, got none")
    found = {} if objects is None else {OBJECTS: objects}
    found[CARS] = cars
    roads = load_scene_roads(truth_folder)
    return {level: _both_sides(table, one, view, roads) for level, one in found.items()}


def compare_tracks(path: Path, truth_folder: Path) -> Compared:
    """Lay a file of tracks (CSV, or MOT text) beside the truth.

    Raises
    ------
    ServiceError, VisionError
        If the file or the truth cannot be read.
    """
    table = load_truth_table(truth_folder)
    view = load_scene_view(truth_folder)
    times_us = table.times_us()
    span_us = int(times_us[0]), int(times_us[-1])
    # Only MOT text counts frames, and the times of all frames cost reading the whole video.
    is_mot = path.suffix.lower() in MOT_SUFFIXES
    video = scene_video(truth_folder) if is_mot else None
    frame_us = np.array([frame.t_us for frame in video], np.int64) if video else times_us
    found = load_tracks(path, span_us=span_us, frame_us=frame_us, view=view)
    return {TRACKS: _both_sides(table, found, view, load_scene_roads(truth_folder))}


def score_scene(compared: Compared) -> SceneScore:
    """Score both sides of a scene."""
    settled = {level: settle(*sides) for level, sides in compared.items()}
    seen_by = next(iter(settled))
    tracks = {level: score_settled_tracks(one) for level, one in settled.items()}
    return SceneScore(seen_by, score_detection(settled[seen_by]), tracks)


def _both_sides(
    table: TruthTable, found: Found, view: SceneView | None, roads: shapely.Geometry | None
) -> tuple[ObjectRows, ObjectRows]:
    """Give the true rows of the frames, and the found rows of frames that the truth knows."""
    true = keep_to_roads(table.rows_at(found.frame_us, view), roads)
    known = np.isin(found.rows.frame, np.flatnonzero(table.knows(found.frame_us)))
    return true, found.rows.select(known)
