"""Does a client hear of each event once, in order, however often it comes back and whoever writes?"""

import asyncio
import random
import subprocess
import sys
import threading
from collections.abc import Iterator
from contextlib import closing, contextmanager
from itertools import islice, pairwise

import httpx
import msgspec
import pytest

from service.api.app import create_app
from service.api.delivery.event_stream import EventStream
from service.api.messages.bodies import Problem
from service.questions.events.queries import EventFilter
from service.records.events import EventRecord
from service.store.log import open_log
from tests.service.conftest import NewLog, in_a_file
from tests.service.http import Client, serving
from tests.service.logs import overtake, read_rows, run, write_log

PATH = "/api/v1/events/stream"
CLIENT = httpx.Client(timeout=None)
WRITE = """
import sys
from service.store.log import open_log
from tests.service.logs import overtake, run
with open_log(sys.argv[1], "w") as log:
    writer = log.begin_run(run(sys.argv[2]))
    for start_us in range(60):
        writer.append_events([overtake(start_us)] * (1 + start_us % 3))
        writer.flush()
    writer.finish("finished")
"""


@contextmanager
def streamed(url: str, *, after: int | None = None, query: str = "") -> Iterator[Iterator[dict[str, str]]]:
    """Connect, and give the blocks as they come, each by the names of its lines."""
    headers = {} if after is None else {"Last-Event-ID": str(after)}
    with CLIENT.stream("GET", f"{url}{PATH}?{query}", headers=headers) as answer:
        assert answer.status_code == 200, answer.read()
        assert answer.headers["content-type"].startswith("text/event-stream")
        assert answer.headers["x-accel-buffering"] == "no"
        yield blocks(answer.iter_lines())


def blocks(lines: Iterator[str]) -> Iterator[dict[str, str]]:
    block: dict[str, str] = {}
    for line in lines:
        if line:
            name, _, value = line.partition(": ")
            block[name] = value
        else:
            yield block
            block = {}


def test_rows_come_as_they_are_stored_states_and_all(new_log: NewLog) -> None:
    drafts = [
        overtake(0, status="tentative"),
        overtake(1, confidence=0.2, status="doubtful"),
        overtake(0, status="retracted", revises="r1-1"),
        overtake(2, type="pass", roles={"passer": "car1"}),
    ]
    url = write_log(new_log(), drafts)
    rows = read_rows(url)
    with serving(create_app(url, shipped=())) as (_, address):
        with streamed(address, query="last_event_id=0") as found:
            first, *events = islice(found, 4)
        assert first == {"retry": "2000", "id": "0"}
        assert [msgspec.json.decode(one["data"], type=EventRecord) for one in events] == [rows[0], *rows[2:]]
        assert [(one["id"], one["event"]) for one in events] == [
            ("1", "tentative"), ("3", "retracted"), ("4", "recognised"),
        ]  # fmt: skip
        for query, seq in (("type=pass", 4), ("actor=car1", 4), ("min_confidence=0.1", 2), ("status=doubtful", 2)):
            with streamed(address, after=1, query=query) as found:
                assert [one["id"] for one in islice(found, 2)] == ["1", str(seq)]


@pytest.mark.long
@in_a_file
def test_nothing_is_lost_or_doubled_over_reconnects_while_others_write(new_log: NewLog) -> None:
    url = write_log(new_log(), [overtake()] * 5, record=run("r0"))
    app, rng, told = create_app(url, shipped=()), random.Random(3), list[list[int]]()

    def listen(address: str, seed: int, most: int) -> None:
        rng, heard, last = random.Random(seed), list[int](), 0
        end = 5 + 2 * 120
        while last < end:
            with streamed(address, after=last) as found:
                for block in islice(found, rng.randrange(1, most)):
                    last = int(block["id"])
                    heard += [last] if "data" in block else []
                    if last == end:
                        break
        told.append(heard)

    with serving(app) as (_, address):
        clients = [
            threading.Thread(target=listen, args=(address, rng.randrange(99), most)) for most in (5, 12, 40, 1000)
        ]
        for client in clients:
            client.start()
        writers = [subprocess.Popen([sys.executable, "-c", WRITE, url, name]) for name in ("r1", "r2")]
        assert [writer.wait() for writer in writers] == [0, 0]
        for client in clients:
            client.join()
    assert told == [[event.seq for event in read_rows(url)]] * 4


