"""How fast is the backfill, beside the live executor and pychronicles, in one run?

Pattern and streams are those of `bench_chronicles`. The live one takes one event at a time and counts what it is
told. The backfill gets stored columns of `--events` events (a tenth in `skew`, which has five matches an event) and is
timed twice: until the number of occurrences is known, and until every `Occurrence` was built and looked at. The peer
reads a stored list of the same events (the first 10,000 in `skew`). Ratios are events/s by the peer's events/s;
without pychronicles (extra `bench`) they are left out. Trust the ratios, not the absolute numbers.

    python -m benchmarks.bench_executors [--events 1000000] [--streams few skew]
"""

from __future__ import annotations

import argparse
import gc
import importlib.util
import time
from collections.abc import Callable, Sequence

from benchmarks.bench_chronicles import STREAMS, Stream, chronicle_set, peer
from chronicles import Event, Recogniser
from chronicles.execution.stored.backfill import recognise_columns
from chronicles.execution.stored.columns import EventColumns

HEADS = ("stream", "events", "matches", "eager", "backfill", "looked at", "peer", "backfill x")
_PEER_IN_SKEW = 10_000
_STREAMED = 100_000


def streaming(stream: Stream, events: Sequence[Event]) -> Callable[[], int]:
    """Make the run that observes event by event and counts occurrences."""
    chronicles = chronicle_set(stream)

    def run() -> int:
        observe = Recogniser(chronicles).observe
        return sum(len(found) for event in events if (found := observe(event)))

    return run


def stored(stream: Stream, columns: EventColumns, *, look: bool) -> Callable[[], int]:
    """Make the run that backfills columns, and maybe looks at every occurrence."""
    chronicles = chronicle_set(stream)

    def run() -> int:
        found = recognise_columns(chronicles, columns)
        return sum(1 for _ in found) if look else len(found)

    return run


def rate(run: Callable[[], int], events: int, times: int = 3) -> tuple[float, int]:
    """Give events/s of the best of some runs, and the number of matches."""
    best_s, matches = float("inf"), 0
    for _ in range(times):
        gc.collect()
        start_s = time.perf_counter()
        matches = run()
        best_s = min(best_s, time.perf_counter() - start_s)
    return events / best_s, matches


def row(stream: Stream, events: Sequence[Event], *, has_peer: bool) -> list[str]:
    """Measure one stream."""
    is_skewed = stream.name == "skew"
    columns = EventColumns.from_events(events)
    backfill, matches = rate(stored(stream, columns, look=False), len(events), times=5)
    looked_at, _ = rate(stored(stream, columns, look=True), len(events), times=1)
    part = events[:_STREAMED]
    # In `skew` the eager store makes thousands of instances for each event.
    few = part[:2000] if is_skewed else part
    eager, streamed = rate(streaming(stream, few), len(few), times=1 if is_skewed else 3)
    cells = [stream.name, f"{len(events):,}", f"{matches:,}"]
    cells += [f"{number / 1e6:.3f} M" for number in (eager, backfill, looked_at)]
    if len(few) == len(events) and streamed != matches:
        cells.append(f"eager found {streamed:,}")
    if has_peer:
        some = events[:_PEER_IN_SKEW] if is_skewed else events
        peer_rate, found = rate(peer(some), len(some), times=1)
        same = len(some) < len(events) or found == matches
        cells += [f"{peer_rate / 1e6:.3f} M", f"{backfill / peer_rate:.1f}"]
        cells += [] if same else [f"peer found {found:,}"]
    return cells


def main() -> None:
    """Measure the streams asked for."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--events", type=int, default=1_000_000, help="number of stored events")
    parser.add_argument("--streams", nargs="+", default=[one.name for one in STREAMS], help="which streams")
    options = parser.parse_args()
    has_peer = importlib.util.find_spec("pychronicles") is not None
    print("".join(f"{head:>12}" for head in HEADS) + "   (events/s)")
    for stream in STREAMS:
        if stream.name in options.streams:
            count = options.events // 10 if stream.name == "skew" else options.events
            cells = row(stream, stream.events(count / stream.count), has_peer=has_peer)
            print("".join(f"{cell:>12}" for cell in cells), flush=True)
    if not has_peer:
        print("pychronicles is not installed: pip install 'dyknow[bench]' for the ratios")


if __name__ == "__main__":
    main()
