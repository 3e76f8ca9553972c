"""What does the middleware cost: samples a second for each hop, delay for each hop, policies, synchronised states?

Payloads are small and consumers only count, so the figures are the cost of `dyknow` alone. Every line also checks that
nothing was lost.

Run from the root of the repository: ``python -m benchmarks.bench_dyknow``
"""

import gc
import time
from collections.abc import Callable, Iterable, Sequence
from itertools import count
from typing import Any

import numpy as np

from dyknow.node import Node
from dyknow.policies.policy import AnyChange, Approximation, Order, Policy, SampleEvery
from dyknow.policies.synchroniser import Synchroniser
from dyknow.sample import Sample
from dyknow.streams.stream import StreamGenerator

PERIOD_US = 1_000
REPETITIONS = 5


class PassOn:
    """Answer each sample with itself."""

    def update(self, sample: Sample[int]) -> Iterable[Sample[int]]:
        """Give it back."""
        return (sample,)

    def finish(self) -> Iterable[Sample[int]]:
        """Hold nothing."""
        return ()


class Counting:
    """Count samples."""

    def __init__(self) -> None:
        self.count = 0

    def __call__(self, sample: Sample[Any]) -> None:
        """Count one."""
        self.count += 1


def samples_at(period_us: int, number: int) -> list[Sample[int]]:
    return [Sample(k * period_us, k * period_us, k // 4) for k in range(number)]


def best_s(work: Callable[[], object]) -> float:
    """Time the quickest of a few runs: other work on the machine only ever adds."""
    gc.collect()
    gc.disable()
    try:
        return min(timed_s(work) for _ in range(REPETITIONS))
    finally:
        gc.enable()


def timed_s(work: Callable[[], object]) -> float:
    start_s = time.process_time()
    work()
    return time.process_time() - start_s


def publish_all(source: StreamGenerator, samples: Sequence[Sample[int]]) -> None:
    for sample in samples:
        source.publish(sample)


def chain(hops: int, end: Callable[[Sample[Any]], None]) -> tuple[Node, StreamGenerator]:
    """Build a source and so many refinements behind each other."""
    node = Node(time.perf_counter_ns)
    source = node.add_source("hop0")
    for hop in range(hops):
        node.add_refinement(f"hop{hop + 1}", PassOn(), of=f"hop{hop}")
    node.subscribe(f"hop{hops}", end)
    return node, source


def print_chains(number: int = 40_000) -> None:
    print(f"{'hops':>5} {'samples/s per hop':>18} {'delay per hop: p50':>19} {'p95':>8} lost")
    samples = samples_at(PERIOD_US, number)
    for hops in (1, 2, 5, 10, 20):
        end = Counting()
        _, source = chain(hops, end)
        rate = number * hops / best_s(lambda: publish_all(source, samples))  # noqa: B023 - called at once
        p50_us, p95_us = np.percentile(delays_us(hops, samples[:20_000]), (50, 95)) / hops
        lost = number * REPETITIONS - end.count
        print(f"{hops:5d} {rate:18,.0f} {p50_us:16.2f} us {p95_us:5.2f} us {lost:4d}")


def print_long_chain(hops: int = 5_000, number: int = 20) -> None:
    """Show a chain that nested calls would not get through."""
    end = Counting()
    _, source = chain(hops, end)
    samples = samples_at(PERIOD_US, number)
    rate = number * hops / best_s(lambda: publish_all(source, samples))
    print(f"{hops:5d} {rate:18,.0f} {'':19} {'':8} {number * REPETITIONS - end.count:4d}")


def delays_us(hops: int, samples: Sequence[Sample[int]]) -> list[float]:
    """Measure how long each sample takes from one end of a chain to the other, in wall time."""
    started_ns, taken_us = 0, []
    _, source = chain(hops, lambda _: taken_us.append((time.perf_counter_ns() - started_ns) / 1e3))
    for sample in samples:
        started_ns = time.perf_counter_ns()
        source.publish(sample)
    return taken_us


def print_subscribers(number: int = 20_000) -> None:
    print(f"\n{'subscribers':>11} {'samples/s':>12} {'deliveries/s':>13} lost")
    samples = samples_at(PERIOD_US, number)
    for readers in (1, 10, 100):
        source, ends = StreamGenerator("s"), [Counting() for _ in range(readers)]
        for end in ends:
            source.subscribe(end)
        rate = number / best_s(lambda: publish_all(source, samples))  # noqa: B023 - called at once
        lost = number * readers * REPETITIONS - sum(end.count for end in ends)
        print(f"{readers:11d} {rate:12,.0f} {rate * readers:13,.0f} {lost:4d}")


def print_policies(number: int = 40_000) -> None:
    print(f"\n{'policy (a sample a millisecond, one in eight late)':70s} {'samples/s':>10} delivered and dropped")
    samples = [
        Sample(one.available_us, one.valid_us - (5 * PERIOD_US if k % 8 == 7 else 0), one.value)
        for k, one in enumerate(samples_at(PERIOD_US, number))
    ]
    every = SampleEvery(10 * PERIOD_US)
    for policy in (
        Policy(),
        Policy(order=Order.STRICT),
        Policy(max_delay_us=2 * PERIOD_US),
        Policy(AnyChange(), order=Order.MONOTONE),
        Policy(every, order=Order.STRICT),
        Policy(every, Approximation.MOST_RECENT, order=Order.STRICT),
        Policy(every, Approximation.MOST_RECENT, max_delay_us=20 * PERIOD_US),
        Policy(every, Approximation.LINEAR, order=Order.STRICT),
    ):
        runs: list[StreamGenerator] = []
        rate = number / best_s(lambda: runs.append(run_policy(policy, samples)))  # noqa: B023 - called at once
        print(f"{policy!s:70s} {rate:10,.0f} {runs[-1].delivered} {runs[-1].dropped()}")


def run_policy(policy: Policy, samples: Sequence[Sample[int]]) -> StreamGenerator:
    source = StreamGenerator("s")
    source.subscribe(Counting(), policy)
    publish_all(source, samples)
    source.finish()
    return source


def print_synchroniser(number: int = 60_000) -> None:
    print(f"\n{'streams':>7} {'approximation':20s} {'order':15s} {'samples/s':>10} mean delay")
    for streams in (2, 4, 16, 64):
        for approximation, order in (
            (Approximation.MOST_RECENT, Order.STRICT),
            (Approximation.LINEAR, Order.STRICT),
            (Approximation.MOST_RECENT, Order.ANY),
        ):
            fluents = {f"f{k}": Policy(approximation=approximation, order=order) for k in range(streams)}
            inputs = interleaved(streams, number)
            runs: list[list[Sample[Any]]] = []
            rate = number / best_s(lambda: runs.append(synchronise(fluents, inputs)))  # noqa: B023 - called at once
            delay_ms = np.mean([state.delay_us for state in runs[-1]]) / 1e3
            print(f"{streams:7d} {approximation.value:20s} {order.value:15s} {rate:10,.0f} {delay_ms:7.1f} ms")


def interleaved(streams: int, number: int) -> list[tuple[int, Sample[float]]]:
    """Give each stream a sample every 40 ms, at its own phase and with a delay below 30 ms, in order of arrival."""
    rng = np.random.default_rng(1)
    delay_us, phase_us = rng.integers(0, 30_000, streams), rng.integers(0, 40_000, streams)
    rows = []
    for k in range(number):
        stream, turn = k % streams, k // streams
        valid_us = turn * 40_000 + int(phase_us[stream])
        rows.append((stream, Sample(valid_us + int(delay_us[stream]), valid_us, float(k))))
    return sorted(rows, key=lambda row: row[1].available_us)


def synchronise(fluents: dict[str, Policy], inputs: Sequence[tuple[int, Sample[float]]]) -> list[Sample[Any]]:
    synchroniser = Synchroniser(fluents, period_us=40_000, max_delay_us=200_000)
    states = [state for index, sample in inputs for state in synchroniser.update(index, sample)]
    return states + synchroniser.finish()


def print_life_cycles(number: int = 5_000) -> None:
    """Create and remove a refinement of a stream, again and again."""
    node = Node()
    node.add_source("cars")
    labels = (f"relation{k}" for k in count())

    def cycle() -> None:
        for _ in range(number):
            label = next(labels)
            node.add_refinement(label, PassOn(), of="cars")
            node.remove(label)

    print(f"\ncreate and remove a process: {number / best_s(cycle):,.0f} times a second, {len(node.labels)} label left")


def main() -> None:
    print_chains()
    print_long_chain()
    print_subscribers()
    print_policies()
    print_synchroniser()
    print_life_cycles()


if __name__ == "__main__":
    main()
