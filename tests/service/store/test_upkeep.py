"""A log says what it holds and what of it is damaged, and loses what is old and nothing else."""

import json
import sqlite3
from pathlib import Path

import pytest

from service.cli.app import run as dyknow
from service.errors import LogError
from service.store.databases.location import database_of
from service.store.log import open_log
from service.store.upkeep import damage, holdings, prune
from tests.service.logs import SECOND_US, START_UTC_US, kept_rows, overtake, run, state, write_log, write_small_log

MINUTE_US = 60_000_000


def minute_log(path: Path, **fields: object) -> str:
    """Write a minute of a car, with an overtake every ten seconds."""
    with open_log(str(path), "w") as log:
        writer = log.begin_run(run(**({"start_from": "option"} | fields)))
        for t_us in range(0, MINUTE_US, 80_000):
            writer.append_frames([t_us])
            writer.append_states([state(t_us, "car7", t_us / 1e5)])
        writer.append_events([overtake(t_us) for t_us in range(0, MINUTE_US, 10_000_000)])
        writer.append_events([overtake(0, revises="r1-1", status="confirmed")])
        writer.finish("finished")
    return str(path)


def test_a_log_says_what_it_holds(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    url = minute_log(tmp_path / "a.db")
    with open_log(url) as log:
        held = {one.kind: one for one in holdings(log, "r1")}
    assert {kind: one.rows for kind, one in held.items()} == {"events": 7, "car_states": 750, "frames": 750}
    assert (held["car_states"].first_us, held["car_states"].last_us) == (0, MINUTE_US - 80_000)
    assert 0 < held["car_states"].size_bytes < 750 * 4
    assert dyknow(["log", "info", url]) == 0
    assert "run r1 of demo.mp4, finished: 00:00.000 to 00:59.920" in capsys.readouterr().out
    assert dyknow(["log", "info", url, "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["runs"][0]["holds"][1]["rows"] == 750


def test_all_of_a_log_can_be_read_or_it_is_said_what_not(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    url = minute_log(tmp_path / "a.db")
    assert dyknow(["log", "verify", url]) == 0
    with sqlite3.connect(url) as connection:
        connection.execute(
            "update chunks set data = substr(data, 1, 90) where kind = 'car_states' and span_us = 20000000"
        )
        connection.execute("update chunks set rows = 3 where kind = 'frames' and span_us = 0")
        connection.execute("update chunks set data = null where kind = 'car_states' and span_us = 0")  # as if pruned
    connection.close()
    capsys.readouterr()
    assert dyknow(["log", "verify", url]) == 3
    first, second = capsys.readouterr().err.splitlines()
    assert first.startswith(
        "error: run 'r1': car_states of 00:20.000 to 00:30.000 are damaged: expected the bytes that "
    )
    assert second.startswith("error: run 'r1': frames of 00:00.000 to 00:10.000 are other than their row says: ")


def test_what_is_old_goes_and_nothing_else(tmp_path: Path) -> None:
    url = minute_log(tmp_path / "a.db")
    before = kept_rows(Path(url))
    size_bytes = Path(url).stat().st_size
    now_us = START_UTC_US + MINUTE_US
    with open_log(url, "w") as log:
        keep_us = {"car_states": 35_000_000, "events": 25_000_000}
        would_go = prune(log, keep_us, now_us, dry_run=True)
        assert kept_rows(Path(url)) == before
        removed = prune(log, keep_us, now_us)
        assert removed == would_go
        # Whole chunks go: that from 20 s on reaches into the time that is kept.
        assert [(one.kind, one.rows) for one in removed] == [("car_states", 250), ("events", 5)]
        assert prune(log, keep_us, now_us) == [type(one)(one.kind, 0, 0) for one in removed]
        assert {one.kind: (one.rows, one.pruned) for one in holdings(log, "r1")} == {
            "events": (2, 0),
            "car_states": (500, 250),
            "frames": (750, 0),
        }
    after = kept_rows(Path(url))
    assert after["states"] == [one for one in before["states"] if one.t_us >= 20_000_000]
    assert after | {"states": [], "events": []} == before | {"states": [], "events": []}
    assert Path(url).stat().st_size <= size_bytes
    with sqlite3.connect(url) as connection:
        assert connection.execute("select count(*) from event_roles").fetchone() == (4,)
        assert connection.execute("select count(*) from revisions").fetchone() == (0,)
    connection.close()
    with open_log(url) as log:
        assert list(damage(log)) == []


def test_what_ends_as_the_kept_time_begins_is_kept(tmp_path: Path) -> None:
    with open_log(write_log(tmp_path / "a.db", [overtake(0, SECOND_US)], record=run(start_from="site")), "w") as log:
        start_us = log.run().start_utc_us
        assert start_us is not None
        assert [one.rows for one in prune(log, {"events": MINUTE_US}, start_us + MINUTE_US + SECOND_US)] == [0]
        assert [one.rows for one in prune(log, {"events": MINUTE_US}, start_us + MINUTE_US + SECOND_US + 1)] == [1]


def test_a_run_of_which_nobody_knows_when_it_was_stays_whole(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    url = minute_log(tmp_path / "a.db", start_from="unknown")
    assert dyknow(["log", "prune", url, "--keep", "car_states=1d"]) == 0
    printed = capsys.readouterr()
    assert "note: run 'r1' of demo.mp4 stays whole: nobody says when it was" in printed.err
    assert len(kept_rows(Path(url))["states"]) == 750


def test_frames_and_unknown_kinds_are_not_pruned(tmp_path: Path) -> None:
    with open_log(write_small_log(tmp_path / "a.db"), "w") as log:
        for kind in ("frames", "cars", ""):
            with pytest.raises(LogError, match=f"prune: expected kinds among events, audit, car_.* got '{kind}'"):
                prune(log, {kind: 0}, START_UTC_US)


@pytest.mark.parametrize("given", ["car_states", "car_states=", "car_states=7 days", "car_states=-1d"])
def test_ages_that_are_none_are_refused(given: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    url = write_small_log(tmp_path / "a.db")
    assert dyknow(["log", "prune", url, "--keep", given]) == 2
    assert f"--keep: expected KIND=AGE such as car_states=7d, relations=36h or views=90min, got {given!r}" in (
        capsys.readouterr().err
    )


def test_a_time_that_is_not_on_the_calendar_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    url = write_small_log(tmp_path / "a.db")
    assert dyknow(["log", "prune", url, "--keep", "events=1d", "--now", "12.5s"]) == 2
    assert "such as 2026-05-01T08:00:00Z, got '12.5s'" in capsys.readouterr().err


def test_a_backup_taken_while_a_run_is_written_is_one_state_of_the_log(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    url, copy = minute_log(tmp_path / "a.db"), tmp_path / "copy.db"
    before = kept_rows(url)
    with open_log(url, "w") as log:
        writer = log.begin_run(run("r2"))
        writer.append_events([overtake()])
        writer.append_frames([0])  # not committed yet
        assert dyknow(["log", "backup", url, str(copy), "--json"]) == 0
        writer.finish("finished")
    told = json.loads(capsys.readouterr().out)
    assert (told["to"], told["bytes"], told["damage"]) == (str(copy), copy.stat().st_size, [])
    assert dyknow(["log", "restore", str(copy), str(tmp_path / "again.db")]) == 0
    with open_log(str(tmp_path / "again.db")) as log:
        assert [(one.id, one.status) for one in log.runs()] == [("r1", "finished"), ("r2", "running")]
    with sqlite3.connect(tmp_path / "again.db") as connection:
        connection.execute("delete from runs where id = 'r2'")
    connection.close()
    assert kept_rows(str(tmp_path / "again.db")) == before
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a.db", "again.db", "copy.db"]


@pytest.mark.parametrize("there", ["b.db", "b.db-wal"], ids=["the log", "a journal that was left"])
def test_neither_backup_nor_restore_overwrites(tmp_path: Path, capsys: pytest.CaptureFixture[str], there: str) -> None:
    url = minute_log(tmp_path / "a.db")
    (tmp_path / there).write_text("mine")
    for command in (["backup", url, str(tmp_path / "b.db")], ["restore", url, str(tmp_path / "b.db")]):
        assert dyknow(["log", *command]) == 3
        assert f"{tmp_path / there}: expected no such file, got one" in capsys.readouterr().err
    assert (tmp_path / there).read_text() == "mine"


@pytest.mark.long
def test_a_backup_of_what_is_no_log_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "text.db").write_text("no database at all, whatever its name says" * 30)
    (tmp_path / "empty.db").touch()
    target = str(tmp_path / "copy.db")
    for source, told in (("text", "not a database"), ("empty", "an empty database"), ("missing", "no such file")):
        assert dyknow(["log", "restore", str(tmp_path / f"{source}.db"), target]) == 3
        assert told in capsys.readouterr().err
    minute_log(tmp_path / "a.db")
    assert dyknow(["log", "backup", str(tmp_path / "a.db"), str(tmp_path / "nowhere" / "copy.db")]) == 3
    assert "expected an existing folder" in capsys.readouterr().err
    assert not Path(target).exists()


def test_a_backup_keeps_a_damaged_chunk_and_says_so(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    url = minute_log(tmp_path / "a.db")
    with sqlite3.connect(url) as connection:
        connection.execute("update chunks set data = substr(data, 1, 90) where kind = 'car_states' and span_us = 0")
    connection.close()
    assert dyknow(["log", "backup", url, str(tmp_path / "copy.db")]) == 3
    assert "car_states of 00:00.000 to 00:10.000 are damaged" in capsys.readouterr().err
    assert dyknow(["log", "info", str(tmp_path / "copy.db")]) == 0


def test_a_backup_leaves_an_older_schema_as_it_is(tmp_path: Path) -> None:
    old = tmp_path / "old.db"
    with sqlite3.connect(old) as connection:
        connection.executescript((Path(__file__).parent / "schema_2.sql").read_text())
    connection.close()
    assert dyknow(["log", "backup", str(old), str(tmp_path / "copy.db")]) == 0
    for path in (old, tmp_path / "copy.db"):
        with sqlite3.connect(path) as connection:
            assert connection.execute("select value from meta where key = 'schema_version'").fetchone() == ("2",)
        connection.close()
    with open_log(str(tmp_path / "copy.db")) as log:
        assert len(log.runs()) > 0


def test_a_log_on_a_server_is_backed_up_by_its_own_programs(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    server = "postgresql+psycopg://road:secret@db.example/log"
    with pytest.raises(LogError, match=r"log 'postgresql.*:\*\*\*@db.example/log': .* pg_dump backs up"):
        database_of(server).back_up(tmp_path / "copy.db")
    assert dyknow(["log", "restore", minute_log(tmp_path / "a.db"), server]) == 3
    assert "which pg_restore fills" in capsys.readouterr().err
