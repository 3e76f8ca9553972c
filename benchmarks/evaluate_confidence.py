"""How often is an event right that is said to be so sure? The reliability table, and the curve that is fitted to it.

Events of tracks and of rendered scenes are pooled: ``python -m benchmarks.evaluate_confidence [--seeds 1 2 3 4 5]
[--seconds 60] [--only KIND ...] [--sigmas .2 .5 1 1.5] [--scenes FOLDER ...] [--fit]``. Tracks are as noisy as they say
(a column ``sigma_m``), and broken once a minute; ``--scenes`` adds folders that ``dyknow generate`` made. Border events
count as neither right nor wrong. The calibration error is the mean distance between what is said and what is true, over
bins of a tenth, weighted by their events. A second table says of each type what a floor of .98 keeps back. ``--fit``
prints the offset and the slope that would suit these events best.
"""

import argparse
import tempfile
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.optimize import minimize

from benchmarks.whole_runs import process_whole
from chronicles.execution.told.confidence import OFFSET_NATS, SLOPE
from data_gen.outputs.track_scene import make_track_scene, write_scenario_tracks
from data_gen.outputs.trajectories import TrackFaults
from data_gen.scenarios.catalogue import SCENARIOS
from data_gen.truth.event import ROLES
from service.questions.events.queries import EventFilter, decode_event, iterate_events
from service.questions.scoring.evaluate_log import evaluate_log_types
from service.runs.processing import RunRequest
from service.store.log import open_log

RATE_HZ, BINS = 10, 10
_LEAST = 1e-3  # as the curve takes it
FLOOR = 0.98  # that of the library's chronicles that blame somebody


@dataclass(frozen=True, slots=True)
class Judged:
    """Hold how sure an event was said to be, and whether it was right."""

    type: str
    source: str
    confidence: float
    is_right: bool


def main(arguments: Sequence[str] | None = None) -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, nargs="+", default=[1, 2, 3, 4, 5])
    parser.add_argument("--seconds", type=int, default=60)
    parser.add_argument("--only", nargs="*", choices=tuple(SCENARIOS), default=["rural_overtaking", "junction"])
    parser.add_argument("--sigmas", type=float, nargs="+", default=[0.2, 0.5, 1.0, 1.5])
    parser.add_argument("--scenes", type=Path, nargs="*", default=[])
    parser.add_argument("--fit", action="store_true", help="print the curve that suits these events best")
    options = parser.parse_args(arguments)
    judged: list[Judged] = []
    for seed in options.seeds:
        for scenario in options.only:
            judged += judge_tracks(scenario, seed, seconds=options.seconds, sigmas_m=options.sigmas)
            print(f"{scenario}, seed {seed}: {len(judged)} events so far", flush=True)
    for folder in options.scenes:
        judged += judge_scene(folder)
        print(f"{folder}: {len(judged)} events so far", flush=True)
    print("\n".join(table(judged)))
    if options.fit:
        offset, slope = fitted(judged)
        print(f"offset_nats {offset:.2f}, slope {slope:.2f}")


def judge_tracks(scenario: str, seed: int, *, seconds: int, sigmas_m: Sequence[float]) -> Iterator[Judged]:
    """Judge the events of one simulated scene, seen with several noises that the tracks tell of."""
    with tempfile.TemporaryDirectory(prefix="confidence_") as folder:
        path = Path(folder)
        scene = make_track_scene(
            scenario, seed=seed, duration_us=seconds * 1_000_000, out_dir=path, rate_hz=RATE_HZ, in_view=True
        )
        for sigma_m in sigmas_m:
            faults = TrackFaults(
                position_sigma_m=sigma_m,
                heading_sigma_rad=0.03,
                speed_sigma_mps=0.3,
                miss_share=0.02,
                gaps_per_minute=1.0,
                gap_us=1_000_000,
            )
            file = path / f"{sigma_m}.csv"
            write_scenario_tracks(scene, file, faults)
            lines = file.read_text(encoding="utf-8").splitlines()
            told = [f"{lines[0]},sigma_m", *(f"{line},{sigma_m}" for line in lines[1:])]
            file.write_text("\n".join(told) + "\n", encoding="utf-8")
            yield from _judge(file, path, f"{scenario} {sigma_m:g} m")


def judge_scene(folder: Path) -> Iterator[Judged]:
    """Judge the events of one rendered scene."""
    yield from _judge(folder / "video.mp4", folder, "rendered")


def _judge(file: Path, truth: Path, source: str) -> Iterator[Judged]:
    with tempfile.TemporaryDirectory(prefix="confidence_") as folder:
        log = str(Path(folder) / "a.db")
        process_whole(RunRequest(file, truth / "site.toml", log, min_confidence=0.0))
        with open_log(log) as opened:
            told = [decode_event(text) for text in iterate_events(opened, EventFilter())]
        sure = {one.id: one.confidence for one in told}
        types = tuple({one.type for one in told} & set(ROLES))
        for event_type, score in evaluate_log_types(log, truth, event_types=types).items():
            yield from (Judged(event_type, source, sure[one.recognised.id], True) for one in score.right)
            yield from (Judged(event_type, source, sure[one.id], False) for one in score.wrong)


def table(judged: Sequence[Judged]) -> Iterator[str]:
    """Write the reliability table in Markdown, and the calibration error."""
    said, right = _arrays(judged)
    bins = np.minimum((said * BINS).astype(int), BINS - 1)
    yield "| said | events | mean said | right |\n|---|---|---|---|"
    error = 0.0
    for one in np.unique(bins).tolist():
        mine = bins == one
        mean_said, share = said[mine].mean(), right[mine].mean()
        error += mine.mean() * abs(mean_said - share)
        yield f"| {one / BINS:.1f} to {(one + 1) / BINS:.1f} | {mine.sum()} | {mean_said:.3f} | {share:.3f} |"
    yield f"\n{len(judged)} events, {right.mean():.3f} right; calibration error {error:.3f}"
    for source in sorted({one.source for one in judged}):
        own_said, own_right = _arrays([one for one in judged if one.source == source])
        yield f"{source}: {len(own_said)} events, said {own_said.mean():.3f}, right {own_right.mean():.3f}"
    yield f"\n| event | told at {FLOOR} or more: right, wrong | below: right, wrong |\n|---|---|---|"
    for event_type in sorted({one.type for one in judged}):
        mine = Counter((one.confidence >= FLOOR, one.is_right) for one in judged if one.type == event_type)
        above, below = (f"{mine[told, True]}, {mine[told, False]}" for told in (True, False))
        yield f"| {event_type} | {above} | {below} |"


def fitted(judged: Sequence[Judged]) -> tuple[float, float]:
    """Fit offset and slope of the logistic curve over the log odds of what was said before it: maximum likelihood."""
    said, right = _arrays([one for one in judged if one.confidence < 1.0])
    odds = np.clip(said, _LEAST, 1.0 - _LEAST)
    before = (np.log(odds / (1.0 - odds)) - OFFSET_NATS) / SLOPE

    def loss(curve: np.ndarray) -> float:
        nats = curve[0] + curve[1] * before
        return float(np.logaddexp(0.0, np.where(right > 0, -nats, nats)).sum())

    offset, slope = minimize(loss, np.array([0.0, 1.0]), method="Nelder-Mead").x
    return float(offset), float(slope)


def _arrays(judged: Sequence[Judged]) -> tuple[np.ndarray, np.ndarray]:
    return np.array([one.confidence for one in judged]), np.array([float(one.is_right) for one in judged])


if __name__ == "__main__":
    main()
