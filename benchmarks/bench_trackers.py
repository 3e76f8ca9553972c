"""How well, and how fast, does our tracker follow detections, beside trackers of other people?

``python -m benchmarks.bench_trackers --peer-python ENVIRONMENT/bin/python ...`` from the repository. All trackers get
the same made detections (`tracked_traffic.py`) at three difficulties; what they output in a frame counts only if they
have seen it there. Each is tried with the same number of settings on the same scenes. The best by mean IDF1 over all
scenes is scored beside the settings as shipped, and of peers also the best that keeps a lost track for no longer than
a second; all are timed turn by turn. ``--chosen`` takes what the sweep found on seeds 1 to 5 (`CHOSEN`) and does not
sweep: for seeds that nothing was tuned on. Peers that no given environment holds are left out, and said so; they do
not go together in one:

    python -m venv norfair && norfair/bin/pip install norfair
    python -m venv trackers && trackers/bin/pip install trackers
"""

from __future__ import annotations

import argparse
import itertools
import json
import statistics
import sys
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

import numpy as np

from benchmarks.tracked_traffic import DIFFICULTIES, DetectedTraffic, make_traffic
from benchmarks.tracker_runners import (
    OURS,
    OURS_ANCHORED,
    PEERS,
    FloatArray,
    Followed,
    IntArray,
    Runner,
    Settings,
    find_runners,
)
from service.questions.scoring.pairs import ground_pairs
from service.questions.scoring.tracks import TrackRows, TrackScore, score_tracks

Turn = tuple[DetectedTraffic, Followed]
Titled = Mapping[str, Settings]

REACH_M = 4.0
SHIPPED, BEST, BEST_SHORT = "as shipped", "best", "best that waits 1 s"
# The two peers of one package match by overlap, have the same parameters, and came out best with the same values.
OVERLAP_SWEEP: Mapping[str, Sequence[float | int]] = {
    "lost_track_buffer": (30, 90),
    "buffer_ratio": (0.5, 1.0),
    "minimum_iou_threshold": (0.1, 0.2),
    "minimum_consecutive_frames": (2, 3),
}
OVERLAP_CHOSEN: Titled = {
    BEST: {
        "lost_track_buffer": 90,
        "buffer_ratio": 1.0,
        "minimum_iou_threshold": 0.1,
        "minimum_consecutive_frames": 2,
    },
    BEST_SHORT: {
        "lost_track_buffer": 30,
        "buffer_ratio": 1.0,
        "minimum_iou_threshold": 0.2,
        "minimum_consecutive_frames": 2,
    },
}
# Two values of four parameters each, where a first look (seed 1) at wider ranges found the best.
SWEEPS: Mapping[str, Mapping[str, Sequence[float | int]]] = {
    OURS: {
        "position_noise_m": (0.3, 0.5),
        "acceleration_along_mps2": (1.5, 3.0),
        "acceleration_across_mps2": (0.5, 1.0),
        "confirm_hits": (3, 4),
    },
    "norfair": {"distance_m": (6.0, 8.0), "keep_s": (1.0, 3.0), "confirm_s": (0.04, 0.12), "noise": (1.0, 4.0)},
    "ByteTrack": OVERLAP_SWEEP,
    "OC-SORT": OVERLAP_SWEEP,
}
# How peers are told to keep a lost track for one second, as ours does for all but driving vehicles of known size.
SHORT: Mapping[str, tuple[str, float | int]] = {
    "norfair": ("keep_s", 1.0),
    "ByteTrack": ("lost_track_buffer", 30),
    "OC-SORT": ("lost_track_buffer", 30),
}
# What the sweep on seeds 1 to 5 printed.
CHOSEN: Mapping[str, Titled] = {
    OURS: {
        BEST: {
            "position_noise_m": 0.5,
            "acceleration_along_mps2": 3.0,
            "acceleration_across_mps2": 0.5,
            "confirm_hits": 3,
        },
    },
    "norfair": {
        BEST: {"distance_m": 6.0, "keep_s": 3.0, "confirm_s": 0.04, "noise": 1.0},
        BEST_SHORT: {"distance_m": 6.0, "keep_s": 1.0, "confirm_s": 0.04, "noise": 1.0},
    },
    "ByteTrack": OVERLAP_CHOSEN,
    "OC-SORT": OVERLAP_CHOSEN,
}


