"""Does every answer have what all have, whoever gives it: an identifier, strict headers, and a problem for an error?"""

from collections.abc import Iterator
from pathlib import Path

import msgspec
import pytest
from fastapi import FastAPI, Request
from starlette.exceptions import HTTPException
from starlette.responses import PlainTextResponse, Response

from service.api.app import MOST_BODY_BYTES, create_app
from service.api.frame import STRICT_HEADERS
from service.api.messages.bodies import Problem
from tests.service.http import Client
from tests.service.logs import overtake, write_log

CHECK = "/api/v1/chronicles/check"


@pytest.fixture(scope="module")
def client(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Client]:
    app = create_app(write_log(tmp_path_factory.mktemp("frame") / "a.db", [overtake()] * 50), shipped=())
    add_odd_routes(app)
    with Client(app) as client:
        yield client


def add_odd_routes(app: FastAPI) -> None:
    @app.get("/plain")
    def plain() -> Response:
        return PlainTextResponse("no tea here", 418)

    @app.get("/broken")
    def fail() -> None:
        raise RuntimeError("secret")

    @app.get("/refused")
    def refuse() -> None:
        raise HTTPException(409, "expected another one", {"X-Why": "so"})

    @app.post("/large", max_body_size=2 * MOST_BODY_BYTES)
    async def take(request: Request) -> Response:
        return PlainTextResponse(str(len(await request.body())))

    @app.post("/unread")
    def ignore() -> Response:
        return Response(status_code=204)


@pytest.mark.parametrize(
    ("method", "path", "status"),
    [
        ("GET", "/api/v1/chronicles", 200),
        ("HEAD", "/healthz", 200),
        ("GET", "/nothing", 404),
        ("DELETE", "/healthz", 405),
        ("GET", "/broken", 500),
        ("GET", "/plain", 418),
        ("GET", "/refused", 409),
    ],
)
def test_every_answer_has_strict_headers_and_an_identifier(client: Client, method: str, path: str, status: int) -> None:
    answer = client.request(method, path, headers={"X-Request-Id": "mine"})
    assert (answer.status_code, answer.headers["x-request-id"]) == (status, "mine")
    wanted = {name.decode(): value.decode() for name, value in STRICT_HEADERS.items()}
    assert {name: answer.headers.get(name) for name in wanted} == wanted
    if status >= 400:
        body = msgspec.json.decode(answer.content, type=Problem)
        assert (body.status, body.request_id, body.instance) == (status, "mine", path)
        assert answer.headers["content-type"] == "application/problem+json"
        assert "secret" not in answer.text


def test_what_is_said_in_plain_text_becomes_the_detail_of_a_problem(client: Client) -> None:
    answer = client.get("/plain")
    assert answer.json()["detail"] == "no tea here"
    assert client.get("/refused").headers["x-why"] == "so"


def test_a_body_has_the_size_that_its_route_takes(client: Client) -> None:
    most = b"#" * MOST_BODY_BYTES
    assert client.request("POST", "/large", content=most * 2).text == str(2 * MOST_BODY_BYTES)
    for path, body in (("/large", most * 2 + b"#"), (CHECK, b"#" * 256_001), ("/unread", most + b"#")):
        answer = client.request("POST", path, content=body)
        assert answer.status_code == 413, path
        told = msgspec.json.decode(answer.content, type=Problem).detail
        assert told == f"body: expected at most {len(body) - 1} bytes, got more"


def test_a_page_is_compressed_for_who_takes_it(client: Client) -> None:
    whole = client.get("/api/v1/events", headers={"Accept-Encoding": "identity"})
    small = client.get("/api/v1/events", headers={"Accept-Encoding": "gzip"})
    assert "content-encoding" not in whole.headers
    assert small.headers["content-encoding"] == "gzip"
    assert int(small.headers["content-length"]) < int(whole.headers["content-length"]) / 5
    assert small.content == whole.content


def test_events_are_not_held_back_to_be_compressed(tmp_path: Path) -> None:
    url = write_log(tmp_path / "a.db", [overtake()])
    with Client(create_app(url, shipped=())) as client:
        answer = client.request("HEAD", "/api/v1/events/stream", headers={"Accept-Encoding": "gzip"})
    assert (answer.status_code, answer.headers.get("content-encoding")) == (200, None)
    assert answer.headers["cache-control"] == "no-store"
