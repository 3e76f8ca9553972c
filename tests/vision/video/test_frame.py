from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest

from tests.vision.support import make_frame
from vision.video.frame import Companion, Frame


def video(times_us: Sequence[int]) -> list[Frame]:
    return [make_frame(np.zeros((2, 2)), index=index, t_us=t_us) for index, t_us in enumerate(times_us)]


def joined(second: Sequence[int], first: Sequence[int]) -> list[int | None]:
    companion = Companion(video(second))
    return [None if frame is None else frame.t_us for frame in (companion.at(t_us) for t_us in first)]


def test_equal_times_are_joined() -> None:
    assert joined([0, 40_000, 80_000], [0, 40_000, 80_000]) == [0, 40_000, 80_000]


def test_a_slower_video_is_joined_within_half_its_step() -> None:
    assert joined([0, 100_000, 200_000], range(0, 240_000, 40_000)) == [0, 0, 100_000, 100_000, 200_000, 200_000]


def test_a_hole_gives_nothing() -> None:
    second = [0, 40_000, 80_000, 400_000, 440_000]
    assert joined(second, [80_000, 120_000, 240_000, 380_000, 400_000]) == [80_000, None, None, 400_000, 400_000]


def test_the_end_and_an_empty_video_give_nothing() -> None:
    assert joined([0, 40_000], [0, 40_000, 80_000]) == [0, 40_000, None]
    assert joined([], [0, 40_000]) == [None, None]


@pytest.mark.parametrize("seed", range(5))
def test_the_nearest_frame_is_taken(seed: int) -> None:
    rng = np.random.default_rng(seed)
    second = np.cumsum(rng.integers(30_000, 50_000, 60)).tolist()
    first = sorted(rng.integers(0, second[-1], 40).tolist())
    for t_us, came in zip(first, joined(second, first), strict=True):
        nearest_us = min(abs(one - t_us) for one in second)
        assert came is None or abs(came - t_us) == nearest_us
        assert came is not None or nearest_us > 15_000
