"""Manoeuvres of small hand-made trajectories, each beside a harmless twin, through relations and library chronicles."""

import pytest

from gis.roads.road_network import RoadNetwork
from gis.roads.sumo_net import read_sumo_net
from tests.gis.support import CROSSING_NET
from tests.qsr.scenes import Knots, at_speed, found, straight_road

with_and_without_noise = pytest.mark.parametrize(
    "seed",
    [
        pytest.param(None, id="exact", marks=pytest.mark.slow),  # with noise it is harder
        pytest.param(1, id="noise1"),
        pytest.param(2, id="noise2", marks=pytest.mark.slow),
    ],
)


@pytest.fixture(scope="module")
def crossing() -> RoadNetwork:
    return read_sumo_net(CROSSING_NET)


WAYS = ["turn_left", "turn_right", "drive_straight", "u_turn"]
FROM_WEST = [(0.0, -100.0, -1.65), (6.0, -40.0, -1.65), (10.0, -12.0, -1.65)]
TO: dict[str, Knots] = {
    "turn_left": [(11.5, -2.0, 1.0), (12.3, 1.65, 7.0), (13.0, 1.65, 14.0), (16.0, 1.65, 44.0), (20.0, 1.65, 90.0)],
    "turn_right": [(11.0, -5.5, -4.0), (12.0, -4.95, -10.0), (13.0, -4.95, -16.0), (16.0, -4.95, -45.0)],
    "drive_straight": [(11.0, -2.0, -1.65), (12.0, 8.0, 0.0), (13.0, 17.0, 0.3), (16.0, 45.0, 1.0)],
    "u_turn": [(12.0, -5.0, 0.0), (13.5, -7.0, 1.65), (14.5, -11.5, 1.65), (16.0, -19.0, 1.65), (20.0, -50.0, 1.65)],
}


@with_and_without_noise
@pytest.mark.parametrize("way", WAYS)
def test_each_way_over_a_junction_is_that_way_and_no_other(crossing: RoadNetwork, way: str, seed: int | None) -> None:
    road = {"turn_left": "cn", "turn_right": "cs", "drive_straight": "ce"}
    roles = "junction=c road=cw" if way == "u_turn" else f"junction=c from=cw to={road[way]}"
    assert found(crossing, {"a": [*FROM_WEST, *TO[way]]}, WAYS, seed=seed) == [f"{way} car=a {roles}"]


@pytest.mark.long
def test_waiting_at_the_edge_of_a_junction_is_no_turn(crossing: RoadNetwork) -> None:
    waiting: Knots = [(0.0, -60.0, -1.65), (6.0, -12.0, -1.65), (8.0, -10.6, -1.65), (20.0, -10.6, -1.65)]
    for seed in (1, 2, 3):
        assert found(crossing, {"a": waiting}, WAYS, seed=seed) == []


def changing_lanes(gap_m: float) -> dict[str, Knots]:
    """Let a change into the lane of b, both at 20 m/s, with a gap between their bumpers."""
    ahead_m = 54.5 + gap_m
    cutter = [(0.0, ahead_m, -1.75), (4.0, ahead_m + 80, -1.75), (7.0, ahead_m + 140, -5.25)]
    return {
        "a": [*cutter, (12.0, ahead_m + 240, -5.25)],
        "b": at_speed(20.0, 50.0, -5.25, seconds=12.0),
    }


@with_and_without_noise
def test_cut_in_is_a_lane_change_into_a_short_gap(seed: int | None) -> None:
    road = straight_road(lanes_each_way=2)
    assert found(road, changing_lanes(8.0), ["cut_in"], seed=seed) == ["cut_in cutter=a car=b lane=east1"]
    assert found(road, changing_lanes(30.0), ["cut_in"], seed=seed) == []


@pytest.mark.long
@with_and_without_noise
def test_tailgating_is_a_short_time_gap_that_lasts(seed: int | None) -> None:
    def behind(gap_m: float) -> dict[str, Knots]:
        return {
            "b": at_speed(25.0, 50.0, -1.75, seconds=10.0),
            "a": at_speed(25.0, 45.5 - gap_m, -1.75, seconds=10.0),
        }

    road = straight_road()
    names = ["tailgating", "follow"]
    assert found(road, behind(12.0), names, seed=seed) == []  # nobody has seen it end
    gone = behind(12.0)
    gone["b"] = at_speed(25.0, 50.0, -1.75, seconds=8.0)
    assert found(road, gone, names, seed=seed) == ["tailgating tailgater=a leader=b", "follow follower=a leader=b"]
    far = behind(34.0)
    far["b"] = at_speed(25.0, 50.0, -1.75, seconds=8.0)
    assert found(road, far, names, seed=seed) == ["follow follower=a leader=b"]


