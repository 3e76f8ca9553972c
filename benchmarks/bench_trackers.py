"""How well, and how fast, does our tracker follow detections, beside trackers of other people?

``python -m benchmarks.bench_trackers --peer-python ENVIRONMENT/bin/python ...`` from the repository. All trackers get
the same made detections (`tracked_traffic.py`) at three difficulties; what they output in a frame counts only if they
have seen it there. Each has twelve settings, of which ``--sweep`` finds the one with the best mean IDF1 over all
difficulties and the tuning seeds 1 to 5; the findings stand in `CHOSEN`. Peers that no given environment holds are left
out, and said so; they do not go together in one:

    python -m venv norfair && norfair/bin/pip install norfair
    python -m venv trackers && trackers/bin/pip install trackers
"""

from __future__ import annotations

import argparse
import itertools
import json
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, fields
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from anchoring.anchorer import Anchorer
from anchoring.observations import Observations
from benchmarks.tracked_traffic import DIFFICULTIES, DetectedTraffic, make_traffic
from service.scoring.pairs import ground_pairs
from service.scoring.tracks import TrackRows, TrackScore, score_tracks
from vision.boxes import Boxes, distance_to_boxes
from vision.detector import Detections, Expected
from vision.objects import VisionObjects
from vision.settings import VisionSettings
from vision.tracker import Tracker

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
Settings = Mapping[str, float | int]

REACH_M = 4.0
OURS, OURS_ANCHORED = "ours", "ours, with anchoring"
PEERS = ("norfair", "ByteTrack", "OC-SORT")
SWEEPS: Mapping[str, Mapping[str, Sequence[float | int]]] = {
    OURS: {
        "coast_us": (1_000_000, 2_000_000, 3_000_000),
        "position_noise_m": (0.3, 0.5),
        "acceleration_along_mps2": (1.5, 3.0),
    },
    "norfair": {"distance_m": (2.0, 4.0, 8.0), "keep_s": (1.0, 2.0), "confirm_s": (0.12, 0.32)},
    "ByteTrack": {
        "lost_track_buffer": (30, 60, 90),
        "minimum_iou_threshold": (0.05, 0.2),
        "minimum_consecutive_frames": (2, 4),
    },
    "OC-SORT": {
        "lost_track_buffer": (30, 60, 90),
        "minimum_iou_threshold": (0.05, 0.2),
        "minimum_consecutive_frames": (2, 4),
    },
}
# What `--sweep --seeds 1 2 3 --seconds 8` printed for ours and norfair, `--sweep --seeds 1 --seconds 4` for the others.
CHOSEN: Mapping[str, Settings] = {
    OURS: {"coast_us": 3_000_000, "position_noise_m": 0.5, "acceleration_along_mps2": 1.5},
    "norfair": {"distance_m": 8.0, "keep_s": 2.0, "confirm_s": 0.12},
    "ByteTrack": {"lost_track_buffer": 60, "minimum_iou_threshold": 0.05, "minimum_consecutive_frames": 2},
    "OC-SORT": {"lost_track_buffer": 30, "minimum_iou_threshold": 0.05, "minimum_consecutive_frames": 2},
}


@dataclass(frozen=True, slots=True, eq=False)
class Followed:
    """Hold the rows that a tracker gave, ordered by frame, and the processor time it took."""

    frame: IntArray
    track: IntArray
    centre_m: FloatArray
    elapsed_s: float


Runner = Callable[[DetectedTraffic, Settings], Followed]


def main(arguments: Sequence[str] | None = None) -> None:
    options = _parse(arguments)
    runners = _runners(options.peer_python)
    if options.sweep:
        for name, sweep in SWEEPS.items():
            if name in runners and name in (options.only or SWEEPS):
                chosen = _best(runners[name], sweep, options.seeds, options.seconds)
                print(f"{name}: {json.dumps(chosen)}", flush=True)
        return
    print(f"seeds {' '.join(map(str, options.seeds))}, {options.seconds} s each; frames/s of processor time\n")
    print("| detections | tracker | IDF1 | HOTA | identity switches | frames/s | ours as shipped is faster by |")
    print("|---|---|---|---|---|---|---|")
    for difficulty, one in DIFFICULTIES.items():
        traffic = [make_traffic(one, seed=seed, seconds=options.seconds) for seed in options.seeds]
        ours_per_s: float | None = None
        for name, settings in _contestants(runners, options.only or tuple(runners)):
            score, frames_per_s = _score(runners[name], traffic, settings)
            ours_per_s = frames_per_s if ours_per_s is None else ours_per_s
            title = name if settings or name in PEERS else f"{name}, as shipped"
            figures = f"{score.idf1:.3f} | {score.hota:.3f} | {score.id_switches}"
            ratio = ours_per_s / frames_per_s
            print(f"| {difficulty} | {title} | {figures} | {frames_per_s:.0f} | {ratio:.1f} |", flush=True)


