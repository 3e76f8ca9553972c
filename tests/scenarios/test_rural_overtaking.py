"""From simulated traffic to the event log, through every stage."""

import sqlite3
from pathlib import Path

import pytest

from service.runs.processing import RunRequest, RunSummary, process
from service.scoring.evaluate import Evaluation
from service.scoring.evaluate_log import evaluate_log
from service.store.log import open_log


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> str:
    return f"sqlite:///{tmp_path_factory.mktemp('log')}/log.db"


@pytest.fixture(scope="module")
def summary(scene: Path, log: str) -> RunSummary:
    return process(RunRequest(scene / "video.mp4", scene / "site.toml", log))


@pytest.fixture(scope="module")
def evaluation(scene: Path, log: str, summary: RunSummary) -> Evaluation:
    return evaluate_log(log, scene, event_type="overtake", run=summary.run)


def rows(log: str, table: str) -> list[tuple[object, ...]]:
    with sqlite3.connect(log.removeprefix("sqlite:///")) as connection:
        return connection.execute(f"SELECT * FROM {table}").fetchall()


def test_every_countable_overtake_is_recognised_and_no_other(evaluation: Evaluation) -> None:
    assert len(evaluation.right) >= 3
    assert not evaluation.missed
    assert not evaluation.wrong


def test_core_interval_is_met_within_a_fifth_of_a_second(evaluation: Evaluation) -> None:
    assert evaluation.mean_start_error_s <= 0.2
    assert evaluation.mean_end_error_s <= 0.2


def test_every_frame_reached_every_stage(summary: RunSummary) -> None:
    published = {stream.label: stream.published for stream in summary.streams}
    assert published["frames"] == published["vision_objects"] == published["cars"] == published["relations"] == 1000
    assert all(not stream.dropped for stream in summary.streams)


def test_event_says_where_and_from_which_sub_events(log: str, evaluation: Evaluation) -> None:
    from service.questions.queries import decode_event, find_event

    with open_log(log) as opened:
        text = find_event(opened, evaluation.right[0].recognised.id)
    assert text is not None
    event = decode_event(text)
    assert event.place is not None
    assert event.place.road == event.roles["road"]
    assert {"t1", "t2"} <= {part.label for part in event.sub_events}
    assert event.start.startswith("2026-05-01T08:00:")
    assert event.recognised_us >= event.end_us


def test_one_car_symbol_for_one_vehicle(scene: Path, log: str, summary: RunSummary) -> None:
    from service.scoring.evaluate import load_truth

    _, vehicles = load_truth(scene)
    with open_log(log) as opened:
        cars = opened.cars(summary.run)
    # A vehicle that only touches the edge of the view may go without a symbol; none may have two.
    assert 0.8 * len(set(vehicles.ids)) <= len(cars) <= len(set(vehicles.ids))


def test_repeating_a_run_replaces_its_rows_by_the_same(scene: Path, log: str, summary: RunSummary) -> None:
    tables = ("car_states", "relations", "links", "frames", "cars", "streams")
    before = {table: rows(log, table) for table in tables}
    events_before = [row[2:] for row in rows(log, "events")]
    again = process(RunRequest(scene / "video.mp4", scene / "site.toml", log, again=True))
    assert again.run == summary.run
    assert {table: rows(log, table) for table in tables} == before
    assert len(rows(log, "events")) == len(events_before)


def test_trajectories_of_the_truth_give_the_same_overtakes(scene: Path, tmp_path: Path) -> None:
    log = f"sqlite:///{tmp_path}/tracks.db"
    summary = process(RunRequest(scene / "truth.csv", scene / "site.toml", log))
    result = evaluate_log(log, scene, event_type="overtake", run=summary.run)
    assert not result.missed
    assert not result.wrong
    assert summary.streams[0].label == "vision_objects"
