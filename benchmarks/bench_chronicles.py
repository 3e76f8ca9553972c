"""How fast is recognition event by event, compared with pychronicles on the same events in the same run?

The pattern has four events A, B, C, D with B-A and C-B in [1, 5], D-C in [0.5, 4] and D-A in [3, 10] seconds. Streams
are Poisson with 20 kinds of events:

* few: 2 events/s; many: 10 events/s; none: 10 events/s without any D
* keyed: 200 events/s about 50 things, all four events about the same thing
* skew: 15 events/s of A, B, C only, one in a thousand is a D

Occurrences are built when they are looked at, so there are two figures: "counted" asks how many each event gives,
"built" looks at each of them. Latency is that of an event until all its occurrences are built.

pychronicles has no variables: for `keyed` it gets one sequence a thing. It reads a stored list and gives times, not
events; ours takes one event at a time. Ratios are to its events/s, without it (extra `bench`) they are left out.
Trust the ratios, not the absolute numbers.

    python -m benchmarks.bench_chronicles [--scale 0.1]
"""

from __future__ import annotations

import argparse
import gc
import importlib
import importlib.util
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from chronicles import ChronicleSet, Event, Recogniser, load

PATTERN = """
timeunit 1s
chronicle p4{params}(t1, t4) {{
  event(A{args}, t1) event(B{args}, t2) event(C{args}, t3) event(D{args}, t4)
  t2 - t1 in [1, 5]  t3 - t2 in [1, 5]  t4 - t3 in [0.5, 4]  t4 - t1 in [3, 10]
}}
"""
BOUNDS_S = {(0, 1): (1.0, 5.0), (1, 2): (1.0, 5.0), (2, 3): (0.5, 4.0), (0, 3): (3.0, 10.0)}
OTHERS = tuple(f"E{index}" for index in range(16))


@dataclass(frozen=True)
class Stream:
    """Events of one benchmark; `things` counts the values of the key, 0 for none."""

    name: str
    count: int
    rate_hz: float
    things: int = 0

    def events(self, scale: float) -> list[Event]:
        """Draw the events, in the order of time."""
        random = np.random.default_rng(1)
        count = max(1000, int(self.count * scale))
        times_us = (np.cumsum(random.exponential(1 / self.rate_hz, count)) * 1e6).astype(np.int64).tolist()
        names = self._names(random, count)
        if not self.things:
            return [Event(name, (), t_us) for name, t_us in zip(names, times_us, strict=True)]
        keys = random.integers(self.things, size=count).tolist()
        return [Event(name, (f"k{key}",), t_us) for name, key, t_us in zip(names, keys, times_us, strict=True)]

    def _names(self, random: np.random.Generator, count: int) -> list[str]:
        if self.name == "skew":
            picked = random.choice(np.array(["A", "B", "C"]), size=count)
            return [str(one) for one in np.where(random.random(count) < 0.001, "D", picked)]
        names = np.array(["A", "B", "C", "X" if self.name == "none" else "D", *OTHERS])
        return [str(one) for one in random.choice(names, size=count)]


STREAMS = (
    Stream("none", 100_000, 10),
    Stream("few", 100_000, 2),
    Stream("many", 50_000, 10),
    Stream("keyed", 100_000, 200, things=50),
    Stream("skew", 4_000, 15),
)


def chronicle_set(stream: Stream) -> ChronicleSet:
    """Load the pattern, with a variable for keyed streams."""
    variable = "[?k]" if stream.things else "[]"
    return load(PATTERN.format(params=variable, args=variable))


def ours(stream: Stream, events: Sequence[Event], *, build: bool) -> Callable[[], int]:
    """Make the run that recognises event by event and counts matches, or looks at each."""
    chronicles = chronicle_set(stream)

    def run() -> int:
        observe = Recogniser(chronicles).observe
        found = 0
        for event in events:
            occurrences = observe(event)
            if occurrences:
                found += len(list(occurrences)) if build else len(occurrences)
        return found

    return run


def peer(events: Sequence[Event]) -> Callable[[], int]:
    """Make the run of pychronicles; its sequences are made beforehand."""
    pychronicles = importlib.import_module("pychronicles")
    chronicle = pychronicles.Chronicle()
    for index, label in enumerate("ABCD"):
        chronicle.add_event(index, label)
    for (first, second), bounds in BOUNDS_S.items():
        chronicle.add_constraint(first, second, bounds)
    groups: dict[tuple[str, ...], list[Event]] = {}
    for event in events:
        groups.setdefault(event.args, []).append(event)
    sequences = [
        pychronicles.TimedSequence(
            np.array([event.t_us / 1e6 for event in group]), np.array([event.name for event in group], dtype=object)
        )
        for group in groups.values()
    ]
    return lambda: sum(len(chronicle.recognize(sequence)) for sequence in sequences)


def latencies_us(stream: Stream, events: Sequence[Event]) -> tuple[float, float, float]:
    """Measure single events; give the median, the 99th percentile and the maximum."""
    recogniser = Recogniser(chronicle_set(stream))
    spent = []
    for event in events:
        start = time.perf_counter_ns()
        list(recogniser.observe(event))
        spent.append(time.perf_counter_ns() - start)
    p50_ns, p99_ns = np.percentile(spent, (50, 99)).tolist()
    return p50_ns / 1000, p99_ns / 1000, max(spent) / 1000


def best_seconds(run: Callable[[], int]) -> tuple[float, int]:
    """Run three times; give the best time and the number of matches."""
    best, matches = float("inf"), 0
    for _ in range(3):
        gc.collect()
        start = time.perf_counter()
        matches = run()
        best = min(best, time.perf_counter() - start)
    return best, matches


def row(stream: Stream, scale: float, *, has_peer: bool) -> str:
    """Measure one stream."""
    events = stream.events(scale)
    counted_s, matches = best_seconds(ours(stream, events, build=False))
    built_s, _ = best_seconds(ours(stream, events, build=True))
    p50_us, p99_us, max_us = latencies_us(stream, events)
    written = (
        f"{stream.name:8}{len(events):11,}{matches:11,}{len(events) / counted_s:11,.0f}{len(events) / built_s:11,.0f}"
    )
    written += f"{p50_us:11.1f}{p99_us:11.1f}{max_us:11.0f}"
    if has_peer:
        peer_s, peer_matches = best_seconds(peer(events))
        same = "" if peer_matches == matches else f"  (peer found {peer_matches:,})"
        written += f"{len(events) / peer_s:11,.0f}{peer_s / counted_s:11.2f}{same}"
    return written


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--scale", type=float, default=1.0, help="share of the events to use")
    options = parser.parse_args()
    has_peer = importlib.util.find_spec("pychronicles") is not None
    heads = ("events", "matches", "counted/s", "built/s", "p50 us", "p99 us", "max us", "peer/s", "ratio")
    print(f"{'stream':8}" + "".join(f"{head:>11}" for head in (heads if has_peer else heads[:-2])))
    for stream in STREAMS:
        print(row(stream, options.scale, has_peer=has_peer), flush=True)
    if not has_peer:
        print("pychronicles is not installed: pip install 'dyknow[bench]' for the ratio")


if __name__ == "__main__":
    main()
