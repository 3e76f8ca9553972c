"""Tracks: born, shown, kept, lost, and never turned round."""

from collections.abc import Iterable, Sequence
from dataclasses import replace

import numpy as np
import pytest

from tests.vision.support import make_boxes
from vision.detection.detector import Detections
from vision.objects import BoolArray, FloatArray, VisionObjects
from vision.road.boxes import Boxes, distance_to_boxes
from vision.settings import VisionSettings
from vision.tracking.tracker import Tracker

Row = tuple[float, float, float, float, float]
STEP_US = 40_000


def everywhere(points_m: FloatArray) -> BoolArray:
    return np.ones(len(points_m), np.bool_)


def detect(rows: Sequence[Row], *, known: Boxes | None = None, cut: Sequence[int] | None = None) -> Detections:
    """Clean detections, owned by the predicted box that they lie in."""
    boxes = make_boxes(rows)
    count = len(boxes)
    owner = np.full(count, -1)
    if known is not None and len(known) and count:
        distance = distance_to_boxes(boxes.centre_m, known)
        owner = np.where(distance.min(axis=1) < 0, np.argmin(distance, axis=1), -1)
    return Detections(
        boxes=boxes,
        noise=np.broadcast_to(0.09 * np.eye(2), (count, 2, 2)),
        elongation=np.full(count, 2.5),
        owner=owner,
        divided=np.zeros(count, np.bool_),
        directed=owner >= 0,
        cut=np.zeros(count, np.int8) if cut is None else np.array(cut, np.int8),
        borders_m=np.full((count, 4), np.nan),
    )


def track(frames: Sequence[tuple[int, Sequence[Row]]], tracker: Tracker | None = None) -> list[VisionObjects]:
    """Run (time, boxes) through a tracker."""
    tracker = tracker or Tracker(VisionSettings(), everywhere)
    results = []
    for t_us, rows in frames:
        expected = tracker.predict(t_us)
        results.append(tracker.update(detect(rows, known=expected.known)))
    return results


def names(results: Iterable[VisionObjects]) -> set[str]:
    return {name for result in results for name in result.ids}


def drive(speed_mps: float, times: Sequence[int], *, start_m: float = 0.0, north_m: float = 0.0) -> list[Row]:
    heading = 0.0 if speed_mps >= 0 else np.pi
    return [(start_m + speed_mps * t / 1e6, north_m, heading, 4.5, 1.8) for t in times]


TIMES = [STEP_US * k for k in range(50)]


def test_car_is_shown_after_four_hits_and_keeps_its_name() -> None:
    results = track([(t, [row]) for t, row in zip(TIMES, drive(20, TIMES), strict=True)])
    assert [len(r.ids) for r in results[:5]] == [0, 0, 0, 1, 1]
    assert {r.ids for r in results[3:]} == {("v1",)}
    assert results[-1].velocity_mps[0] == pytest.approx([20, 0], abs=0.2)
    assert results[-1].centre_m[0] == pytest.approx([20 * TIMES[-1] / 1e6, 0], abs=0.05)


def test_heading_follows_the_motion_and_not_the_long_axis_of_the_box() -> None:
    rows = [(east, 0.0, 0.0, 4.5, 1.8) for east, *_ in drive(-15, TIMES)]
    last = track([(t, [row]) for t, row in zip(TIMES, rows, strict=True)])[-1]
    assert abs(last.heading_rad[0]) == pytest.approx(np.pi, abs=0.01)


def test_slow_car_of_which_the_box_points_backwards_is_tracked_at_five_frames_a_second() -> None:
    tracker, noise = Tracker(VisionSettings(), everywhere), np.full((1, 2, 2), 0.15**2 * np.eye(2))
    for k in range(6):
        known = tracker.predict(200_000 * k).known
        last = tracker.update(replace(detect([(-0.66 * k, 0.0, 0.0, 4.5, 1.8)], known=known), noise=noise))
    assert last.ids == ("v1",)


def test_heading_is_kept_while_a_car_stands() -> None:
    east = [20 * min(t, 1_000_000) / 1e6 for t in TIMES]
    rng = np.random.default_rng(0)
    rows = [(e + rng.normal(0, 0.1), rng.normal(0, 0.1), 0.0, 4.5, 1.8) for e in east]
    last = track([(t, [row]) for t, row in zip(TIMES, rows, strict=True)])[-1]
    assert abs(last.heading_rad[0]) < 0.1


