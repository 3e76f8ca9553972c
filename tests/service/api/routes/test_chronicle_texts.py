"""Are chronicle texts stored, laid out, tried and compared over HTTP?"""

from collections.abc import Iterator
from pathlib import Path

import pytest

from service.api.app import create_app
from service.store.log import open_log
from service.store.registers.chronicle_texts import ChronicleTexts
from tests.conftest import Demo
from tests.service.http import Client
from tests.service.logs import write_log

CHRONICLES = "/api/v1/chronicles"
NEAR = "chronicle near[?a, ?b](t1) { event(close[?a, ?b]:(false, true), t1) }"
WRONG = NEAR.replace("close", "clse")
NEW = {"If-None-Match": "*"}
HOSTILE = ["%2e%2e", "%2e%2e%2fa", "%2fetc%2fpasswd", "a%00", "a" * 300, "a%0A", "a b", "1a", "%ff"]


@pytest.fixture
def url(tmp_path: Path) -> str:
    return write_log(tmp_path / "a.db", [])


@pytest.fixture
def client(url: str) -> Iterator[Client]:
    with Client(create_app(url, shipped=())) as opened:
        yield opened


@pytest.fixture(scope="module")
def refused(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Client]:
    """Give one client to all tests whose questions are refused: nothing gets into its log."""
    with Client(create_app(write_log(tmp_path_factory.mktemp("refused") / "a.db", []), shipped=())) as opened:
        yield opened


def put(client: Client, name: str, text: str, **headers: str) -> tuple[int, str | None]:
    answer = client.request("PUT", f"{CHRONICLES}/{name}", content=text.encode(), headers=headers)
    return answer.status_code, answer.headers.get("etag")


def test_a_text_is_stored_changed_and_ended(client: Client) -> None:
    assert put(client, "near", NEAR, **NEW) == (201, '"1"')
    assert put(client, "near", f"{NEAR}\n", **{"If-Match": '"1"'}) == (200, '"2"')
    got = client.get(f"{CHRONICLES}/near")
    assert (got.headers["etag"], got.json()["version"], got.json()["text"]) == ('"2"', 2, f"{NEAR}\n")
    assert [one["name"] for one in client.get(CHRONICLES).json()["texts"]] == ["near"]
    ended = client.request("DELETE", f"{CHRONICLES}/near", headers={"If-Match": '"2"'})
    assert (ended.status_code, ended.content) == (204, b"")
    assert client.get(f"{CHRONICLES}/near").status_code == 404
    assert client.get(CHRONICLES).json()["texts"] == []
    versions = client.get(f"{CHRONICLES}/near/versions").json()["items"]
    assert [(one["version"], one["text"]) for one in versions] == [(1, NEAR), (2, f"{NEAR}\n"), (3, None)]


@pytest.mark.long
def test_what_the_client_has_is_not_sent_again(client: Client) -> None:
    put(client, "near", NEAR, **NEW)
    same = client.get(f"{CHRONICLES}/near", headers={"If-None-Match": '"7", "1"'})
    assert (same.status_code, same.content, same.headers["etag"]) == (304, b"", '"1"')
    assert client.get(f"{CHRONICLES}/near", headers={"If-None-Match": '"7"'}).status_code == 200


@pytest.mark.parametrize(
    ("headers", "status"),
    [({}, 428), (NEW, 412), ({"If-Match": '"2"'}, 412), ({"If-Match": "1"}, 412), ({"If-Match": "*"}, 412)],
)
@pytest.mark.parametrize("method", ["PUT", "DELETE"])
def test_who_does_not_know_the_newest_version_changes_nothing(
    client: Client, method: str, headers: dict[str, str], status: int
) -> None:
    put(client, "near", NEAR, **NEW)
    answer = client.request(method, f"{CHRONICLES}/near", content=NEAR.encode(), headers=headers)
    assert answer.status_code == (428 if method == "DELETE" and headers == NEW else status)
    assert len(client.get(f"{CHRONICLES}/near/versions").json()["items"]) == 1


def test_a_text_with_errors_is_refused_with_the_findings_of_check(client: Client, url: str) -> None:
    found = client.request("POST", f"{CHRONICLES}/check", content=WRONG.encode()).json()["findings"]
    requests = {
        "PUT": client.request("PUT", f"{CHRONICLES}/near", content=WRONG.encode(), headers=NEW),
        "try": client.request("POST", f"{CHRONICLES}/try", json={"text": WRONG}),
        "diff": client.request("POST", f"{CHRONICLES}/diff", json={"before": NEAR, "after": WRONG}),
    }
    for which, answer in requests.items():
        body = answer.json()
        assert (answer.status_code, body["type"]) == (422, "urn:dyknow:problem:bad-chronicle"), which
        assert [one | {"file": "text"} for one in body["findings"]] == found, which
    with open_log(url) as opened:
        texts = ChronicleTexts(opened)
        assert texts.current() == []


