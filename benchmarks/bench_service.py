"""How fast is the event log written and asked?

Prints floors and ratios: rows inserted a second, a deep page against the first one, an overlap against a start query,
counts by index against counts of rows, an export, and requests a second of `GET /api/v1/events` (100 events of a
million) beside those of a bare server of the same framework, and of one that does no more than to ask SQLite for them.

``python -m benchmarks.bench_service [EVENTS] [STATES]``
"""

import argparse
import asyncio
import random
import socket
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import TypeVar

import psutil

from service.export.events import ExportFormat, exported
from service.questions.events.queries import MAX_LIMIT, EventFilter, find_events
from service.questions.events.summaries import summarise
from service.records.events import ChronicleRef, EventDraft, Place, SubEvent
from service.records.runs import RunRecord
from service.records.seen import CarState
from service.records.times import TimePoint
from service.store.log import EventLog, open_log

T = TypeVar("T")

CARS_A_FRAME = 20
FRAME_US = 40_000
EVENT_GAP_US = 50_000
TYPES = tuple(f"type{number}" for number in range(20))
CONNECTIONS = 16
REQUESTS = 300
ROUNDS = 9
PAGE = "/api/v1/events?type={}&from={}"
BINS = 500
EXPORTED = 100_000
SERVE = [sys.executable, "-c", "from service.cli.app import main; main()", "serve", "--workers", "0"]
HELLO = [
    sys.executable,
    "-c",
    """
import sys
import uvicorn
from fastapi import FastAPI
app = FastAPI()
@app.get("/")
async def hello() -> dict[str, str]:
    return {"hello": "world"}
uvicorn.run(app, port=int(sys.argv[2]), access_log=False)
""",
]
ONE_QUESTION = [
    sys.executable,
    "-c",
    """
import sqlite3
import sys
import uvicorn
from fastapi import FastAPI, Response
app = FastAPI()
connection = sqlite3.connect(sys.argv[1], isolation_level=None)
PAGE = '''
    SELECT group_concat(body, ',') FROM (
        SELECT body FROM events WHERE type = ? AND start_us >= ? AND end_us > ?
        AND status NOT IN ('retracted', 'doubtful')
        AND NOT EXISTS (SELECT 1 FROM revisions WHERE revised = events.id) ORDER BY start_us, seq LIMIT 100)'''
@app.get("/")
async def page(type: str, since: int) -> Response:
    (items,) = connection.execute(PAGE, (type, since - 8_000_000, since)).fetchone()
    return Response('{"items":[%s]}' % items, media_type="application/json")
uvicorn.run(app, port=int(sys.argv[3]), access_log=False)
""",
]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("events", type=int, nargs="?", default=1_000_000)
    parser.add_argument("states", type=int, nargs="?", default=400_000)
    options = parser.parse_args()
    events, states = options.events, options.states
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "bench.db"
        with open_log(str(path), "w") as log:
            writer = log.begin_run(RunRecord(id="bench", source="bench.mp4", start_utc_us=0))
            rows = make_states(states)
            print_rate("car states", "rows", states, partial(append_all, writer.append_states, rows))
            drafts = make_events(events)
            print_rate("events", "events", events, partial(append_all, writer.append_events, drafts))
            writer.finish("finished")
        print(f"log: {path.stat().st_size / 1e6:.0f} MB")
        with open_log(str(path)) as log:
            bench_pages(log, events)
        asyncio.run(bench_http(str(path), events))


