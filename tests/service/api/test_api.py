"""Does the HTTP interface answer as it says, to a client that knows only its description?"""

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from urllib.parse import quote

import msgspec
import pytest
from fastapi import FastAPI
from hypothesis import given, settings
from hypothesis import strategies as st

from service.api.app import create_app
from service.api.messages.bodies import ChronicleList, EventList, Index, Problem
from service.api.messages.parameters import MEDIA_TIME
from service.errors import LogError
from service.questions.events.queries import EventFilter, iterate_events
from service.records.events import EventRecord
from service.records.runs import ChronicleRecord
from service.records.times import parse_media_us
from service.store.log import open_log
from tests.service.http import Client
from tests.service.logs import SECOND_US, overtake, read_all, write_log

Json = dict[str, Any]  # Any: JSON

SHIPPED = ChronicleRecord(name="overtake", version="v2", parameters=("a", "b"), text="chronicle overtake ...")


@pytest.fixture(scope="module")
def url(tmp_path_factory: pytest.TempPathFactory) -> str:
    """A log of 25 overtakes a second apart, and one pass by other cars."""
    drafts = [overtake(second * SECOND_US) for second in range(25)]
    other = overtake(7 * SECOND_US, type="pass", roles={"passer": "car1", "passed": "truck 2"}, place=None)
    return write_log(tmp_path_factory.mktemp("api") / "a.db", [*drafts, other])


@pytest.fixture(scope="module")
def app(url: str) -> FastAPI:
    return create_app(url, shipped=[SHIPPED])


@pytest.fixture(scope="module")
def client(app: FastAPI) -> Iterator[Client]:
    with Client(app) as client:
        yield client


def get_events(client: Client, query: str = "") -> EventList:
    """Ask for events and read the answer strictly."""
    answer = client.get(f"/api/v1/events?{query}")
    assert answer.status_code == 200, answer.text
    assert answer.headers["content-type"] == "application/json"
    return msgspec.json.decode(answer.content, type=EventList)


def get_problem(client: Client, path: str, status: int, method: str = "GET") -> Problem:
    """Ask for something that fails and read the problem strictly."""
    answer = client.request(method, path)
    assert answer.status_code == status, answer.text
    assert answer.headers["content-type"] == "application/problem+json"
    body = msgspec.json.decode(answer.content, type=Problem)
    assert body.status == status
    assert body.request_id == answer.headers["x-request-id"] != ""
    return body


def test_events_come_as_they_were_stored(client: Client, url: str) -> None:
    page = get_events(client)
    assert page.items == read_all(url)
    assert (page.next_cursor, page.as_of_seq) == (None, 26)