@pytest.mark.parametrize(
    ("name", "text", "detail"),
    [
        ("far", NEAR, "body: expected a text that declares chronicle 'far', got near"),
        ("near", "message near[?a]", "near: expected a text with a chronicle, got one without"),
        ("near", f"# \0\n{NEAR}", "near: expected a text, got a NUL character"),
    ],
)
def test_a_text_that_is_none_of_its_name_is_refused(refused: Client, name: str, text: str, detail: str) -> None:
    answer = refused.request("PUT", f"{CHRONICLES}/{name}", content=text.encode(), headers=NEW)
    assert (answer.status_code, answer.json()["detail"]) == (422, detail)


@pytest.mark.parametrize("name", HOSTILE)
def test_no_name_does_harm(refused: Client, name: str) -> None:
    for method in ("GET", "PUT", "DELETE"):
        answer = refused.request(method, f"{CHRONICLES}/{name}", content=NEAR.encode(), headers=NEW)
        assert answer.status_code in (404, 405, 422), (method, answer.text)
        assert answer.headers["content-type"] == "application/problem+json"
    assert refused.get(CHRONICLES).json()["texts"] == []


def test_a_text_is_laid_out(client: Client) -> None:
    answer = client.request("POST", f"{CHRONICLES}/format", content=b"chronicle  c{event(m[?],t1)}  // now")
    assert answer.json() == {"text": "chronicle c {\n  event(m[?], t1)\n}  // now\n"}
    refused = client.request("POST", f"{CHRONICLES}/format", content=b"chronicle c {")
    assert (refused.status_code, refused.json()["findings"][0]["code"]) == (422, "C0103")


@pytest.mark.long
def test_a_text_is_tried_and_compared(demo: Demo) -> None:
    with open_log(str(demo.log)) as log:
        (text,) = [one.text for one in log.run().texts if one.name == "overtake.chronicle"]
    longer = text.replace("t2 - t1 in [100ms, 60s]", "t2 - t1 in [100ms, 1s]").split("example")[0]
    with Client(create_app(str(demo.log))) as client:
        tried = client.request("POST", f"{CHRONICLES}/try", json={"text": text, "from": "0s", "to": 30_000_000})
        changed = client.request("POST", f"{CHRONICLES}/diff", json={"before": text, "after": longer})
        listed = client.get("/api/v1/events?type=overtake&from=0s&to=30s").json()["items"]
    assert tried.json()["count"] == len(listed) > 3
    assert [one["roles"] for one in tried.json()["items"]] == [one["roles"] for one in listed]
    body = changed.json()
    assert (len(body["gained"]), len(body["moved"])) == (0, 0)
    assert len(body["lost"]) > 0


@pytest.mark.parametrize(
    ("body", "status", "detail"),
    [
        ({"text": 3}, 422, "text: expected a valid string, got 3"),
        ({"text": NEAR, "until": 3}, 422, "until: expected no such parameter"),
        ({"text": NEAR, "from": "soon"}, 422, "from: expected"),
        ({"text": NEAR, "from": 2, "to": 1}, 400, "from: expected a time before 'to'"),
        ({"text": NEAR, "run": "\0"}, 422, "run: expected"),
        ({"text": NEAR, "run": "none"}, 404, "expected a run 'none'"),
        ({"text": NEAR, "limit": 0}, 422, "limit: expected greater than or equal to 1, got 0"),
    ],
)
def test_a_wrong_question_is_refused(refused: Client, body: dict[str, object], status: int, detail: str) -> None:
    answer = refused.request("POST", f"{CHRONICLES}/try", json=body)
    assert (answer.status_code, detail in answer.json()["detail"]) == (status, True), answer.text


@pytest.mark.parametrize("body", [b'{"text": "\\ud800"}', b"{", b"[]", b"\xff", b"", b"[" * 100_000])
def test_a_body_that_is_none_is_refused(refused: Client, body: bytes) -> None:
    headers = {"Content-Type": "application/json"}
    answer = refused.request("POST", f"{CHRONICLES}/try", content=body, headers=headers)
    assert answer.status_code in (400, 422), answer.text
    assert answer.headers["content-type"] == "application/problem+json"


def test_what_takes_too_long_may_be_asked_again(url: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("service.api.processes.pool.ANSWERED_WITHIN_S", 0.0)
    with Client(create_app(url, shipped=())) as client:
        answer = client.request("POST", f"{CHRONICLES}/try", json={"text": NEAR})
    assert (answer.status_code, "retry-after" in answer.headers) == (503, True)
