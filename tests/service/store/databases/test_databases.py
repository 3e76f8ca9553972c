"""Is a log on a server what it is in a file?"""

import shutil
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest
from sqlalchemy import create_engine, text

from service.api.app import create_app
from service.cli.app import run as run_cli
from service.errors import LogError, RunBusyError
from service.questions.events.queries import EventFilter, decode_event, iterate_events
from service.runs.processing import RunRequest, process
from service.store.entries import Written
from service.store.log import open_log
from service.store.registers.access import list_written, note_written
from service.store.upkeep import Pruned, damage, holdings, prune
from tests.service.conftest import NewLog
from tests.service.http import Client
from tests.service.logs import kept_rows, overtake, read_all, read_rows, run, write_log

DAY_US = 86_400_000_000


@pytest.fixture(scope="module")
def both(
    small_scene: Path, tracks_log: Path, postgres: NewLog, tmp_path_factory: pytest.TempPathFactory
) -> tuple[str, str]:
    """One run in a file, and the same on the server."""
    file, server = shutil.copy(tracks_log, tmp_path_factory.mktemp("both") / "a.db"), postgres()
    process(RunRequest(small_scene / "truth.csv", small_scene / "site.toml", server))
    return f"sqlite:///{file}", server


@pytest.mark.long
def test_a_run_has_the_same_rows_in_a_file_and_on_a_server(both: tuple[str, str]) -> None:
    file, server = map(kept_rows, both)
    assert file == server
    assert len(file["events"]) > 10


def test_a_server_is_asked_over_http_and_says_why(both: tuple[str, str]) -> None:
    answers = []
    for url in both:
        event = next(one for one in read_all(url) if one.type == "overtake")
        with Client(create_app(url)) as client:
            paths = ("events?limit=5", f"events/{event.id}/why", "chronicles/overtake/why-not?limit=2", "cars")
            answers.append([client.get(f"/api/v1/{path}").content for path in paths])
    assert answers[0] == answers[1]


def test_a_server_is_asked_by_commands(both: tuple[str, str], capsys: pytest.CaptureFixture[str]) -> None:
    printed = []
    for url in both:
        for command in (["events", url, "--json"], ["objects", url], ["log", "verify", url], ["recognise", url]):
            assert run_cli(command) == 0
        printed.append(capsys.readouterr().out.replace(url, "LOG"))
    assert printed[0] == printed[1]


def test_numbers_are_taken_once_by_runs_that_are_written_together(new_log: NewLog) -> None:
    url = new_log()

    def write(number: int) -> None:
        with open_log(url, "w") as log:
            writer = log.begin_run(run(f"r{number}"))
            for start_us in range(20):
                writer.append_events([overtake(start_us)])
                writer.flush()
            writer.finish("finished")

    with ThreadPoolExecutor(4) as pool:
        list(pool.map(write, range(4)))
    assert [event.seq for event in read_rows(url)] == list(range(1, 81))
    with open_log(url) as log:
        assert sorted(one.id for one in log.runs()) == ["r0", "r1", "r2", "r3"]


def test_what_is_read_in_one_go_is_one_state(new_log: NewLog, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("service.questions.events.queries.MAX_LIMIT", 1)
    url = write_log(new_log(), [overtake(0), overtake(2)])
    with open_log(url) as log:
        reading = iterate_events(log, EventFilter())
        assert decode_event(next(reading)).start_us == 0
        write_log(url, [overtake(1)], record=run("r2"))
        assert [decode_event(one).start_us for one in reading] == [2]
        assert len(list(iterate_events(log, EventFilter()))) == 3


def test_old_rows_are_pruned_on_both(new_log: NewLog) -> None:
    url = write_log(new_log(), [overtake(0), overtake(3 * DAY_US)], record=run(start_from="site"))
    with open_log(url, "w") as log:
        now_us = log.run().start_utc_us + 4 * DAY_US
        assert [(one.kind, one.rows) for one in prune(log, {"events": 2 * DAY_US}, now_us)] == [("events", 1)]
        assert [(one.kind, one.rows) for one in holdings(log, "r1")] == [("events", 1)]
        assert list(damage(log)) == []


def test_old_rows_of_the_audit_are_pruned_whatever_the_runs_are(new_log: NewLog) -> None:
    url = write_log(new_log(), [overtake()], record=run(start_from="unknown"))
    with open_log(url, "w") as log:
        for day in range(4):
            note_written(log, Written(day * DAY_US, "office", "PUT", "/api/v1/ä", 204, str(day)))
        keep_us, now_us = {"audit": 2 * DAY_US}, 4 * DAY_US
        would_go = prune(log, keep_us, now_us, dry_run=True)
        assert len(list_written(log, limit=9)) == 4
        assert prune(log, keep_us, now_us) == would_go == [Pruned("audit", 2, 2 * len("officePUT/api/v1/ä0"))]
        assert [one.request_id for one in list_written(log, limit=9)] == ["3", "2"]
        assert [(one.kind, one.rows) for one in holdings(log, "r1")] == [("events", 1)]


def test_a_server_that_does_not_answer_is_told_without_its_password() -> None:
    for mode in ("r", "w"):
        with pytest.raises(LogError, match=r"road:\*\*\*@127\.0\.0\.1:1/x.*expected a server that answers") as refused:
            open_log("postgresql+psycopg://road:secret@127.0.0.1:1/x", mode)  # type: ignore[arg-type]
        assert "secret" not in str(refused.value)


@pytest.mark.long
def test_a_server_that_was_restarted_is_asked_as_before(postgres: NewLog) -> None:
    url = write_log(postgres(), [overtake()])
    with Client(create_app(url, shipped=[])) as client, open_log(url, "w") as log:
        assert client.get("/api/v1/events").status_code == 200
        writer = log.begin_run(run("r2"))
        end_all_connections(url)
        assert client.get("/api/v1/events").status_code == 200
        # What is written at that moment is not: its run is left as far as it came, and is processed anew.
        writer.append_events([overtake(5)])
        writer.flush()
        assert len(read_all(url)) == 2


def test_a_run_keeps_its_lock_over_a_restart_and_ends_where_somebody_else_has_it(postgres: NewLog) -> None:
    url = postgres()
    with open_log(url, "w") as log, open_log(url, "w") as other:
        writer = log.begin_run(run())
        end_all_connections(url)
        writer.append_events([overtake()])
        writer.flush()
        with pytest.raises(RunBusyError, match="expected run 'r1' to be free"):
            other.begin_run(run())
        end_all_connections(url)
        second = other.begin_run(run())
        writer.append_events([overtake(5)])
        with pytest.raises(RunBusyError, match="expected run 'r1' to stay ours, got another writer since"):
            writer.finish("finished")
        second.append_events([overtake(), overtake(5), overtake(6)])
        second.finish("finished")
    assert len(read_all(url)) == 3


def end_all_connections(url: str) -> None:
    engine = create_engine(url)
    with engine.begin() as connection:
        others = "datname = current_database() AND pid <> pg_backend_pid()"
        connection.execute(text(f"SELECT pg_terminate_backend(pid) FROM pg_stat_activity WHERE {others}"))
    engine.dispose()


def test_an_empty_database_is_no_log_to_read(postgres: NewLog) -> None:
    with pytest.raises(LogError, match="expected an event log, got an empty database"):
        open_log(postgres())


def test_an_address_that_is_none_is_refused() -> None:
    with pytest.raises(LogError, match=r"expected postgresql\+psycopg://USER:PASSWORD@HOST:PORT/DATABASE"):
        open_log("postgresql+psycopg://road@host:port/x")
