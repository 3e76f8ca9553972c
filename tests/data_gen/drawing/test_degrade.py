"""Faults come as asked for, and the same for the same seed."""

from itertools import pairwise

import numpy as np
import pytest

from data_gen.drawing.degrade import Degradation, PlannedFrame, parse_degradation, plan_frames
from data_gen.errors import DataGenError

STEP_US = 40_000


def planned(text: str, count: int = 5000, seed: int = 1) -> tuple[PlannedFrame, ...]:
    return plan_frames(parse_degradation(text), count, step_us=STEP_US, rng=np.random.default_rng(seed))


def test_without_faults_every_frame_shows_its_own_step() -> None:
    assert planned("", 100) == tuple(PlannedFrame(number, number) for number in range(100))


def test_the_asked_for_part_of_the_frames_is_lost() -> None:
    numbers = [frame.number for frame in planned("drop=0.1")]
    assert 1 - len(numbers) / 5000 == pytest.approx(0.1, abs=0.02)
    assert numbers == sorted(set(numbers))


def test_a_repeated_frame_shows_the_picture_before_it() -> None:
    frames = planned("duplicate=0.2")
    repeated = [place for place, frame in enumerate(frames) if frame.shows != frame.number]
    assert len(repeated) / len(frames) == pytest.approx(0.2, abs=0.03)
    assert all(frames[place].shows == frames[place - 1].shows for place in repeated)


def test_a_gap_has_no_frames_and_others_stay() -> None:
    numbers = {frame.number for frame in planned("gap=10+2,gap=20+1", 1000)}
    missing = set(range(1000)) - numbers
    assert missing == set(range(250, 300)) | set(range(500, 525))


def test_every_fifth_frame_makes_a_fifth_of_the_rate() -> None:
    assert [frame.number for frame in planned("every=5", 21)] == [0, 5, 10, 15, 20]


def test_a_variable_rate_changes_between_seconds_and_not_within() -> None:
    frames = [frame.number for frame in planned("vfr=3", 2500)]
    steps = [{b - a for a, b in pairwise(second)} for second in _by_second(frames)]
    assert all(len(step) == 1 for step in steps)
    assert set.union(*steps) == {1, 2, 3}


def _by_second(numbers: list[int]) -> list[list[int]]:
    # Counted from each second's own multiples of the pace; the first one may belong to the pace before.
    return [[number for number in numbers if number // 25 == second] for second in range(100)]


def test_a_longer_clip_begins_with_the_shorter_ones_faults() -> None:
    long = planned("drop=0.2,duplicate=0.1,vfr=4", 400)
    short = planned("drop=0.2,duplicate=0.1,vfr=4", 200)
    assert short == tuple(frame for frame in long if frame.number < 200)


def test_the_first_frame_is_never_lost() -> None:
    assert all(planned("drop=0.9", 5, seed)[0] == PlannedFrame(0, 0) for seed in range(50))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("rain=1", "degrade: expected some of noise, drop, duplicate, every, vfr, crf, gap, got 'rain'"),
        ("drop", r"degrade, drop: expected a number from 0 to 0\.9, got ''"),
        ("drop=1", r"degrade, drop: expected a number from 0 to 0\.9, got '1'"),
        ("drop=nan", r"degrade, drop: expected a number from 0 to 0\.9, got 'nan'"),
        ("every=2.5", "degrade, every: expected a whole number from 1 to 25, got '2.5'"),
        ("drop=0.1,drop=0.2", "degrade, drop: expected it once, got it again as '0.2'"),
        ("gap=10", r"degrade, gap: expected START\+LENGTH in seconds, as 10\+2, got '10'"),
        ("gap=0+2", r"degrade, gap: expected START\+LENGTH in seconds, both above 0, got '0\+2'"),
        ("gap=a+b", r"degrade, gap: expected START\+LENGTH in seconds, as 10\+2, got 'a\+b'"),
    ],
)
def test_a_wrong_fault_is_refused(text: str, message: str) -> None:
    with pytest.raises(DataGenError, match=message):
        parse_degradation(text)


def test_an_empty_list_is_no_fault() -> None:
    assert parse_degradation(" ") == Degradation()
