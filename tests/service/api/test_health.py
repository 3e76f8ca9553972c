"""Does a server say how it is, however busy it is, and is what it counts what happened?"""

import asyncio
import re
import threading
from collections.abc import Iterator
from pathlib import Path

import httpx
import msgspec
import pytest
from sqlalchemy import update

from service.api.app import WORKER_THREADS, create_app
from service.api.messages.bodies import Problem
from service.api.processes.pool import ProcessPool
from service.errors import CrowdedError
from service.runs.machine import cores
from service.store import schema
from service.store.databases.database import Database
from service.store.databases.location import database_of
from service.store.log import open_log
from service.store.registers.jobs import Jobs
from tests.service.api.processes.acting import begin
from tests.service.http import Client, serving
from tests.service.logs import overtake, write_log

WATCHED = ("/healthz", "/readyz", "/metrics")


@pytest.fixture
def url(tmp_path: Path) -> str:
    return write_log(tmp_path / "a.db", [overtake(), overtake()])


@pytest.fixture
def client(url: str) -> Iterator[Client]:
    with Client(create_app(url, shipped=())) as client:
        yield client


def metrics(client: Client) -> dict[str, float]:
    """Give the numbers by their names with labels."""
    lines = re.findall(r"^(dyknow_\S+) (\S+)$", client.get("/metrics").text, re.MULTILINE)
    return {name: float(value) for name, value in lines}


def test_answers_are_counted_by_route_method_and_status(client: Client) -> None:
    for path in ("/api/v1/events/r1-1", "/api/v1/events/r1-2", "/api/v1/events/r9-1", "/nothing/1", "/nothing/2"):
        client.get(path)
    client.request("HEAD", "/api/v1/events")
    client.request("BREW", "/api/v1/events")
    client.get("/api/v1/events", headers={"Host": "evil.example"})
    found = metrics(client)

    def count(route: str, method: str, status: int) -> float:
        return found[f'dyknow_http_request_seconds_count{{method="{method}",route="{route}",status="{status}"}}']

    assert count("/api/v1/events/{event_id}", "GET", 200) == 2
    assert count("/api/v1/events/{event_id}", "GET", 404) == 1
    assert count("none", "GET", 404) == 2
    assert count("none", "GET", 400) == 1
    assert count("/api/v1/events", "HEAD", 200) == 1
    assert count("/api/v1/events", "other", 405) == 1


def test_metrics_tell_of_the_log(client: Client, url: str) -> None:
    jobs = Jobs(database_of(url))
    for name in ("a", "b"):
        jobs.add(name, "{}")
    jobs.close()
    found = metrics(client)
    told = ("last_seq", 'jobs{state="waiting"}', "streams_open", "questions_waiting")
    assert [found[f"dyknow_{name}"] for name in told] == [2, 2, 0, 0]


def test_open_streams_are_counted(url: str) -> None:
    with serving(create_app(url, shipped=())) as (_, address):
        with httpx.stream("GET", f"{address}/api/v1/events/stream") as stream:
            lines = stream.iter_lines()
            next(lines)
            assert "dyknow_streams_open 1.0" in httpx.get(f"{address}/metrics").text
        while "dyknow_streams_open 1.0" in httpx.get(f"{address}/metrics").text:
            pass  # until the server has noticed that it is gone


def test_what_is_ready_says_so(client: Client) -> None:
    assert (client.get("/readyz").status_code, client.get("/readyz").text) == (200, "ready\n")


