"""From simulated traffic to the event log, through every stage."""

import json
import shutil
import sqlite3
from pathlib import Path

import pytest

from service.questions.scoring.evaluate import Evaluation
from service.questions.scoring.evaluate_log import evaluate_log
from service.runs.inputs.sensors.video_sensor import USUAL_RATE_HZ as RATE_HZ
from service.runs.processing import RunRequest, process
from service.store.log import open_log
from tests.conftest import SECONDS, Demo


@pytest.fixture(scope="module")
def log(demo: Demo) -> str:
    return str(demo.log)


@pytest.fixture(scope="module")
def evaluation(scene: Path, log: str) -> Evaluation:
    return evaluate_log(log, scene, event_type="overtake", run=None)


def rows(log: str | Path, table: str) -> list[tuple[object, ...]]:
    with sqlite3.connect(log) as connection:
        return connection.execute(f"SELECT * FROM {table}").fetchall()


def test_every_countable_overtake_is_recognised_and_no_other(evaluation: Evaluation) -> None:
    assert len(evaluation.right) >= 3
    assert not evaluation.missed
    assert not evaluation.wrong


def test_core_interval_is_met_within_a_fifth_of_a_second(evaluation: Evaluation) -> None:
    assert evaluation.mean_start_error_s <= 0.2
    assert evaluation.mean_end_error_s <= 0.2


def test_every_frame_reached_every_stage(log: str) -> None:
    with open_log(log) as opened:
        streams = opened.streams(opened.run().id)
    published = {stream.label: stream.published for stream in streams}
    assert (
        published["frames"]
        == published["vision_objects"]
        == published["cars"]
        == published["relations"]
        == RATE_HZ * SECONDS
    )
    assert all(not stream.dropped for stream in streams)


def test_event_says_where_and_from_which_sub_events(log: str, evaluation: Evaluation) -> None:
    from service.questions.events.queries import decode_event, find_event

    with open_log(log) as opened:
        text = find_event(opened, evaluation.right[0].recognised.id)
    assert text is not None
    event = decode_event(text)
    assert event.place is not None
    assert event.place.road == event.roles["road"]
    assert {"t1", "t2"} <= {part.label for part in event.sub_events}
    assert event.start.startswith("2026-05-01T08:00:")
    assert event.recognised_us >= event.end_us


def test_one_car_symbol_for_one_vehicle(scene: Path, log: str) -> None:
    from service.questions.scoring.evaluate import load_truth

    _, vehicles = load_truth(scene)
    with open_log(log) as opened:
        cars = opened.cars(opened.run().id)
    # A vehicle that only touches the edge of the view may go without a symbol; none may have two.
    assert 0.8 * len(set(vehicles.ids)) <= len(cars) <= len(set(vehicles.ids))


@pytest.mark.long
def test_repeating_a_run_replaces_its_rows_by_the_same(small_scene: Path, tracks_log: Path, tmp_path: Path) -> None:
    repeated = shutil.copy(tracks_log, tmp_path / "log.db")
    process(RunRequest(small_scene / "truth.csv", small_scene / "site.toml", str(repeated), again=True))
    for table in ("runs", "chunks", "links", "cars", "streams"):
        assert rows(repeated, table) == rows(tracks_log, table), table
    # Each event is told once more, under the next free number.
    before, after = (
        [(*one[1:-1], json.loads(str(one[-1])) | {"seq": 0}) for one in rows(path, "events")]
        for path in (tracks_log, repeated)
    )
    assert after == before
    assert len(before) > 10


def test_trajectories_of_the_truth_give_the_same_overtakes(small_scene: Path, tracks_log: Path) -> None:
    result = evaluate_log(str(tracks_log), small_scene, event_type="overtake", run=None)
    assert not result.missed
    assert not result.wrong
    with open_log(str(tracks_log)) as opened:
        assert opened.streams(opened.run().id)[0].label == "vision_objects"
