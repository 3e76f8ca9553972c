"""Other people's trackers on stored detections; `bench_trackers` runs this file in the peers' own environment.

``python peer_trackers.py PEER DETECTIONS.npz OUT.npz SETTINGS`` needs numpy and the peer, and nothing of ours: peers
bring builds of OpenCV that do not go together with ours. Without DETECTIONS it only says whether the peer is there.
"""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Iterator, Mapping
from typing import Any  # the peers are not typed

import numpy as np

PX_PER_M = 10.0
Rows = list[tuple[int, int, float, float]]


def main() -> None:
    peer, *rest = sys.argv[1:]
    run = {"norfair": norfair_rows, "ByteTrack": bytetrack_rows, "OC-SORT": ocsort_rows}[peer]
    if not rest:
        __import__({"norfair": "norfair"}.get(peer, "trackers"))
        return
    detections, out, settings = rest
    stored = np.load(detections)
    start_s = time.process_time()
    rows = run(stored, json.loads(settings))
    elapsed_s = time.process_time() - start_s
    table = np.array(rows, np.float64).reshape(-1, 4)
    np.savez(out, frame=table[:, 0], track=table[:, 1], centre_m=table[:, 2:], elapsed_s=elapsed_s)


def norfair_rows(stored: Mapping[str, Any], settings: Mapping[str, Any]) -> Rows:
    """Track centres in metres by their distance."""
    from norfair import Detection, Tracker

    per_s = int(stored["frames_per_s"])  # norfair counts in frames, so its two times are given in seconds here
    tracker = Tracker(
        distance_function="euclidean",
        distance_threshold=settings["distance_m"],
        hit_counter_max=round(settings["keep_s"] * per_s),
        initialization_delay=max(1, round(settings["confirm_s"] * per_s)),
    )
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

    return _box_rows(stored, ByteTrackTracker(frame_rate=float(stored["frames_per_s"]), **settings))


def ocsort_rows(stored: Mapping[str, Any], settings: Mapping[str, Any]) -> Rows:
    """Track upright boxes by their overlap and direction."""
    from trackers import OCSORTTracker

    return _box_rows(stored, OCSORTTracker(frame_rate=float(stored["frames_per_s"]), **settings))


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
