"""The declared pipeline: the texts that come with the package, and texts of one's own."""

from pathlib import Path

import pytest

from chronicles.library import load_library
from dyknow.errors import KplError
from dyknow.kpl.loader import DeclaredStream
from dyknow.kpl.parser import parse_kpl
from dyknow.kpl.printer import print_statement
from service.errors import InputError, LogError
from service.questions.recognition.stored_monitoring import monitor_log
from service.questions.recognition.stored_recognition import recognise_stored
from service.records.runs import SourceText
from service.runs.graph.pipeline import TRAJECTORIES, VIDEO, Feed, declared_pipeline, shipped_kpl
from service.runs.graph.recording import CarHistory, recorded_streams
from service.runs.processing import RunRequest, process
from service.store.log import open_log
from tests.service.tracks import write_tracks

SHIPPED = shipped_kpl(TRAJECTORIES).text
CHRONICLES = load_library(["overtake"])


def changed(text: str, before: str, after: str) -> str:
    assert before in text
    return text.replace(before, after)


def deployed(text: str) -> dict[str, DeclaredStream]:
    return recorded_streams(
        declared_pipeline(Feed(TRAJECTORIES), None, CHRONICLES, kpl=SourceText("own.kpl", text), clock=lambda: 0)
    )


def run(folder: Path, kpl: str | None) -> tuple[str, int, int]:
    """Process ten seconds of one car; give the run, its states in the log, and the frames that had cars."""
    tracks = write_tracks(folder / "tracks.csv", frames=100)
    file = None
    if kpl is not None:
        file = folder / "own.kpl"
        file.write_text(kpl)
    url = f"sqlite:///{folder / 'log.db'}"
    summary = process(RunRequest(input=tracks, site=None, log_url=url, kpl_file=file, again=True))
    with open_log(url) as log:
        states = len(list(log.states(summary.run)))
    published = {stream.label: stream.published for stream in summary.streams}
    return summary.run, states, published["cars"]


def test_shipped_texts_differ_only_before_the_objects() -> None:
    video, tracks = (
        {print_statement(one) for one in parse_kpl(shipped_kpl(source).text).statements}
        for source in (VIDEO, TRAJECTORIES)
    )
    assert {one for one in tracks - video if "trajectories" not in one} == {"stream recorded_frames = vision_objects"}


def test_shipped_text_leaves_no_doubt() -> None:
    pipeline = declared_pipeline(Feed(TRAJECTORIES), None, CHRONICLES, clock=lambda: 0)
    assert pipeline.deployment.warnings == ()


@pytest.mark.long
def test_a_longer_sample_period_in_the_text_is_seen_in_the_run(tmp_path: Path) -> None:
    every_second = "anchoring(vision_objects with sample every 1s, use most recent, strict order)"
    slow = changed(SHIPPED, "anchoring(vision_objects with strict order)", every_second)
    _, states, frames = run(tmp_path, None)
    _, sampled_states, sampled_frames = run(tmp_path, slow)
    assert (frames, sampled_frames) == (100, 10)
    assert 0 < sampled_states < states / 5


@pytest.mark.long
def test_another_text_makes_another_run(tmp_path: Path) -> None:
    first, _, _ = run(tmp_path, None)
    second, _, _ = run(tmp_path, SHIPPED)
    third, _, _ = run(tmp_path, changed(SHIPPED, "stream recorded_frames = vision_objects;", ""))
    assert first == second != third


def test_what_a_text_does_not_declare_for_the_log_is_not_recorded() -> None:
    streams = deployed(changed(SHIPPED, "stream recorded_cars = cars;", ""))
    assert "recorded_cars" not in streams
    assert "recorded_occurrences" in streams


def test_recorded_stream_of_another_type_is_refused() -> None:
    text = changed(SHIPPED, "stream recorded_cars = cars;", "stream recorded_cars = relations;")
    with pytest.raises(InputError, match=r"own\.kpl: stream 'recorded_cars': expected .* Cars, got Relations"):
        deployed(text)


def test_misspelt_stream_for_the_log_is_refused() -> None:
    with pytest.raises(
        InputError, match=r"own\.kpl: expected streams among \['recorded_frames', .*\], got 'recorded_autos'"
    ):
        deployed(changed(SHIPPED, "stream recorded_cars", "stream recorded_autos"))


def test_sampling_that_leaves_gaps_is_refused() -> None:
    gaps = "qsr(cars with sample every 1s, no approximation, strict order)"
    with pytest.raises(InputError, match=r"own\.kpl: 'relations' reading 'cars': expected 'use most recent' with"):
        deployed(changed(SHIPPED, "qsr(cars with strict order)", gaps))


@pytest.mark.long
def test_sampling_faster_than_frames_come_adds_nothing(tmp_path: Path) -> None:
    fast = "anchoring(vision_objects with sample every 10ms, use most recent, strict order)"
    _, states, _ = run(tmp_path, None)
    _, sampled_states, frames = run(tmp_path, changed(SHIPPED, "anchoring(vision_objects with strict order)", fast))
    assert (sampled_states, frames) == (states, 100)


def test_relations_of_a_repeated_frame_are_told_once(tmp_path: Path) -> None:
    fast = "qsr(cars with sample every 10ms, use most recent, strict order)"
    tracks = write_tracks(tmp_path / "tracks.csv", frames=100)
    kpl = tmp_path / "own.kpl"
    kpl.write_text(changed(SHIPPED, "qsr(cars with strict order)", fast))
    log_url = f"sqlite:///{tmp_path / 'log.db'}"
    summary = process(RunRequest(input=tracks, site=None, log_url=log_url, kpl_file=kpl))
    assert {one.label: one.published for one in summary.streams}["relations"] == 100


def test_run_that_fails_by_a_fault_of_ours_says_so_in_the_log(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(history: CarHistory, cars: object) -> None:
        raise RuntimeError("no such luck")

    monkeypatch.setattr(CarHistory, "remember", fail)
    with pytest.raises(RuntimeError, match="no such luck"):
        run(tmp_path, None)
    with open_log(f"sqlite:///{tmp_path / 'log.db'}") as log:
        [broken] = log.runs()
    assert broken.status == "broken"
    assert "input at 0 us: expected to go on to its end, got RuntimeError('no such luck')" in broken.reason


def test_logs_that_lack_frames_are_refused_where_they_would_mislead(tmp_path: Path) -> None:
    rules = tmp_path / "rules.monitors"
    rules.write_text("monitor limit per ?car in Car: always speed[?car] < 15 m/s\n")
    run(tmp_path, changed(SHIPPED, "recorded_relations = relations", "recorded_relations = relations with any change"))
    url = f"sqlite:///{tmp_path / 'log.db'}"
    with pytest.raises(InputError, match="expected one of the shipped pipeline"):
        monitor_log(url, [rules])
    with pytest.raises(LogError, match="expected all relation changes in the log"):
        recognise_stored(url, [])


def test_text_that_nothing_feeds_is_refused() -> None:
    with pytest.raises(InputError, match=r"own\.kpl: expected a process made of the source 'trajectories', got none"):
        deployed("")


def test_malformed_text_is_refused_before_anything_is_written(tmp_path: Path) -> None:
    with pytest.raises(KplError, match="did you mean 'strict'"):
        run(tmp_path, changed(SHIPPED, "cars with strict order", "cars with stirct order"))
    assert not (tmp_path / "log.db").exists()