def make_states(count: int) -> list[list[CarState]]:
    """Make frames of 20 cars each."""
    return [
        [
            CarState(frame * FRAME_US, f"car{car}", 1.5 * frame, 3.0 * car, 0.1, 13.9, 4.5, 1.8, "car", "road1",
                     2.5 * car, "road1_0", True, f"v{car}")
            for car in range(CARS_A_FRAME)
        ]
        for frame in range(count // CARS_A_FRAME)
    ]  # fmt: skip


def make_events(count: int) -> list[list[EventDraft]]:
    """Make events of 20 types in batches of 1,000; one lasts long, as in every real log."""
    rng = random.Random(1)
    drafts = []
    for number in range(count):
        start_us = number * EVENT_GAP_US
        length_us = 60_000_000 if number == count // 2 else rng.randrange(500_000, 8_000_000)
        drafts.append(
            EventDraft(
                type=rng.choice(TYPES),
                chronicle=ChronicleRef("overtake", "0123456789abcdef"),
                start_us=start_us,
                end_us=start_us + length_us,
                roles={"overtaker": f"car{number // 3}", "overtaken": f"car{number // 3 + 1}", "road": "road1"},
                recognised_us=start_us + length_us,
                hypotheses=("h1", "h2"),
                sub_events=(SubEvent("begin", start_us), SubEvent("end", start_us + length_us)),
                place=Place("road1", 12.25, -3.5),
            )
        )
    return [drafts[first : first + 1000] for first in range(0, count, 1000)]


def append_all(append: Callable[[Iterable[T]], None], batches: Iterable[Iterable[T]]) -> None:
    for batch in batches:
        append(batch)


def print_rate(what: str, unit: str, count: int, work: Callable[[], object]) -> None:
    began_s = time.perf_counter()
    work()
    print(f"insert {what}: {count / (time.perf_counter() - began_s):,.0f} {unit}/s")


def bench_pages(log: EventLog, events: int) -> None:
    """Time single questions; the ratios are what counts."""
    end_us = events * EVENT_GAP_US
    from_, to = TimePoint(end_us // 2, "media"), TimePoint(end_us, "media")
    rare = EventFilter(actors=(f"car{events // 6}",))
    first = print_median("page 1", lambda: find_events(log, EventFilter()))
    cursor = deep_cursor(log, events)
    deep = print_median(
        f"page {(events - MAX_LIMIT) // 100 + 1:,}", lambda: find_events(log, EventFilter(), cursor=cursor)
    )
    start = print_median("start in window", lambda: find_events(log, EventFilter(match="start", from_=from_, to=to)))
    overlap = print_median("overlap window", lambda: find_events(log, EventFilter(from_=from_, to=to)))
    print_median("one of 20 types", lambda: find_events(log, EventFilter(types=TYPES[:1])))
    print_median("three of 20 types", lambda: find_events(log, EventFilter(types=TYPES[:3])))
    print_median("one car", lambda: find_events(log, rare))
    print_median("role filled everywhere", lambda: find_events(log, EventFilter(roles=(("road", ("road1",)),))))
    print(f"deep page / page 1: {deep / first:.2f}   overlap / start: {overlap / start:.2f}")
    bins = {"bin_us": max(1, end_us // BINS)}
    one = print_median(f"counts of one type, {BINS} bins", lambda: count(log, EventFilter(types=TYPES[:1]), **bins), 5)
    every = print_median(f"counts of all types, {BINS} bins", lambda: count(log, EventFilter(), **bins), 5)
    # Grouping is what a filter beside types and window costs.
    grouped = print_median("counts of all types, rows read", lambda: count(log, EventFilter(min_confidence=0.0)), 1)
    print(f"rows read / by index: {grouped / every:.1f}   all types / one: {every / one:.1f}")
    part = EventFilter(match="start", to=TimePoint(EXPORTED * EVENT_GAP_US, "media"))
    forms: tuple[ExportFormat, ...] = ("jsonl", "csv", "parquet")
    for form in forms:
        print_median(f"export of {min(EXPORTED, events):,} events, {form}", partial(exhaust, log, part, form), 1)


def count(log: EventLog, wanted: EventFilter, **bins: int) -> None:
    summarise(log, wanted, "type", **bins)


def exhaust(log: EventLog, wanted: EventFilter, form: ExportFormat) -> None:
    for _ in exported(log, wanted, form):
        pass


def deep_cursor(log: EventLog, events: int) -> str:
    """Walk to the last page but one, and return its cursor."""
    cursor = None
    for _ in range(events // MAX_LIMIT - 1):
        cursor = find_events(log, EventFilter(), limit=MAX_LIMIT, cursor=cursor).next_cursor
    assert cursor is not None
    return cursor


def print_median(what: str, work: Callable[[], object], repeats: int = 100) -> float:
    """Time a question several times and print the median."""
    times_s = []
    for _ in range(repeats):
        began_s = time.perf_counter()
        work()
        times_s.append(time.perf_counter() - began_s)
    median_ms = statistics.median(times_s) * 1e3
    print(f"{what}: {median_ms:.2f} ms")
    return median_ms


async def bench_http(url: str, events: int) -> None:
    """Ask a server for pages of 100 events by type and time, and a bare one of the framework for a word, in turns."""
    rng = random.Random(2)

    def page(path: str) -> str:
        return path.format(rng.choice(TYPES), rng.randrange(events // 2) * EVENT_GAP_US)

    bare, plain, ours = started(HELLO), started([*ONE_QUESTION, url]), started([*SERVE, url])
    with bare as (hello, hello_port), plain as (asking, asking_port), ours as (service, port):
        cases = {
            "a bare server": (hello, hello_port, lambda: "/"),
            "100 of them by one question to SQLite": (asking, asking_port, partial(page, "/?type={}&since={}")),
            f"100 of {events:,} events by type and time": (service, port, partial(page, PAGE)),
            "the same 100 each time": (service, port, lambda: "/api/v1/events"),
        }
        rounds = [[await times(*case) for case in cases.values()] for _ in range(ROUNDS + 1)][1:]  # the first warms up
    print(f"requests over HTTP, {CONNECTIONS} connections")
    for at, name in enumerate(cases):
        wall_ms, cpu_ms = (statistics.median(one[at][of] for one in rounds) for of in (0, 1))
        wall, cpu = (statistics.median(one[0][of] / one[at][of] for one in rounds) for of in (0, 1))
        print(f"  {name}: {1e3 / wall_ms:,.0f}/s, {wall:.2f} of a bare server; processor {cpu_ms:.2f} ms, {cpu:.2f}")


@contextmanager
def started(command: list[str]) -> Iterator[tuple[psutil.Process, int]]:
    """Start a server; give its process and its port."""
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    with subprocess.Popen([*command, "--port", str(port)], stderr=subprocess.DEVNULL) as server:
        while True:
            try:
                socket.create_connection(("127.0.0.1", port)).close()
                break
            except OSError:
                assert server.poll() is None, command
                time.sleep(0.05)
        try:
            yield psutil.Process(server.pid), port
        finally:
            server.terminate()


async def times(server: psutil.Process, port: int, path: Callable[[], str]) -> tuple[float, float]:
    """Ask from 16 connections at once; give the milliseconds that a request takes, and those of the processor."""
    left = REQUESTS

    async def client() -> None:
        nonlocal left
        reader, writer = await asyncio.open_connection("127.0.0.1", port)
        while left > 0:
            left -= 1
            writer.write(f"GET {path()} HTTP/1.1\r\nHost: localhost\r\n\r\n".encode())
            head = (await reader.readuntil(b"\r\n\r\n")).decode().lower()
            assert " 200 " in head, head
            await reader.readexactly(int(head.partition("content-length: ")[2].partition("\r")[0]))
        writer.close()

    began_s, began_cpu_s = time.perf_counter(), sum(server.cpu_times()[:2])
    await asyncio.gather(*(client() for _ in range(CONNECTIONS)))
    elapsed_s, cpu_s = time.perf_counter() - began_s, sum(server.cpu_times()[:2]) - began_cpu_s
    return elapsed_s / REQUESTS * 1e3, cpu_s / REQUESTS * 1e3


if __name__ == "__main__":
    main()
