"""Does a run that never ends need ever more memory? RSS by minute of media time.

A minute of traffic is repeated, each time with other names, so cars come and go for as long as wanted. `python -m
benchmarks.bench_memory 20` says for how many minutes; a video and its site file may follow, which are processed as they
are. With ``--lost`` tracks are lost and mixed up, so links are made and refuted all the time.
"""

import argparse
import csv
import os
import tempfile
from collections.abc import Sequence
from pathlib import Path

from benchmarks.whole_runs import process_whole
from service.cli.app import run
from service.runs.processing import Progress, RunRequest

MINUTES = 20
MINUTE_US = 60_000_000
LOST = ("--gap", "4:2", "--swap", "0.2", "--miss", "0.1", "--position-noise-m", "0.3")
SETTLED_MINUTES = 6  # events are placed by where cars were in the last five and a half minutes


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("minutes", type=int, nargs="?", default=MINUTES)
    parser.add_argument("video", type=Path, nargs="*", help="a video and its site file")
    parser.add_argument("--scenario", default="motorway")
    parser.add_argument("--lost", action="store_true", help="lose tracks and mix them up")
    args = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        source, site = args.video or _looped(Path(folder), args.minutes, args.scenario, LOST if args.lost else ())
        table = _Table()
        process_whole(RunRequest(source, site, f"{folder}/log.db"), on_progress=table.show)
    table.report()


def _looped(folder: Path, minutes: int, scenario: str, faults: Sequence[str]) -> tuple[Path, Path]:
    minute, looped = folder / "minute.csv", folder / "looped.csv"
    run(["trajectories", scenario, "--out", str(minute), "--seed", "3", "--seconds", "60", *faults])
    with minute.open(newline="") as file:
        header, *rows = csv.reader(file)
    at_t, at_id = header.index("t_us"), header.index("id")
    with looped.open("w", newline="") as file:
        out = csv.writer(file)
        out.writerow(header)
        for loop in range(minutes):
            for row in rows:
                now = row.copy()
                now[at_t], now[at_id] = str(int(row[at_t]) + loop * MINUTE_US), f"{loop}:{row[at_id]}"
                out.writerow(now)
    return looped, folder / "site.toml"


class _Table:
    """Prints and keeps the memory in use at each full minute."""

    def __init__(self) -> None:
        self._rss_mb: list[float] = []

    def show(self, progress: Progress) -> None:
        """Note the memory, if another minute is over."""
        if progress.media_us >= len(self._rss_mb) * MINUTE_US:
            pages = int(Path("/proc/self/statm").read_text().split()[1])
            self._rss_mb.append(pages * os.sysconf("SC_PAGE_SIZE") / 1e6)
            print(f"{len(self._rss_mb) - 1:3d} min  {self._rss_mb[-1]:7.1f} MB  {progress.events} events", flush=True)

    def report(self) -> None:
        """Print how much was added per minute at first and in the end."""
        if len(self._rss_mb) > 2 * SETTLED_MINUTES:
            early, late = self._rss_mb[SETTLED_MINUTES], self._rss_mb[-1]
            print(f"since minute {SETTLED_MINUTES}: {late - early:+.1f} MB, {late / early:.2f} x")


if __name__ == "__main__":
    main()
