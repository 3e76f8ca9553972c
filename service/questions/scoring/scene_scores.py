"""How good is a run, or a file of tracks, at seeing and following the vehicles of a scene?"""

from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
import shapely

from service.errors import LogError
from service.questions.scoring.claims import MOT_SUFFIXES, Found, found_cars, found_objects, load_tracks
from service.questions.scoring.detection import DetectionScore, score_detection, score_settled_tracks, settle
from service.questions.scoring.object_rows import ObjectRows
from service.questions.scoring.scene_view import (
    SceneView,
    keep_to_roads,
    load_scene_roads,
    load_scene_view,
    scene_video,
)
from service.questions.scoring.tracks import TrackScore
from service.questions.scoring.truth_rows import TruthTable, load_truth_table
from service.store.log import open_log

OBJECTS, CARS, TRACKS = "vision objects", "cars", "tracks"


# Both sides of one scene by level (`OBJECTS`, `CARS`, `TRACKS`), in the order of processing: true and found rows.
Compared = dict[str, tuple[ObjectRows, ObjectRows]]


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
