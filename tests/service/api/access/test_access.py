"""Is only answered who may ask, from where he may, and is what he writes noted?"""

import re
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path

import httpx
import msgspec
import pytest
from fastapi import FastAPI
from starlette.responses import Response

from service.api.access.admission import OPEN
from service.api.access.callers import MOST_FAILURES
from service.api.access.settings import Access
from service.api.app import create_app
from service.api.messages.bodies import Problem
from service.cli.app import run
from service.errors import LogError
from service.store.log import open_log
from service.store.registers.access import Scope, list_written, make_token, revoke_token
from tests.service.http import Client, serving
from tests.service.logs import write_log

EVENTS = "/api/v1/events"
NewClient = Callable[[Access | None], Client]


@pytest.fixture
def url(tmp_path: Path) -> str:
    return write_log(tmp_path / "a.db", [])


@pytest.fixture
def new_client(url: str) -> Iterator[NewClient]:
    """Give clients of applications that have a route which writes, and one that fails at it."""
    with ExitStack() as open_clients:

        def opened(access: Access | None = None) -> Client:
            return open_clients.enter_context(Client(writable(create_app(url, shipped=(), access=access))))

        yield opened


def writable(app: FastAPI) -> FastAPI:
    @app.put("/api/v1/things")
    def put() -> Response:
        """Put nothing."""
        return Response(status_code=204)

    @app.delete("/api/v1/things")
    def fail() -> None:
        """Fail."""
        raise RuntimeError("secret")

    return app


def made(url: str, scope: Scope, name: str = "office", **times: int) -> dict[str, str]:
    """Make a token; give the header that shows it."""
    with open_log(url) as log:
        return {"Authorization": f"Bearer {make_token(log, name, scope, **({'now_us': 0} | times))}"}


def refused(answer: httpx.Response, status: int) -> str:
    """Expect a problem; say why."""
    assert answer.status_code == status, answer.text
    assert msgspec.json.decode(answer.content, type=Problem).status == status
    return str(answer.json()["detail"])


def test_nobody_on_this_machine_needs_a_token(new_client: NewClient, url: str) -> None:
    client = new_client(None)
    made(url, "read")
    assert client.get(EVENTS).status_code == 200
    assert client.request("PUT", "/api/v1/things").status_code == 204
    with open_log(url) as log:
        assert [one.token for one in list_written(log, limit=9)] == ["loopback"]


def test_without_a_token_only_what_is_open_is_answered(new_client: NewClient, url: str) -> None:
    client = new_client(Access(needs_token=True))
    reader = made(url, "read")
    paths = client.get("/openapi.json", headers=reader).json()["paths"]
    for path in (*paths, "/", "/openapi.json", "/api/v1/nothing", "/logout/../api/v1"):
        for method in [one.upper() for one in paths.get(path, {"get": None})]:
            answer = client.request(method, path)
            assert (answer.status_code == 401) == (path not in OPEN), (method, path)
    answer = client.get(EVENTS)
    assert refused(answer, 401) == "token: expected one of this log, as 'Authorization: Bearer TOKEN', got none"
    assert answer.headers["www-authenticate"] == 'Bearer realm="dyknow"'
    assert client.get("/healthz").status_code == 200


@pytest.mark.parametrize(
    ("scope", "statuses"),
    [("read", (200, 403, 403, 200)), ("write", (200, 204, 403, 200)), ("admin", (200, 204, 200, 200))],
)
def test_a_token_allows_what_its_scope_says(
    new_client: NewClient, url: str, scope: Scope, statuses: tuple[int, ...]
) -> None:
    client, headers = new_client(Access(needs_token=True)), made(url, scope)
    asked = (
        ("GET", EVENTS),
        ("PUT", "/api/v1/things"),
        ("GET", "/api/v1/webhooks"),
        ("POST", "/api/v1/chronicles/check"),
    )
    answers = [client.request(method, path, headers=headers, content=b"") for method, path in asked]
    assert tuple(one.status_code for one in answers) == statuses
    for one in answers:
        assert one.status_code != 403 or 'error="insufficient_scope"' in one.headers["www-authenticate"]