def test_a_client_that_has_seen_no_event_goes_on_from_where_it_began(new_log: NewLog) -> None:
    url = write_log(new_log(), [overtake()])
    with serving(create_app(url, shipped=())) as (_, address):
        with streamed(address) as found:
            assert next(found)["id"] == "1"
        write_log(url, [overtake(5)], record=run("r2"))
        with streamed(address, after=1) as found:
            assert [one["id"] for one in islice(found, 2)] == ["1", "2"]


@pytest.mark.long
def test_a_repeated_run_is_told_anew_with_numbers_of_its_own(new_log: NewLog) -> None:
    url = write_log(new_log(), [overtake()])
    with serving(create_app(url, shipped=())) as (_, address), streamed(address, after=0) as found:
        before = list(islice(found, 2))[1]
        write_log(url, [overtake()])
        again = next(found)
        ids = [msgspec.json.decode(one["data"])["id"] for one in (before, again)]
        assert (before["id"], again["id"], ids) == ("1", "2", ["r1-1", "r1-1"])


def test_a_silent_stream_says_how_far_it_looked(new_log: NewLog, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("service.api.delivery.event_stream.HEARTBEAT_S", 0.0)
    url = write_log(new_log(), [overtake()])

    async def listen() -> list[bytes]:
        with closing(open_log(url)) as log:
            answer = await EventStream(log).answer(EventFilter(types=("pass",)), 0)
            found = aiter(answer.body_iterator)
            return [bytes(await anext(found)) for _ in range(3)]  # type: ignore[arg-type]  # bytes are what we give

    told = asyncio.run(listen())
    assert told == [b"retry: 2000\nid: 0\n\n", b": nothing new\nid: 1\n\n", b": nothing new\nid: 1\n\n"]


def test_more_streams_than_may_be_are_told_to_come_back(new_log: NewLog, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("service.api.delivery.event_stream.MOST_STREAMS", 1)
    url = write_log(new_log(), [overtake()])
    with serving(create_app(url, shipped=())) as (_, address):
        with streamed(address, after=0) as found:
            assert next(found)["id"] == "0"
            refused = httpx.get(address + PATH)
            assert (refused.status_code, refused.headers["retry-after"]) == (503, "1")
            assert msgspec.json.decode(refused.content, type=Problem).type == "urn:dyknow:problem:crowded"
        while httpx.head(address + PATH).status_code == 503:
            pass  # until the server has noticed that the one before is gone
        assert httpx.head(address + PATH).status_code in (200, 503)


def test_streams_end_whole_when_the_server_stops(new_log: NewLog) -> None:
    url = write_log(new_log(), [overtake()])
    with serving(create_app(url, shipped=())) as (server, address), streamed(address, after=0) as found:
        assert [one["id"] for one in islice(found, 2)] == ["0", "1"]
        server.should_exit = True
        assert list(found) == []


@pytest.fixture(scope="module")
def client(new_log: NewLog) -> Iterator[Client]:
    with Client(create_app(write_log(new_log(), [overtake()]), shipped=())) as opened:
        yield opened


@pytest.mark.parametrize(
    ("query", "detail"),
    [
        ("last_event_id=2", "last_event_id: expected one up to 1, the newest of this log, got 2"),
        ("last_event_id=x", "last_event_id: expected 0 to 1000000000000000, got 'x'"),
        (
            "from=1s",
            "query: expected type, actor, road, source, run, status, min_confidence, last_event_id or role.NAME",
        ),
        ("min_confidence=2", "min_confidence: expected 0 to 1, got '2'"),
    ],
)
def test_what_cannot_be_streamed_is_refused(client: Client, query: str, detail: str) -> None:
    answer = client.get(f"{PATH}?{query}")
    assert answer.status_code == 422
    assert msgspec.json.decode(answer.content, type=Problem).detail.startswith(detail)


def test_heads_are_answered_at_once(new_log: NewLog) -> None:
    with serving(create_app(write_log(new_log(), []), shipped=())) as (_, address):
        assert httpx.head(address + PATH).status_code == 200
        assert httpx.head(f"{address}/healthz").headers["content-length"] == "3"


def test_numbers_grow_from_block_to_block(new_log: NewLog) -> None:
    url = write_log(new_log(), [overtake(start_us) for start_us in range(1_200)])
    with serving(create_app(url, shipped=())) as (_, address), streamed(address, after=0) as found:
        numbers = [int(one["id"]) for one in islice(found, 1_201)]
    assert all(after - before == 1 for before, after in pairwise(numbers))
