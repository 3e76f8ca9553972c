"""How long does a live run stop when its chronicles change, and what does it cost to watch all relations?

Tracks of a scene are processed as a live run. A second before its end another chronicle is looked for besides the
library, or the whole library is begun anew: the run stops while it looks again at all that it has seen. Without a
change, the processor time of the live run is compared with that of one that computes only the relations that the
library looks at.

    python -m benchmarks.bench_activation [--scene rural_overtaking] [--seconds 600] [--seed 5] [--repeats 3]
"""

from __future__ import annotations

import argparse
import statistics
import tempfile
import time
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from unittest.mock import patch

from benchmarks.whole_runs import process_whole
from chronicles.chronicle_set import ChronicleSet
from data_gen.outputs.track_scene import make_track_scene
from service.runs import activation
from service.runs.activation import Activation
from service.runs.processing import Progress
from service.runs.requests import RunRequest
from service.store.log import open_log
from service.store.registers.chronicle_texts import ChronicleTexts
from service.texts.chronicle_files import LoadedChronicles

NEAR = "chronicle near[?a, ?b](t1) { event(close[?a, ?b]:(?, true), t1) }\n"


def main(arguments: Sequence[str] | None = None) -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--scene", default="rural_overtaking")
    parser.add_argument("--seconds", type=int, default=600)
    parser.add_argument("--seed", type=int, default=5)
    parser.add_argument("--repeats", type=int, default=3, help="pairs of runs whose processor times are compared")
    options = parser.parse_args(arguments)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        make_track_scene(options.scene, seed=options.seed, duration_us=options.seconds * 1_000_000, out_dir=folder)
        request = RunRequest(folder / "truth.csv", folder / "site.toml", str(folder / "log.db"), is_live=True)
        process_whole(replace(request, log_url=str(folder / "first.db")))  # what is loaded once in a process
        ratios = [cpu_s(request) / cpu_s(replace(request, is_live=False)) for _ in range(options.repeats)]
        print(f"{options.scene}, {options.seconds} s, seed {options.seed}")
        print(f"all relations: {statistics.median(ratios):.2f} of the processor time with those of the library")
        print("one chronicle more: " + stopped(request, options.seconds))
        with patch.object(activation, "changed", _all_changed):
            print("all begun anew: " + stopped(request, options.seconds))


def cpu_s(request: RunRequest) -> float:
    """Process into a new log; give the processor time."""
    Path(request.log_url).unlink(missing_ok=True)
    began_s = time.process_time()
    process_whole(request)
    return time.process_time() - began_s


def stopped(request: RunRequest, seconds: int) -> str:
    """Tell for how long a run stops when a text is stored a second before its end."""
    Path(request.log_url).unlink(missing_ok=True)
    stops_s: list[float] = []

    def store(progress: Progress) -> None:
        if not stops_s and progress.media_us >= (seconds - 2) * 1_000_000:
            with open_log(request.log_url) as opened:
                texts = ChronicleTexts(opened)
                if not texts.current():
                    texts.put("near", NEAR, None)

    def take(self: Activation, chronicles: LoadedChronicles) -> None:
        began_s = time.perf_counter()
        plain(self, chronicles)
        stops_s.append(time.perf_counter() - began_s)

    plain = Activation.take
    with patch.object(Activation, "take", take), patch("service.runs.activation.LOOKED_EVERY_S", 0.0):
        process_whole(request, on_progress=store)
    with open_log(request.log_url) as log:
        changes = sum(1 for _ in log.relations(log.run().id))
    (stop_s,) = stops_s
    return f"stopped for {stop_s:.2f} s; {changes} changes of relations in the log"


def _all_changed(before: ChronicleSet, after: ChronicleSet) -> tuple[frozenset[str], frozenset[str]]:
    return frozenset(before.names), frozenset(after.names)


if __name__ == "__main__":
    main()
