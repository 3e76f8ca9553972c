"""Lanes, directions of travel, time gaps, conflicts, oncoming cars and turns, in small scenes."""

from collections.abc import Sequence

import numpy as np
import pytest

from gis.roads.turns import Turn
from qsr.changes.crossings import RelationChange, Value
from qsr.errors import QsrError
from qsr.measuring.footprints import Footprints
from qsr.observer import RelationObserver
from qsr.settings import RelationSettings
from tests.qsr.support import changes_of, footprints

LANES = [("east", 1), ("west", -1)]
Xy = Sequence[Sequence[float]]


def run(frames: Sequence[Footprints], *, only: Sequence[str] | None = None) -> list[RelationChange]:
    observer = RelationObserver(("road",), ("cross",), only=only, lanes=LANES)
    return [change for frame in frames for change in observer.observe(frame)]


def on_road(
    t_us: int,
    xy_m: Xy,
    *,
    speed_mps: Sequence[float] | float = 20.0,
    heading_rad: Sequence[float] | float = 0.0,
    lane: int = 0,
) -> Footprints:
    ids = "abcd"[: len(xy_m)]
    return footprints(
        t_us, ids, xy_m, speed_mps=speed_mps, heading_rad=heading_rad, lane=lane, straight_road=True, length_m=4.0
    )


def at_once(frame: Footprints, name: str) -> dict[tuple[str, ...], Value]:
    return {change.args: change.new for change in run([frame]) if change.name == name}


@pytest.mark.parametrize(
    ("gap_m", "speed_mps", "following", "short"),
    [
        (15.0, 20.0, True, True),
        (19.0, 20.0, True, True),
        (21.0, 20.0, True, False),
        (38.0, 20.0, True, False),
        (38.0, 12.0, False, False),
        (3.0, 8.0, True, False),
        (3.0, 1.0, False, False),
    ],
    ids=["0.75 s", "0.95 s", "1.05 s", "1.9 s", "3.2 s", "slow", "crawling"],
)
def test_following_and_headway_go_by_the_followers_time_gap(
    gap_m: float, speed_mps: float, following: bool, short: bool
) -> None:
    frame = on_road(0, [[0.0, 0.0], [4.0 + gap_m, 0.0]], speed_mps=[speed_mps, 30.0])
    assert at_once(frame, "following") == {("a", "b"): following, ("b", "a"): False}
    assert at_once(frame, "short_headway") == {("a", "b"): short, ("b", "a"): False}


def test_only_the_next_car_in_the_path_is_followed() -> None:
    frame = on_road(0, [[0.0, 0.0], [9.0, 0.0], [18.0, 0.0], [5.0, 3.5]])
    assert {pair for pair, holds in at_once(frame, "following").items() if holds} == {("a", "b"), ("b", "c")}
    assert {pair for pair, holds in at_once(frame, "short_headway").items() if holds} == {("a", "b"), ("b", "c")}


def test_car_that_comes_in_between_is_followed_from_then_on() -> None:
    frames = [on_road(k * 100_000, [[0.0, 0.0], [20.0, 0.0], [10.0, 4.0 - 0.4 * k]]) for k in range(11)]
    changes = run(frames)
    [before, cut] = changes_of(changes, "following", "a", "b")
    assert before == (0, None, True)
    assert cut[1:] == (True, False)
    # The bodies, 2 m wide, overlap sideways from 0.5 s on; within a frame of that c is the next one.
    [(_, _, at_first), (t_us, _, later)] = changes_of(changes, "following", "a", "c")
    assert (at_first, later) == (False, True)
    assert 500_000 <= t_us <= 600_000


def test_leader_that_is_going_the_other_way_is_not_followed() -> None:
    frame = on_road(0, [[0.0, 0.0], [15.0, 0.0]], heading_rad=[0.0, np.pi])
    assert set(at_once(frame, "following").values()) == {False}


@pytest.mark.parametrize(
    ("gap_m", "speeds", "conflict"),
    [
        (14.0, (20.0, 8.0), True),
        (20.0, (20.0, 8.0), False),
        (4.0, (10.0, 6.5), False),
        (14.0, (8.0, 20.0), False),
        (14.0, (20.0, 20.0), False),
    ],
    ids=["1.2 s", "1.7 s", "1.1 s but gently braked", "drawing away", "at one speed"],
)
def test_conflict_is_contact_soon_that_takes_hard_braking(
    gap_m: float, speeds: tuple[float, float], conflict: bool
) -> None:
    frame = on_road(0, [[0.0, 0.0], [4.0 + gap_m, 0.0]], speed_mps=speeds)
    assert at_once(frame, "conflict") == {("a", "b"): conflict}


