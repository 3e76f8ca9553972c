"""How many cores do many cameras need, how long do their jobs wait, and what is full first? A simulated queue.

Each camera adds a job when a segment of its video is whole. Jobs are taken in their order by as many workers as there
are cores; to take one, and to write its rows, occupies the store, which does one of these at a time, in their order (in
truth it writes all the while, and hands out jobs meanwhile). The number of cores is the least that does the work and
lets 95 of 100 jobs wait no longer than `--wait-s`. Times are drawn around their mean, since traffic varies; they are
the same for each number of cores.

What it is told by options: what a camera-hour costs, by default the figures of docs/evaluation.md. What it measures, on
a PostgreSQL server of this machine: how long the store takes to hand out and end a job while 1,000 wait, how fast it
takes chunks of rows from one writer, and how many connections a worker holds.

``python -m benchmarks.simulate_fleet [--cameras 100 10000] [--take-s S --write-mb-s MB --connections N]``
"""

import argparse
import heapq
import math
import subprocess
import tempfile
import time
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from sqlalchemy import create_engine, text
from sqlalchemy.engine import URL, make_url

from benchmarks.bench_cluster import WORKER, add_jobs, make_tracks, new_database, running_server
from service.cli.printing import format_table
from service.store import schema
from service.store.databases.location import database_of
from service.store.registers.jobs import Jobs
from service.store.writer import insert_rows, lock_seqs

HOUR_S = 3600.0
SEED = 1
TITLES = ("scene", "cameras", "segments", "load", "cores", "wait s", "95 % s", "store", "connections", "full first")
COSTS = {"rural": (344.0, 5.5), "junction": (737.0, 22.0)}
"""CPU seconds and MB of log of an hour of a camera: "all CPU s" and "log MB" of `python -m benchmarks.bench_day`."""


@dataclass(frozen=True, slots=True)
class Store:
    """What a store can do.

    Attributes
    ----------
    take_s : to hand out a job and note its end.
    write_mb_s : rows that it takes.
    connections : that a worker holds.
    """

    take_s: float
    write_mb_s: float
    connections: int


@dataclass(frozen=True, slots=True)
class Fleet:
    """The jobs of some hours: when they come (ascending), how long each wants a core, and how long the store."""

    arrivals_s: NDArray[np.float64]
    work_s: NDArray[np.float64]
    take_s: float
    write_s: float


def main(arguments: Sequence[str] | None = None) -> None:
    """Print what was measured, a row for each fleet, and how many cameras fill each thing that can be full."""
    options = _options(arguments)
    store = measured_store(options)
    rates = f"{1e3 * store.take_s:.1f} ms a job, {store.write_mb_s:.1f} MB/s"
    print(f"store: {rates}, {store.connections} connections a worker")
    rows, limits = list[list[str]](), list[list[str]]()
    for scene in options.scenes:
        cpu_s, log_mb = (options.cpu_s or COSTS[scene][0]), (options.log_mb or COSTS[scene][1])
        rows += [
            _row(scene, count, arrive, cpu_s, log_mb, store=store, options=options)
            for count in options.cameras
            for arrive in ("spread", "at once")
        ]
        store_s = store.take_s * 60 / options.segment_min + log_mb / store.write_mb_s
        a_worker = store.connections * cpu_s / HOUR_S
        full = {"cores": HOUR_S / cpu_s, "connections": options.most_connections / a_worker, "store": HOUR_S / store_s}
        limits.append([scene, *(f"{one:,.0f}" if name != "cores" else f"{one:.1f}" for name, one in full.items())])
    print(format_table(TITLES, rows))
    print(format_table(("scene", "cameras a core", "fill the connections", "fill the store"), limits), end="")


