"""How is a tracker, ours or somebody else's, run on made detections, and what does it cost?

A runner takes jobs, each a scene with settings, and gives back for each the rows of what the tracker saw and the
processor time it took. Peers do all their jobs in one process of their own environment, so a sweep starts it once.
"""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any, cast  # each setting has a type of its own

import numpy as np
from numpy.typing import NDArray

from anchoring.adapter import AnchoringUnit
from anchoring.anchorer import Anchorer
from benchmarks.tracked_traffic import DetectedTraffic
from dyknow.sample import Sample
from vision.detection.detector import Detections, Expected
from vision.detection.settings import DetectionSettings
from vision.objects import VisionObjects
from vision.road.boxes import Boxes, distance_to_boxes
from vision.settings import VisionSettings
from vision.tracking.settings import TrackingSettings
from vision.tracking.tracker import Tracker

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
Settings = Mapping[str, float | int]
Job = tuple[DetectedTraffic, Settings]
Shown = tuple[int, tuple[str, ...], FloatArray, NDArray[np.bool_]]

OURS, OURS_ANCHORED = "ours", "ours, with anchoring"
PEERS = ("norfair", "ByteTrack", "OC-SORT")


@dataclass(frozen=True, slots=True, eq=False)
class Followed:
    """Hold the rows that a tracker gave, ordered by frame, and the processor time it took."""

    frame: IntArray
    track: IntArray
    centre_m: FloatArray
    elapsed_s: float


Runner = Callable[[Sequence[Job]], list[Followed]]


def find_runners(peer_pythons: Sequence[Path]) -> dict[str, Runner]:
    """Find out which trackers can be run, and how.

    Parameters
    ----------
    peer_pythons : interpreters of environments that may hold peers; a peer that none holds is left out, and said so.
    """
    runners: dict[str, Runner] = {OURS: run_ours, OURS_ANCHORED: run_anchored}
    for peer in PEERS:
        python = next((one for one in peer_pythons if call_peer(one, peer).returncode == 0), None)
        if python is None:
            print(f"{peer}: in none of the environments of --peer-python, left out", file=sys.stderr)
        else:
            runners[peer] = PeerRunner(python, peer)
    return runners


def call_peer(python: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    """Run `peer_trackers.py` with an interpreter.

    Parameters
    ----------
    python : the interpreter. arguments : the peer, and a folder of jobs if it is to do some.
    """
    script = Path(__file__).with_name("peer_trackers.py")
    return subprocess.run([python, script, *arguments], capture_output=True, text=True, check=False)


@dataclass(frozen=True, slots=True)
class PeerRunner:
    """Run a peer in its own environment."""

    python: Path
    peer: str

    def __call__(self, jobs: Sequence[Job]) -> list[Followed]:
        """Hand over the detections as files, and read what comes back."""
        with tempfile.TemporaryDirectory() as name:
            folder = Path(name)
            self._write(jobs, folder)
            done = call_peer(self.python, self.peer, name)
            if done.returncode != 0:
                raise RuntimeError(f"{self.peer} with {len(jobs)} jobs: expected tracks, got {done.stderr[-500:]!r}")
            return [_read(folder / f"rows_{place}.npz") for place in range(len(jobs))]

    def _write(self, jobs: Sequence[Job], folder: Path) -> None:
        """Store every scene once, and the list of jobs."""
        scenes = {id(traffic): traffic for traffic, _ in jobs}
        places = {key: f"scene_{place}.npz" for place, key in enumerate(scenes)}
        for key, traffic in scenes.items():
            np.savez(folder / places[key], **{field.name: getattr(traffic, field.name) for field in fields(traffic)})
        listed = [{"scene": places[id(traffic)], "settings": dict(settings)} for traffic, settings in jobs]
        (folder / "jobs.json").write_text(json.dumps(listed))


def _read(path: Path) -> Followed:
    with np.load(path) as rows:
        frame, track = rows["frame"].astype(np.int64), rows["track"].astype(np.int64)
        return Followed(frame, track, rows["centre_m"], float(rows["elapsed_s"]))


def run_ours(jobs: Sequence[Job]) -> list[Followed]:
    """Let our tracker do jobs.

    Parameters
    ----------
    jobs : settings are fields of `TrackingSettings`, and the noise of detections; what is not named is as shipped.
    """
    return [
        _follow(traffic, settings, lambda objects: [(objects.t_us, objects.ids, objects.centre_m, objects.observed)])
        for traffic, settings in jobs
    ]


def run_anchored(jobs: Sequence[Job]) -> list[Followed]:
    """Let anchoring, without a road network, join what the tracker loses.

    Cars count where they are linked, as the log has them: from the first row of their vision objects on.

    Parameters
    ----------
    jobs : as for `run_ours`; anchoring is as shipped.
    """
    return [_follow(traffic, settings, _anchored(AnchoringUnit(Anchorer(None)))) for traffic, settings in jobs]


def _anchored(unit: AnchoringUnit) -> Callable[[VisionObjects], Iterable[Shown]]:
    def cars(objects: VisionObjects) -> Iterable[Shown]:
        for one in unit.update(Sample(objects.t_us, objects.t_us, objects)):
            for seen in (*one.value.former, one.value.cars):
                yield seen.t_us, seen.ids, seen.centre_m, seen.linked

    return cars


def _follow(traffic: DetectedTraffic, settings: Settings, show: Callable[[VisionObjects], Iterable[Shown]]) -> Followed:
    own = {name: value for name, value in settings.items() if name != "position_noise_m"}
    tracking = TrackingSettings(**cast(dict[str, Any], own))
    noise_m = float(settings.get("position_noise_m", DetectionSettings().position_noise_m))
    known = VisionSettings(detection=DetectionSettings(position_noise_m=noise_m), tracking=tracking)
    tracker = Tracker(known, lambda points_m: np.ones(len(points_m), np.bool_))
    bounds = np.searchsorted(traffic.found_frame, np.arange(traffic.frame_count + 1))
    numbers: dict[str, int] = {}
    rows: list[tuple[int, int, float, float]] = []
    start_s = time.process_time()
    frames = {frame * 1_000_000 // traffic.frames_per_s: frame for frame in range(traffic.frame_count)}
    for t_us, frame in frames.items():
        expected = tracker.predict(t_us)
        # What our detections claim of their noise is the setting, not the truth.
        found = _detections(traffic, slice(bounds[frame], bounds[frame + 1]), expected, noise_m)
        for then_us, ids, centre_m, is_seen in show(tracker.update(found)):
            for place in np.flatnonzero(is_seen).tolist():
                number = numbers.setdefault(ids[place], len(numbers))
                rows.append((frames[then_us], number, *centre_m[place].tolist()))
    elapsed_s = time.process_time() - start_s
    table = np.array(sorted(rows), np.float64).reshape(-1, 4)
    return Followed(table[:, 0].astype(np.int64), table[:, 1].astype(np.int64), table[:, 2:], elapsed_s)


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
