"""Which passes in a trajectory file are found as well where its cars are lost for a while? Gaps, with new ids after.

``python -m benchmarks.evaluate_gaps TRACKS.csv [--site SITE.toml] [--columns t_s=t,x_m=x,...] [--gaps 1 2 4]
[--seconds 120]`` runs the product on the file as it is, and again for each length of gaps, three a minute of a car in
the mean. What is told without gaps is taken for the truth: a pass is found if one of the same vehicles overlaps it,
give or take two seconds; the ids of the file tell which vehicle a track was on. *others* are told with gaps alone.
Whether cars are known again is counted besides, as by `benchmarks.evaluate_identity`.
"""

import argparse
import tempfile
from collections import defaultdict
from collections.abc import Mapping, Sequence
from importlib.resources import as_file, files
from pathlib import Path

import numpy as np

from benchmarks.compare_passes import Intervals, overlapping, recognised_passes
from benchmarks.kept_identity import count_returns, follow, idf1, revise
from benchmarks.lost_tracks import GAPS_PER_MINUTE
from benchmarks.pooled_scores import share_text
from benchmarks.whole_runs import process_whole
from data_gen.outputs.trajectories import NoisyTracks, TrackFaults, TrueRows, disturb, write_tracks
from service.cli.making.process import parse_columns
from service.runs.inputs.sites.site import load_site
from service.runs.inputs.trajectories import load_trajectories
from service.runs.processing import RunRequest
from service.store.log import open_log

TITLES = ("gap", "found", "of", "share", "others", "right", "wrong", "new", "share right", "share wrong", "IDF1")


def main(arguments: Sequence[str] | None = None) -> None:
    """Print the table."""
    options = _parse(arguments)
    truth = read_rows(options.tracks, options.columns, seconds=options.seconds)
    site = load_site(options.site) if options.site else None
    network, settings = (site.network, site.anchoring) if site else (None, None)
    step_us = int(np.diff(np.unique(truth.t_us)).min())
    known: Intervals | None = None
    for line in (TITLES, ("---",) * len(TITLES)):
        print(f"| {' | '.join(line)} |", flush=True)
    for gap_s in (0.0, *options.gaps):
        faults = TrackFaults(gaps_per_minute=GAPS_PER_MINUTE if gap_s else 0.0, gap_us=round(gap_s * 1e6))
        tracks = disturb(truth, faults, seed=options.seed)
        told = find_passes(tracks, options.site)
        known = told if known is None else known
        found, count, others = overlapping(known, told), _count(known), _count(told) - overlapping(told, known)
        named = follow(tracks, network, settings)
        returns = count_returns(named, step_us=step_us)
        cells = (
            *(f"{gap_s:g}", found, count, share_text(found, count), others, returns.right, returns.wrong, returns.new),
            *(share_text(returns.right, returns.count), share_text(returns.wrong, returns.count)),
            f"{idf1([(named, revise(named))]):.3f}",
        )
        print(f"| {' | '.join(str(cell) for cell in cells)} |", flush=True)


def _parse(arguments: Sequence[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("tracks", type=Path)
    parser.add_argument("--site", type=Path)
    parser.add_argument("--columns", type=parse_columns, help="as of `dyknow process`")
    parser.add_argument("--gaps", type=float, nargs="+", default=[1.0, 2.0, 4.0], help="seconds")
    parser.add_argument("--seconds", type=float, default=np.inf, help="only so much of the file")
    parser.add_argument("--seed", type=int, default=1)
    return parser.parse_args(arguments)


def read_rows(path: Path, columns: Mapping[str, str] | None, *, seconds: float = np.inf) -> TrueRows:
    """Read a trajectory file as if its ids were the vehicles."""
    read = load_trajectories(path, columns)
    kept = np.flatnonzero(read.t_us - read.t_us[0] < seconds * 1e6)
    return TrueRows(read.t_us[kept], tuple(read.ids[row] for row in kept.tolist()), read.values[kept])


def find_passes(tracks: NoisyTracks, site: Path | None) -> Intervals:
    """Run everything after vision with the chronicle of passes; list when each vehicle passed each other one."""
    with tempfile.TemporaryDirectory(prefix="gaps_") as name:
        file, log_url = Path(name, "tracks.csv"), str(Path(name, "tracks.db"))
        write_tracks(file, tracks)
        with as_file(files("chronicles.library") / "pass.chronicle") as chronicle:
            process_whole(RunRequest(input=file, site=site, log_url=log_url, chronicle_files=(chronicle,)))
        with open_log(log_url) as log:
            of_tracks = recognised_passes(log)
    vehicle_of = dict(zip(tracks.ids, tracks.rows.vehicles, strict=True))
    passes: Intervals = defaultdict(list)
    for (passer, passed), times in of_tracks.items():
        passes[vehicle_of[passer], vehicle_of[passed]] += times
    return passes


def _count(passes: Intervals) -> int:
    return sum(map(len, passes.values()))


if __name__ == "__main__":
    main()
