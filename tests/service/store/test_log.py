"""Does the event log keep what a run writes, and refuse what it cannot hold?"""

import random
import sqlite3
from pathlib import Path

import msgspec
import pytest
from sqlalchemy import text

from service.errors import LogError
from service.questions.events.queries import decode_event
from service.records.runs import RunStatus
from service.records.seen import CarRecord, LinkRecord, RelationRecord
from service.store.chunks.kinds import SPAN_US
from service.store.log import open_log
from tests.service.conftest import NewLog
from tests.service.logs import count_rows, overtake, random_drafts, read_all, run, state, write_log, write_small_log


def test_what_a_run_wrote_is_read_back(new_log: NewLog) -> None:
    url = write_small_log(new_log())
    with open_log(url) as log:
        assert log.runs() == [run(status="finished")]
        assert list(log.frames("r1")) == [(1, 0), (2, 40_000), (3, 80_000)]
        assert log.cars("r1") == [CarRecord("car7", 1, "car", 0, 80_000), CarRecord("car10", 2, "car", 0, 80_000)]
        assert list(log.links("r1")) == [
            LinkRecord(0, "established", "car", "o1", "car7", "seen for 0.5 s", "o1->car7#1")
        ]
        assert list(log.relations("r1")) == [
            RelationRecord(10_000, 40_000, "behind", ("car7", "car10"), "unknown", "true", ("v1->w1#1",)),
            RelationRecord(20_000, 40_000, "moving", ("car7",), "false", "true"),
            RelationRecord(30_000, 40_000, "turn", ("car7", "from", "j1"), "unknown", "left"),
        ]
        assert [one.name for one in log.relations("r1", names=["moving"])] == ["moving"]
        assert [one.name for one in log.relations("r1", about=["car10"])] == ["behind"]
        assert [one.name for one in log.relations("r1", about=["car1", "car"])] == []
        assert [one.name for one in log.relations("r1", about=["car7", "j1"], from_us=20_000)] == ["moving", "turn"]
        assert [one.label for one in log.links("r1", uppers=["car7"])] == ["o1->car7#1"]
        assert list(log.links("r1", uppers=["car10"])) == []
        assert log.life_us("r1", ["car7", "j1"]) == (0, 80_000)
        assert log.life_us("r1", ["j1"]) is None


def test_states_come_in_the_order_of_time_and_first_sight(new_log: NewLog) -> None:
    with open_log(write_small_log(new_log())) as log:
        states = list(log.states("r1"))
        assert [(one.t_us, one.car) for one in states[:3]] == [(0, "car7"), (0, "car10"), (40_000, "car7")]
        assert states[-1] == state(80_000, "car10", 9.0, 5.0, linked=False)
        assert [one.t_us for one in log.states("r1", cars=("car10",), from_us=40_000, to_us=80_000)] == [40_000]
        assert list(log.states("r1", cars=("car99",))) == []


def test_an_event_comes_back_with_its_number_and_utc_times(new_log: NewLog) -> None:
    (event,) = read_all(write_log(new_log(), [overtake(12_500_000)]))
    assert (event.id, event.seq, event.run, event.source) == ("r1-1", 1, "r1", "demo.mp4")
    assert (event.start, event.end) == ("2026-05-01T08:00:12.500000Z", "2026-05-01T08:00:15.500000Z")
    assert event.roles == {"overtaker": "car7", "overtaken": "car3"}


def test_the_same_input_gives_the_same_rows(tmp_path: Path) -> None:
    drafts = random_drafts(random.Random(1), 50)
    first = write_log(tmp_path / "a.db", drafts)
    second = write_log(tmp_path / "b.db", drafts)
    assert read_all(first) == read_all(second)
    assert _dump(tmp_path / "a.db") == _dump(tmp_path / "b.db")


def test_opening_for_writing_creates_nothing(tmp_path: Path) -> None:
    with open_log(str(tmp_path / "a.db"), "w"):
        assert list(tmp_path.iterdir()) == []


def test_closing_leaves_one_file(tmp_path: Path) -> None:
    write_small_log(tmp_path / "a.db")
    assert [path.name for path in tmp_path.iterdir()] == ["a.db"]
    read_all(str(tmp_path / "a.db"))
    assert [path.name for path in tmp_path.iterdir()] == ["a.db"]