@pytest.mark.parametrize(
    ("query", "starts"),
    [
        ("type=pass", [7]),
        ("type=pass&type=overtake&limit=3", [0, 1, 2]),
        ("from=20s&match=start", [20, 21, 22, 23, 24]),
        ("from=00:20&to=00:21", [18, 19, 20]),
        ("from=2026-05-01T08:00:23Z&match=start", [23, 24]),
        ("from=2026-05-01T10:00:23%2B02:00&match=start", [23, 24]),
        ("to=5000000&match=inside", [0, 1, 2]),
        ("actor=car1", [7]),
        ("role.passed=truck+2", [7]),
        ("role.overtaker=car3", []),
        ("road=road1&order=-start&limit=2", [24, 23]),
        ("source=other.mp4", []),
        ("status=tentative", []),
        ("run=r1&limit=1", [0]),
    ],
)
def test_filters_of_the_query_string(client: Client, query: str, starts: list[int]) -> None:
    assert [event.start_us // SECOND_US for event in get_events(client, query).items] == starts


def test_following_next_cursor_reads_everything_once(client: Client, url: str) -> None:
    found: list[EventRecord] = []
    page = get_events(client, "limit=4")
    while page.next_cursor:
        found += page.items
        page = get_events(client, f"limit=4&cursor={page.next_cursor}")
    assert found + page.items == read_all(url)


def test_the_link_header_leads_to_the_next_page(client: Client) -> None:
    answer = client.get("/api/v1/events?type=overtake&limit=10&role.overtaker=car7")
    match = re.fullmatch(r'<(/api/v1/events\?[^>]+)>; rel="next"', answer.headers["link"])
    assert match is not None
    following = client.get(match[1]).json()
    assert [event["start_us"] // SECOND_US for event in following["items"]] == list(range(10, 20))


def test_one_event_by_its_identifier(client: Client) -> None:
    event = get_events(client, "type=pass").items[0]
    answer = client.get(f"/api/v1/events/{event.id}")
    assert msgspec.json.decode(answer.content, type=EventRecord) == event


def test_chronicles_of_the_library_and_of_the_runs(client: Client) -> None:
    found = msgspec.json.decode(client.get("/api/v1/chronicles").content, type=ChronicleList).items
    assert [(one.name, one.version, one.is_shipped, one.runs) for one in found] == [
        ("overtake", "v1", False, ["r1"]),
        ("overtake", "v2", True, []),
    ]
    assert found[0].parameters == ("overtaker", "overtaken")


POSTED = ("check", "format", "try", "diff", "login", "logout", "try_monitors")


def test_the_index_leads_to_paths_that_answer(client: Client) -> None:
    index = msgspec.json.decode(client.get("/api/v1").content, type=Index)
    assert index.as_of_seq == 26
    links = index.links
    assert set(client.get("/openapi.json").json()["paths"]) >= set(links.values()) - {"/openapi.json"}
    # A stream has no end, what was at a time needs a time, and texts are sent.
    whole = set(links.values()) - {links[one] for one in ("stream", "relations_at", "tracks", *POSTED)}
    for path in (one for one in whole if "{" not in one):
        assert client.get(path).status_code == 200, path


def test_the_root_shows_a_line_to_copy(client: Client) -> None:
    answer = client.get("/")
    command = re.search(r"curl '(\S+)'", answer.text)
    assert command is not None
    assert client.get(command[1]).status_code == 200


def test_health_is_plain_text(client: Client) -> None:
    assert client.get("/healthz").text == "ok\n"


@pytest.mark.parametrize("path", ["/api/v1/events", "/api/v1/events/r1-1", "/healthz", "/openapi.json"])
def test_head_is_get_without_a_body(client: Client, path: str) -> None:
    full, bare = client.get(path), client.request("HEAD", path)
    assert (bare.status_code, bare.content) == (200, b"")
    assert bare.headers["content-length"] == full.headers["content-length"]


def test_an_unknown_event_is_a_problem(client: Client) -> None:
    body = get_problem(client, "/api/v1/events/r9-1", 404)
    assert body.detail == "event: expected the id of an event in this log, got 'r9-1'"
    assert body.instance == "/api/v1/events/r9-1"


def test_an_unknown_path_is_a_problem(client: Client) -> None:
    assert "expected a path of this interface" in get_problem(client, "/api/v1/event", 404).detail


@pytest.mark.parametrize("path", ["/api/v1/", "/api/v1/events/", "/healthz/"])
def test_a_final_slash_is_another_path(client: Client, path: str) -> None:
    get_problem(client, path, 404)


def test_a_wrong_method_is_a_problem(client: Client) -> None:
    body = get_problem(client, "/api/v1/events", 405, "DELETE")
    assert body.detail == "/api/v1/events: expected method GET or HEAD, got 'DELETE'"
    assert client.request("DELETE", "/api/v1/events").headers["allow"] == "GET, HEAD"


@pytest.mark.parametrize(
    ("path", "allowed"),
    [
        ("sources", "GET, HEAD, POST"),
        ("sources/a", "DELETE, GET, HEAD"),
        ("chronicles/near", "DELETE, GET, HEAD, PUT"),
        ("chronicles/check", "POST"),
        ("chronicles/try", "POST"),
        ("jobs/0/cancel", "POST"),
    ],
)
def test_all_methods_of_a_path_are_told(client: Client, path: str, allowed: str) -> None:
    answer = client.request("PATCH", f"/api/v1/{path}")
    assert (answer.status_code, answer.headers["allow"]) == (405, allowed)


@pytest.mark.parametrize(
    ("query", "parameter", "detail"),
    [
        ("limit=0", "limit", "limit: expected 1 to 1000, got '0'"),
        ("limit=2e3", "limit", "limit: expected 1 to 1000, got '2e3'"),
        ("limit=²", "limit", "limit: expected 1 to 1000, got '²'"),
        ("match=near", "match", "match: expected end or inside or overlap or start, got 'near'"),
        ("order=end", "order", "order: expected -start or start, got 'end'"),
        (
            "status=maybe",
            "status",
            "status: expected confirmed or doubtful or recognised or retracted or tentative, got ['maybe']",
        ),
        ("limit=1&limit=2", "limit", "limit: expected one value, got ['1', '2']"),
        ("&".join(["actor=car1"] * 51), "actor", "actor: expected at most 50 values, got 51"),
    ],
)
def test_a_wrong_parameter_is_named(client: Client, query: str, parameter: str, detail: str) -> None:
    body = get_problem(client, f"/api/v1/events?{query}", 422)
    assert body.detail == detail
    assert [(one.parameter, one.detail) for one in body.errors] == [(parameter, detail)]


@pytest.mark.parametrize("name", ["actr", "role.", "From", "bbox"])
def test_an_unknown_parameter_is_refused(client: Client, name: str) -> None:
    body = get_problem(client, f"/api/v1/events?{name}=x", 422)
    assert body.errors[0].parameter == name


def test_a_mistyped_parameter_gets_a_hint(client: Client) -> None:
    assert get_problem(client, "/api/v1/events?typ=pass", 422).detail.endswith("got 'typ'; did you mean 'type'?")


@pytest.mark.parametrize(
    ("body", "kind", "came"),
    [
        ("source=a", "application/x-www-form-urlencoded", "b'source=a'"),
        ("{source: a}", "application/json", "'Expecting property name enclosed in double quotes'"),
        ("[1]", "application/json", "[1]"),
        ("", "application/json", "None"),
    ],
)
def test_a_body_that_is_no_object_is_refused(client: Client, body: str, kind: str, came: str) -> None:
    answer = client.request("POST", "/api/v1/runs", content=body, headers={"Content-Type": kind})
    assert answer.json()["detail"] == f"body: expected a JSON object, as application/json, got {came}"


@pytest.mark.parametrize("text", ["noon", "12.5", "2026-05-01T08:00:00", "2026-05-01T08:00:00+02:00"])
def test_a_time_that_is_none_is_refused(client: Client, text: str) -> None:
    # The last one is the classic: + in a query string is a blank.
    assert get_problem(client, f"/api/v1/events?from={text}", 422).errors[0].parameter == "from"


def test_an_empty_window_is_a_bad_request(client: Client) -> None:
    body = get_problem(client, "/api/v1/events?from=5s&to=5s", 400)
    assert body.type == "urn:dyknow:problem:bad-filter"


@pytest.mark.parametrize("cursor", ["", "x", quote("é"), "A" * 32])
def test_a_damaged_cursor_is_a_bad_request(client: Client, cursor: str) -> None:
    assert get_problem(client, f"/api/v1/events?cursor={cursor}", 400).type == "urn:dyknow:problem:bad-cursor"


def test_a_cursor_of_other_filters_is_a_bad_request(client: Client) -> None:
    cursor = get_events(client, "limit=1").next_cursor
    detail = get_problem(client, f"/api/v1/events?type=pass&cursor={cursor}", 400).detail
    assert "expected the filters of the page it came from" in detail


def test_a_fault_of_ours_tells_nothing_but_the_request(client: Client, monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(*_: object, **__: object) -> None:
        raise RuntimeError("secret")

    monkeypatch.setattr("service.api.routes.events.find_events", fail)
    body = get_problem(client, "/api/v1/events?limit=7", 500)
    assert body.detail == "/api/v1/events: expected an answer, got an internal error"


def test_a_log_that_breaks_is_unavailable(client: Client, monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(*_: object, **__: object) -> None:
        raise LogError("log 'a.db': expected a log that can be read, got 'disk I/O error'")

    monkeypatch.setattr("service.api.routes.events.find_events", fail)
    assert get_problem(client, "/api/v1/events?limit=7", 503).type == "urn:dyknow:problem:log-unavailable"


def test_parameters_checked_by_the_framework_give_problems_too(app: FastAPI, client: Client) -> None:
    @app.get("/counted/{count}", include_in_schema=False)
    def counted(count: int) -> None:
        assert count

    body = get_problem(client, "/counted/many", 422)
    assert body.errors[0].parameter == "count"


def test_a_plain_request_identifier_is_kept(client: Client) -> None:
    kept = client.get("/healthz", headers={"X-Request-Id": "abc-1"}).headers["x-request-id"]
    replaced = client.get("/healthz", headers={"X-Request-Id": "a b"}).headers["x-request-id"]
    assert kept == "abc-1"
    assert re.fullmatch(r"[0-9a-f]{32}", replaced)


def test_a_missing_log_is_refused_at_once(tmp_path: Path) -> None:
    with pytest.raises(LogError, match="got no such file"):
        create_app(str(tmp_path / "a.db"), shipped=())


def test_rows_of_a_running_run_are_served(tmp_path: Path) -> None:
    url = write_log(tmp_path / "a.db", [])
    with Client(create_app(url, shipped=())) as live:
        assert get_events(live).items == []
        write_log(tmp_path / "a.db", [overtake()])
        assert len(get_events(live).items) == 1


def test_openapi_describes_every_route_and_body(client: Client) -> None:
    document: Json = client.get("/openapi.json").json()
    assert document["openapi"].startswith("3.1")
    named = set(re.findall(r'"#/components/schemas/(\w+)"', client.get("/openapi.json").text))
    assert named <= set(document["components"]["schemas"])


def test_openapi_bodies_have_the_keys_that_are_sent(client: Client) -> None:
    schemas = client.get("/openapi.json").json()["components"]["schemas"]
    page = client.get("/api/v1/events").json()
    assert set(page) == set(schemas["EventList"]["required"])
    nothing = client.get("/api/v1/events?type=nosuch&count=exact").json()
    assert set(nothing) == set(schemas["EventList"]["properties"])
    assert set(page["items"][0]) == set(schemas["EventRecord"]["properties"])
    problem = client.get("/api/v1/events?limit=0").json()
    assert set(problem) == set(schemas["Problem"]["properties"]) - {"findings"}


def test_openapi_parameters_are_the_ones_accepted(client: Client) -> None:
    document = client.get("/openapi.json").json()
    parameters = document["paths"]["/api/v1/events"]["get"]["parameters"]
    words = {one["name"]: one["schema"].get("default", "car7") for one in parameters if one["name"] != "roles"}
    words |= {"from": "1s", "to": "2s", "status": "recognised", "min_confidence": "0.5"}
    words |= {"datetime": "1s/..", "min_duration_us": "1", "max_duration_us": "2", "as_of": "3"}
    for name in set(words) - {"cursor"}:
        assert client.get("/api/v1/events", params={name: words[name]}).status_code == 200, name


def test_items_are_the_stored_text_byte_by_byte(client: Client, url: str) -> None:
    with open_log(url) as log:
        stored = ",".join(iterate_events(log, EventFilter()))
    assert stored.encode() in client.get("/api/v1/events").content


PARAMETER_NAMES = ("type", "from", "to", "match", "actor", "role.overtaker", "status", "order", "limit", "cursor")
AWKWARD_VALUES = ("9999-12-31T23:59:59Z", "0001-01-01T00:00:00+23:59", "999999:59:59", "9" * 18, "' or 1=1 --", "%")


@pytest.mark.long
@settings(max_examples=50, deadline=None)
@given(
    name=st.sampled_from(PARAMETER_NAMES),
    value=st.text(max_size=40) | st.from_regex(r"[0-9]{1,25}", fullmatch=True) | st.sampled_from(AWKWARD_VALUES),
)
def test_no_value_of_a_parameter_breaks_the_server(client: Client, name: str, value: str) -> None:
    answer = client.get("/api/v1/events", params={name: value})
    assert answer.status_code in (200, 400, 422), answer.text
    msgspec.json.decode(answer.content, type=EventList if answer.status_code == 200 else Problem)


@given(event_id=st.text(min_size=1, max_size=40).filter(lambda text: text not in (".", "..")))
@settings(max_examples=40, deadline=None)
def test_no_identifier_breaks_the_server(client: Client, event_id: str) -> None:
    assert client.get(f"/api/v1/events/{quote(event_id, safe='')}").status_code in (200, 404)


def test_thousands_of_roles_are_refused_at_once(client: Client) -> None:
    answer = client.get("/api/v1/events?" + "&".join(f"role.r{number}=x" for number in range(3000)))
    assert answer.status_code == 422
    assert answer.json()["detail"] == "role: expected at most 20 roles, got 3000"


def test_a_text_is_checked(client: Client) -> None:
    text = "chronicle met[?a, ?b](t1) { event(clse[?a, ?b]:(false, true), t1) }"
    answer = client.request("POST", "/api/v1/chronicles/check", content=text.encode())
    [error] = [one for one in answer.json()["findings"] if one["severity"] == "error"]
    assert error["range"] == {"start": {"line": 0, "character": 34}, "end": {"line": 0, "character": 38}}
    assert (error["edit"]["newText"], error["file"]) == ("close", "text")
    schema = client.get("/openapi.json").json()["components"]["schemas"]["Finding"]
    assert set(error) == set(schema["properties"]) == set(schema["required"])
    good = client.request("POST", "/api/v1/chronicles/check", content=text.replace("clse", "close").encode())
    assert (good.status_code, good.json()) == (200, {"findings": []})


def test_a_text_that_is_too_long_or_none_is_refused(client: Client) -> None:
    path = "/api/v1/chronicles/check"
    assert client.request("POST", path, content=b"#" * 256_001).status_code == 413
    answer = client.request("POST", path, content=b"\xff")
    assert (answer.status_code, answer.json()["detail"]) == (422, "body: expected UTF-8 text, got byte 0xff")


@given(text=st.from_regex(re.compile(MEDIA_TIME["pattern"], re.ASCII), fullmatch=True))
@settings(max_examples=40, deadline=None)
def test_every_time_that_is_described_is_read(text: str) -> None:
    assert parse_media_us(text, parameter="from") >= 0
