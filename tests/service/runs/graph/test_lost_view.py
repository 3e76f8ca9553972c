"""What is told of the time around a lost view? Nothing that rests on states from before it."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from anchoring.settings import AnchoringSettings
from chronicles.events import Occurrence
from dyknow.sample import Sample
from dyknow.streams.stream import exhaust
from service.questions.scoring.evaluate_log import LostViews, find_lost_views
from service.records.seen import ViewRecord
from service.runs.graph.pipeline import OCCURRENCE, TRAJECTORIES, Feed, declared_pipeline
from service.runs.inputs.trajectories import TrajectoryObjects
from service.store.log import open_log
from service.texts.chronicle_files import load_chronicle_files
from tests.service.logs import overtake, run, write_small_log

STEP_US = 40_000
LOST = range(75, 90)


def objects(frame: int, speed_of_second_mps: float = 20.0) -> TrajectoryObjects:
    """Two cars, 7 m apart, at 20 m/s; the speed of the second may be told wrongly."""
    x_m = 20.0 * frame * STEP_US / 1e6
    return TrajectoryObjects(
        t_us=frame * STEP_US,
        ids=("v1", "v2"),
        centre_m=np.array([[x_m + 7.0, 0.0], [x_m, 0.0]]),
        velocity_mps=np.array([[20.0, 0.0], [speed_of_second_mps, 0.0]]),
        heading_rad=np.zeros(2),
        length_m=np.full(2, 4.5),
        width_m=np.full(2, 1.8),
        observed=np.ones(2, dtype=np.bool_),
        clipped=np.zeros(2, dtype=np.bool_),
    )


def nobody(frame: int) -> TrajectoryObjects:
    """The sample that tells of a lost view."""
    pairs, ones, falses = np.zeros((0, 2)), np.zeros(0), np.zeros(0, np.bool_)
    return TrajectoryObjects(frame * STEP_US, (), pairs, pairs, ones, ones, ones, falses, falses, is_lost=True)


def around_a_loss(*, wrong_for: int) -> Iterator[TrajectoryObjects]:
    """Drive for three seconds, lose the view, and tell a wrong speed for some frames after it."""
    yield from (objects(frame) for frame in range(LOST.start))
    yield nobody(LOST.start)
    for frame in range(LOST.stop, 200):
        yield objects(frame, 25.0 if frame < LOST.stop + wrong_for else 20.0)


def recognised(frames: Iterator[TrajectoryObjects]) -> list[Occurrence]:
    pipeline = declared_pipeline(Feed(TRAJECTORIES), None, load_chronicle_files(()).merged, clock=lambda: 0)
    found: list[Occurrence] = []
    stream = pipeline.stream("recorded_occurrences", OCCURRENCE)
    assert stream is not None
    stream.subscribe(lambda sample: found.append(sample.value))
    for frame in frames:
        exhaust(pipeline.publish_in_steps(Sample(frame.t_us, frame.t_us, frame)))
    pipeline.node.finish()
    return found


def near_misses(found: list[Occurrence]) -> list[Occurrence]:
    return [one for one in found if one.chronicle == "near_miss"]


def test_a_wrong_speed_in_the_middle_of_a_clip_is_a_near_miss() -> None:
    frames = (objects(frame, 25.0 if 75 <= frame < 84 else 20.0) for frame in range(200))
    assert len(near_misses(recognised(frames))) == 1


@pytest.mark.long
def test_the_same_wrong_speed_just_after_a_lost_view_is_none() -> None:
    assert near_misses(recognised(around_a_loss(wrong_for=9))) == []


@pytest.mark.long
def test_what_goes_on_longer_than_the_view_needs_to_settle_is_told() -> None:
    (event,) = near_misses(recognised(around_a_loss(wrong_for=30)))
    assert event.start_us >= LOST.stop * STEP_US + AnchoringSettings().settle_us


def log_with_views(folder: Path, lost: set[int]) -> str:
    """Write a run of ten seconds, a view a second, with events from 2 s to 3 s, from 5 s to 8 s, and at 9 s."""
    url = f"sqlite:///{folder / 'log.db'}"
    with open_log(url, "w") as log:
        writer = log.begin_run(run())
        writer.append_frames([second * 1_000_000 for second in range(11)])
        writer.append(ViewRecord(second * 1_000_000, () if second in lost else (1.0,) * 9) for second in range(11))
        for start_s, end_s in ((2, 3), (5, 8), (9, 9)):
            writer.append_events([overtake(start_s * 1_000_000, end_s * 1_000_000)])
        writer.finish("finished")
    return url


def test_events_that_end_with_the_loss_or_begin_after_it_are_no_tales(tmp_path: Path) -> None:
    url = log_with_views(tmp_path, {3, 4})
    assert find_lost_views(url) == LostViews(((3_000_000, 5_000_000),), (), 3)


def test_an_event_across_a_loss_is_told_of_a_time_without_a_view(tmp_path: Path) -> None:
    found = find_lost_views(log_with_views(tmp_path, {6}))
    assert found is not None
    assert (found.losses_us, len(found.told), found.lost_s) == (((6_000_000, 7_000_000),), 1, 1.0)


def test_a_loss_at_the_end_lasts_to_the_last_frame(tmp_path: Path) -> None:
    found = find_lost_views(log_with_views(tmp_path, {8, 9, 10}))
    assert found is not None
    assert found.losses_us == ((8_000_000, 10_000_000),)
    assert len(found.told) == 1  # the one at 9 s; that which ended at 8 s is not


def test_a_run_with_a_fixed_camera_has_no_view_to_lose(tmp_path: Path) -> None:
    assert find_lost_views(write_small_log(tmp_path / "log.db")) is None