@pytest.mark.parametrize("shares", [True, False])
def test_creeping_car_that_is_drawn_aside_in_a_shared_blob_neither_turns_nor_drives_sideways(*, shares: bool) -> None:
    tracker, last = Tracker(VisionSettings(), everywhere), VisionObjects.lost(0, "")
    for t, (east, north, *_) in zip(TIMES, drive(2, TIMES), strict=True):
        row = (east, north + 3.75 * max(0.0, t / 1e6 - 1.6), 0.0, 4.5, 1.8)
        seen = detect([row], known=tracker.predict(t).known)
        last = tracker.update(replace(seen, divided=np.full(1, shares and t > 1_600_000)))
    assert last.centre_m[0, 1] > 0.5
    assert (last.velocity_mps[0] == pytest.approx([2.0, 0.0], abs=0.2)) == shares
    assert (last.heading_rad[0] == pytest.approx(0.0, abs=0.1)) == shares


@pytest.mark.parametrize(("driven_m", "turns"), [(20.0, False), (0.0, True)])
def test_car_that_drove_in_keeps_its_front_when_it_backs(driven_m: float, turns: bool) -> None:
    ways_m = [min(10.0 * t / 1e6, driven_m) - 3.8 * max(t / 1e6 - 3.0, 0.0) for t in range(0, 5_000_000, STEP_US)]
    last = track([(k * STEP_US, [(way_m, 0.0, 0.0, 4.5, 1.8)]) for k, way_m in enumerate(ways_m)])[-1]
    assert last.velocity_mps[0, 0] == pytest.approx(-3.8, abs=0.2)
    assert (abs(last.heading_rad[0]) > np.pi / 2) == turns


@pytest.mark.parametrize("rate_hz", [25, 12.5, 5])
def test_lower_frame_rates_and_dropped_frames_change_nothing_but_the_uncertainty(rate_hz: float) -> None:
    step_us = round(1e6 / rate_hz)
    times = [step_us * k for k in range(int(4 * rate_hz)) if k % 7 != 5]
    cars = [drive(27, times), drive(12, times, start_m=25.0), drive(-22, times, start_m=90.0, north_m=3.5)]
    results = track([(t, list(rows)) for t, rows in zip(times, zip(*cars, strict=True), strict=True)])
    assert len(names(results)) == 3
    last = results[-1]
    assert sorted(np.round(last.velocity_mps[:, 0]).tolist()) == [-22, 12, 27]


def test_car_survives_a_short_loss_and_not_a_long_one() -> None:
    times = [STEP_US * k for k in range(100)]
    for lost_us, count in ((800_000, 1), (1_400_000, 2)):
        rows = drive(15, times)
        frames = [
            (t, [] if 1_000_000 <= t < 1_000_000 + lost_us else [row]) for t, row in zip(times, rows, strict=True)
        ]
        results = track(frames)
        assert len(names(results)) == count
        coasting = results[30]
        assert coasting.observed.tolist() == [False]
        assert coasting.centre_m[0, 0] == pytest.approx(15 * 1.2, abs=0.3)


def test_name_does_not_jump_to_oncoming_traffic() -> None:
    one, two = drive(20, TIMES), drive(-20, TIMES, start_m=38.0, north_m=1.0)
    frames = []
    for t, a, b in zip(TIMES, one, two, strict=True):
        # The first car is not found while the other one comes by.
        frames.append((t, [b] if 0.8e6 <= t <= 1.2e6 else [a, b]))
    results = track(frames)
    east = {name: r.velocity_mps[r.ids.index(name), 0] for r in results[8:] for name in r.ids}
    assert len(east) == 2
    for r in results[8:]:
        assert all(np.sign(r.velocity_mps[i, 0]) == np.sign(east[name]) for i, name in enumerate(r.ids))


def test_standing_car_is_not_pushed_on_by_its_neighbour_that_is_not_seen() -> None:
    tracker, noise = Tracker(VisionSettings(), everywhere), np.broadcast_to(np.diag([1.0, 0.1]), (2, 2, 2))
    for k in range(13):
        tracker.predict(250_000 * k)
        seen_m = (0.0, 5.0) if k < 12 else (5.0, 11.0)
        last = tracker.update(replace(detect([(east, 0.0, 0.0, 4.5, 1.8) for east in seen_m]), noise=noise))
        tracker.prove(tracker.standing(0)[0])
    assert last.ids == ("v1", "v2")
    assert last.observed.tolist() == [False, True]
    assert last.centre_m[:, 0] == pytest.approx([0.0, 5.0], abs=0.1)


