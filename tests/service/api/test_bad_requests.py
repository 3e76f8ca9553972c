"""Does a server outlive clients that send nonsense, leave in the middle, or do not read what they asked for?"""

import random
import socket
from collections import Counter
from contextlib import ExitStack
from pathlib import Path
from urllib.parse import urlsplit

import httpx
import msgspec
import pytest

from service.api.access.settings import Access
from service.api.app import create_app
from service.api.messages.bodies import EventList, Problem
from service.store.log import open_log
from service.store.registers.access import make_token
from tests.service.http import Client, serving
from tests.service.logs import overtake, write_log

REQUESTS = 1_000
SLOW_READERS = 50
WORDS = (
    "api",
    "v1",
    "events",
    "r1-1",
    "why",
    "cars",
    "chronicles",
    "overtake",
    "why-not",
    "check",
    "..",
    "%2e%2e",
    "stream",
)
METHODS = ("GET", "GET", "GET", "POST", "PUT", "PATCH", "DELETE", "OPTIONS", "HEAD", "TRACE", "BREW")
NAMES = (
    "type",
    "from",
    "to",
    "limit",
    "cursor",
    "status",
    "run",
    "role.",
    "role.a",
    "last_event_id",
    "at",
    "order",
    "é",
    "",
)
VALUES = (
    "-1",
    "1e9",
    "9" * 30,
    "12:99",
    "2026-02-30T00:00:00Z",
    "\x00",
    "%00",
    "'",
    "é" * 50,
    "null",
    "x" * 3_000,
    "\ud83d",
)
HEADERS = (
    ("Host", ("evil.example", "localhost:x", "[::", "a b", "127.0.0.1")),
    ("Origin", ("null", "https://evil.example", "http://localhost", "x" * 500)),
    ("Authorization", ("Bearer", "Bearer ", "Bearer é", "Basic eDp5", "Bearer " + "x" * 5_000)),
    ("Cookie", ("dyknow_token=x", "=;;=", "dyknow_token=" + "%" * 99)),
    ("X-Request-Id", ("a\tb", "x" * 999)),
    ("Content-Type", ("application/json", "multipart/form-data", "x")),
    ("Content-Length", ("0", "99999999", "-5")),
    ("Last-Event-ID", ("-1", "x", "9" * 40)),
    ("If-None-Match", ("*", '"', 'W/"x"')),
    ("Accept-Encoding", ("gzip", "gzip;q=0", "x")),
    ("Range", ("bytes=-1", "x")),
)  # fmt: skip


def bad_request(rng: random.Random) -> tuple[str, str, list[tuple[bytes, bytes]], bytes]:
    """Make a request that something is wrong with: its method, address, headers or body."""
    path = rng.choice(("/", "/api/v1/", "//", "/api/v1/events/")) + "/".join(rng.choices(WORDS, k=rng.randrange(4)))
    if path.endswith("/events/stream"):
        path += "/x"  # one that is right has no end
    query = "&".join(f"{rng.choice(NAMES)}={rng.choice(VALUES)}" for _ in range(rng.choice((1, 1, 2, 60))))
    raw_query = query.encode("utf-8", "surrogatepass").replace(b" ", b"+")
    quoted = "".join(chr(one) if 32 < one < 127 and one != 35 else f"%{one:02x}" for one in raw_query)
    headers = [(name, rng.choice(values)) for name, values in rng.sample(HEADERS, rng.randrange(4))]
    raw_headers = [(name.encode(), value.encode("latin-1")) for name, value in headers]
    body = rng.choice((b"", b"", b"\xff\xfe", b"chronicle {", rng.randbytes(2_000), b"#" * 1_100_000))
    return rng.choice(METHODS), f"{path}?{quoted}", raw_headers, body


