"""How well do trackers of other people keep the names of cars that are hidden? The same lost tracks, as detections.

A peer gets the rows without their names, at the places, times and sizes that anchoring gets, and each row has the name
of the peer's track that is nearest to it then. Of a small grid of settings the one with the best IDF1 is reported: for
each case another one, which is more than a user could do.
"""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from benchmarks.kept_identity import NO_CAR, NamedRows, idf1
from benchmarks.lost_tracks import STEP_US
from benchmarks.tracked_traffic import DetectedTraffic
from benchmarks.tracker_runners import Followed, Runner, Settings
from data_gen.outputs.trajectories import NoisyTracks, TrueRows
from service.questions.scoring.pairs import assign, ground_pairs

FloatArray = NDArray[np.float64]

REACH_M = 4.0
"""A peer's track farther from a row is not of it."""
# Waiting long enough for most gaps, or for none too long; in seconds here, and in frames of 30 a second there.
SWEEPS: Mapping[str, Mapping[str, Sequence[float | int]]] = {
    "norfair": {"distance_m": (4.0, 8.0, 16.0), "keep_s": (3.0, 6.0), "confirm_s": (0.1,), "noise": (1.0, 4.0)},
    "ByteTrack": {
        "lost_track_buffer": (90, 180),
        "buffer_ratio": (0.5, 1.0, 2.0),
        "minimum_iou_threshold": (0.1, 0.2),
        "minimum_consecutive_frames": (2,),
    },
}


def best_of_peer(peer: str, run: Runner, scenes: Sequence[NoisyTracks]) -> tuple[Settings, list[NamedRows]]:
    """Try the settings of a peer on all scenes of a case; give the best by IDF1, and what it named.

    Parameters
    ----------
    peer : of `SWEEPS`. run : it. scenes : their tracks.
    """
    sweep = SWEEPS[peer]
    candidates = [dict(zip(sweep, values, strict=True)) for values in itertools.product(*sweep.values())]
    traffic = [as_detections(tracks) for tracks in scenes]
    found = iter(run([(one, candidate) for candidate in candidates for one in traffic]))
    tried = [[name_rows(tracks, next(found)) for tracks in scenes] for _ in candidates]
    scores = [idf1([(named, named.symbols) for named in scenes_named]) for scenes_named in tried]
    best = int(np.argmax(scores))
    return candidates[best], tried[best]


def as_detections(tracks: NoisyTracks) -> DetectedTraffic:
    """Give rows the form that peers take, without their names; sizes are those of upright boxes, as peers want them."""
    rows = tracks.rows
    frame = rows.t_us // STEP_US
    length_m, width_m = _upright(rows)
    return DetectedTraffic(
        frames_per_s=1_000_000 // STEP_US,
        frame_count=int(frame[-1]) + 1,
        true_frame=frame,
        true_car=np.unique(np.array(rows.vehicles), return_inverse=True)[1],
        true_m=rows.values[:, :2],
        found_frame=frame,
        found_m=rows.values[:, :2],
        heading_rad=np.zeros(len(frame)),
        length_m=length_m,
        width_m=width_m,
    )


def _upright(rows: TrueRows) -> tuple[FloatArray, FloatArray]:
    """Measure boxes around turned vehicles, east and north."""
    heading_rad, (length_m, width_m) = rows.values[:, 2], rows.values[:, 4:6].T
    along, across = np.abs(np.cos(heading_rad)), np.abs(np.sin(heading_rad))
    return along * length_m + across * width_m, across * length_m + along * width_m


def name_rows(tracks: NoisyTracks, found: Followed) -> NamedRows:
    """Give each row the name of the peer's track that is nearest to it in its frame, one to one.

    Parameters
    ----------
    tracks : what the peer was given. found : what it made of it.
    """
    frame = tracks.rows.t_us // STEP_US
    pairs = ground_pairs(frame, tracks.rows.values[:, :2], found.frame, found.centre_m, reach_m=REACH_M)
    chosen = pairs.select(assign(pairs, frame[pairs.true_row], pairs.similarity))
    symbols = [NO_CAR] * len(frame)
    for row, track in zip(chosen.true_row.tolist(), found.track[chosen.found_row].tolist(), strict=True):
        symbols[row] = f"p{track}"
    return NamedRows(tracks.rows.t_us, tracks.rows.vehicles, tracks.ids, tuple(symbols))