@pytest.mark.parametrize(("across_m", "conflict"), [(1.9, True), (2.1, False)])
def test_bodies_that_pass_clear_of_each_other_on_a_road_are_in_no_conflict(across_m: float, conflict: bool) -> None:
    head_on = on_road(0, [[0.0, 0.0], [30.0, across_m]], heading_rad=[0.02, np.pi])
    assert at_once(head_on, "conflict") == {("a", "b"): conflict}


@pytest.mark.parametrize("on_road", [True, False])
@pytest.mark.parametrize(("across_m", "sure"), [(0.2, (0.95, 1.0)), (1.8, (0.6, 0.8))])
def test_a_conflict_of_bodies_that_overlap_by_no_more_than_their_noise_is_unsure(
    across_m: float, sure: tuple[float, float], *, on_road: bool
) -> None:
    frames = [
        footprints(t_us, "ab", [[0.0, 0.0], [ahead_m, across_m]], speed_mps=[25.0, 5.0], straight_road=on_road)
        for t_us, ahead_m in ((0, 60.0), (40_000, 8.0), (1_000_000, 8.0))
    ]
    noisy = [one.having(sigma_m=np.full(2, 0.2)) for one in frames]
    (told,) = [one for one in run(noisy) if one.name == "conflict" and one.new]
    assert sure[0] < told.confidence <= sure[1]


def test_track_that_is_too_wide_for_any_vehicle_is_not_in_its_neighbours_way() -> None:
    xy_m = [[0.0, 0.0], [30.0, 3.0]]
    frame = footprints(0, "ab", xy_m, heading_rad=[0.0, np.pi], speed_mps=20.0, width_m=4.5, straight_road=True)
    assert at_once(frame, "conflict") == {("a", "b"): False}


@pytest.mark.parametrize(("lead_s", "conflict"), [(0.0, True), (0.2, True), (1.0, False)])
def test_paths_that_cross_are_a_conflict_if_both_cars_come_at_one_time(lead_s: float, conflict: bool) -> None:
    speed_mps, to_crossing_m = 12.0, 16.0
    xy_m = [[-to_crossing_m, 0.0], [0.0, -to_crossing_m - lead_s * speed_mps]]
    frame = footprints(0, "ab", xy_m, heading_rad=[0.0, np.pi / 2], speed_mps=speed_mps, width_m=1.8)
    assert at_once(frame, "conflict") == {("a", "b"): conflict}


@pytest.mark.parametrize(
    ("y_m", "conflict"), [(-7.5, True), (-10.0, False)], ids=["corner by corner", "0.9 m behind it"]
)
def test_bodies_that_pass_each_other_askew_are_in_no_conflict(y_m: float, conflict: bool) -> None:
    frame = footprints(0, "ab", [[0.0, 0.0], [8.0, y_m]], heading_rad=[0.0, np.deg2rad(120.0)], speed_mps=10.0)
    assert at_once(frame, "conflict") == {("a", "b"): conflict}


def test_conflict_is_told_once_for_a_pair_whoever_comes_first_in_the_frame() -> None:
    xy_m = [[0.0, 0.0], [18.0, 0.0]]
    frames = [
        footprints(0, "ab", xy_m, speed_mps=[20.0, 8.0], straight_road=True),
        footprints(40_000, "ba", xy_m[::-1], speed_mps=[20.0, 20.0], straight_road=True),
    ]
    changes = [change for change in run(frames) if change.name == "conflict"]
    assert [(change.args, change.old, change.new) for change in changes] == [
        (("a", "b"), None, True),
        (("a", "b"), True, False),
    ]


def meeting(t_us: int, x_a_m: float, x_b_m: float) -> Footprints:
    return on_road(t_us, [[x_a_m, -1.75], [x_b_m, 1.75]], heading_rad=[0.0, np.pi], speed_mps=25.0)


def test_cars_are_oncoming_from_three_seconds_before_they_meet_until_they_meet() -> None:
    frames = [meeting(k * 100_000, 2.5 * k, 160.0 - 2.5 * k) for k in range(60)]
    changes = changes_of(run(frames), "oncoming", "a", "b")
    # They start 156 m apart, bumper to bumper, and close at 50 m/s; looked at from 150 m on.
    assert changes[0] == (200_000, None, True)
    assert changes[1][1:] == (True, False)
    assert changes[1][0] == pytest.approx(3_120_000, abs=100_000)
    assert changes_of(run(frames), "oncoming", "b", "a") == changes


