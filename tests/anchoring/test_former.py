"""Names are dated back to the first row of their track: against all that is known afterwards, and case by case."""

import math
from collections.abc import Mapping, Sequence

import numpy as np
import pytest

from anchoring.adapter import Anchored, AnchoringUnit
from anchoring.anchorer import Anchorer
from anchoring.observations import Observations
from anchoring.settings import AnchoringSettings
from dyknow.sample import Sample
from tests.anchoring.support import Seen, observations, straight_road
from tests.anchoring.test_anchorer import random_tracks
from vision.objects import VisionObjects

ROW_US = 100_000
BACK_US = AnchoringSettings().name_back_us
Row = tuple[int, str, str]


def objects_of(seen: Observations) -> VisionObjects:
    arrays = (seen.centre_m, seen.velocity_mps, seen.heading_rad, seen.length_m, seen.width_m)
    return VisionObjects(seen.t_us, seen.ids, *arrays, seen.observed, seen.clipped)


def anchored(frames: Sequence[tuple[int, Mapping[str, Seen]]], anchorer: Anchorer) -> list[Anchored]:
    """Run frames through the unit."""
    unit, found = AnchoringUnit(anchorer), list[Anchored]()
    for t_us, seen in frames:
        (sample,) = unit.update(Sample(t_us, t_us, objects_of(observations(t_us, seen))))
        found.append(sample.value)
    return found


def former_rows(found: Sequence[Anchored]) -> list[Row]:
    """List time, car and vision object of what was dated back."""
    return [
        (then.t_us, *names)
        for one in found
        for then in one.former
        for names in zip(then.ids, then.vision_ids, strict=True)
    ]


def given_rows(found: Sequence[Anchored]) -> list[Row]:
    """List the same of what was given out at its time, without the vision object where it was predicted."""
    return [
        (one.cars.t_us, car, vision_id if linked else "")
        for one in found
        for car, vision_id, linked in zip(one.cars.ids, one.cars.vision_ids, one.cars.linked, strict=True)
    ]


def expected_rows(frames: Sequence[tuple[int, Mapping[str, Seen]]], found: Sequence[Anchored]) -> set[Row]:
    """Find the former rows slowly, from all frames: go back from each row that gives a vision object a car."""
    given = {(t_us, vision_id): car for t_us, car, vision_id in given_rows(found) if vision_id}
    told = {(t_us, car) for t_us, car, _ in given_rows(found)}
    refuted = {
        (change.t_us, change.lower)
        for one in found
        for change in one.link_changes
        if change.kind == "refuted" and change.level == "world"
    }
    rows: set[Row] = set()
    for place, (now_us, _) in enumerate(frames):
        for vision_id, car in [(name, car) for (t_us, name), car in given.items() if t_us == now_us]:
            track: list[Row] = []
            after_us, after = now_us, frames[place][1][vision_id]
            for t_us, seen in reversed(frames[:place]):
                if (t_us, vision_id) in given:  # it had a car before
                    track = []
                if vision_id not in seen or (t_us, vision_id) in given:
                    break
                way_m = math.hypot(seen[vision_id].x_m - after.x_m, seen[vision_id].y_m - after.y_m)
                if seen[vision_id].observed and way_m > 4 + 70e-6 * (after_us - t_us):  # it cannot have come from there
                    break
                if now_us - t_us <= BACK_US and seen[vision_id].observed:
                    track.append((t_us, car, vision_id))
                    after_us, after = t_us, seen[vision_id]
                if (t_us, vision_id) in refuted:  # from here on it is something new
                    break
            newest_us = max((t_us for t_us, one in told if one == car and t_us < now_us), default=-1)
            rows |= {row for row in track if row[0] > newest_us}
    return rows