def test_what_fails_is_listed(client: Client, url: str, monkeypatch: pytest.MonkeyPatch) -> None:
    with open_log(url) as log, log.change() as connection:
        is_version = schema.meta.c.key == "schema_version"
        connection.execute(update(schema.meta).where(is_version).values(value=str(schema.SCHEMA_VERSION - 1)))
    monkeypatch.setattr("service.api.health.LEAST_FREE_BYTES", 10**18)
    answer = client.get("/readyz")
    assert (answer.status_code, answer.headers["retry-after"]) == (503, "1")
    told = msgspec.json.decode(answer.content, type=Problem)
    assert told.type == "urn:dyknow:problem:not-ready"
    schema_told, disk_told = [one.detail for one in told.errors]
    assert schema_told == f"schema: expected version {schema.SCHEMA_VERSION}, got {schema.SCHEMA_VERSION - 1}"
    assert disk_told.startswith("disk: expected 1,000,000,000,000,000,000 bytes that are free, got ")


def test_a_log_that_breaks_is_not_ready_and_names_no_file(
    client: Client, url: str, caplog: pytest.LogCaptureFixture
) -> None:
    path = Path(url.removeprefix("sqlite:///"))
    client.get("/readyz")
    path.write_bytes(b"x" * 4096 + path.read_bytes()[4096:])
    answer = client.get("/readyz")
    assert answer.status_code == 503
    assert str(path) not in answer.text
    assert str(path) in caplog.text
    assert client.get("/healthz").status_code == 200
    assert client.get("/metrics").status_code == 200


def test_a_log_that_does_not_answer_is_not_ready(client: Client, monkeypatch: pytest.MonkeyPatch) -> None:
    ended = threading.Event()

    def wait(_: Database) -> int:
        ended.wait()
        return 0

    monkeypatch.setattr("service.api.health.LOOKED_WITHIN_S", 0.01)
    monkeypatch.setattr("service.api.health.read_version", wait)
    assert client.get("/readyz").json()["errors"] == [{"detail": "log: expected an answer within 0.01 s, got none"}]
    ended.set()


def test_all_is_told_while_every_thread_and_process_is_busy(
    url: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pools = list[ProcessPool]()
    monkeypatch.setattr("service.api.app.ProcessPool", lambda log: pools.append(ProcessPool(log)) or pools[-1])
    app = create_app(url, shipped=())
    ended, held = threading.Event(), threading.Semaphore(0)

    @app.get("/slow")
    def slow() -> None:
        held.release()
        ended.wait()

    async def ask() -> None:
        transport = httpx.ASGITransport(app=app)
        async with (
            app.router.lifespan_context(app),
            httpx.AsyncClient(transport=transport, base_url="http://localhost") as http,
        ):
            busy = [asyncio.create_task(http.get("/slow")) for _ in range(2 * WORKER_THREADS)]
            begun = [tmp_path / f"begun{number}" for number in range(cores())]
            busy += [asyncio.create_task(pools[0].ask(begin, str(one))) for one in begun]
            busy += [asyncio.create_task(http.get("/api/v1/events/r1-1/why")) for _ in range(3)]
            while not all(one.exists() for one in begun) or held._value < WORKER_THREADS or pools[0].waiting < 3:
                await asyncio.sleep(0.01)
            answers = [await http.get(path) for path in WATCHED]
            assert [one.status_code for one in answers] == [200, 200, 200]
            assert "dyknow_questions_waiting 3.0" in answers[2].text
            assert not any(one.done() for one in busy)
            ended.set()
            for one in busy:
                one.cancel()
            await asyncio.gather(*busy, return_exceptions=True)

    asyncio.run(ask())


def test_who_asks_when_too_many_wait_is_told_at_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("service.api.processes.pool.WAITING_PER_CORE", 1)

    async def ask() -> None:
        pool = ProcessPool("")
        begun = [tmp_path / f"begun{number}" for number in range(2 * cores())]
        busy = [asyncio.create_task(pool.ask(begin, str(one))) for one in begun]
        while pool.waiting < cores():
            await asyncio.sleep(0.01)
        with pytest.raises(CrowdedError, match=f"expected at most {cores()} that wait, got one more"):
            await pool.ask(begin, "")
        assert not any(one.done() for one in busy)
        for one in busy:
            one.cancel()
        await asyncio.gather(*busy, return_exceptions=True)

    asyncio.run(ask())