def main(arguments: Sequence[str] | None = None) -> None:
    options = _parse(arguments)
    runners = find_runners(options.peer_python)
    names = [name for name in (OURS, *PEERS) if name in runners and name in (options.only or runners)]
    scenes = {
        difficulty: [make_traffic(one, seed=seed, seconds=options.seconds) for seed in options.seeds]
        for difficulty, one in DIFFICULTIES.items()
    }
    chosen = CHOSEN if options.chosen else {name: _sweep(name, runners[name], scenes) for name in names}
    print(f"seeds {' '.join(map(str, options.seeds))}, {options.seconds} s each, all with each tracker\n")
    for name in names:
        print(f"{name}: {json.dumps(chosen[name])}")
    print("\n| detections | tracker | IDF1 | HOTA | identity switches | ms a frame | as many times ours as shipped |")
    print("|---|---|---|---|---|---|---|")
    contestants = {name: {SHIPPED: {}, **chosen[name]} for name in names}
    if OURS in contestants:
        contestants[OURS_ANCHORED] = contestants[OURS]
    for difficulty, traffic in scenes.items():
        for line in _lines(traffic, contestants, runners):
            print(f"| {difficulty} | {line} |", flush=True)


def _parse(arguments: Sequence[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, nargs="+", default=[1, 2, 3, 4, 5])
    parser.add_argument("--seconds", type=int, default=8)
    parser.add_argument("--peer-python", type=Path, nargs="*", default=[], help="environments that hold peers")
    parser.add_argument("--only", nargs="+", choices=(OURS, *PEERS), help="some of the trackers; default: all")
    parser.add_argument("--chosen", action="store_true", help="take the settings found on seeds 1 to 5, do not sweep")
    return parser.parse_args(arguments)


def _sweep(name: str, run: Runner, scenes: Mapping[str, Sequence[DetectedTraffic]]) -> dict[str, Settings]:
    """Try all settings of a tracker on all scenes, and find the best; what each gave goes to the error stream."""
    sweep = SWEEPS[name]
    candidates = [dict(zip(sweep, values, strict=True)) for values in itertools.product(*sweep.values())]
    traffic = [one for group in scenes.values() for one in group]
    followed = iter(run([(one, candidate) for candidate in candidates for one in traffic]))
    tried: list[tuple[float, Settings]] = []
    for candidate in candidates:
        # The mean of the scenes' figures: frames at 5 fps are few, and would count for little in a pooled one.
        idf1 = float(np.mean([score([(one, next(followed))]).idf1 for one in traffic]))
        print(f"{name}: {json.dumps(candidate)} mean IDF1 {idf1:.4f}", file=sys.stderr, flush=True)
        tried.append((idf1, candidate))
    best = {BEST: max(tried, key=lambda one: one[0])[1]}
    if name in SHORT:
        key, value = SHORT[name]
        best[BEST_SHORT] = max((one for one in tried if one[1][key] == value), key=lambda one: one[0])[1]
    return best


def _lines(
    traffic: Sequence[DetectedTraffic], contestants: Mapping[str, Titled], runners: Mapping[str, Runner]
) -> Iterator[str]:
    """Run everybody on every scene in turn, and give the rows of the table; speed is compared with the first."""
    turns: dict[tuple[str, str], list[Turn]] = {}
    for one in traffic:
        for name, titled in contestants.items():
            rows = runners[name]([(one, settings) for settings in titled.values()])
            for title, followed in zip(titled, rows, strict=True):
                turns.setdefault((name, title), []).append((one, followed))
    first_ms = frame_ms(next(iter(turns.values())))
    for (name, title), mine in turns.items():
        found, own_ms = score(mine), frame_ms(mine)
        figures = f"{found.idf1:.3f} | {found.hota:.3f} | {found.id_switches}"
        yield f"{name}, {title} | {figures} | {own_ms:.2f} | {own_ms / first_ms:.1f}"


def frame_ms(turns: Sequence[Turn]) -> float:
    """Take the median over scenes of the processor time a frame, in milliseconds."""
    return statistics.median(followed.elapsed_s / traffic.frame_count * 1000 for traffic, followed in turns)


def score(turns: Sequence[Turn]) -> TrackScore:
    """Score the scenes as one long one."""
    first_frame, first_track = 0, 0
    parts: dict[str, list[tuple[IntArray, IntArray, FloatArray]]] = {"true": [], "found": []}
    for traffic, followed in turns:
        parts["true"].append((traffic.true_frame + first_frame, traffic.true_car + first_track, traffic.true_m))
        parts["found"].append((followed.frame + first_frame, followed.track + first_track, followed.centre_m))
        first_frame += traffic.frame_count
        first_track += 1_000_000
    sides = [[np.concatenate(column) for column in zip(*parts[side], strict=True)] for side in ("true", "found")]
    (true_frame, true_track, true_m), (frame, track, centre_m) = sides
    pairs = ground_pairs(true_frame, true_m, frame, centre_m, reach_m=REACH_M)
    return score_tracks(TrackRows(true_frame, _numbered(true_track)), TrackRows(frame, _numbered(track)), pairs)


def _numbered(track: IntArray) -> IntArray:
    return np.unique(track, return_inverse=True)[1].astype(np.int64)


if __name__ == "__main__":
    main()
