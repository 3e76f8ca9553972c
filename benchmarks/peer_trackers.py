"""Other people's trackers on stored detections; `tracker_runners` runs this file in the peers' own environment.

``python peer_trackers.py PEER FOLDER`` does the jobs listed in the folder's ``jobs.json`` and needs numpy and the peer,
and nothing of ours: peers bring builds of OpenCV that do not go together with ours. Without FOLDER it only says whether
the peer is there. A setting that a job does not name is the package's own default.
"""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Iterator, Mapping
from importlib import import_module
from pathlib import Path
from typing import Any  # the peers are not typed

import numpy as np

PX_PER_M = 10.0
# norfair has no default for the farthest match; this is the reach within which rows are scored.
NORFAIR_DISTANCE_M = 4.0
Rows = list[tuple[int, int, float, float]]


def main() -> None:
    peer, *rest = sys.argv[1:]
    run = {"norfair": norfair_rows, "ByteTrack": bytetrack_rows, "OC-SORT": ocsort_rows}[peer]
    # Before the clock starts: what an import costs is no cost of tracking.
    import_module({"norfair": "norfair"}.get(peer, "trackers"))
    for name in rest:
        folder = Path(name)
        for place, job in enumerate(json.loads((folder / "jobs.json").read_text())):
            with np.load(folder / job["scene"]) as stored:
                scene = dict(stored)
            start_s = time.process_time()
            rows = run(scene, job["settings"])
            elapsed_s = time.process_time() - start_s
            table = np.array(rows, np.float64).reshape(-1, 4)
            np.savez(
                folder / f"rows_{place}.npz",
                frame=table[:, 0],
                track=table[:, 1],
                centre_m=table[:, 2:],
                elapsed_s=elapsed_s,
            )


def norfair_rows(stored: Mapping[str, Any], settings: Mapping[str, Any]) -> Rows:
    """Track centres in metres by their distance."""
    from norfair import Detection, Tracker
    from norfair.filter import OptimizedKalmanFilterFactory

    per_s = int(stored["frames_per_s"])  # norfair counts in frames, so its two times are given in seconds here
    life: dict[str, Any] = {}
    if "keep_s" in settings:
        life["hit_counter_max"] = round(settings["keep_s"] * per_s)
    if "confirm_s" in settings:
        life["initialization_delay"] = max(1, round(settings["confirm_s"] * per_s))
    if "noise" in settings:
        life["filter_factory"] = OptimizedKalmanFilterFactory(R=settings["noise"])
    distance_m = settings.get("distance_m", NORFAIR_DISTANCE_M)
    tracker = Tracker(distance_function="euclidean", distance_threshold=distance_m, **life)
    rows: Rows = []
    for frame, places in _frames(stored):
        seen = [Detection(stored["found_m"][place : place + 1], data=frame) for place in places]
        for one in tracker.update(seen):
            if one.last_detection.data == frame:  # what is predicted only is not scored, for any tracker
                rows.append((frame, one.id, *one.estimate[0].tolist()))
    return rows


def bytetrack_rows(stored: Mapping[str, Any], settings: Mapping[str, Any]) -> Rows:
    """Track upright boxes by their overlap."""
    from trackers import ByteTrackTracker

    return _box_rows(stored, ByteTrackTracker(frame_rate=float(stored["frames_per_s"]), **_overlap(settings)))


def ocsort_rows(stored: Mapping[str, Any], settings: Mapping[str, Any]) -> Rows:
    """Track upright boxes by their overlap and direction."""
    from trackers import OCSORTTracker

    return _box_rows(stored, OCSORTTracker(frame_rate=float(stored["frames_per_s"]), **_overlap(settings)))


def _overlap(settings: Mapping[str, Any]) -> dict[str, Any]:
    """Turn `buffer_ratio` into the overlap of boxes grown by it: noise moves small boxes apart."""
    from trackers.utils.iou import BIoU

    named = {key: value for key, value in settings.items() if key != "buffer_ratio"}
    return {**named, "iou": BIoU(settings["buffer_ratio"])} if "buffer_ratio" in settings else named


def _box_rows(stored: Mapping[str, Any], tracker: Any) -> Rows:
    from supervision import Detections

    half = np.column_stack((stored["length_m"], stored["width_m"])) / 2
    corners_px = np.hstack((stored["found_m"] - half, stored["found_m"] + half)) * PX_PER_M
    rows: Rows = []
    for frame, places in _frames(stored):
        count = len(places)
        seen = Detections(corners_px[places], confidence=np.full(count, 0.9), class_id=np.zeros(count, int))
        followed = tracker.update(seen)
        for box, track in zip(followed.xyxy, followed.tracker_id, strict=True):
            if track >= 0:
                rows.append((frame, int(track), *((box[:2] + box[2:]) / 2 / PX_PER_M).tolist()))
    return rows


def _frames(stored: Mapping[str, Any]) -> Iterator[tuple[int, Any]]:
    """Yield every frame with the rows of its detections, also those without any."""
    bounds = np.searchsorted(stored["found_frame"], np.arange(int(stored["frame_count"]) + 1))
    for frame in range(int(stored["frame_count"])):
        yield frame, np.arange(bounds[frame], bounds[frame + 1])


if __name__ == "__main__":
    main()