@with_and_without_noise
def test_slow_queue_is_not_tailgating(seed: int | None) -> None:
    cars = {"b": at_speed(5.0, 50.0, -1.75, seconds=8.0), "a": at_speed(5.0, 42.5, -1.75, seconds=10.0)}
    assert found(straight_road(), cars, ["tailgating"], seed=seed) == []


OVERTAKER: Knots = [
    (0.0, 30.0, -1.75),
    (3.0, 120.0, -1.75),
    (5.0, 180.0, 1.75),
    (10.0, 330.0, 1.75),
    (12.0, 390.0, -1.75),
    (16.0, 510.0, -1.75),
]
OVERTAKEN = at_speed(20.0, 120.0, -1.75, seconds=16.0)


@pytest.mark.long
@with_and_without_noise
def test_wrong_way_is_the_oncoming_lane_for_long_and_not_for_an_overtake(seed: int | None) -> None:
    names = ["wrong_way", "overtake"]
    ghost = {"a": at_speed(25.0, 20.0, 1.75, seconds=16.0)}
    assert found(straight_road(), ghost, names, seed=seed) == ["wrong_way car=a"]
    overtake = {"a": OVERTAKER, "b": OVERTAKEN}
    assert found(straight_road(), overtake, names, seed=seed) == ["overtake overtaker=a overtaken=b road=road"]


@pytest.mark.long
@with_and_without_noise
def test_reckless_is_an_overtake_that_ends_shortly_before_an_oncoming_car(seed: int | None) -> None:
    road, names = straight_road(), ["reckless_overtake"]
    near = at_speed(-25.0, 690.0, 1.75, seconds=16.0)  # they meet 2.5 s after the overtaker has passed
    far = at_speed(-25.0, 950.0, 1.75, seconds=16.0)
    pair = {"a": OVERTAKER, "b": OVERTAKEN}
    assert found(road, pair | {"c": near}, names, seed=seed) == ["reckless_overtake overtaker=a overtaken=b danger=c"]
    assert found(road, pair | {"c": far}, names, seed=seed) == []


@pytest.mark.long
@with_and_without_noise
def test_reckless_is_an_overtake_in_a_junction_out_of_one_lane(crossing: RoadNetwork, seed: int | None) -> None:
    slow: Knots = [(0.0, -60.0, -1.65), (6.0, -12.0, -1.65), (9.0, 12.0, 0.3), (14.0, 52.0, 3.2)]
    out_of_its_lane: Knots = [
        (0.0, -85.0, -1.65),
        (5.0, -30.0, -1.65),
        (6.7, -11.0, 0.2),
        (7.6, 0.0, 2.5),
        (9.6, 26.0, 3.2),
    ]
    beside_it: Knots = [(0.0, -85.0, -4.95), (5.0, -30.0, -4.95), (6.7, -11.0, -4.95), (9.6, 24.0, -3.4)]
    names = ["reckless_overtake", "pass"]
    passes = "pass passer=a passed=b"
    reckless = "reckless_overtake overtaker=a overtaken=b danger=c"
    assert found(crossing, {"b": slow, "a": out_of_its_lane}, names, seed=seed) == [reckless, passes]
    assert found(crossing, {"b": slow, "a": beside_it}, names, seed=seed) == [passes]


def braking_for(standing_m: float, *, speed_mps: float, braking_mps2: float, start_m: float) -> dict[str, Knots]:
    """Let a brake from `start_m` on, at a constant rate, for a car that stands."""
    brake_s = speed_mps / braking_mps2
    braking = [
        (4.0 + s, start_m + speed_mps * s - braking_mps2 * s * s / 2, -1.75)
        for s in [k * 0.25 for k in range(int(brake_s * 4) + 1)]
    ]
    before = [(t, start_m - speed_mps * (4.0 - t), -1.75) for t in (0.0, 1.0, 2.0, 3.0)]
    after = [(braking[-1][0] + 4.0, braking[-1][1], -1.75)]
    return {"a": [*before, *braking, *after], "b": [(0.0, standing_m, -1.75), (20.0, standing_m, -1.75)]}


