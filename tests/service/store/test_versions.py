"""Logs of older schemas are carried over, whoever opens them, and lose nothing on the way."""

import signal
import sqlite3
import subprocess
import sys
from pathlib import Path

import pytest
from sqlalchemy import inspect

from service.errors import LogError
from service.store import schema
from service.store.databases.location import database_of
from service.store.databases.sqlite_file import SqliteFile
from service.store.log import open_log
from service.store.registers.jobs import Jobs
from tests.service.logs import read_all, run, write_log, write_small_log

SCHEMA_2 = Path(__file__).with_name("schema_2.sql")  # what `write_small_log` wrote when the version was 2
LATE_TABLES = ("seen_objects", "views", "streams", "costs")  # the first two lie in chunks by now
NEW_TABLES = (
    *("streams", "costs", "chunks", "jobs", "webhooks", "undelivered"),
    *("tokens", "audit", "sources", "chronicle_texts"),
)

DIE_WHILE_CARRYING_OVER = """
import os, signal, sys
from service.store import log, versions
versions.update = lambda table: os.kill(os.getpid(), signal.SIGKILL)  # after the tables have changed
log.open_log(sys.argv[1], "w")
"""


def old_log(path: Path, *, without: tuple[str, ...] = ()) -> str:
    """Make a log of schema 2; the tables `without` came while the version stood at 2."""
    with sqlite3.connect(path) as connection:
        connection.executescript(SCHEMA_2.read_text())
        connection.executescript("".join(f"drop table {table};" for table in without))
    connection.close()
    return str(path)


def rows(path: Path) -> dict[str, list[object]]:
    with sqlite3.connect(path) as connection:
        names = [name for (name,) in connection.execute("select name from sqlite_master where type = 'table'")]
        found = {name: connection.execute(f"select * from {name}").fetchall() for name in names}
    connection.close()
    return found


@pytest.mark.parametrize("without", [(), LATE_TABLES], ids=["with late tables", "without"])
@pytest.mark.parametrize("mode", ["r", "w"])
def test_an_older_log_is_read_as_one_of_today(
    tmp_path: Path, mode: str, without: tuple[str, ...], caplog: pytest.LogCaptureFixture
) -> None:
    url = old_log(tmp_path / "old.db", without=without)
    today = write_small_log(tmp_path / "new.db")
    with open_log(url, mode) as old, open_log(today) as new:  # type: ignore[arg-type]  # parametrised
        assert old.runs() == [run(status="finished")]
        for read in ("states", "links", "relations", "objects", "views", "hypotheses", "frames"):
            assert list(getattr(old, read)("r1")) == list(getattr(new, read)("r1"))
        assert (old.cars("r1"), old.streams("r1"), old.costs("r1")) == (new.cars("r1"), (), {})
    assert read_all(url) == read_all(today)
    assert "old.db': carried over from schema version 2 to 11" in caplog.text
    assert caplog.text.count("carried over") == 1


def test_an_older_log_takes_new_runs(tmp_path: Path) -> None:
    url = old_log(tmp_path / "a.db", without=LATE_TABLES)
    write_log(tmp_path / "a.db", [], record=run("r2"))
    with open_log(url) as log:
        assert [one.id for one in log.runs()] == ["r1", "r2"]


def test_the_migrated_schema_is_that_of_a_new_log(tmp_path: Path) -> None:
    from alembic.autogenerate import compare_metadata
    from alembic.migration import MigrationContext

    open_log(old_log(tmp_path / "a.db", without=LATE_TABLES)).close()
    write_log(tmp_path / "new.db", [])
    engine, new = (SqliteFile(tmp_path / name).reading() for name in ("a.db", "new.db"))
    with engine.begin() as connection:
        assert compare_metadata(MigrationContext.configure(connection), schema.metadata) == []
        described = {name: inspect(connection).get_columns(name) for name in NEW_TABLES}
    with new.begin() as connection:
        for name in NEW_TABLES:
            assert _plain(described[name]) == _plain(inspect(connection).get_columns(name))
    engine.dispose()
    new.dispose()


def _plain(columns: list[object]) -> list[str]:
    return [str(column) for column in columns]


def test_a_log_that_cannot_be_written_is_read_from_a_copy(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    url = old_log(tmp_path / "a.db")
    before = (tmp_path / "a.db").read_bytes()
    monkeypatch.setattr(SqliteFile, "can_write", lambda _: False)
    assert [event.type for event in read_all(url)] == ["overtake", "pass"]
    assert (tmp_path / "a.db").read_bytes() == before
    assert "cannot be written, so it is read from a copy" in caplog.text


@pytest.mark.long
def test_a_kill_while_a_log_is_carried_over_loses_nothing(tmp_path: Path) -> None:
    url = old_log(tmp_path / "a.db")
    before = rows(tmp_path / "a.db")
    killed = subprocess.run([sys.executable, "-c", DIE_WHILE_CARRYING_OVER, url], check=False)
    assert killed.returncode == -signal.SIGKILL
    assert rows(tmp_path / "a.db") == before
    assert len(read_all(url)) == 2


def test_jobs_are_added_to_an_older_log(tmp_path: Path) -> None:
    url = old_log(tmp_path / "a.db")
    jobs = Jobs(database_of(url))
    assert jobs.add("one", "{}").number == 1
    jobs.close()
    assert len(read_all(url)) == 2


@pytest.mark.long
def test_what_needs_no_migration_loads_no_alembic(tmp_path: Path) -> None:
    url = write_log(tmp_path / "a.db", [])
    program = (
        "import sys; from service.store.log import open_log; open_log(sys.argv[1], 'w').close(); "
        "assert 'alembic' not in sys.modules"
    )
    subprocess.run([sys.executable, "-c", program, url], check=True)


@pytest.mark.parametrize(
    ("version", "hint"), [("99", "a newer dyknow reads it"), ("1", "process the input again into a new log")]
)
def test_a_log_of_another_version_is_refused(tmp_path: Path, version: str, hint: str) -> None:
    path = tmp_path / "a.db"
    write_log(path, [])
    with sqlite3.connect(path) as connection:
        connection.execute("update meta set value = ? where key = 'schema_version'", (version,))
    connection.close()
    with pytest.raises(LogError, match=f"expected schema version 2 to 11, got '{version}'; {hint}"):
        open_log(str(path))
