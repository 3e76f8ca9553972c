from __future__ import annotations

import numpy as np
import pytest

from vision.networks.box_detector import CLASS_NAMES, UNKNOWN, GroundBoxes
from vision.networks.stored_detections import StoredDetections, StoredInstant


def stored(*keys: int, is_by_frame: bool = False) -> StoredDetections:
    """One detection for each key, whose x is the key."""
    count = len(keys)
    nan = np.full(count, np.nan)
    centre_m = np.column_stack([np.array(keys, np.float64), np.zeros(count)])
    classes = np.full(count, CLASS_NAMES.index(UNKNOWN))
    boxes = GroundBoxes(centre_m, nan, nan, nan, np.ones(count), classes)
    return StoredDetections(np.array(keys, np.int64), boxes, is_by_frame=is_by_frame)


def keys_at(file: StoredDetections, *times_us: int) -> list[list[float]]:
    """The keys found at each time."""
    found = [file.detect(StoredInstant(index, t_us)) for index, t_us in enumerate(times_us)]
    assert all(isinstance(one, GroundBoxes) for one in found)
    return [one.centre_m[:, 0].tolist() for one in found if isinstance(one, GroundBoxes)]


def test_times_are_joined_to_the_nearest_frame() -> None:
    file = stored(1_000, 41_000, 41_000, 79_000)
    assert keys_at(file, 0, 40_000, 80_000, 120_000) == [[1_000], [41_000, 41_000], [79_000], []]


def test_a_slow_file_is_used_once_a_time_and_not_stretched() -> None:
    file = stored(0, 100_000, 200_000)
    found = keys_at(file, *range(0, 240_000, 40_000))
    assert found == [[0], [], [100_000], [], [], [200_000]]


def test_a_fast_file_gives_the_nearest_time_only() -> None:
    file = stored(*range(0, 100_000, 10_000))
    assert keys_at(file, 0, 41_000, 80_000) == [[0], [40_000], [80_000]]


def test_dropped_frames_do_not_widen_what_is_near() -> None:
    file = stored(0, 40_000, 80_000, 520_000)
    assert keys_at(file, 0, 500_000) == [[0], [520_000]]
    assert keys_at(stored(0, 40_000, 80_000, 530_000), 0, 500_000) == [[0], []]


@pytest.mark.parametrize("seed", range(5))
def test_no_detection_is_given_twice_and_all_near_ones_are_given(seed: int) -> None:
    rng = np.random.default_rng(seed)
    frames = np.arange(0, 4_000_000, 40_000)
    keys = np.unique(np.round(frames[rng.random(len(frames)) < 0.7] + rng.integers(-15_000, 15_000)).clip(0))
    found = keys_at(stored(*keys.tolist()), *frames.tolist())
    assert [key for one in found for key in one] == keys.tolist()


def test_frames_are_looked_up_by_their_number() -> None:
    file = stored(0, 2, 2, is_by_frame=True)
    assert keys_at(file, 5, 50, 500) == [[0], [], [2, 2]]
    assert (file.count_after(0), file.count_after(2), file.count_after(3)) == (3, 2, 0)


def test_a_file_by_frame_alone_tells_of_every_frame() -> None:
    instants = list(stored(1, 3, is_by_frame=True).instants(25.0))
    assert [(one.index, one.t_us) for one in instants] == [(0, 0), (1, 40_000), (2, 80_000), (3, 120_000)]


def test_a_gap_of_a_file_alone_is_told_as_empty_for_a_while() -> None:
    times_us = [one.t_us for one in stored(0, 40_000, 80_000, 60_000_000, 60_040_000).instants(None)]
    assert times_us[:5] == [0, 40_000, 80_000, 120_000, 160_000]
    assert times_us[-2:] == [60_000_000, 60_040_000]
    assert 2_000_000 < times_us[-3] <= 2_080_000
