"""Do routes about runs say what is known of a run, and which time it looked at?"""

from collections.abc import Iterator
from pathlib import Path

import msgspec
import pytest

from service.api.app import create_app
from service.api.messages.bodies import CarList, RunDetail, RunList
from service.questions.events.queries import EventFilter
from service.questions.observations.coverage import MAX_RUNS, Coverage
from service.records.runs import InputFile, StreamRecord
from service.records.seen import ViewRecord
from service.store.log import open_log
from tests.service.http import Client
from tests.service.logs import SECOND_US, overtake, run, state, write_log, write_small_log

FILE = InputFile(path="/secret/place/demo.mp4", size_bytes=7, digest="d")


@pytest.fixture(scope="module")
def client(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Client]:
    """A run of ten seconds that lost its view for two, and one that is being written."""
    url = str(tmp_path_factory.mktemp("runs") / "a.db")
    with open_log(url, "w") as log:
        writer = log.begin_run(run("r1", file=FILE))
        writer.append_frames([second * SECOND_US for second in range(11)])
        writer.append([ViewRecord(4 * SECOND_US, ()), ViewRecord(6 * SECOND_US, (1.0,) * 9)])
        writer.append_states([state(0, "car7")])
        writer.append_events([overtake(8 * SECOND_US)])
        writer.append_streams([StreamRecord(label="cars", kind="refinement", made_of="x", type="T", inputs=())])
        writer.append_costs({"cars": 5})
        writer.finish("finished")
        log.begin_run(run("r2", source="other.mp4"))
        with Client(create_app(url, shipped=())) as client:
            yield client


def test_a_run_looked_at_what_it_covers_but_for_the_lost_view(client: Client) -> None:
    found = msgspec.json.decode(client.get("/api/v1/runs").content, type=RunList).items
    assert [(one.id, one.status, one.looked_at_us) for one in found] == [
        ("r1", "finished", ((0, 4 * SECOND_US), (6 * SECOND_US, 10 * SECOND_US))),
        ("r2", "running", ()),
    ]


@pytest.mark.parametrize(
    ("query", "ids"), [("status=running", ["r2"]), ("source=demo.mp4&source=x", ["r1"]), ("source=x", [])]
)
def test_runs_are_chosen_by_source_and_status(client: Client, query: str, ids: list[str]) -> None:
    assert [one["id"] for one in client.get(f"/api/v1/runs?{query}").json()["items"]] == ids


def test_a_run_tells_what_it_holds_and_no_path_of_the_server(client: Client) -> None:
    answer = client.get("/api/v1/runs/r1")
    found = msgspec.json.decode(answer.content, type=RunDetail)
    assert (found.covered_us, found.lost_us) == ((0, 10 * SECOND_US), ((4 * SECOND_US, 6 * SECOND_US),))
    assert {one.kind: one.rows for one in found.holds} == {"events": 1, "car_states": 1, "frames": 11, "views": 2}
    assert found.file is not None
    assert found.file.path == "demo.mp4"
    assert "secret" not in answer.text


def test_streams_of_a_run_come_with_their_cost(client: Client) -> None:
    (stream,) = client.get("/api/v1/runs/r1/streams").json()["streams"]
    assert (stream["label"], stream["busy_us"]) == ("cars", 5)
    assert client.get("/api/v1/runs/r2/streams").status_code == 404


@pytest.mark.parametrize("path", ["/api/v1/runs/r9", "/api/v1/runs/r9/streams"])
def test_an_unknown_run_is_not_in_the_log(client: Client, path: str) -> None:
    assert client.get(path).json()["type"] == "urn:dyknow:problem:not-in-log"


@pytest.mark.parametrize("path", ["runs?x=r1", "runs/r1?x=1", "runs/r1/streams?x=1", "cars?x=r1"])
def test_a_parameter_that_is_not_taken_is_named(client: Client, path: str) -> None:
    answer = client.get(f"/api/v1/{path}")
    assert (answer.status_code, answer.json()["errors"][0]["parameter"]) == (422, "x")


@pytest.mark.parametrize(("query", "ids"), [("", ["r1", "r2"]), ("run=r2", ["r2"]), ("source=demo.mp4", ["r1"])])
def test_a_page_of_events_tells_of_the_runs_that_were_asked_about(client: Client, query: str, ids: list[str]) -> None:
    assert [one["run"] for one in client.get(f"/api/v1/events?{query}").json()["looked_at"]] == ids


def test_cars_come_with_the_time_that_was_looked_at(client: Client) -> None:
    found = msgspec.json.decode(client.get("/api/v1/cars?run=r1").content, type=CarList)
    assert [one.spans_us for one in found.looked_at] == [((0, 4 * SECOND_US), (6 * SECOND_US, 10 * SECOND_US))]


def test_what_a_growing_run_looked_at_grows(tmp_path: Path) -> None:
    with open_log(str(tmp_path / "a.db"), "w") as log:
        writer = log.begin_run(run())
        writer.append_frames([0, SECOND_US])
        writer.flush()
        coverage = Coverage(log, look_every_s=0)
        before = coverage.of_all()["r1"]
        writer.append_frames([25 * SECOND_US])
        writer.flush()
        assert (before.spans_us, coverage.of_all()["r1"].spans_us) == (((0, SECOND_US),), ((0, 25 * SECOND_US),))


@pytest.mark.long
def test_of_too_many_runs_nothing_is_told_beside_a_page(tmp_path: Path) -> None:
    for number in range(MAX_RUNS + 1):
        url = write_log(tmp_path / "a.db", [], record=run(f"r{number}"))
    with open_log(url) as log:
        coverage = Coverage(log)
        assert coverage.of(EventFilter()) is None
        assert len(coverage.of(EventFilter(runs=("r1", "r2"))) or ()) == 2
        assert len(coverage.of_all()) == MAX_RUNS + 1


def test_a_small_log_answers_by_the_framework_as_it_is_described(tmp_path: Path) -> None:
    with Client(create_app(write_small_log(tmp_path / "a.db"), shipped=())) as client:
        schemas = client.get("/openapi.json").json()["components"]["schemas"]
        assert set(client.get("/api/v1/runs/r1").json()) == set(schemas["RunDetail"]["properties"])
