"""What do many chronicles cost, and what do many instances weigh?

* sets: a stream of 60 kinds of events, 200 a second about 50 things. Each chronicle has four events about one thing,
  of kinds drawn at random, with bounds of its own between neighbours. 1, 10 and 100 of them see the same stream, after
  a fifth of it has gone by; the ratio is the median of five rounds.
* memory: a million things, each with one event of its own that is the first of four; the bound is so long that all
  instances stay. Events and keys are made on the fly and live on only if the recogniser keeps them. One process
  counts with `tracemalloc`, one that is not slowed by it reports its resident memory and the time of each event.

    python -m benchmarks.bench_instances [--scale 0.1]
"""

from __future__ import annotations

import argparse
import gc
import statistics
import subprocess
import sys
import time
import tracemalloc
from pathlib import Path

import numpy as np

from chronicles import ChronicleSet, Event, Recogniser, load

KINDS, THINGS, RATE_HZ = 60, 50, 200.0
COUNTS = (1, 10, 100)
ROUNDS = 5
HELD = """
chronicle held[?k](t1, t4) {
  event(A[?k], t1) event(B[?k], t2) event(C[?k], t3) event(D[?k], t4)
  t2 - t1 in [1s, 24h]  t3 - t2 in [1s, 24h]  t4 - t3 in [1s, 24h]
}
"""


def chronicle_text(count: int) -> str:
    """Write chronicles with four kinds of events each, drawn at random."""
    random = np.random.default_rng(1)
    texts = ["timeunit 1s"]
    for number in range(count):
        kinds = random.choice(KINDS, 4, replace=False)
        events = " ".join(f"event(E{kind}[?k], t{place})" for place, kind in enumerate(kinds, 1))
        lows, spans = random.uniform(0.5, 1, 3), random.uniform(2, 6, 3)
        gaps = " ".join(
            f"t{place + 2} - t{place + 1} in [{low:.2f}, {low + span:.2f}]"
            for place, (low, span) in enumerate(zip(lows, spans, strict=True))
        )
        texts.append(f"chronicle c{number}[?k](t1, t4) {{ {events} {gaps} }}")
    return "\n".join(texts)


def stream(count: int) -> list[Event]:
    """Draw the events of the sets."""
    random = np.random.default_rng(2)
    times_us = (np.cumsum(random.exponential(1 / RATE_HZ, count)) * 1e6).astype(np.int64).tolist()
    kinds, things = random.integers(KINDS, size=count).tolist(), random.integers(THINGS, size=count).tolist()
    return [Event(f"E{kind}", (f"k{thing}",), t_us) for kind, thing, t_us in zip(kinds, things, times_us, strict=True)]


def run_set(chronicles: ChronicleSet, events: list[Event]) -> tuple[float, int]:
    """Give the seconds an event of the last four fifths takes, and the number of matches."""
    observe = Recogniser(chronicles).observe
    begin = len(events) // 5
    found = sum(len(observe(event)) for event in events[:begin])
    gc.collect()
    start = time.perf_counter()
    for event in events[begin:]:
        found += len(observe(event))
    return (time.perf_counter() - start) / (len(events) - begin), found


def compare_sets(scale: float) -> None:
    """Print what sets of chronicles cost, as a ratio to ten of them."""
    events = stream(max(2000, int(100_000 * scale)))
    sets = {count: load(chronicle_text(count)) for count in COUNTS}
    spent: dict[int, list[float]] = {count: [] for count in COUNTS}
    matches = {}
    for _ in range(ROUNDS):
        for count, chronicles in sets.items():
            seconds, matches[count] = run_set(chronicles, events)
            spent[count].append(seconds)
    print(f"{'chronicles':>10}{'events':>11}{'matches':>11}{'us/event':>11}{'to ten':>11}")
    for count in COUNTS:
        ratio = statistics.median(one / ten for one, ten in zip(spent[count], spent[10], strict=True))
        us = statistics.median(spent[count]) * 1e6
        print(f"{count:>10}{len(events):>11,}{matches[count]:>11,}{us:>11.2f}{ratio:>11.2f}", flush=True)


def resident_bytes() -> int:
    """Read how much memory of this process is resident."""
    for line in Path("/proc/self/status").read_text(encoding="ascii").splitlines():
        if line.startswith("VmRSS:"):
            return int(line.split()[1]) * 1024
    raise OSError("/proc/self/status: expected a line VmRSS, got none")


def weigh(count: int, *, is_traced: bool) -> str:
    """Hold instances in a process of its own; tell bytes an instance, and latencies where nothing slows them."""
    recogniser = Recogniser(load(HELD))
    for thing in range(2000):  # what grows once, such as programs and pools of small objects, is there afterwards
        recogniser.observe(Event("A", (f"w{thing}",), thing))
    spent_ns = np.zeros(count, dtype=np.int64)
    if is_traced:
        tracemalloc.start()
    gc.collect()
    before = tracemalloc.get_traced_memory()[0] if is_traced else resident_bytes()
    for thing in range(count):
        event = Event("A", (f"k{thing}",), 10_000 + thing)
        start = time.perf_counter_ns()
        recogniser.observe(event)
        spent_ns[thing] = time.perf_counter_ns() - start
    after = tracemalloc.get_traced_memory()[0] if is_traced else resident_bytes()
    held = (after - before) / count
    if is_traced:
        return f"{'traced':>10}{count:>11,}{held:>11.0f}{after / 1e6 - before / 1e6:>11.0f}"
    p50, p99, longest = (float(np.percentile(spent_ns, share)) / 1000 for share in (50, 99, 100))
    return (
        f"{'resident':>10}{count:>11,}{held:>11.0f}{held * count / 1e6:>11.0f}{p50:>11.1f}{p99:>11.1f}{longest:>11.0f}"
    )


def compare_memory(scale: float) -> None:
    """Print what a held instance weighs, counted twice."""
    count = str(max(10_000, int(1_000_000 * scale)))
    print(f"{'memory':>10}{'instances':>11}{'bytes each':>11}{'MB':>11}{'p50 us':>11}{'p99 us':>11}{'max us':>11}")
    for way in ("traced", "resident"):
        command = [sys.executable, "-m", "benchmarks.bench_instances", "--weigh", way, "--instances", count]
        print(subprocess.run(command, check=True, capture_output=True, text=True).stdout, end="", flush=True)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--scale", type=float, default=1.0, help="share of the events and instances to use")
    parser.add_argument("--weigh", choices=("traced", "resident"), help=argparse.SUPPRESS)
    parser.add_argument("--instances", type=int, default=0, help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.weigh:
        print(weigh(arguments.instances, is_traced=arguments.weigh == "traced"))
        return
    compare_sets(arguments.scale)
    compare_memory(arguments.scale)


if __name__ == "__main__":
    main()