def test_a_token_that_is_wrong_revoked_or_over_is_refused(new_client: NewClient, url: str) -> None:
    client, good = new_client(None), made(url, "read")
    over = made(url, "read", "over", expires_us=time.time_ns() // 1000 - 1)
    assert client.get(EVENTS, headers=good).status_code == 200
    for wrong in (over, {"Authorization": "Bearer x"}):
        assert refused(client.get(EVENTS, headers=wrong), 401).endswith("got one that is not, or has ended")
    with open_log(url) as log:
        revoke_token(log, "office")
    while client.get(EVENTS, headers=good).status_code == 200:
        pass  # until the server has looked again
    assert client.get(EVENTS).status_code == 200


@pytest.mark.long
def test_tokens_that_are_known_stay_good_while_the_log_cannot_be_read(
    new_client: NewClient, url: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(_: object) -> None:
        raise LogError("log: expected one that can be read, got none")

    client, good = new_client(Access(needs_token=True)), made(url, "read")
    assert client.get("/openapi.json", headers=good).status_code == 200
    monkeypatch.setattr("service.api.access.callers.READ_EVERY_S", -1.0)
    monkeypatch.setattr("service.api.access.callers.list_tokens", fail)
    assert client.get("/openapi.json", headers=good).status_code == 200
    assert refused(client.get("/openapi.json", headers={"Authorization": "Bearer x"}), 401)


def test_too_many_wrong_tokens_are_told_to_wait_and_the_right_one_is_not(new_client: NewClient, url: str) -> None:
    client, good = new_client(Access(needs_token=True)), made(url, "read")
    for number in range(MOST_FAILURES):
        refused(client.request("POST", "/login", headers={"Authorization": f"Bearer {number}"}), 401)
    answer = client.request("POST", "/login", headers={"Authorization": "Bearer x"})
    assert "expected fewer than 10 wrong ones a minute" in refused(answer, 429)
    assert 0 < int(answer.headers["retry-after"]) <= 60
    assert client.get(EVENTS, headers=good).status_code == 200


def test_a_client_has_so_many_requests_at_once_and_streams_are_such(url: str) -> None:
    good = made(url, "read")
    with serving(create_app(url, shipped=(), access=Access(most_at_once=2))) as (_, address), ExitStack() as streams:
        client = streams.enter_context(httpx.Client(base_url=address, timeout=None))
        for _ in range(2):
            streams.enter_context(client.stream("GET", f"{EVENTS}/stream"))
        answer = client.get(EVENTS)
        wanted = "requests: expected at most 2 of '127.0.0.1' at once, got one more; ask again later"
        assert (refused(answer, 429), answer.headers["retry-after"]) == (wanted, "1")
        assert {client.get(one).status_code for one in ("/healthz", "/readyz", "/metrics")} == {200}
        assert client.get(EVENTS, headers=good).status_code == 200
    with serving(create_app(url, shipped=(), access=Access(most_at_once=1))) as (_, address):
        with httpx.stream("GET", f"{address}{EVENTS}/stream") as one:
            assert one.status_code == 200
        while httpx.get(f"{address}{EVENTS}").status_code == 429:  # the server hears of its end a little later
            time.sleep(0.01)
        assert httpx.get(f"{address}{EVENTS}").status_code == 200


@pytest.mark.parametrize("scheme", ["http", "https"])
def test_a_token_becomes_a_cookie_that_scripts_do_not_see(new_client: NewClient, url: str, scheme: str) -> None:
    client, headers = new_client(Access(needs_token=True)), made(url, "write")
    assert refused(client.request("POST", "/login"), 401)
    answer = client.request("POST", f"{scheme}://localhost/login", headers=headers)
    assert answer.status_code == 204
    told = answer.headers["set-cookie"]
    assert ("Secure" in told) == (scheme == "https")
    assert {"HttpOnly", "SameSite=strict", "Path=/"} <= set(told.split("; "))
    cookie = {"Cookie": told.partition(";")[0]}
    assert client.get(EVENTS, headers=cookie).status_code == 200
    assert client.request("PUT", "/api/v1/things", headers=cookie).status_code == 204
    forgotten = client.request("POST", "/logout").headers["set-cookie"]
    assert re.match(r'dyknow_token=""; .*Max-Age=0', forgotten)


def test_a_cookie_that_is_over_keeps_nobody_from_his_own_machine(new_client: NewClient) -> None:
    assert new_client(None).get(EVENTS, headers={"Cookie": "dyknow_token=x"}).status_code == 200


@pytest.mark.parametrize(
    ("host", "is_ours"),
    [
        ("localhost", True), ("localhost:8420", True), ("127.0.0.1:1", True), ("[::1]:8420", True), ("LOCALHOST", True),
        ("evil.example", False), ("localhost.evil.example", False), ("", False), ("10.0.0.1", False),
    ],
)  # fmt: skip
def test_a_name_that_was_led_here_is_not_ours(new_client: NewClient, host: str, *, is_ours: bool) -> None:
    answer = new_client(None).get(EVENTS, headers={"Host": host})
    assert answer.status_code == (200 if is_ours else 400)
    assert is_ours or refused(answer, 400).startswith("Host: expected a name of this server (serve --allow-host")


def test_a_server_is_called_by_its_address_and_by_names_that_are_allowed() -> None:
    fixed = Access.at("192.168.1.5", hosts=["Road.Example"])
    called = [fixed.is_called(one) for one in ("192.168.1.5:80", "road.example", "localhost", "192.168.1.6")]
    assert called == [True, True, True, False]
    everywhere = Access.at("0.0.0.0")
    assert [everywhere.is_called(one) for one in ("10.0.0.7:8420", "[fe80::1]", "evil.example")] == [True, True, False]


@pytest.mark.parametrize(
    ("origin", "status"),
    [
        (None, 204), ("http://localhost", 204), ("https://desk.example", 204),
        ("http://localhost:3000", 403), ("https://evil.example", 403), ("null", 403),
    ],
)  # fmt: skip
def test_only_pages_of_ours_may_write(new_client: NewClient, url: str, origin: str | None, status: int) -> None:
    client = new_client(Access(origins=("https://desk.example",)))
    headers = {} if origin is None else {"Origin": origin}
    assert client.request("PUT", "/api/v1/things", headers=headers).status_code == status
    answer = client.get(EVENTS, headers=headers)
    is_shown = answer.headers.get("access-control-allow-origin") == origin
    assert (answer.status_code, is_shown) == (200, origin in (None, "https://desk.example"))
    with open_log(url) as log:
        assert len(list_written(log, limit=9)) == (status == 204)


def test_a_page_that_is_allowed_may_ask_what_it_may_send(new_client: NewClient) -> None:
    client = new_client(Access(origins=("https://desk.example",), needs_token=True))
    asked = {"Access-Control-Request-Method": "PUT", "Access-Control-Request-Headers": "authorization"}
    good = client.request("OPTIONS", EVENTS, headers={"Origin": "https://desk.example"} | asked)
    assert (good.status_code, "PUT" in good.headers["access-control-allow-methods"]) == (200, True)
    assert refused(client.request("OPTIONS", EVENTS, headers={"Origin": "https://evil.example"} | asked), 400)


def test_what_may_change_something_is_noted_with_its_answer(new_client: NewClient, url: str) -> None:
    client, headers = new_client(Access(needs_token=True)), made(url, "write")
    answers = [
        client.request(method, path, headers=headers | {"X-Request-Id": f"id-{method}"})
        for method, path in (("PUT", "/api/v1/things"), ("DELETE", "/api/v1/things"), ("POST", EVENTS), ("GET", EVENTS))
    ]
    assert [one.status_code for one in answers] == [204, 500, 405, 200]
    with open_log(url) as log:
        rows = list_written(log, limit=9)[::-1]
    assert [(one.token, one.method, one.path, one.status, one.request_id) for one in rows] == [
        ("office", "PUT", "/api/v1/things", 204, "id-PUT"),
        ("office", "DELETE", "/api/v1/things", 500, "id-DELETE"),
    ]


def test_what_others_reach_is_not_served_without_a_token(
    url: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("uvicorn.Server.run", lambda *_, **__: None)
    serve = ["serve", url, "--port", "0", "--workers", "0"]
    for options in (["--host", "0.0.0.0"], ["--require-token"]):
        assert run([*serve, *options]) == 3
        told = capsys.readouterr().err
        assert told.endswith(f"got none; make one: dyknow token make {url} NAME\n")
        assert told.count("\n") == 1
    made(url, "read", "over", expires_us=1)
    assert run([*serve, "--host", "0.0.0.0"]) == 3
    made(url, "read")
    capsys.readouterr()
    assert run([*serve, "--host", "0.0.0.0"]) == 0
    assert "warning: what is sent is not encrypted" in capsys.readouterr().err
    assert run([*serve, "--allow-origin", "*"]) == 2
    assert "--allow-origin: expected https://HOST or http://HOST:PORT, got '*'" in capsys.readouterr().err
