"""Two tracks on one vehicle: found, joined, and not confused with neighbours."""

from dataclasses import replace

import numpy as np
import pytest

from tests.vision.support import make_boxes
from tests.vision.tracking.test_tracker import STEP_US, detect, everywhere
from vision.settings import VisionSettings
from vision.tracking.couples import find_couples
from vision.tracking.settings import TrackingSettings
from vision.tracking.tracker import Tracker

Row = tuple[float, float, float, float, float]

BODY: Row = (0.0, 0.0, 0.0, 6.8, 2.4)
SHADOW_AHEAD: Row = (6.2, 0.2, 0.0, 3.0, 2.4)


def are_couple(other: Row, speeds_mps: tuple[float, float] = (13, 13)) -> bool:
    velocity = np.array([[speed, 0.0] for speed in speeds_mps])
    return bool(find_couples(make_boxes([BODY, other]), velocity, TrackingSettings())[0, 1])


def test_pieces_that_move_as_one_are_a_couple() -> None:
    assert are_couple(SHADOW_AHEAD)


@pytest.mark.parametrize(
    ("other", "speeds_mps"),
    [
        ((8.7, 0.2, 0.0, 3.0, 2.4), (13, 13)),
        ((1.0, 3.4, 0.0, 4.5, 1.8), (13, 13)),
        (SHADOW_AHEAD, (13, 17)),
        (SHADOW_AHEAD, (2, 2)),
        (SHADOW_AHEAD, (13, -13)),
        ((6.8, 0.2, 0.0, 3.0, 2.4), (5, 5)),
    ],
    ids=["a real gap", "side by side", "closing in", "in a queue", "oncoming", "slow traffic"],
)
def test_neighbours_are_no_couple(other: Row, speeds_mps: tuple[float, float]) -> None:
    assert not are_couple(other, speeds_mps)


def names_shown(gap_m: float, frames: int = 80) -> list[tuple[str, ...]]:
    """Drive two boxes in line, as one blob once only one of them is left; return the names of each frame."""
    tracker, shown = Tracker(VisionSettings(), everywhere), []
    for k in range(frames):
        expected = tracker.predict(k * STEP_US)
        along_m = 13 * k * STEP_US / 1e6
        rows = [(along_m, *BODY[1:]), (along_m + 4.9 + gap_m, *SHADOW_AHEAD[1:])]
        if len(expected.known) == 1 and k > 20:
            rows = [(2.15 + along_m, 0.1, 0.0, 11.1, 2.4)]  # nobody divides the blob any more
        seen = detect(rows, known=expected.known)
        is_divided = (seen.owner >= 0) & (len(rows) == 2)
        shown.append(tracker.update(replace(seen, divided=is_divided)).ids)
    return shown


def test_pieces_of_one_vehicle_become_one_track() -> None:
    shown = names_shown(gap_m=1.3)
    assert len(shown[10]) == 2
    assert len(shown[-1]) == 1
    assert shown[-1][0] in shown[10]


def test_windscreens_of_a_car_of_the_colour_of_the_road_become_one_as_long_as_both_with_what_is_between() -> None:
    tracker, lengths_m = Tracker(VisionSettings(), everywhere), []
    for k in range(60):
        expected = tracker.predict(k * STEP_US)
        lengths_m.append(expected.known.length_m.tolist())
        along_m = 20 * k * STEP_US / 1e6
        rows: list[Row] = [(along_m, 0.0, 0.0, 2.1, 1.8), (along_m + 3.0, 0.0, 0.0, 1.7, 1.6)]
        if len(expected.known) == 1 and k > 20:
            break
        tracker.update(detect(rows, known=expected.known))
    assert lengths_m[-1] == [pytest.approx(4.9, abs=0.1)]


def test_car_that_follows_another_at_a_distance_stays_one_of_two() -> None:
    assert len(names_shown(gap_m=6.0)[-1]) == 2
