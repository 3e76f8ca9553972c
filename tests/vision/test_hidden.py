"""Vehicles under bridges and trees: waited for, known again by the part that shows, and of the same size after it."""

import pytest

from tests.vision.tracking.test_tracker import STEP_US, Row, detect, everywhere, names
from vision.objects import VisionObjects
from vision.settings import VisionSettings
from vision.tracking.tracker import Tracker

LENGTH_M = 10.0


def shown(rear_m: float, front_m: float, hidden_m: list[tuple[float, float]]) -> list[tuple[float, float]]:
    """Take the hidden stretches of the road off a body."""
    parts = [(rear_m, front_m)]
    for start_m, end_m in hidden_m:
        parts = [
            piece
            for rear, front in parts
            for piece in ((rear, min(front, start_m)), (max(rear, end_m), front))
            if piece[1] - piece[0] > 0.8
        ]
    return parts


def drive_under(
    hidden_m: list[tuple[float, float]], *, speed_mps: float = 15.0, frames: int = 250, trail_m: float = 0.0
) -> list[VisionObjects]:
    """Drive a truck along a road of which stretches are hidden; of two parts that show, the larger is detected.

    `trail_m` is how far the picture of its rear end stays behind while its front end is hidden.
    """
    tracker, results = Tracker(VisionSettings(), everywhere), []
    for k in range(frames):
        rear_m = speed_mps * k * STEP_US / 1e6
        parts = shown(rear_m, rear_m + LENGTH_M, hidden_m)
        rear_shows = bool(parts) and parts[0][0] == rear_m and parts[0][1] < rear_m + LENGTH_M
        if rear_shows and trail_m:
            parts[0] = (rear_m - trail_m, parts[0][1])
        largest = sorted(parts, key=lambda part: part[0] - part[1])[:1]
        rows: list[Row] = [((rear + front) / 2, 0.0, 0.0, front - rear, 2.5) for rear, front in largest]
        results.append(tracker.update(detect(rows, known=tracker.predict(k * STEP_US).known)))
    return results


@pytest.mark.long
@pytest.mark.parametrize("wide_m", [5.0, 11.0, 30.0], ids=["gantry", "bridge", "trees"])
def test_truck_keeps_its_name_size_and_speed_under_whatever_hides_it(wide_m: float) -> None:
    results = drive_under([(60.0, 60.0 + wide_m)])
    assert names(results) == {"v1"}
    shown = [result for result in results[30:] if result.ids]
    assert shown[-1] is results[-1]
    for result in shown:
        assert result.length_m[0] == pytest.approx(LENGTH_M, abs=0.5)
        assert result.velocity_mps[0, 0] == pytest.approx(15, abs=1.5)


def test_hidden_truck_is_shown_for_a_second_and_again_when_it_comes_out() -> None:
    results = drive_under([(60.0, 95.0)])
    is_shown = [bool(result.ids) for result in results[30:]]
    since_seen, waits = 0, []
    for result in results[30:]:
        since_seen = 0 if result.observed.any() else since_seen + 1
        waits.append(since_seen)
    assert is_shown == [wait * STEP_US <= 1_000_000 for wait in waits]
    assert max(waits) * STEP_US > 1_400_000
    assert names(results) == {"v1"}


def test_truck_is_where_it_must_be_while_half_of_it_is_hidden() -> None:
    results = drive_under([(60.0, 80.0)])
    for k, result in enumerate(results[30:], start=30):
        assert result.centre_m[0, 0] == pytest.approx(15 * k * STEP_US / 1e6 + LENGTH_M / 2, abs=1.0)


@pytest.mark.long
def test_hole_in_the_leaves_is_not_taken_for_the_size_of_what_passes_under_it() -> None:
    results = drive_under([(60.0, 75.0), (77.0, 92.0)])
    assert names(results) == {"v1"}
    assert results[-1].length_m[0] == pytest.approx(LENGTH_M, abs=0.3)
    assert min(result.length_m[0] for result in results[30:]) > LENGTH_M - 0.75


@pytest.mark.long
def test_rear_end_that_stays_behind_in_the_picture_is_not_believed_to_brake_harder_than_tyres_can() -> None:
    results = drive_under([(60.0, 72.0)], trail_m=1.5)
    assert names(results) == {"v1"}
    assert min(result.velocity_mps[0, 0] for result in results[60:120]) > 9


@pytest.mark.long
def test_truck_that_creeps_under_a_bridge_is_not_waited_for() -> None:
    assert len(names(drive_under([(60.0, 75.0)], speed_mps=6.0, frames=500))) == 2


@pytest.mark.parametrize("speed_mps", [4.0, 10.0, 20.0])
def test_car_that_comes_out_for_the_first_time_is_soon_as_long_as_it_is(speed_mps: float) -> None:
    tracker, results = Tracker(VisionSettings(), everywhere), []
    for k in range(60):
        front_m = 1.7 + speed_mps * k * STEP_US / 1e6
        seen_m = min(front_m, 4.4)
        rows: list[Row] = [(front_m - seen_m / 2, 0.0, 0.0, seen_m, 1.8)]
        results.append(tracker.update(detect(rows, known=tracker.predict(k * STEP_US).known)))
        if front_m > 4.4:
            assert results[-1].length_m.tolist() == [pytest.approx(4.4, abs=0.5)] * len(results[-1].ids)
    assert names(results) == {"v1"}