@pytest.mark.long
@with_and_without_noise
def test_near_miss_is_braking_at_the_last_moment(seed: int | None) -> None:
    road, names = straight_road(), ["near_miss"]
    # From 15 m/s at 7 m/s2 a car needs 16 m, at 2.5 m/s2 it needs 45 m; both stop some two metres short.
    late = braking_for(300.0, speed_mps=15.0, braking_mps2=7.0, start_m=300.0 - 4.5 - 18.5)
    calm = braking_for(300.0, speed_mps=15.0, braking_mps2=2.5, start_m=300.0 - 4.5 - 47.5)
    assert found(road, late, names, seed=seed) == ["near_miss car=a other=b"]
    assert found(road, calm, names, seed=seed) == []


@with_and_without_noise
def test_near_miss_is_crossing_right_in_front_of_somebody(crossing: RoadNetwork, seed: int | None) -> None:
    def northbound(passes_s: float) -> Knots:
        return [(0.0, 1.65, -15.0 * passes_s), (passes_s + 4.0, 1.65, 60.0)]

    eastbound: Knots = [(0.0, -90.0, -1.65), (6.0, 0.0, -1.65), (10.0, 60.0, 0.5)]
    # Both drive at 15 m/s: half a second apart they miss each other by a metre or two.
    assert found(crossing, {"a": eastbound, "b": northbound(6.35)}, ["near_miss"], seed=seed) == [
        "near_miss car=a other=b"
    ]
    assert found(crossing, {"a": eastbound, "b": northbound(9.0)}, ["near_miss"], seed=seed) == []


@with_and_without_noise
def test_oncoming_cars_in_their_own_lanes_do_not_nearly_collide(seed: int | None) -> None:
    cars = {"a": at_speed(25.0, 100.0, -1.75, seconds=10.0), "b": at_speed(-25.0, 500.0, 1.75, seconds=10.0)}
    assert found(straight_road(), cars, ["near_miss", "wrong_way"], seed=seed) == []


def queue_and(jumper: Knots) -> dict[str, Knots]:
    places_m = {"q1": 300.0, "q2": 292.0, "q3": 284.0}
    queue: dict[str, Knots] = {name: [(0.0, x_m, -1.75), (30.0, x_m, -1.75)] for name, x_m in places_m.items()}
    return queue | {"j": jumper}


@pytest.mark.long
@with_and_without_noise
def test_queue_jump_is_passing_waiting_cars_and_getting_in_before_them(seed: int | None) -> None:
    passing = [(0.0, 220.0, -1.75), (4.0, 260.0, -1.75), (6.0, 275.0, 1.75), (10.0, 306.0, 1.75)]
    names = ["queue_jump"]
    gets_in: Knots = [*passing, (12.0, 318.0, -1.75), (16.0, 360.0, -1.75), (20.0, 400.0, -1.75)]
    goes_on: Knots = [*passing, (12.0, 321.0, 1.75), (16.0, 360.0, 1.75), (20.0, 400.0, 1.75)]
    assert found(straight_road(), queue_and(gets_in), names, seed=seed) == [
        "queue_jump jumper=j first=q1 last=q2 lane=east0"
    ]
    assert found(straight_road(), queue_and(goes_on), names, seed=seed) == []
    alone = {name: path for name, path in queue_and(gets_in).items() if name in {"q1", "j"}}
    assert found(straight_road(), alone, names, seed=seed) == []


@pytest.mark.long
@with_and_without_noise
def test_stop_and_go_is_three_stops_and_not_two(seed: int | None) -> None:
    def stops(count: int) -> Knots:
        knots = [(0.0, 20.0, -1.75), (4.0, 60.0, -1.75)]
        for k in range(count):
            knots += [(8.0 + 10 * k, 80.0 + 40 * k, -1.75), (12.0 + 10 * k, 80.0 + 40 * k, -1.75)]
        return [*knots, (knots[-1][0] + 6.0, knots[-1][2] + knots[-1][1] + 40.0 + 1.75, -1.75)]

    road, names = straight_road(), ["stop_and_go"]
    assert found(road, {"a": stops(3)}, names, seed=seed) == ["stop_and_go car=a road=road"]
    assert found(road, {"a": stops(2)}, names, seed=seed) == []
