"""Rows that lie in chunks are read as from a plain list of them, whatever came late and whichever chunk is missing."""

import logging
import random
import sqlite3
from pathlib import Path

import msgspec
import numpy as np
import pytest

from service.errors import LogError
from service.records.seen import CarState, RelationRecord
from service.store.chunks.columns import pack
from service.store.chunks.kinds import CAR_STATES, RELATIONS, SPAN_US
from service.store.chunks.packing import packed, unpacked
from service.store.log import open_log
from tests.cases import first_kept
from tests.service.logs import run, state

STEP_US = 80_000


def late_states(rng: random.Random) -> list[CarState]:
    """Make states of some cars over a minute in the order of writing: some are of earlier times."""
    cars = [f"car{number}" for number in rng.sample(range(1, 20), 6)]
    rows = [state(t_us, car, rng.randint(-9999, 9999) / 100) for t_us in range(0, 60_000_000, STEP_US) for car in cars]
    kept = [row for row in rows if rng.random() < 0.5]
    return sorted(kept, key=lambda row: row.t_us + (rng.random() < 0.1) * rng.randint(0, 30_000_000))


def written(path: Path, states: list[CarState]) -> str:
    """Write states as a run does, frame by frame."""
    with open_log(str(path), "w") as log:
        writer = log.begin_run(run())
        now_us = 0
        for one in states:
            if one.t_us > now_us:
                now_us = one.t_us
                writer.append_frames([now_us])
            writer.append_states([one])
        writer.finish("finished")
    return str(path)


@pytest.mark.parametrize("seed", first_kept(range(4)))
def test_windows_and_cars_are_those_of_a_list(tmp_path: Path, seed: int) -> None:
    rng = random.Random(seed)
    states = late_states(rng)
    expected = sorted(states, key=lambda one: (one.t_us, len(one.car), one.car))
    with open_log(written(tmp_path / "a.db", states)) as log:
        assert list(log.states("r1")) == expected
        for _ in range(20):
            from_us, to_us = sorted(rng.choices(range(-STEP_US, 70_000_000, STEP_US // 2), k=2))
            window = [one for one in expected if from_us <= one.t_us < to_us]
            assert list(log.states("r1", from_us=from_us, to_us=to_us)) == window
            car = rng.choice(expected).car
            own = [one for one in window if one.car == car]
            assert list(log.states("r1", cars=(car,), from_us=from_us, to_us=to_us)) == own
        spans = list(log.state_columns("r1", ("t_us", "x_m", "linked", "sigma_m", "confidence")))
    names, columns = [name for _, some, _ in spans for name in some], np.hstack([table for *_, table in spans])
    assert names == [one.car for one in expected]
    assert columns[:3].T.tolist() == [[one.t_us, one.x_m, one.linked] for one in expected]
    assert np.isnan(columns[3]).all()
    assert (columns[4] == 1.0).all()


def test_a_window_reads_the_chunks_of_its_spans_alone(tmp_path: Path) -> None:
    states = [state(t_us, "car1") for t_us in range(0, 60_000_000, STEP_US)]
    with open_log(written(tmp_path / "a.db", states)) as log:
        assert len(list(log.chunks("r1", CAR_STATES))) == 6
        assert [one.span_us for one in log.chunks("r1", CAR_STATES, 25_000_000, 30_000_000)] == [20_000_000]
        assert [one.rows for one in log.chunks("r1", CAR_STATES)] == [125] * 6


def test_relations_come_as_they_were_decided_by_when_they_crossed() -> None:
    changes = [
        RelationRecord(t_us, decided_us, name, ("car1", "car2"), "false", "true")
        for t_us, decided_us, name in [(9_000_000, 9_500_000, "beside"), (8_000_000, 11_000_000, "ahead")]
    ]
    chunks = list(packed(RELATIONS, changes))
    assert [(one.span_us, one.first_us) for one in chunks] == [(0, 9_000_000), (SPAN_US, 8_000_000)]
    assert list(unpacked(RELATIONS, chunks)) == changes
    assert list(unpacked(RELATIONS, chunks, to_us=9_000_000)) == changes[1:]
    assert list(unpacked(RELATIONS, chunks, where={"name": "beside".__eq__})) == changes[:1]


def test_a_field_that_an_older_chunk_does_not_know_has_its_default() -> None:
    row = state(0, "car1")
    known = msgspec.structs.asdict(row)
    del known["linked"], known["vision_id"]
    (chunk,) = packed(CAR_STATES, [row])
    older = chunk._replace(data=pack({name: [value] for name, value in known.items()}))
    (read,) = unpacked(CAR_STATES, [older])
    assert read == msgspec.structs.replace(row, linked=True, vision_id="")


def test_one_car_twice_in_a_frame_is_refused() -> None:
    with pytest.raises(LogError, match="car_states: expected one row of 'car1' at 80000 us, got two"):
        list(packed(CAR_STATES, [state(80_000, "car1"), state(0, "car1"), state(80_000, "car1")]))


@pytest.mark.parametrize(
    "damage",
    ["substr(data, 1, length(data) / 2)", "cast(substr(data, 1, 40) || x'00' || substr(data, 42) as blob)"],
    ids=["half is gone", "a byte is another"],
)
def test_a_damaged_chunk_is_told_with_its_time_and_the_rest_is_read(
    tmp_path: Path, damage: str, caplog: pytest.LogCaptureFixture
) -> None:
    states = [state(t_us, "car1") for t_us in range(0, 60_000_000, STEP_US)]
    url = written(tmp_path / "a.db", states)
    _execute(url, f"update chunks set data = {damage} where kind = 'car_states' and span_us = 20000000")
    with open_log(url) as log:
        assert list(log.states("r1")) == [one for one in states if not 20_000_000 <= one.t_us < 30_000_000]
        assert _told(caplog) == 1
        assert f"log '{url}': car_states of 00:20.000 to 00:30.000 are damaged: expected " in caplog.text
        assert len(list(log.states("r1", from_us=30_000_000))) == 375
        assert len(list(log.frames("r1"))) > 700
        assert _told(caplog) == 1


def test_pruned_stretches_are_told_once(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    url = written(tmp_path / "a.db", [state(t_us, "car1") for t_us in range(0, 60_000_000, STEP_US)])
    _execute(url, "update chunks set data = null where kind = 'car_states' and span_us in (0, 10000000, 40000000)")
    with open_log(url) as log:
        assert len(list(log.states("r1"))) == 375
    assert [record.getMessage() for record in caplog.records] == [
        f"log '{url}': car_states of {stretch} are pruned; the rest is read"
        for stretch in ("00:00.000 to 00:20.000", "00:40.000 to 00:50.000")
    ]


def _told(caplog: pytest.LogCaptureFixture) -> int:
    return sum(record.levelno == logging.WARNING for record in caplog.records)


def _execute(url: str, statement: str) -> None:
    with sqlite3.connect(url) as connection:
        connection.execute(statement)
    connection.close()


def test_an_empty_run_covers_no_time(tmp_path: Path) -> None:
    with open_log(written(tmp_path / "a.db", [])) as log:
        assert (log.covered_us("r1"), log.last_us("r1"), list(log.states("r1"))) == (None, 0, [])