def test_track_ends_when_it_leaves_the_view() -> None:
    tracker = Tracker(VisionSettings(), lambda points_m: points_m[:, 0] < 15.0)
    rows = drive(20, TIMES)
    frames = [(t, [row] if row[0] < 14.5 else []) for t, row in zip(TIMES, rows, strict=True)]
    results = track(frames, tracker)
    gone = [r.t_us for r, row in zip(results, rows, strict=True) if row[0] > 15.5 and r.ids]
    assert gone == []


def test_box_cut_by_the_view_edge_is_completed_by_the_known_length() -> None:
    tracker = Tracker(VisionSettings(), everywhere)
    rows = drive(10, TIMES)
    for t, (east, north, heading, length, width) in zip(TIMES, rows, strict=True):
        seen_m = min(length, max(15.0 - (east - length / 2), 0.5))  # the view ends at 15 m
        cut = seen_m < length
        row = (east - length / 2 + seen_m / 2, north, heading, seen_m, width)
        expected = tracker.predict(t)
        result = tracker.update(detect([row], known=expected.known, cut=[1 if cut else 0]))
        if result.ids and east < 16.5:
            assert result.centre_m[0, 0] == pytest.approx(east, abs=0.3)
            assert result.clipped.tolist() == [cut]
            assert result.length_m[0] == pytest.approx(4.5, abs=0.1)


def test_length_forgets_outliers_but_not_two_cars_that_part() -> None:
    times = [STEP_US * k for k in range(200)]
    rows = [
        (15 * t / 1e6, 0.0, 0.0, 9.5 if t < 2_000_000 else (4.5 if k % 10 else 6.0), 1.8) for k, t in enumerate(times)
    ]
    results = track([(t, [row]) for t, row in zip(times, rows, strict=True)])
    assert results[40].length_m[0] == pytest.approx(9.5, abs=0.1)
    assert results[-1].length_m[0] == pytest.approx(4.5, abs=0.2)
    assert {r.ids for r in results[4:]} == {("v1",)}


def test_fragment_of_a_car_is_not_shown_for_long() -> None:
    times = [STEP_US * k for k in range(60)]
    frames = []
    for t, row in zip(times, drive(15, times), strict=True):
        fragment = (row[0] + 0.8, 0.2, 0.0, 2.0, 1.0)
        frames.append((t, [row, fragment]))
    results = track(frames)
    assert all(len(r.ids) == 1 for r in results[25:])


def test_thing_that_never_moves_is_listed_until_it_is_proved_or_dropped() -> None:
    tracker = Tracker(VisionSettings(), everywhere)
    results = track([(t, [(5.0, 0.0, 0.0, 4.5, 1.8)]) for t in TIMES], tracker)
    assert results[-1].ids == ()
    rows, boxes = tracker.standing(1_000_000)
    assert boxes.centre_m[0] == pytest.approx([5, 0])
    tracker.prove(rows)
    later = track([(t + 2_000_000, [(5.0, 0.0, 0.0, 4.5, 1.8)]) for t in TIMES[:3]], tracker)
    assert later[-1].ids == ("v1",)


@pytest.mark.parametrize("way", [pytest.param((1.0, 0.0), id="ahead"), pytest.param((0.0, 1.0), id="sideways")])
def test_standing_car_that_creeps_sideways_must_prove_itself_again(way: tuple[float, float]) -> None:
    # It may be the road that the car has left, or its shadow, learned as background.
    tracker = Tracker(VisionSettings(), everywhere)
    braking_s = [min(t / 1e6, 1.5) for t in TIMES]  # from 9 m/s, at 6 m/s2
    east = [9 * s - 3 * s**2 for s in braking_s]
    track([(t, [(e, 0.0, 0.0, 4.5, 1.8)]) for t, e in zip(TIMES, east, strict=True)], tracker)
    assert tracker.claims()[1].tolist() == [True]
    shifts_m = [0.02 * k for k in range(75)]
    places = [(east[-1] + way[0] * shift, way[1] * shift, 0.0, 4.5, 1.8) for shift in shifts_m]
    results = track([(TIMES[-1] + STEP_US * (k + 1), [place]) for k, place in enumerate(places)], tracker)
    assert results[-1].ids == ("v1",)
    assert tracker.claims()[1].tolist() == [way[1] == 0.0]


def test_oversized_blob_starts_no_track() -> None:
    results = track([(t, [(20 * t / 1e6, 0.0, 0.0, 80.0, 9.0)]) for t in TIMES])
    assert all(r.ids == () for r in results)
