"""Twins: two names for one vehicle are never both seen in a frame, those of two vehicles soon are."""

from dataclasses import replace

import numpy as np
import pytest

from tests.vision.tracking.test_tracker import STEP_US, Row, detect, drive, everywhere, names, track
from vision.settings import VisionSettings
from vision.tracking.tracker import Tracker

TIMES = [STEP_US * k for k in range(75)]
BESIDE_M = 1.7


def two(north_m: float) -> list[tuple[Row, Row]]:
    return list(zip(drive(15, TIMES), drive(15, TIMES, start_m=0.5, north_m=north_m), strict=True))


def test_sightings_that_begin_to_jump_to_and_fro_start_no_second_name() -> None:
    frames = [
        (t, [pair[k % 2 if k >= 25 else 0]]) for k, (t, pair) in enumerate(zip(TIMES, two(BESIDE_M), strict=True))
    ]
    assert len(names(track(frames))) == 1


def test_two_that_are_seen_together_get_two_names_however_near_they_are() -> None:
    results = track([(t, list(pair)) for t, pair in zip(TIMES, two(BESIDE_M), strict=True)])
    assert names(results) == {"v1", "v2"}
    assert len(results[-1].ids) == 2


def test_name_ends_that_only_ever_takes_turns_with_an_older_one() -> None:
    frames = [
        (t, list(pair) if k < 25 else [pair[k % 2]])
        for k, (t, pair) in enumerate(zip(TIMES, two(BESIDE_M), strict=True))
    ]
    results = track(frames)
    assert len(results[30].ids) == 2
    assert len(results[-1].ids) == 1


@pytest.mark.parametrize(("noise_m", "count"), [(0.3, 2), (4.0, 1)])
def test_who_takes_turns_is_one_where_noise_hides_who_is_ahead(noise_m: float, count: int) -> None:
    pairs = zip(drive(15, TIMES), drive(15, TIMES, start_m=5.5), strict=True)
    tracker = Tracker(VisionSettings(), everywhere)
    for k, (t_us, pair) in enumerate(zip(TIMES, pairs, strict=True)):
        expected = tracker.predict(t_us)
        seen = detect(list(pair) if k < 25 else [pair[k // 5 % 2]], known=expected.known)
        noise = np.broadcast_to(np.diag([noise_m**2, 0.09]), (len(seen), 2, 2))
        objects = tracker.update(replace(seen, noise=noise))
        if k == 25:
            assert len(objects.ids) == 2
    assert len(objects.ids) == count


def test_vehicle_hidden_beside_another_keeps_its_name() -> None:
    frames = [
        (t, list(pair) if not 25 <= k < 45 else [pair[0]])
        for k, (t, pair) in enumerate(zip(TIMES, two(BESIDE_M), strict=True))
    ]
    results = track(frames)
    assert names(results) == {"v1", "v2"}
    assert results[-1].observed.all()
    assert len(results[-1].ids) == 2


def test_sightings_far_apart_in_time_prove_a_vehicle_sooner() -> None:
    times = [200_000 * k for k in range(6)]
    results = track([(t, [row]) for t, row in zip(times, drive(15, times), strict=True)])
    assert [len(result.ids) for result in results] == [0, 0, 1, 1, 1, 1]


def test_sightings_noisier_than_they_claim_lose_no_name() -> None:
    """Ten cars, seen with twice the noise that their detections claim."""
    rng = np.random.default_rng(3)
    times = [STEP_US * k for k in range(200)]
    lanes = [drive(15 + lane, times, north_m=8.0 * lane) for lane in range(10)]
    tracker = Tracker(VisionSettings(), everywhere)
    frames = []
    for k, t in enumerate(times):
        shift_m = rng.normal(0, 0.6, (10, 2)).tolist()
        rows = [one[k] for one in lanes]
        frames.append(
            (t, [(row[0] + east, row[1] + north, *row[2:]) for row, (east, north) in zip(rows, shift_m, strict=True)])
        )
    results = track(frames, tracker)
    late = [name for result in results[100:] for name in result.ids]
    assert len(results[-1].ids) == 10
    assert len(set(late)) <= 11