def _parse(arguments: Sequence[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, nargs="+", default=[1, 2, 3, 4, 5])
    parser.add_argument("--seconds", type=int, default=20)
    parser.add_argument("--peer-python", type=Path, nargs="*", default=[], help="environments that hold peers")
    parser.add_argument("--only", nargs="+", choices=(OURS, *PEERS), help="some of the trackers; default: all")
    parser.add_argument("--sweep", action="store_true", help="choose settings instead of comparing")
    return parser.parse_args(arguments)


def _contestants(runners: Mapping[str, Runner], wanted: Sequence[str]) -> Iterator[tuple[str, Settings]]:
    """Yield who is run with which settings: ours as shipped first, then everybody with the best of the sweep."""
    yield OURS, {}
    yield OURS_ANCHORED, {}
    for name in (OURS, *PEERS):
        if name in runners and name in wanted:
            yield name, CHOSEN[name]


def _best(run: Runner, sweep: Mapping[str, Sequence[float | int]], seeds: Sequence[int], seconds: int) -> Settings:
    traffic = [make_traffic(one, seed=seed, seconds=seconds) for one in DIFFICULTIES.values() for seed in seeds]
    candidates = [dict(zip(sweep, values, strict=True)) for values in itertools.product(*sweep.values())]
    # The mean of the scenes' figures: frames at 5 fps are few, and would count for little in a pooled one.
    return max(candidates, key=lambda settings: np.mean([_score(run, [one], settings)[0].idf1 for one in traffic]))


def _score(run: Runner, traffic: Sequence[DetectedTraffic], settings: Settings) -> tuple[TrackScore, float]:
    """Score the scenes as one long one; return that and the frames per second."""
    elapsed_s, first_frame, first_track = 0.0, 0, 0
    parts: dict[str, list[tuple[IntArray, IntArray, FloatArray]]] = {"true": [], "found": []}
    for one in traffic:
        followed = run(one, settings)
        elapsed_s += followed.elapsed_s
        parts["true"].append((one.true_frame + first_frame, one.true_car + first_track, one.true_m))
        parts["found"].append((followed.frame + first_frame, followed.track + first_track, followed.centre_m))
        first_frame += one.frame_count
        first_track += 1_000_000
    sides = [[np.concatenate(column) for column in zip(*parts[side], strict=True)] for side in ("true", "found")]
    (true_frame, true_track, true_m), (frame, track, centre_m) = sides
    pairs = ground_pairs(true_frame, true_m, frame, centre_m, reach_m=REACH_M)
    score = score_tracks(TrackRows(true_frame, _numbered(true_track)), TrackRows(frame, _numbered(track)), pairs)
    return score, first_frame / max(elapsed_s, 1e-9)


def _numbered(track: IntArray) -> IntArray:
    return np.unique(track, return_inverse=True)[1].astype(np.int64)


def _runners(peer_pythons: Sequence[Path]) -> dict[str, Runner]:
    """Find out which trackers can be run, and how."""
    runners: dict[str, Runner] = {OURS: _run_ours, OURS_ANCHORED: _run_anchored}
    for peer in PEERS:
        python = next((one for one in peer_pythons if _peer(one, peer).returncode == 0), None)
        if python is None:
            print(f"{peer}: in none of the environments of --peer-python, left out", file=sys.stderr)
        else:
            runners[peer] = _PeerRunner(python, peer)
    return runners


def _peer(python: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    script = Path(__file__).with_name("peer_trackers.py")
    return subprocess.run([python, script, *arguments], capture_output=True, text=True, check=False)


@dataclass(frozen=True, slots=True)
class _PeerRunner:
    """Run a peer in its own environment."""

    python: Path
    peer: str

    def __call__(self, traffic: DetectedTraffic, settings: Settings) -> Followed:
        """Hand over the detections as a file, and read what comes back."""
        with tempfile.TemporaryDirectory() as folder:
            detections, out = Path(folder) / "detections.npz", Path(folder) / "out.npz"
            np.savez(detections, **{field.name: getattr(traffic, field.name) for field in fields(traffic)})
            done = _peer(self.python, self.peer, str(detections), str(out), json.dumps(dict(settings)))
            if done.returncode != 0:
                raise RuntimeError(f"{self.peer} with {settings}: expected tracks, got {done.stderr[-500:]!r}")
            with np.load(out) as rows:
                frame, track = rows["frame"].astype(np.int64), rows["track"].astype(np.int64)
                return Followed(frame, track, rows["centre_m"], float(rows["elapsed_s"]))


def _run_ours(traffic: DetectedTraffic, settings: Settings) -> Followed:
    return _follow(traffic, settings, lambda objects: (objects.ids, objects.centre_m, objects.observed))


def _run_anchored(traffic: DetectedTraffic, settings: Settings) -> Followed:
    """Let anchoring, without a road network, join what the tracker loses; cars count where they are linked."""
    anchorer = Anchorer(None)

    def cars(objects: VisionObjects) -> Shown:
        seen, _ = anchorer.observe(
            Observations(**{one.name: getattr(objects, one.name) for one in fields(Observations)})
        )
        return seen.ids, seen.centre_m, seen.linked

    return _follow(traffic, settings, cars)


Shown = tuple[tuple[str, ...], FloatArray, NDArray[np.bool_]]


def _follow(traffic: DetectedTraffic, settings: Settings, show: Callable[[VisionObjects], Shown]) -> Followed:
    tracker = Tracker(VisionSettings(**settings), lambda points_m: np.ones(len(points_m), np.bool_))
    noise_m = tracker_noise_m(settings)
    bounds = np.searchsorted(traffic.found_frame, np.arange(traffic.frame_count + 1))
    numbers: dict[str, int] = {}
    rows: list[tuple[int, int, float, float]] = []
    start_s = time.process_time()
    for frame in range(traffic.frame_count):
        expected = tracker.predict(frame * 1_000_000 // traffic.frames_per_s)
        found = _detections(traffic, slice(bounds[frame], bounds[frame + 1]), expected, noise_m)
        ids, centre_m, is_seen = show(tracker.update(found))
        for place in np.flatnonzero(is_seen).tolist():
            number = numbers.setdefault(ids[place], len(numbers))
            rows.append((frame, number, *centre_m[place].tolist()))
    elapsed_s = time.process_time() - start_s
    table = np.array(rows, np.float64).reshape(-1, 4)
    return Followed(table[:, 0].astype(np.int64), table[:, 1].astype(np.int64), table[:, 2:], elapsed_s)


def tracker_noise_m(settings: Settings) -> float:
    """Say what our detections claim of their noise: the setting, not the truth."""
    return float(settings.get("position_noise_m", VisionSettings().position_noise_m))


def _detections(traffic: DetectedTraffic, rows: slice, expected: Expected, noise_m: float) -> Detections:
    """Make detections as the motion detector does: cells in a predicted box belong to it and get its direction."""
    boxes = Boxes(traffic.found_m[rows], traffic.heading_rad[rows], traffic.length_m[rows], traffic.width_m[rows])
    owner = _owners(boxes, expected.known)
    is_owned = owner >= 0
    heading_rad = boxes.heading_rad.copy()
    heading_rad[is_owned] = expected.known.heading_rad[owner[is_owned]]
    count = len(boxes)
    return Detections(
        boxes=Boxes(boxes.centre_m, heading_rad, boxes.length_m, boxes.width_m),
        noise=np.broadcast_to(noise_m**2 * np.eye(2), (count, 2, 2)),
        elongation=boxes.length_m / boxes.width_m,
        owner=owner,
        divided=np.zeros(count, np.bool_),
        directed=is_owned,
        cut=np.zeros(count, np.int8),
        borders_m=np.full((count, 4), np.nan),
    )


def _owners(boxes: Boxes, known: Boxes) -> NDArray[np.intp]:
    """Give each predicted box the detection deepest inside it, if there is one."""
    owner = np.full(len(boxes), -1)
    if len(boxes) and len(known):
        inside_m = distance_to_boxes(boxes.centre_m, known)
        nearest = np.argmin(inside_m, axis=1)
        depth_m = inside_m[np.arange(len(boxes)), nearest]
        for place in np.argsort(depth_m)[::-1].tolist():  # the deepest comes last and stays
            if depth_m[place] < 0:
                owner[owner == nearest[place]] = -1
                owner[place] = nearest[place]
    return owner


if __name__ == "__main__":
    main()
