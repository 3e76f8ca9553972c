"""Do counts and files of events hold what the list of events has?"""

import csv
import io
from collections.abc import Iterator

import msgspec
import pytest

from service.api.app import create_app
from service.api.messages.bodies import EventSummary
from service.cli.app import run
from service.records.events import EventRecord
from tests.service.http import Client
from tests.service.logs import SECOND_US, event_of_row, overtake, read_all, write_log
from tests.service.logs import run as run_record


@pytest.fixture(scope="module")
def url(tmp_path_factory: pytest.TempPathFactory) -> str:
    drafts = [overtake(second * SECOND_US) for second in range(25)]
    other = overtake(7 * SECOND_US, type="pass", roles={"passer": "car1", "passed": "truck 2"}, place=None)
    return write_log(tmp_path_factory.mktemp("files") / "a.db", [*drafts, other])


@pytest.fixture(scope="module")
def client(url: str) -> Iterator[Client]:
    with Client(create_app(url, shipped=())) as client:
        yield client


def test_lines_are_the_stored_events(client: Client, url: str) -> None:
    answer = client.get("/api/v1/events/export")
    assert answer.headers["content-disposition"] == 'attachment; filename="events.jsonl"'
    assert msgspec.json.decode(f"[{','.join(answer.text.splitlines())}]", type=list[EventRecord]) == (read_all(url))


def test_a_csv_file_is_that_of_the_command_line(
    client: Client, url: str, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    assert run(["events", url, "--format", "csv", "--order", "-start"]) == 0
    printed = capsys.readouterr().out
    monkeypatch.setattr("service.questions.events.queries.MAX_LIMIT", 7)
    answer = client.get("/api/v1/events/export?format=csv&order=-start")
    assert answer.headers["content-type"].startswith("text/csv")
    assert answer.text == printed
    assert len([event_of_row(row) for row in csv.DictReader(io.StringIO(answer.text))]) == 26


def test_a_csv_file_of_nothing_has_its_header(client: Client) -> None:
    assert client.get("/api/v1/events/export?format=csv&type=nosuch").text.startswith("id,seq,type")


def test_counts_come_with_bins(client: Client) -> None:
    answer = client.get("/api/v1/events/summary?bin_us=10000000&type=overtake&type=pass")
    found = msgspec.json.decode(answer.content, type=EventSummary)
    assert [(one.key, one.count, one.bins) for one in found.items] == [
        ("overtake", 25, [(0, 10), (10_000_000, 10), (20_000_000, 5)]),
        ("pass", 1, [(0, 1)]),
    ]
    assert (found.as_of_seq, found.by, found.bin_us) == (26, "type", 10_000_000)


@pytest.mark.parametrize(
    ("path", "parameter"),
    [
        ("summary?by=car", "by"), ("summary?bin_us=0", "bin_us"),
        ("summary?limit=1001", "limit"), ("summary?cursor=x", "cursor"), ("export?limit=1", "limit"),
        ("export?format=xml", "format"), ("summary?datetime=1s", "datetime"),
        ("summary?min_duration_us=-1", "min_duration_us"),
    ],
)  # fmt: skip
def test_a_wrong_parameter_is_named(client: Client, path: str, parameter: str) -> None:
    answer = client.get(f"/api/v1/events/{path}")
    assert (answer.status_code, answer.json()["errors"][0]["parameter"]) == (422, parameter)


def test_what_is_wrong_together_only_is_another_error(client: Client) -> None:
    assert client.get("/api/v1/events/summary?bin_us=1").status_code == 400  # more than may be, of what is in this log
    answer = client.get("/api/v1/events/summary?datetime=1s/2s&to=3s")
    assert (answer.status_code, answer.json()["detail"]) == (400, "datetime: expected it without from and to, got both")


@pytest.mark.parametrize(
    ("query", "count"), [("", 26), ("datetime=5s/..", 23), ("datetime=../5s", 5), ("datetime=2026-05-01T08:00:24Z/", 3)]
)
def test_all_events_of_a_page_are_counted(client: Client, query: str, count: int) -> None:
    assert client.get(f"/api/v1/events?count=exact&limit=1&{query}").json()["count"] == count


def test_a_page_of_then_is_the_same_to_the_byte(client: Client, url: str) -> None:
    then = client.get("/api/v1/events?as_of=20&count=exact").content
    write_log(url, [overtake(3 * SECOND_US)], record=run_record("r2"))
    assert client.get("/api/v1/events?as_of=20&count=exact").content == then
    assert client.get("/api/v1/events?as_of=99").status_code == 400
