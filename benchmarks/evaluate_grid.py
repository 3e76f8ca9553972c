"""How good are recognised overtakes if the tracks are bad? Precision and recall over noise, gaps and swapped ids.

No pixels: the truth of the rural road is turned into tracks with known faults, and what comes after vision is run on
them. Run with ``python -m benchmarks.evaluate_grid [--seeds 1,2,3,4,5] [--seconds 60]``. Each figure pools the seeds.
"""

import argparse
import itertools
import tempfile
from collections.abc import Iterator, Sequence
from pathlib import Path

from benchmarks.pooled_scores import merge_evaluations
from benchmarks.recognised_tracks import score_recognition
from data_gen.outputs.track_scene import TrackScene, make_track_scene, write_scenario_tracks
from data_gen.outputs.trajectories import TrackFaults
from service.questions.scoring.evaluate import Evaluation
from service.questions.scoring.proportions import wilson_interval

SEEDS = (1, 2, 3, 4, 5)
SECONDS = 60
NOISE_M = (0.0, 0.3, 0.6)
GAP_S = (0.0, 1.0, 3.0)
SWAPS = (0.0, 0.2)
GAPS_PER_MINUTE = 3.0
RATE_HZ = 10
EVENT_TYPE = "overtake"


def main() -> None:
    """Print the grid."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", default=",".join(map(str, SEEDS)))
    parser.add_argument("--seconds", type=int, default=SECONDS)
    arguments = parser.parse_args()
    seeds = [int(seed) for seed in arguments.seeds.split(",")]
    with tempfile.TemporaryDirectory(prefix="grid_") as folder:
        scenes = [_scene(seed, arguments.seconds, Path(folder) / str(seed)) for seed in seeds]
        print(f"rural_overtaking, seeds {arguments.seeds}, {arguments.seconds} s each, {RATE_HZ} rows/s in view")
        print(f"gaps: {GAPS_PER_MINUTE:g} a minute of each vehicle, new id after each; swaps: share of encounters")
        print(f"{'noise':>7} {'gap':>5} {'swap':>5}  {'right':>5} {'wrong':>5} {'missed':>6}  precision  recall (95 %)")
        for noise_m, gap_s, swap, score in grid(scenes):
            print(f"{noise_m:5.1f} m {gap_s:3.0f} s {swap:5.1f}  {_line(score)}", flush=True)


def grid(scenes: Sequence[TrackScene]) -> Iterator[tuple[float, float, float, Evaluation]]:
    """Score every combination of faults: noise in metres, length of gaps in seconds, share of swaps."""
    for noise_m, gap_s, swap in itertools.product(NOISE_M, GAP_S, SWAPS):
        faults = TrackFaults(
            position_sigma_m=noise_m,
            gaps_per_minute=GAPS_PER_MINUTE if gap_s else 0.0,
            gap_us=round(gap_s * 1e6),
            swap_share=swap,
        )
        yield noise_m, gap_s, swap, merge_evaluations([_score(scene, faults) for scene in scenes])


def _scene(seed: int, seconds: int, folder: Path) -> TrackScene:
    return make_track_scene(
        "rural_overtaking", seed=seed, duration_us=seconds * 1_000_000, out_dir=folder, rate_hz=RATE_HZ, in_view=True
    )


def _score(scene: TrackScene, faults: TrackFaults) -> Evaluation:
    file = scene.folder / "tracks.csv"
    write_scenario_tracks(scene, file, faults)
    return score_recognition(scene, file, EVENT_TYPE)


def _line(score: Evaluation) -> str:
    right, wrong, missed = len(score.right), len(score.wrong), len(score.missed)
    low, high = wilson_interval(right, right + missed) if right + missed else (0.0, 1.0)
    precision = "-" if score.precision is None else f"{score.precision:.3f}"
    recall = "-" if score.recall is None else f"{score.recall:.3f}"
    return f"{right:5} {wrong:5} {missed:6}  {precision:>9}  {recall:>6} ({low:.3f} to {high:.3f})"


if __name__ == "__main__":
    main()
