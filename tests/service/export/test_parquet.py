"""Do events and cars come back from Parquet as they are, with types, and in groups of rows?"""

import csv
import io
import random
import sys
from pathlib import Path

import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from service.api.app import create_app
from service.cli.app import run as run_cli
from service.export import parquet as writing
from service.export.events import exported
from service.export.tracks import tracks_parquet
from service.questions.events.queries import EventFilter
from service.store.log import open_log
from tests.service.http import Client
from tests.service.logs import event_of_row, overtake, random_drafts, read_all, state, write_log


@pytest.fixture
def url(tmp_path: Path) -> str:
    odd = overtake(5, 6, roles={"überholer": 'car "7", x'}, hypotheses=(), sub_events=())
    return write_log(tmp_path / "a.db", [*random_drafts(random.Random(3), 60), odd])


def file_of(url: str, **filters: object) -> pq.ParquetFile:
    with open_log(url) as log:
        blocks = exported(log, EventFilter(**filters), "parquet")  # type: ignore[arg-type]  # by name
        return pq.ParquetFile(io.BytesIO(b"".join(blocks)))  # type: ignore[arg-type]  # of bytes, for Parquet


def test_events_are_those_of_csv_with_types(url: str) -> None:
    found = file_of(url).read()
    with open_log(url) as log:
        text = "".join(map(str, exported(log, EventFilter(), "csv")))
    as_csv = list(csv.DictReader(io.StringIO(text, newline="")))
    as_text = [{key: "" if one is None else str(one) for key, one in row.items()} for row in found.to_pylist()]
    assert as_text == as_csv
    assert [event_of_row(row) for row in as_text] == read_all(url)
    kinds = {field.name: field.type for field in found.schema}
    assert (kinds["start_us"], kinds["confidence"], kinds["id"]) == (pa.int64(), pa.float64(), pa.string())
    assert kinds["role.überholer"] == pa.string()
    assert {row["role.überholer"] for row in found.to_pylist()} == {None, 'car "7", x'}


def test_groups_leave_as_they_are_full(url: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(writing, "GROUP", 7)
    file = file_of(url)
    sizes = [file.metadata.row_group(number).num_rows for number in range(file.num_row_groups)]
    assert set(sizes[:-1]) == {7}
    assert sum(sizes) == len(read_all(url))
    with open_log(url) as log:
        assert len([block for block in exported(log, EventFilter(), "parquet") if block]) == len(sizes) + 1


def test_a_file_of_nothing_has_its_columns(url: str) -> None:
    file = file_of(url, types=("nosuch",))
    assert file.metadata.num_rows == 0
    assert file.schema_arrow.names[:3] == ["id", "seq", "type"]


def test_cars_have_the_columns_of_the_truth() -> None:
    blocks = tracks_parquet([state(40_000, "car7", 1.5, -2.0, linked=False, lane="")])
    table = pq.read_table(io.BytesIO(b"".join(blocks)))
    assert table.to_pylist() == [
        {
            "t_us": 40_000, "id": "car7", "class": "car", "x_m": 1.5, "y_m": -2.0, "heading_rad": 0.0,
            "speed_mps": 13.9, "length_m": 4.5, "width_m": 1.8, "road": "road1", "lane": "", "visible": False,
        }
    ]  # fmt: skip


def test_command_and_server_write_the_same_file(url: str, capfdbinary: pytest.CaptureFixture[bytes]) -> None:
    assert run_cli(["events", url, "--format", "parquet", "--type", "overtake"]) == 0
    printed = capfdbinary.readouterr().out
    with Client(create_app(url, shipped=())) as client:
        answer = client.get("/api/v1/events/export?format=parquet&type=overtake")
    assert answer.headers["content-type"] == "application/vnd.apache.parquet"
    assert answer.content == printed
    assert pq.ParquetFile(io.BytesIO(printed)).metadata.num_rows > 0


def test_a_terminal_gets_no_bytes(
    url: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(sys.stdout, "isatty", lambda: True)
    assert run_cli(["events", url, "--format", "parquet"]) == 2
    assert "got a terminal" in capsys.readouterr().err


def test_without_the_library_the_extra_is_named(
    url: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    for command in ("events", "tracks"):
        assert run_cli([command, url, "--format", "parquet"]) == 3
        (line,) = capsys.readouterr().err.splitlines()
        assert "Parquet: expected the extra 'parquet' (pip install 'dyknow[parquet]'), got" in line
    with Client(create_app(url, shipped=())) as client:
        answer = client.get("/api/v1/events/export?format=parquet")
    assert (answer.status_code, answer.json()["type"]) == (501, "urn:dyknow:problem:extra-missing")