def test_a_log_in_a_read_only_folder_is_read(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    url = write_log(tmp_path / "a.db", [overtake()])
    monkeypatch.setattr("service.store.databases.sqlite_file.os.access", lambda *_: False)
    assert len(read_all(url)) == 1
    assert [path.name for path in tmp_path.iterdir()] == ["a.db"]


def test_a_read_only_folder_takes_no_log(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("service.store.databases.sqlite_file.os.access", lambda *_: False)
    with pytest.raises(LogError, match=r"expected a writable folder and file, got '.*' without permission"):
        open_log(str(tmp_path / "a.db"), "w")


def test_a_state_written_twice_is_refused(new_log: NewLog) -> None:
    with open_log(new_log(), "w") as log:
        writer = log.begin_run(run())
        writer.append_states([state(0, "car1"), state(0, "car1")])
        with pytest.raises(LogError, match="car_states: expected one row of 'car1' at 0 us, got two"):
            writer.flush()


def test_a_repeated_run_replaces_its_rows_and_no_others(new_log: NewLog) -> None:
    url = new_log()
    write_small_log(url, run("other"))
    write_small_log(url)
    before = count_rows(url)
    write_small_log(url)
    assert count_rows(url) == before
    events = read_all(url)
    assert sorted(event.id for event in events) == ["other-1", "other-2", "r1-1", "r1-2"]
    assert sorted(event.seq for event in events) == [1, 2, 5, 6]  # numbers of replaced rows are not used again


def test_a_killed_run_repeats_without_doubled_events(new_log: NewLog) -> None:
    url = new_log()
    with open_log(url, "w") as log:
        writer = log.begin_run(run())
        writer.append_events([overtake()])
        writer.flush()
        writer.append_events([overtake(20_000_000)])  # never flushed: the process dies here
    with open_log(url) as log:
        assert log.run().status == "running"
    assert len(read_all(url)) == 1
    write_log(url, [overtake(), overtake(20_000_000)])
    assert [event.id for event in read_all(url)] == ["r1-1", "r1-2"]


def test_a_repeat_is_not_seen_before_it_is_finished(new_log: NewLog) -> None:
    url = write_small_log(new_log())
    before = count_rows(url), read_all(url)
    with open_log(url, "w") as log:
        writer = log.begin_run(run())
        writer.append_events([overtake()])
        writer.flush()
        assert (count_rows(url), read_all(url)) == before
        assert writer.finish("finished")
    assert [(event.id, event.seq, event.type) for event in read_all(url)] == [("r1-1", 3, "overtake")]


def test_a_repeat_gives_the_same_rows_but_for_the_numbers_of_events(new_log: NewLog) -> None:
    drafts = random_drafts(random.Random(1), 50)
    first, second = write_log(new_log(), drafts), write_log(new_log(), drafts)
    write_log(second, drafts)
    shifted = [msgspec.structs.replace(event, seq=event.seq + 50) for event in read_all(first)]
    assert read_all(second) == shifted
    with open_log(second) as log, log.connect() as connection:
        texts = connection.execute(text("select seq, body from events")).all()
    assert [seq for seq, _ in texts] == [decode_event(body).seq for _, body in texts]
    assert [body for _, body in texts] == [msgspec.json.encode(decode_event(body)).decode() for _, body in texts]


@pytest.mark.parametrize(
    ("old", "new", "stays"),
    [
        (("finished", 3), ("interrupted", 3), True),
        (("finished", 3), ("finished", 3), False),
        (("interrupted", 3), ("interrupted", 2), True),
        (("interrupted", 3), ("interrupted", 3), False),
        (("running", 2), ("broken", 3), False),
    ],
)
def test_a_run_is_replaced_by_a_repeat_that_came_as_far(
    new_log: NewLog, old: tuple[RunStatus, int], new: tuple[RunStatus, int], stays: bool
) -> None:
    url = new_log()
    for number, (status, frames) in enumerate((old, new)):
        with open_log(url, "w") as log:
            writer = log.begin_run(run())
            writer.append_frames(range(frames))
            writer.append_events([overtake(number)])
            assert writer.finish(status) is not (stays and number == 1)
    assert [event.start_us for event in read_all(url)] == [0 if stays else 1]
    with open_log(url) as log:
        assert log.run().status == (old if stays else new)[0]


def test_a_repeat_that_is_given_up_leaves_nothing(tmp_path: Path) -> None:
    url = write_small_log(tmp_path / "a.db")
    with open_log(url, "w") as log:
        log.begin_run(run()).append_events([overtake()])
    assert len(read_all(url)) == 2
    assert [one.name for one in tmp_path.iterdir()] == ["a.db"]


def test_a_car_that_comes_back_after_a_flush_is_the_same_car(new_log: NewLog) -> None:
    with open_log(new_log(), "w") as log:
        writer = log.begin_run(run())
        for t_us, cars in enumerate([("car1", "car2"), ("car2",), ("car3", "car1")]):
            writer.append_states([state(t_us, car) for car in cars])
            writer.flush()
        assert writer.cars == 3
        assert [(one.car, one.number, one.first_us, one.last_us) for one in log.cars("r1")] == [
            ("car1", 1, 0, 2),
            ("car2", 2, 0, 1),
            ("car3", 3, 2, 2),
        ]


def test_readers_see_a_run_grow(new_log: NewLog) -> None:
    url = new_log()
    with open_log(url, "w") as log:
        writer = log.begin_run(run())
        writer.append_events([overtake()])
        assert read_all(url) == []
        writer.append_states([state(11_000_000, "car1")])  # ten seconds of media time have passed
        assert len(read_all(url)) == 1


def test_a_broken_run_says_why(new_log: NewLog) -> None:
    with open_log(new_log(), "w") as log:
        log.begin_run(run()).finish("broken", "demo.mp4 at 4000000 us: expected a frame, got damaged data")
        assert log.run("r1").reason.startswith("demo.mp4 at 4000000 us")


def test_the_class_of_a_car_is_the_last_known_one(new_log: NewLog) -> None:
    with open_log(new_log(), "w") as log:
        writer = log.begin_run(run())
        for t_us, name in [(0, "unknown"), (1, "truck"), (2, "unknown")]:
            writer.append_states([state(t_us, "car1", car_class=name)])
            writer.flush()
        assert log.cars("r1") == [CarRecord("car1", 1, "truck", 0, 2)]


@pytest.mark.parametrize(
    ("url", "came"),
    [
        ("postgresql://host/db", "got scheme 'postgresql'"),
        ("sqlite://", "got scheme 'sqlite'"),
        ("sqlite:///", "got ''"),
        ("log.txt", "got 'log.txt'"),
        ("missing/a.db", "got no such folder"),
    ],
)
def test_a_place_that_cannot_hold_a_log_is_refused(url: str, came: str) -> None:
    with pytest.raises(LogError, match="expected") as refused:
        open_log(url, "w")
    assert came in str(refused.value)


def test_a_missing_log_is_refused_and_not_created(tmp_path: Path) -> None:
    with pytest.raises(LogError, match="expected an event log, got no such file"):
        open_log(str(tmp_path / "a.db"))
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("mode", ["r", "w"])
def test_a_file_that_is_no_log_is_refused_and_left_alone(tmp_path: Path, mode: str) -> None:
    path = tmp_path / "a.db"
    path.write_bytes(b"not a database, but longer than the header of one" * 20)
    before = path.read_bytes()
    with pytest.raises(LogError, match=r"expected an event log written by dyknow, got 'file is not a database'"):
        open_log(str(path), mode)  # type: ignore[arg-type]  # parametrised
    assert path.read_bytes() == before


def test_a_database_of_another_program_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "a.db"
    with sqlite3.connect(path) as connection:
        connection.execute("create table meta (name text)")
    connection.close()
    with pytest.raises(LogError, match=r"got a database with tables \['meta'\]"):
        open_log(str(path), "w")


def test_an_empty_database_left_by_a_killed_first_run_is_used(tmp_path: Path) -> None:
    path = tmp_path / "a.db"
    path.touch()
    assert len(read_all(write_log(path, [overtake()]))) == 1


def test_a_run_identifier_must_be_plain(tmp_path: Path) -> None:
    with open_log(str(tmp_path / "a.db"), "w") as log, pytest.raises(LogError, match="got 'a/b'"):
        log.begin_run(run("a/b"))
    assert list(tmp_path.iterdir()) == []


def test_a_log_open_for_reading_takes_no_run(new_log: NewLog) -> None:
    with open_log(write_log(new_log(), [])) as log, pytest.raises(LogError, match="expected mode 'w'"):
        log.begin_run(run())


def test_naming_no_run_of_several_is_refused(new_log: NewLog) -> None:
    url = write_log(new_log(), [], record=run("r1"))
    with open_log(write_log(url, [], record=run("r2"))) as log:
        with pytest.raises(LogError, match=r"expected the name of one run, got \['r1', 'r2'\]"):
            log.run()
        assert log.run("r2").id == "r2"


def _dump(path: Path) -> list[str]:
    connection = sqlite3.connect(path)
    lines = list(connection.iterdump())
    connection.close()
    return lines


def test_how_late_relation_changes_are_decided_is_known_to_the_span(tmp_path: Path) -> None:
    with open_log(str(tmp_path / "a.db"), "w") as log:
        writer = log.begin_run(run())
        writer.append([RelationRecord(1_000_000, 55_000_000, "moving", ("car7",), "false", "true")])
        writer.finish("finished")
        assert 54_000_000 <= log.late_us("r1") < 54_000_000 + 2 * SPAN_US
        assert log.late_us("none") == SPAN_US