def _options(arguments: Sequence[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cameras", type=int, nargs="+", default=[100, 10_000])
    parser.add_argument("--scenes", nargs="+", choices=tuple(COSTS), default=list(COSTS))
    parser.add_argument("--cpu-s", type=float, help="of an hour of a camera; default: as docs/evaluation.md has it")
    parser.add_argument("--log-mb", type=float, help="as --cpu-s")
    parser.add_argument("--segment-min", type=float, default=60.0, help="minutes of video in a job")
    parser.add_argument("--hours", type=float, default=6.0, help="simulated")
    parser.add_argument("--wait-s", type=float, default=600.0, help="that 95 of 100 jobs may wait at most")
    parser.add_argument("--variation", type=float, default=0.3, help="of times, standard deviation over mean")
    parser.add_argument("--most-connections", type=int, default=100, help="of the server; PostgreSQL's default is 100")
    parser.add_argument("--take-s", type=float, help="do not measure it")
    parser.add_argument("--write-mb-s", type=float, help="do not measure it")
    parser.add_argument("--connections", type=int, help="of a worker; do not measure it")
    return parser.parse_args(arguments)


def _row(
    scene: str, cameras: int, arrive: str, cpu_s: float, log_mb: float, *, store: Store, options: argparse.Namespace
) -> list[str]:
    share = options.segment_min / 60
    fleet = make_fleet(
        cameras,
        hours=options.hours,
        segment_s=60 * options.segment_min,
        is_spread=arrive == "spread",
        work_s=cpu_s * share,
        variation=options.variation,
        take_s=store.take_s,
        write_s=log_mb * share / store.write_mb_s,
    )
    load, busy = cameras * cpu_s / HOUR_S, cameras * (fleet.take_s + fleet.write_s) / (60 * options.segment_min)
    cores, waits = math.ceil(load), ("grows", "grows")  # whatever the number of cores, where the store is full
    if busy < 1:
        cores, waits_s = least_cores(fleet, options.wait_s, at_least=cores)
        waits = (f"{np.median(waits_s):.0f}", f"{np.percentile(waits_s, 95):.0f}")
    shares = {"store": busy, "connections": cores * store.connections / options.most_connections}
    first = max(shares, key=shares.__getitem__)
    full = f"{first} ({100 * shares[first]:.0f} %)"
    return [
        scene, f"{cameras:,}", arrive, f"{load:.1f}", f"{cores:,}", *waits, f"{100 * busy:.1f} %",
        f"{cores * store.connections:,}", full,
    ]  # fmt: skip


def make_fleet(
    cameras: int,
    *,
    hours: float,
    segment_s: float,
    is_spread: bool,
    work_s: float,
    variation: float,
    take_s: float,
    write_s: float,
) -> Fleet:
    """Draw the jobs of cameras whose segments end one after the other, or all at the same time."""
    rng = np.random.default_rng(SEED)
    first_s = rng.uniform(0, segment_s, cameras) if is_spread else np.zeros(cameras)
    arrivals_s = np.sort((first_s + segment_s * np.arange(math.ceil(hours * HOUR_S / segment_s))[:, None]).ravel())
    if variation == 0:
        return Fleet(arrivals_s, np.full(len(arrivals_s), work_s), take_s, write_s)
    shape = 1 / variation**2
    return Fleet(arrivals_s, rng.gamma(shape, work_s / shape, len(arrivals_s)), take_s, write_s)


def least_cores(fleet: Fleet, wait_s: float, *, at_least: int = 1) -> tuple[int, NDArray[np.float64]]:
    """Find the least number of cores with which 95 of 100 jobs wait no longer than that, and how long they wait.

    Found to half a percent. Where no number is enough since the store has too much at once, as many cores as jobs.
    """
    few, many = at_least - 1, at_least
    waits_s = simulated_waits_s(fleet, many)
    while np.percentile(waits_s, 95) > wait_s and many < len(fleet.arrivals_s):
        few, many = many, 2 * many
        waits_s = simulated_waits_s(fleet, many)
    while many - few > max(1, many // 200):
        middle = (few + many) // 2
        found_s = simulated_waits_s(fleet, middle)
        if np.percentile(found_s, 95) > wait_s:
            few = middle
        else:
            many, waits_s = middle, found_s
    return many, waits_s


def simulated_waits_s(fleet: Fleet, cores: int) -> NDArray[np.float64]:
    """Tell how long each job waits, from its arrival until a worker has taken it from the store.

    A worker takes a job (the store), computes (its core), writes (the store), and is free. What is done at one moment
    is done in the order of jobs.
    """
    arrivals_s, work_s = fleet.arrivals_s.tolist(), fleet.work_s.tolist()
    waiting, waits_s = deque[int](), np.zeros(len(arrivals_s))
    ending: list[tuple[float, int, bool]] = []  # when, which job, whether it has written too
    free, store_free_s, arrived = cores, 0.0, 0
    while arrived < len(arrivals_s) or ending:
        if arrived < len(arrivals_s) and (not ending or arrivals_s[arrived] <= ending[0][0]):
            now_s = arrivals_s[arrived]
            waiting.append(arrived)
            arrived += 1
        else:
            now_s, job, has_written = heapq.heappop(ending)
            if has_written:
                free += 1
            else:
                store_free_s = max(store_free_s, now_s) + fleet.write_s
                heapq.heappush(ending, (store_free_s, job, True))
        while free and waiting:
            job = waiting.popleft()
            free -= 1
            store_free_s = max(store_free_s, now_s) + fleet.take_s
            waits_s[job] = store_free_s - arrivals_s[job]
            heapq.heappush(ending, (store_free_s + work_s[job], job, False))
    return waits_s


def measured_store(options: argparse.Namespace) -> Store:
    """Measure what the options do not say, on a server of this machine."""
    if None not in (options.take_s, options.write_mb_s, options.connections):
        return Store(options.take_s, options.write_mb_s, options.connections)
    with tempfile.TemporaryDirectory(prefix="fleet_") as name, running_server(Path(name) / "server") as place:
        tracks = make_tracks(Path(name), 60.0)
        return Store(
            options.take_s or _take_s(new_database(place, "take"), tracks),
            options.write_mb_s or _write_mb_s(new_database(place, "write")),
            options.connections or _connections(place, new_database(place, "connections"), tracks),
        )


def _take_s(log: str, tracks: Path, waiting: int = 1_000, taken: int = 200) -> float:
    add_jobs(log, tracks, waiting)
    jobs = Jobs(database_of(log))
    began_s = time.perf_counter()
    for _ in range(taken):
        job = jobs.take()
        assert job is not None, f"expected {waiting} jobs that wait, got none"
        job.end("finished", "")
    took_s = time.perf_counter() - began_s
    jobs.close()
    return took_s / taken


def _write_mb_s(log: str, spans: int = 1_000, kinds: int = 5, bytes_each: int = 3_000) -> float:
    """Write chunks as a run does, those of a span in a transaction; what is in them cannot be compressed further."""
    rng = np.random.default_rng(SEED)
    database = database_of(log)
    Jobs(database).close()  # makes the tables
    engine, began_s = database.writing(), time.perf_counter()
    for span in range(spans):
        rows = [(1, f"kind{kind}", 10, span, span, span, 1, rng.bytes(bytes_each)) for kind in range(kinds)]
        with engine.begin() as connection:
            lock_seqs(connection)
            insert_rows(connection, schema.chunks, rows)
    took_s = time.perf_counter() - began_s
    engine.dispose()
    return spans * kinds * bytes_each / 1e6 / took_s


def _connections(place: URL, log: str, tracks: Path) -> int:
    """Count the most connections that a worker holds while it is at a job."""
    add_jobs(log, tracks, 1)
    engine = create_engine(place, isolation_level="AUTOCOMMIT")
    wanted = text("select count(*) from pg_stat_activity where datname = :name")
    most = 0
    with subprocess.Popen([*WORKER, log, "--once"], stderr=subprocess.DEVNULL) as worker, engine.connect() as asking:
        while worker.poll() is None:
            most = max(most, asking.execute(wanted, {"name": make_url(log).database}).scalar_one())
            time.sleep(0.02)
    engine.dispose()
    return most


if __name__ == "__main__":
    main()