@pytest.mark.long
@pytest.mark.parametrize("trusts_ids", [False, True])
@pytest.mark.parametrize("seed", [0, 1, *(pytest.param(one, marks=pytest.mark.slow) for one in range(2, 8))])
def test_former_rows_are_those_that_all_frames_show(seed: int, trusts_ids: bool) -> None:
    frames = random_tracks(np.random.default_rng(seed), seconds=12.0)
    found = anchored(frames, Anchorer(straight_road() if seed % 2 else None, trusts_ids=trusts_ids))
    rows = former_rows(found)
    assert set(rows) == expected_rows(frames, found)
    assert len(rows) > 50
    given = {(t_us, car) for t_us, car, _ in given_rows(found)}
    assert len({(t_us, car) for t_us, car, _ in rows} | given) == len(rows) + len(given)  # no car twice at a time


def east(frame: int, **changed: float) -> Seen:
    return Seen(**{"x_m": float(frame), "y_m": -1.75} | changed)  # type: ignore[arg-type]


def test_a_car_has_the_rows_from_before_its_name() -> None:
    found = anchored([(k * ROW_US, {"v": east(k)}) for k in range(8)], Anchorer(straight_road()))
    assert former_rows(found) == [(k * ROW_US, "car1", "v") for k in range(4)]
    assert [one.cars.ids for one in found] == [()] * 4 + [("car1",)] * 4
    first = found[4].former[0]
    assert (first.centre_m.tolist(), first.positions.road.tolist()) == ([[0.0, -1.75]], [0])
    assert (first.speed_mps.tolist(), first.linked.tolist(), first.classes) == ([10.0], [True], ("car",))


def test_a_name_is_dated_back_by_two_seconds_at_most() -> None:
    def parked_first(frame: int) -> Seen:
        return east(frame, y_m=-1.75 if frame >= 50 else -9.0)

    anchorer = Anchorer(straight_road(), AnchoringSettings(jump_m=20.0))
    found = anchored([(k * ROW_US, {"v": parked_first(k)}) for k in range(60)], anchorer)
    assert [t_us // ROW_US for t_us, *_ in former_rows(found)] == list(range(34, 54))


def test_rows_that_were_told_as_predicted_stay_as_they_were_told() -> None:
    def fast_at_first(k: int) -> Seen:
        return east(k, heading_rad=math.pi if k < 27 else 0.0)

    frames: list[tuple[int, Mapping[str, Seen]]] = [
        (k * ROW_US, {"v": east(k)} if k < 10 else {"w": fast_at_first(k)} if k >= 25 else {}) for k in range(40)
    ]
    found = anchored(frames, Anchorer(straight_road()))
    assert {car for _, car, _ in given_rows(found)} == {"car1"}
    assert [(t_us // ROW_US, car) for t_us, car, name in former_rows(found) if name == "w"] == [
        (25, "car1"),
        (26, "car1"),
    ]


def test_a_wild_row_before_the_name_is_left_out_with_all_before_it() -> None:
    frames = [(k * ROW_US, {"v": east(k, x_m=900.0 if k == 2 else float(k))}) for k in range(8)]
    found = anchored(frames, Anchorer(straight_road()))
    assert [t_us // ROW_US for t_us, *_ in former_rows(found)] == [3, 4, 5, 6]


def test_guesses_of_the_tracker_are_not_dated_back() -> None:
    frames = [(k * ROW_US, {"v": east(k, observed=k != 1)}) for k in range(10)]
    found = anchored(frames, Anchorer(straight_road()))
    assert [t_us // ROW_US for t_us, *_ in former_rows(found)] == [0, 2, 3, 4, 5]


def test_nothing_is_dated_back_into_a_lost_view_and_the_time_after_it() -> None:
    unit = AnchoringUnit(Anchorer(None))
    found: list[Anchored] = []
    for k in range(24):
        now = objects_of(observations(k * ROW_US, {f"v{k > 11}": east(k)}))
        lost = VisionObjects.lost(k * ROW_US)
        found += [one.value for one in unit.update(Sample(0, k * ROW_US, lost if k in (2, 3, 10, 11) else now))]
    settled = 4 + AnchoringSettings().settle_us // ROW_US
    assert found[settled].cars.ids == ("car1",)
    assert former_rows(found) == []
