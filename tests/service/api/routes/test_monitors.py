"""Do monitors over HTTP tell what the command line tells?"""

import json
from collections.abc import Iterator
from pathlib import Path

import pytest

from service.api.app import create_app
from service.cli.app import run
from tests.service.http import Client
from tests.service.runs.graph.test_stream_processes import APART, LIMIT, run_race, written


@pytest.fixture(scope="module")
def url(tmp_path_factory: pytest.TempPathFactory) -> str:
    return run_race(tmp_path_factory.mktemp("race"), LIMIT)


@pytest.fixture(scope="module")
def client(url: str) -> Iterator[Client]:
    with Client(create_app(url)) as client:
        yield client


@pytest.mark.long
def test_a_trial_is_what_the_command_line_tells(
    client: Client, url: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(["monitor", url, str(written(tmp_path, "b.monitors", APART)), "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    found = client.request("POST", "/api/v1/monitors/try", json={"text": APART}).json()
    assert (found["run"], found["items"], found["monitors"]) == (told["run"], told["events"], told["monitors"])
    assert found["count"] == len(told["events"]) > 0
    assert found["looked_at"][0]["run"] == found["run"]


def test_what_the_monitors_of_a_run_told_are_events(client: Client) -> None:
    [listed] = client.get("/api/v1/runs").json()["items"]
    [monitor] = client.get(f"/api/v1/runs/{listed['id']}").json()["monitors"]
    assert (monitor["name"], monitor["text"].startswith("monitor limit")) == ("limit", True)
    found = client.request("POST", "/api/v1/monitors/try", json={"text": monitor["text"]}).json()
    events = client.get(f"/api/v1/events?run={listed['id']}&chronicle=limit").json()["items"]
    assert [(one["type"], one["roles"]) for one in events] == [
        (f"limit_{one['outcome']}", one["roles"]) for one in found["items"]
    ]


@pytest.mark.parametrize(
    ("body", "status", "told"),
    [
        ({"text": LIMIT.replace("speed[", "spead[")}, 422, "did you mean 'speed'?"),
        ({"text": "# nothing"}, 409, "text: expected at least one monitor, got none"),
        ({"text": LIMIT, "run": "r9"}, 404, "expected a run 'r9'"),
        ({"text": LIMIT, "from": "1s"}, 422, "from: expected no such parameter"),
        ({}, 422, "text: expected a value, got none"),
    ],
)
def test_what_cannot_be_tried_is_a_problem(client: Client, body: dict[str, str], status: int, told: str) -> None:
    answer = client.request("POST", "/api/v1/monitors/try", json=body)
    assert (answer.status_code, told in answer.json()["detail"]) == (status, True), answer.text
    assert bool(answer.json().get("findings")) == ("spead" in body.get("text", ""))
