"""What does a camera cost for a day? CPU seconds, bytes and memory for an hour of video of each kind, by stage.

Each scene (seed 1, 60 s) is processed several times, turn by turn with decoding alone, so that the ratio of both holds
on a busy machine; figures are medians. Time of the processor is scaled to an hour: *decode* by itself; *vision*,
*anchoring*, *relations*, *chronicles* as the streams measure them; *rest* is what is left of the whole, the sampling of
the road and the log above all. *x real time* is by the wall, with a process for vision where a core is free. All runs
of a scene go into one log, and *log MB* is by what it grows from run to run, without the record of the run, of which an
hour has but one.

``python -m benchmarks.bench_day [--only KIND ...] [--rate HZ] [--turns 3] [--folder FOLDER]``
"""

import argparse
import multiprocessing
import resource
import statistics
import tempfile
import time
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import msgspec

from benchmarks.evaluate_scenes import KINDS, made_scene
from benchmarks.whole_runs import process_whole
from service.cli.printing import format_table
from service.runs.processing import RunRequest
from service.store.log import open_log
from vision.video.frames import open_video

SECONDS, HOUR_S = 60, 3600
USUAL = ("rural", "rural 1080p", "rural uav", "motorway", "junction", "junction oblique")
STAGES = {"vision": "vision_objects", "anchoring": "cars", "relations": "relations", "chronicles": "occurrences"}
RATIOS = ("ms a frame", "x real time", "x decoding", "log MB", "RSS MB")
TITLES = ("scene", "decode", *STAGES, "rest", "all CPU s", *RATIOS)


@dataclass(frozen=True, slots=True)
class Cost:
    """What one run took: seconds of the processor by stage and in all, of the wall, and most memory in bytes."""

    stages_s: dict[str, float]
    cpu_s: float
    wall_s: float
    memory_bytes: int


def main(arguments: Sequence[str] | None = None) -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", nargs="+", choices=tuple(KINDS), default=USUAL)
    parser.add_argument("--rate", type=float, help="frames looked at in a second, inf for all; default: as usual")
    parser.add_argument("--turns", type=int, default=3)
    parser.add_argument("--folder", type=Path, help="keeps the scenes; default: they are made and thrown away")
    options = parser.parse_args(arguments)
    with tempfile.TemporaryDirectory(prefix="day_") as folder:
        rows = [_row(name, options, options.folder or Path(folder)) for name in options.only]
    print(format_table(TITLES, rows), end="")


def _row(name: str, options: argparse.Namespace, folder: Path) -> list[str]:
    scene = made_scene(KINDS[name], folder, seed=1, seconds=SECONDS)
    video, log = scene / "video.mp4", folder / "day.db"
    decoding, alone, together, sizes = [], [], [], []
    log.unlink(missing_ok=True)
    for _ in range(options.turns):
        decoding.append(_apart(_decode, video))
        for workers, costs in ((0, alone), (None, together)):
            own = {"rate_hz": options.rate, "workers": workers, "start_utc_us": len(sizes)}  # so each is another run
            request = RunRequest(video, scene / "site.toml", str(log), **own)
            costs.append(_apart(_process, request))
            sizes.append(log.stat().st_size)
    with open_log(str(log)) as opened:
        record_bytes = len(msgspec.json.encode(opened.runs()[-1]))
    growth_bytes = (sizes[-1] - sizes[0]) / (len(sizes) - 1)
    scale, frames = HOUR_S / SECONDS, SECONDS * open_video(video).rate_hz
    cpu_s, decode_s = (statistics.median(one.cpu_s for one in costs) for costs in (alone, decoding))
    stages_s = [statistics.median(one.stages_s[label] for one in alone) for label in STAGES.values()]
    wall_s = statistics.median(one.wall_s for one in together)
    figures = (decode_s, *stages_s, cpu_s - decode_s - sum(stages_s), cpu_s)
    return [
        name,
        *(f"{scale * one:.0f}" for one in figures),
        f"{1e3 * cpu_s / frames:.2f}",
        f"{SECONDS / wall_s:.1f}",
        f"{statistics.median(two.wall_s / one.wall_s for one, two in zip(decoding, together, strict=True)):.2f}",
        f"{scale * (growth_bytes - record_bytes) / 1e6:.1f}",
        f"{statistics.median(one.memory_bytes for one in alone) / 1e6:.0f}",
    ]


def _apart(work: Callable[[Any], Cost], what: object) -> Cost:
    """Do the work in a process of its own, so that memory and time are those of this work alone."""
    with ProcessPoolExecutor(1, mp_context=multiprocessing.get_context("spawn")) as pool:
        return pool.submit(work, what).result()


def _decode(video: Path) -> Cost:
    started_s, started_cpu_s = time.perf_counter(), time.process_time()
    for _ in open_video(video):
        pass
    return Cost({}, time.process_time() - started_cpu_s, time.perf_counter() - started_s, _memory_bytes())


def _process(request: RunRequest) -> Cost:
    started_s, started_cpu_s = time.perf_counter(), time.process_time()
    summary = process_whole(request)
    cpu_s, wall_s = time.process_time() - started_cpu_s, time.perf_counter() - started_s
    return Cost({one.label: one.busy_ns / 1e9 for one in summary.streams}, cpu_s, wall_s, _memory_bytes())


def _memory_bytes() -> int:
    return 1024 * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss


if __name__ == "__main__":
    main()