@pytest.mark.long
@pytest.mark.parametrize("needs_token", [False, True])
def test_a_thousand_bad_requests_are_answered_with_problems(tmp_path: Path, *, needs_token: bool) -> None:
    url = write_log(tmp_path / "a.db", [overtake()])
    with open_log(url) as log:
        good = {"Authorization": f"Bearer {make_token(log, 'office', 'admin', now_us=0)}"}
    rng, told = random.Random(7), Counter[int]()
    with Client(create_app(url, shipped=(), access=Access(needs_token=needs_token))) as client:
        for _ in range(REQUESTS):
            method, path, headers, body = bad_request(rng)
            if rng.random() < 0.5:
                headers = [*headers, *((name.encode(), value.encode()) for name, value in good.items())]
            answer = client.request(method, path, headers=headers, content=body)
            told[answer.status_code] += 1
            if answer.status_code >= 400 and method != "HEAD":
                problem = msgspec.json.decode(answer.content, type=Problem)
                assert problem.status == answer.status_code, (method, path, headers)
                assert answer.headers["content-type"] == "application/problem+json"
                assert problem.request_id == answer.headers["x-request-id"]
        page = client.get("/api/v1/events", headers=good)
        assert len(msgspec.json.decode(page.content, type=EventList).items) == 1
    assert not {status for status in told if status >= 500}, told
    assert {400, 401, 403, 404, 405, 413, 422, 429} <= set(told), told
    assert sum(count for status, count in told.items() if status >= 400) > REQUESTS / 2


def test_a_body_that_is_cut_off_is_counted_and_holds_up_nobody(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    url = write_log(tmp_path / "a.db", [overtake()])
    with serving(create_app(url, shipped=())) as (_, address):
        place = urlsplit(address)
        for path in ("/api/v1/chronicles/check", "/api/v1/events"):
            with socket.create_connection((place.hostname, place.port)) as cut:
                head = f"POST {path} HTTP/1.1\r\nHost: localhost\r\nContent-Length: 1000\r\n\r\n"
                cut.sendall(head.encode() + b"#" * 500)
        counted = 'route="/api/v1/chronicles/check",status="400"} 1.0'
        while counted not in httpx.get(f"{address}/metrics").text:
            pass  # until the server has noticed that it is gone
        assert httpx.get(f"{address}/api/v1/events").status_code == 200
    assert not [one for one in caplog.records if one.exc_info]


def test_a_body_that_does_not_say_how_long_it_is_has_its_limit_too(tmp_path: Path) -> None:
    url = write_log(tmp_path / "a.db", [overtake()])
    with serving(create_app(url, shipped=())) as (_, address):
        answer = httpx.post(f"{address}/api/v1/runs", content=(b"#" * 100_000 for _ in range(11)))
    assert (answer.status_code, answer.json()["detail"]) == (413, "body: expected at most 1000000 bytes, got more")


def test_half_a_head_and_none_at_all_hold_up_nobody(tmp_path: Path) -> None:
    url = write_log(tmp_path / "a.db", [overtake()])
    with serving(create_app(url, shipped=())) as (_, address), ExitStack() as left:
        place = urlsplit(address)
        for sent in (b"", b"GET /api/v1/events HT", b"\x16\x03\x01\x02\x00", b"GET / HTTP/1.1\r\nHost: "):
            half = left.enter_context(socket.create_connection((place.hostname, place.port)))
            half.sendall(sent)
        assert httpx.get(f"{address}/api/v1/events").status_code == 200


@pytest.mark.long
def test_fifty_who_do_not_read_their_events_hold_up_nobody(tmp_path: Path) -> None:
    url = write_log(tmp_path / "a.db", [overtake(start_us) for start_us in range(3_000)])
    with serving(create_app(url, shipped=())) as (server, address), ExitStack() as readers:
        place = urlsplit(address)
        for _ in range(SLOW_READERS):
            slow = socket.socket()
            slow.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4_096)
            slow.connect((place.hostname, place.port))
            slow.sendall(b"GET /api/v1/events/stream?last_event_id=0 HTTP/1.1\r\nHost: localhost\r\n\r\n")
            readers.enter_context(slow)
        while f"dyknow_streams_open {SLOW_READERS}.0" not in httpx.get(f"{address}/metrics").text:
            pass  # until all have been answered
        assert httpx.get(f"{address}/api/v1/events?limit=1000").status_code == 200
        with httpx.stream("GET", f"{address}/api/v1/events/stream?last_event_id=0", timeout=None) as quick:
            assert sum(line.startswith("data:") for line, _ in zip(quick.iter_lines(), range(400), strict=False)) > 90
        server.should_exit = True
        for _ in iter(lambda: slow.recv(100_000), b""):
            pass  # it ends, whole, though nobody had read
