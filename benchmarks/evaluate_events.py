"""How well is every type of event recognised on every kind of scene, if tracks are exact, noisy, or broken as well?

No pixels: traffic is simulated, its truth is turned into tracks as a tracker would make them, and everything after
vision runs on them. Run with ``python -m benchmarks.evaluate_events [--seeds 1 2 3] [--seconds 120]
[--only KIND ...] [--types TYPE ...] [--tracks NAME ...] [--failures]``. A row pools the seeds of one kind and type;
rows without truth and without finds are left out. ``!`` marks a share below 0.95. ``--failures`` lists what is wrong
and what is missed.
"""

import argparse
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from types import MappingProxyType

from benchmarks.pooled_scores import merge_evaluations
from benchmarks.whole_runs import process_whole
from data_gen.outputs.track_scene import TrackScene, make_track_scene, write_scenario_tracks
from data_gen.outputs.trajectories import TrackFaults
from data_gen.scenarios.catalogue import SCENARIOS
from data_gen.truth.event import ROLES
from service.questions.scoring.evaluate import Evaluation
from service.questions.scoring.evaluate_log import evaluate_log_types
from service.questions.scoring.proportions import wilson_interval
from service.runs.processing import RunRequest

RATE_HZ = 10
LOW_SHARE = 0.95
_NOISE = TrackFaults(position_sigma_m=0.2, heading_sigma_rad=0.03, speed_sigma_mps=0.3, miss_share=0.02)
TRACKS: Mapping[str, TrackFaults] = MappingProxyType(
    {
        "exact": TrackFaults(),
        "noisy": _NOISE,
        "broken": replace(_NOISE, gaps_per_minute=0.5, gap_us=1_000_000),
    }
)
"""Tracks by name: without fault; with noise of about what vision leaves from straight above; with the same noise and a
gap of 1 s every two minutes, after which the tracker gives another name."""


@dataclass(frozen=True, slots=True)
class Row:
    """Hold the score of one type on one kind of scene with one kind of tracks."""

    scenario: str
    tracks: str
    score: Evaluation


def main(arguments: Sequence[str] | None = None) -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, nargs="+", default=[1, 2, 3])
    parser.add_argument("--seconds", type=int, default=120)
    parser.add_argument("--only", nargs="+", choices=tuple(SCENARIOS), default=tuple(SCENARIOS))
    parser.add_argument("--tracks", nargs="+", choices=tuple(TRACKS), default=tuple(TRACKS))
    parser.add_argument("--types", nargs="+", choices=tuple(ROLES), default=tuple(ROLES))
    parser.add_argument("--failures", action="store_true", help="list every wrong and missed event")
    options = parser.parse_args(arguments)
    print("| scenario | tracks | event | right | wrong | missed | border | precision | recall |")
    print("|---|---|---|---|---|---|---|---|---|")
    for scenario in options.only:
        rows = score_scenario(
            scenario, seeds=options.seeds, seconds=options.seconds, types=options.types, tracks=options.tracks
        )
        for row in rows:
            print(row_text(row), flush=True)
            if options.failures:
                print("".join(f"    {line}\n" for line in failures(row.score)), end="", flush=True)


def score_scenario(
    scenario: str, *, seeds: Sequence[int], seconds: int, types: Sequence[str], tracks: Sequence[str]
) -> Iterator[Row]:
    """Score every type on every kind of tracks of one scenario, in the camera's view.

    Parameters
    ----------
    scenario : a name of the catalogue.
    seeds : of the scenes, whose events are pooled.
    seconds : length of each.
    types : of events.
    tracks : names out of `TRACKS`.

    Yields
    ------
    Rows with something to tell, by type and tracks.
    """
    scores: dict[tuple[str, str], list[Evaluation]] = {}
    for seed in seeds:
        with tempfile.TemporaryDirectory(prefix="events_") as folder:
            duration_us, path = seconds * 1_000_000, Path(folder)
            scene = make_track_scene(
                scenario, seed=seed, duration_us=duration_us, out_dir=path, rate_hz=RATE_HZ, in_view=True
            )
            for kind in tracks:
                for event_type, score in _score(scene, kind, types).items():
                    scores.setdefault((event_type, kind), []).append(score)
    for event_type in types:
        for kind in tracks:
            pooled = merge_evaluations(scores[event_type, kind])
            if pooled.right or pooled.wrong or pooled.missed:
                yield Row(scenario, kind, pooled)


def _score(scene: TrackScene, tracks: str, types: Sequence[str]) -> dict[str, Evaluation]:
    file, log = scene.folder / f"{tracks}.csv", scene.folder / f"{tracks}.db"
    write_scenario_tracks(scene, file, TRACKS[tracks])
    process_whole(RunRequest(input=file, site=scene.folder / "site.toml", log_url=str(log)))
    return evaluate_log_types(str(log), scene.folder, event_types=types)


def row_text(row: Row) -> str:
    """Write one row of the Markdown table."""
    score = row.score
    right, wrong, missed = len(score.right), len(score.wrong), len(score.missed)
    cells = (
        *(row.scenario, row.tracks, score.type),
        *(str(count) for count in (right, wrong, missed, len(score.border))),
        _share(right, right + wrong),
        _share(right, right + missed),
    )
    return f"| {' | '.join(cells)} |"


def _share(part: int, whole: int) -> str:
    if not whole:
        return "-"
    low, high = wilson_interval(part, whole)
    return f"{part / whole:.3f}{'!' if part / whole < LOW_SHARE else ''} [{low:.3f} to {high:.3f}]"


def failures(score: Evaluation) -> Iterator[str]:
    """Describe every wrong and every missed event of a score."""
    for kind, events in (("wrong", score.wrong), ("missed", score.missed)):
        for event in events:
            roles = ", ".join(f"{role}={vehicle}" for role, vehicle in event.roles.items())
            yield f"{kind} {event.type}[{roles}] {event.start_us / 1e6:.2f} s to {event.end_us / 1e6:.2f} s"


if __name__ == "__main__":
    main()