def test_slower_cars_are_oncoming_when_they_are_nearer() -> None:
    frames = [
        on_road(k * 100_000, [[k, -1.75], [100.0 - k, 1.75]], heading_rad=[0.0, np.pi], speed_mps=10.0)
        for k in range(40)
    ]
    changes = changes_of(run(frames), "oncoming", "a", "b")
    assert changes == [(0, None, False), (1_800_000, False, True)]  # 96 m, less 60 m, at 20 m/s


def test_oncoming_cars_off_the_roads_or_across_the_road_are_not_known() -> None:
    off_road = footprints(0, "ab", [[0.0, 0.0], [50.0, 3.0]], heading_rad=[0.0, np.pi])
    across = on_road(0, [[0.0, 0.0], [50.0, 3.0]], heading_rad=[0.0, np.pi / 2])
    assert at_once(off_road, "oncoming") == at_once(across, "oncoming") == {}


def test_lane_is_a_place_that_settles() -> None:
    lanes = [0, 0, 1, 0, 1, 1, 1, 1]
    frames = [on_road(k * 100_000, [[0.0, 0.0]], lane=lane) for k, lane in enumerate(lanes)]
    changes = run(frames)
    assert changes_of(changes, "in_lane", "a", "east") == [(0, None, True), (400_000, True, False)]
    assert changes_of(changes, "in_lane", "a", "west") == [(400_000, False, True)]


def test_traffic_is_against_its_lane_by_heading_and_lane() -> None:
    frames = [on_road(k * 100_000, [[0.0, 0.0]], lane=int(k >= 5)) for k in range(10)]
    frames += [on_road(k * 100_000, [[0.0, 0.0]], lane=1, heading_rad=1.5) for k in range(10, 15)]
    frames += [on_road(k * 100_000, [[0.0, 0.0]], lane=1, heading_rad=3.1) for k in range(15, 20)]
    changes = run(frames)
    assert changes_of(changes, "against_traffic", "a") == [
        (0, None, False),
        (500_000, False, True),
        (1_000_000, True, None),  # across the road
        (1_500_000, None, False),
    ]
    assert changes_of(changes, "forward", "a") == [
        (0, None, True),
        (1_000_000, True, None),
        (1_500_000, None, False),
    ]


def test_direction_of_travel_is_unknown_off_the_roads_and_when_the_car_is_gone() -> None:
    frames = [on_road(0, [[0.0, 0.0]]), footprints(100_000, "", [])]
    assert changes_of(run(frames), "forward", "a") == [(0, None, True), (100_000, True, None)]
    assert changes_of(run([footprints(0, "a", [[0.0, 0.0]])]), "forward", "a") == []


def test_without_lanes_nothing_is_said_of_lanes() -> None:
    observer = RelationObserver(("road",), ())
    assert {"in_lane", "against_traffic"}.isdisjoint(
        change.name for change in observer.observe(on_road(0, [[0.0, 0.0]], lane=5))
    )


def test_lane_that_is_not_on_the_list_is_refused() -> None:
    with pytest.raises(QsrError, match="index of in_lane at 0 us must be below 2, got 2"):
        run([on_road(0, [[0.0, 0.0]], lane=2)])


def test_turns_are_told_once_with_the_first_frame() -> None:
    ways = [Turn("west", "x", "north", "left"), Turn("west", "x", "east", "straight")]
    observer = RelationObserver(("west", "north", "east"), ("x",), turns=ways)
    first = [change for change in observer.observe(footprints(70, "", [])) if change.name == "turn"]
    assert first == [
        RelationChange("turn", ("west", "x", "east"), 70, 70, None, "straight"),
        RelationChange("turn", ("west", "x", "north"), 70, 70, None, "left"),
    ]
    assert observer.observe(footprints(80, "", [])) == []
    silent = RelationObserver(("west", "north", "east"), ("x",), turns=ways, only=["on"])
    assert silent.observe(footprints(70, "", [])) == []


@pytest.mark.parametrize("name", ["conflict", "following", "short_headway", "oncoming", "in_lane", "against_traffic"])
def test_relation_asked_for_alone_is_the_same_as_among_all(name: str) -> None:
    rng = np.random.default_rng(3)
    heading_rad = np.array([0.0, 0.0, 0.0, np.pi])
    frames = [
        on_road(k * 100_000, rng.uniform([0, -1], [40, 1], (4, 2)).tolist(), heading_rad=heading_rad.tolist())
        for k in range(30)
    ]
    everything = [change for change in run(frames) if change.name == name]
    assert everything
    assert run(frames, only=[name]) == everything


def test_settings_refuse_an_oncoming_radius_that_ends_before_it_begins() -> None:
    with pytest.raises(QsrError, match=r"oncoming_leave_m must be at least oncoming_enter_m \(150.0\), got 100.0"):
        RelationSettings(oncoming_leave_m=100.0)
