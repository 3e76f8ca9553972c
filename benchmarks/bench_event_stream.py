"""How soon do clients hear of an event, and do they hear of each once?

One process serves a log, this one writes an event every 20 to 80 ms, and twenty clients listen, each of which leaves
and comes back at random. Prints the time from the commit of a row to the client that has read it, and how many rows
were lost or doubled.

``python -m benchmarks.bench_event_stream [EVENTS] [LOG]``
"""

import argparse
import asyncio
import random
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import httpx

from service.records.events import ChronicleRef, EventDraft
from service.records.runs import RunRecord
from service.store.log import open_log

CLIENTS = 20
LEAVES = 0.05  # of the events after which a client leaves
SERVE = [sys.executable, "-c", "from service.cli.app import main; main()", "serve", "--port", "0", "--workers", "0"]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("events", type=int, nargs="?", default=400)
    parser.add_argument("log", nargs="?", help="default: a new SQLite file")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        url = options.log or str(Path(folder) / "bench.db")
        with open_log(url, "w") as log:
            log.begin_run(RunRecord(id="empty", source="bench.mp4", start_utc_us=0)).finish("finished")
        with subprocess.Popen([*SERVE, url], stderr=subprocess.PIPE, text=True) as server:
            assert server.stderr is not None
            address = server.stderr.readline().split()[3].removesuffix("/events")
            asyncio.run(listen_and_write(url, address, options.events))
            server.terminate()


async def listen_and_write(url: str, address: str, events: int) -> None:
    """Let clients listen while events are written, and print what came of it."""
    heard: list[list[tuple[int, float]]] = [[] for _ in range(CLIENTS)]
    listening = asyncio.Barrier(CLIENTS + 1)
    clients = [
        asyncio.create_task(listen(address, one, events, random.Random(at), listening)) for at, one in enumerate(heard)
    ]
    await listening.wait()
    committed_s = await asyncio.to_thread(write, url, events)
    await asyncio.gather(*clients)
    late_ms = sorted((at_s - committed_s[seq]) * 1e3 for one in heard for seq, at_s in one)
    numbers = [[seq for seq, _ in one] for one in heard]
    lost = sum(len(committed_s.keys() - set(one)) for one in numbers)
    doubled = sum(len(one) - len(set(one)) for one in numbers)
    p50, p99 = (late_ms[int(share * (len(late_ms) - 1))] for share in (0.5, 0.99))
    print(
        f"{CLIENTS} clients, {events} events, reconnects after one in {1 / LEAVES:.0f}: lost {lost}, doubled {doubled}"
    )
    print(f"from commit to client: p50 {p50:.0f} ms, p99 {p99:.0f} ms, most {late_ms[-1]:.0f} ms")


async def listen(
    address: str, heard: list[tuple[int, float]], events: int, rng: random.Random, listening: asyncio.Barrier
) -> None:
    """Note the number and the time of each event, over as many connections as it takes."""
    last = 0
    async with httpx.AsyncClient(timeout=None) as client:
        while last < events:
            async with client.stream("GET", f"{address}/events/stream", headers={"Last-Event-ID": str(last)}) as answer:
                if not last:
                    await listening.wait()
                async for line in answer.aiter_lines():
                    name, _, value = line.partition(": ")
                    if name == "id":
                        last = int(value)
                    elif name == "data":
                        heard.append((last, time.monotonic()))
                        if last == events or rng.random() < LEAVES:
                            break


def write(url: str, events: int) -> dict[int, float]:
    """Write events one by one; give when each was committed."""
    rng, committed_s = random.Random(0), dict[int, float]()
    draft = EventDraft(
        type="overtake", chronicle=ChronicleRef("overtake", "v1"), start_us=0, end_us=1, roles={}, recognised_us=1
    )
    with open_log(url, "w") as log:
        writer = log.begin_run(RunRecord(id="bench", source="bench.mp4", start_utc_us=0))
        for seq in range(1, events + 1):
            time.sleep(rng.uniform(0.02, 0.08))
            writer.append_events([draft])
            writer.flush()
            committed_s[seq] = time.monotonic()
        writer.finish("finished")
    return committed_s


if __name__ == "__main__":
    main()
