"""Single pictures are those of the scene, at the times asked for."""

import numpy as np
import pytest

from data_gen.errors import DataGenError
from data_gen.outputs.stills import draw_stills

SIZE_PX = (320, 180)


@pytest.mark.long
def test_stills_come_at_their_times_and_move_on() -> None:
    stills = list(draw_stills("rural_overtaking", seed=3, count=3, every_us=500_000, size_px=SIZE_PX))
    assert [still.states.t_us for still in stills] == [0, 500_000, 1_000_000]
    assert stills[0].shown is not None
    assert len(stills[0].shown.rows) > 0
    difference = np.abs(stills[0].picture.astype(np.int64) - stills[2].picture).max(axis=2)
    assert (difference > 60).any()


@pytest.mark.long
def test_a_camera_straight_above_shows_no_boxes() -> None:
    still = next(draw_stills("rural_overtaking", seed=3, count=1, camera="vertical", size_px=SIZE_PX))
    assert still.shown is None


@pytest.mark.parametrize(("count", "every_us"), [(0, 100_000), (1, 150_000), (1, 0)])
def test_times_that_are_not_simulated_are_refused(count: int, every_us: int) -> None:
    with pytest.raises(DataGenError, match="stills: expected at least one picture"):
        next(draw_stills("rural_overtaking", seed=3, count=count, every_us=every_us))
