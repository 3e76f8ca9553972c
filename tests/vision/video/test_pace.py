"""Which frames are looked at: every n-th of a steady clock, and no more than asked of one that is not."""

import math
from pathlib import Path

import numpy as np
import pytest

from tests.vision.support import write_video
from vision.video.frames import open_video
from vision.video.pace import Pace


def taken(pace: Pace, times_us: list[int]) -> list[int]:
    return [nth for nth, t_us in enumerate(times_us) if pace.takes(t_us)]


@pytest.mark.parametrize(
    ("rate_hz", "source_hz", "every"),
    [(12.5, 25, 2), (12.5, 30, 2), (12.5, 29.97, 2), (12.5, 24, 1), (12.5, 24.9, 2), (12.5, 60, 4), (math.inf, 60, 1)],
)
def test_every_nth_frame_of_a_steady_clock_is_looked_at(rate_hz: float, source_hz: float, every: int) -> None:
    pace = Pace(rate_hz, source_hz)
    times_us = [round(1e6 * nth / source_hz) for nth in range(3000)]
    assert pace.every == every
    assert taken(pace, times_us) == list(range(0, 3000, every))


def test_frames_that_come_early_or_late_shift_nothing_and_missing_ones_do() -> None:
    rng = np.random.default_rng(1)
    shaken_us = [40_000 * nth + int(rng.integers(-9_000, 9_000)) for nth in range(500)]
    assert taken(Pace(12.5, 25), shaken_us) == list(range(0, 500, 2))
    dropped_us = [40_000 * nth for nth in range(20) if nth not in (4, 5, 11)]
    assert [dropped_us[nth] // 40_000 for nth in taken(Pace(12.5, 25), dropped_us)] == [0, 2, 6, 8, 10, 12, 14, 16, 18]


def test_rate_that_varies_is_never_passed_by_much_and_a_slow_one_is_kept_whole() -> None:
    fast_us, slow_us = [20_000 * nth for nth in range(200)], [4_000_000 + 100_000 * nth for nth in range(40)]
    chosen_us = [(*fast_us, *slow_us)[nth] for nth in taken(Pace(12.5, 30), [*fast_us, *slow_us])]
    assert 80_000 * 0.8 <= np.diff([t_us for t_us in chosen_us if t_us < 4_000_000]).mean() <= 80_000
    assert [t_us for t_us in chosen_us if t_us >= 4_000_000] == slow_us


def test_source_of_an_unknown_rate_is_thinned_by_the_clock() -> None:
    assert taken(Pace(12.5, 0), [40_000 * nth for nth in range(9)]) == [0, 2, 4, 6, 8]
    assert taken(Pace(math.inf, 0), [0, 1, 2]) == [0, 1, 2]


def test_left_out_frames_are_not_prepared_and_the_others_keep_their_place(tmp_path: Path) -> None:
    path = tmp_path / "v.mp4"
    write_video(path, [np.full((32, 48), 20 * nth, np.uint8) for nth in range(9)])
    prepared: list[int] = []
    frames = list(open_video(path).frames(lambda frame: (prepared.append(frame.index), frame)[1], rate_hz=12.5))
    assert prepared == [frame.index for frame in frames] == [0, 2, 4, 6, 8]
    assert [frame.t_us for frame in frames] == [0, 80_000, 160_000, 240_000, 320_000]
