"""What do hypotheses cost recognition, when cars get lost and found all the time?

Noisy tracks of `urban_grid` with gaps and exchanged names go through anchoring and relations once. What these tell,
frame by frame, is then recognised several times over, and only the processor time of that counts. As it was told, with
final answers only and with early ones, revised as `dyknow process` does or at once; with the same hypotheses, none of
which is refuted; and without any, where changes of the time in which a car was hidden come too late.

    python -m benchmarks.bench_revision [--seconds 90] [--seed 5] [--repeats 1]
"""

from __future__ import annotations

import argparse
import json
import tempfile
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from chronicles.adapter import RecognitionUnit
from chronicles.recogniser import Recogniser
from data_gen.outputs.track_scene import make_track_scene, write_scenario_tracks
from data_gen.outputs.trajectories import TrackFaults
from dyknow.sample import Sample
from qsr.adapter import FrameRelations
from qsr.settings import RelationSettings
from service.runs.graph.pipeline import RELATIONS, declared_pipeline
from service.runs.inputs.input_kind import Asked
from service.runs.inputs.opening import open_input
from service.runs.inputs.sites.site import load_site
from service.texts.chronicle_files import load_chronicle_files

FAULTS = TrackFaults(position_sigma_m=1.0, miss_share=0.2, gaps_per_minute=8, gap_us=2_000_000, swap_share=1.0)
CHRONICLES = load_chronicle_files(()).merged
LATENESS_US = RelationSettings().backdate_us
Frames = list[Sample[FrameRelations]]


@dataclass(frozen=True, slots=True)
class Cost:
    """Hold what recognition took and told; sizes of the checkpoint after each third."""

    cpu_s: float
    occurrences: int
    tentative: int
    retracted: int
    late: int
    sizes: tuple[int, ...]


def main(arguments: Sequence[str] | None = None) -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seconds", type=int, default=90)
    parser.add_argument("--seed", type=int, default=5)
    parser.add_argument("--repeats", type=int, default=1, help="the least of so many counts")
    options = parser.parse_args(arguments)
    with tempfile.TemporaryDirectory() as folder:
        told = record(Path(folder), seed=options.seed, seconds=options.seconds)
    changes = sum(len(one.value.changes) for one in told)
    refuted = sum(len(one.value.hypotheses.refuted) for one in told)
    labelled = sum(bool(one.value.hypotheses_of(change)) for one in told for change in one.value.changes)
    print(f"{len(told)} frames, {changes} changes, {labelled} of them with hypotheses, {refuted} refuted")
    believed, plain = [_believed(one) for one in told], [_plain(one) for one in told]
    cases = {
        "no hypotheses": (plain, {}),
        "none refuted, final": (believed, {"early": False}),
        "none refuted, early": (believed, {"patience_us": LATENESS_US // 2}),
        "as told, final": (told, {"early": False}),
        "as told, early": (told, {"patience_us": LATENESS_US // 2}),
        "as told, early, at once": (told, {}),
    }
    recognise(plain[:1])  # what is written once in a process
    base_s = 0.0
    print(
        f"{'':24}{'CPU s':>8}{'ratio':>7}{'told':>7}{'tentative':>10}{'retracted':>10}{'late':>6}  kB after each third"
    )
    for name, (frames, settings) in cases.items():
        costs = [recognise(frames, **settings) for _ in range(options.repeats)]
        cost = min(costs, key=lambda one: one.cpu_s)
        base_s = base_s or cost.cpu_s
        figures = f"{cost.cpu_s:8.2f}{cost.cpu_s / base_s:7.2f}{cost.occurrences:7}{cost.tentative:10}"
        sizes = " ".join(str(size // 1000) for size in cost.sizes)
        print(f"{name:24}{figures}{cost.retracted:10}{cost.late:6}  {sizes}", flush=True)


def record(folder: Path, *, seed: int, seconds: int) -> Frames:
    """Give what anchoring and relations tell of the tracks, frame by frame."""
    scene = make_track_scene("urban_grid", seed=seed, duration_us=seconds * 1_000_000, out_dir=folder)
    write_scenario_tracks(scene, folder / "tracks.csv", FAULTS)
    source = open_input(Asked(folder / "tracks.csv", load_site(folder / "site.toml")))
    pipeline = declared_pipeline(source.feed(), source.network, CHRONICLES, clock=time.perf_counter_ns)
    relations = pipeline.stream("recorded_relations", RELATIONS)
    assert relations is not None
    told: Frames = []
    relations.subscribe(told.append)
    # What the chronicles would make of it is thrown away here.
    for sample in pipeline.feed.samples:
        for _ in pipeline.publish_in_steps(sample):
            pass
    return told


def recognise(frames: Frames, *, early: bool = True, patience_us: int = 0) -> Cost:
    """Run recognition alone."""
    recogniser = Recogniser(CHRONICLES, LATENESS_US, early=early, patience_us=patience_us)
    unit = RecognitionUnit(recogniser, horizon_us=LATENESS_US)
    statuses: list[str] = []
    cpu_s, sizes = 0.0, []
    third = max(1, len(frames) // 3)
    for start in range(0, len(frames), third):
        began_s = time.process_time()
        for frame in frames[start : start + third]:
            statuses += [one.value.status for one in unit.update(frame)]
        cpu_s += time.process_time() - began_s
        sizes.append(len(json.dumps(recogniser.checkpoint())))
    began_s = time.process_time()
    statuses += [one.value.status for one in unit.finish()]
    cpu_s += time.process_time() - began_s
    counts = statuses.count("tentative"), statuses.count("retracted")
    return Cost(cpu_s, len(statuses), *counts, recogniser.late_count, tuple(sizes))


def _believed(frame: Sample[FrameRelations]) -> Sample[FrameRelations]:
    """Take for true what turns out wrong."""
    known = frame.value.hypotheses
    believed = replace(known, validated=known.validated + known.refuted, refuted=())
    return replace(frame, value=replace(frame.value, hypotheses=believed))


def _plain(frame: Sample[FrameRelations]) -> Sample[FrameRelations]:
    """Leave out all hypotheses."""
    changes = tuple(replace(one, absent=()) for one in frame.value.changes)
    return replace(frame, value=FrameRelations(changes))


if __name__ == "__main__":
    main()
