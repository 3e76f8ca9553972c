"""How far apart may two cars be that follow each other or nearly collide? The faster, the further."""

import numpy as np
import pytest

from qsr.changes.crossings import RelationChange
from qsr.observer import RelationObserver
from tests.qsr.support import changes_of, footprints


def gaps_told(speed_mps: float, *, y_m: float = 0.0, x_first_m: int = 160) -> list[int]:
    """Let b come nearer to a, metre by metre; list the gaps between the bumpers at which `following` became true."""
    observer = RelationObserver(("road",), ())
    told: list[RelationChange] = []
    gaps_m = range(x_first_m, 5, -1)
    for k, gap_m in enumerate(gaps_m):
        told += observer.observe(
            footprints(k * 40_000, "ab", [[0.0, 0.0], [4.0 + gap_m, y_m]], speed_mps=speed_mps, straight_road=True)
        )
    return [gaps_m[t_us // 40_000] for t_us, _, new in changes_of(told, "following", "a", "b") if new]


@pytest.mark.parametrize("speed_mps", [8.0, 13.0, 20.0, 33.0, 45.0])
def test_a_time_gap_of_three_seconds_is_seen_at_any_speed(speed_mps: float) -> None:
    (gap_m,) = gaps_told(speed_mps)
    assert gap_m == pytest.approx(3.0 * speed_mps, abs=1.0)


def test_a_car_in_the_next_lane_is_not_even_looked_at_from_afar() -> None:
    observer = RelationObserver(("road",), ())
    frame = footprints(0, "ab", [[0.0, 0.0], [70.0, 7.0]], speed_mps=30.0, straight_road=True)
    assert not {change.name for change in observer.observe(frame)} & {"following", "behind"}


def test_position_relations_reach_no_further_than_before() -> None:
    observer = RelationObserver(("road",), ())
    frame = footprints(0, "ab", [[0.0, 0.0], [70.0, 0.0]], speed_mps=30.0, straight_road=True)
    names = {change.name for change in observer.observe(frame) if len(change.args) == 2 and change.args[1] != "road"}
    assert names == {"following", "short_headway", "conflict"}


def test_who_drives_in_between_is_followed_also_from_afar() -> None:
    observer = RelationObserver(("road",), ())
    frame = footprints(0, "abc", [[0.0, 0.0], [50.0, 0.0], [80.0, 0.0]], speed_mps=30.0, straight_road=True)
    holds = {change.args for change in observer.observe(frame) if change.name == "following" and change.new}
    assert holds == {("a", "b"), ("b", "c")}


def test_two_cars_that_race_towards_each_other_are_in_conflict_at_once() -> None:
    observer = RelationObserver(("road",), ())
    told: list[RelationChange] = []
    for k in range(60):  # they close at 60 m/s, from 180 m
        x_m = [[1.2 * k, 0.0], [180.0 - 1.2 * k, 0.0]]
        told += observer.observe(
            footprints(k * 40_000, "ab", x_m, speed_mps=30.0, heading_rad=[0.0, np.pi], straight_road=True)
        )
    t_us = next(one.t_us for one in told if one.name == "conflict" and one.new)
    left_m = 180.0 - 4.0 - 60.0 * t_us * 1e-6
    assert left_m == pytest.approx(1.5 * 60.0, abs=1.0)
