"""What speaks for a start being a lost car: against the same sums done slowly, and on scenes that anybody can judge."""

import math
from dataclasses import fields

import numpy as np
import pytest

from anchoring.linking.evidence import NewCars, weigh
from anchoring.linking.routes import no_routes
from anchoring.linking.ways import Looks, Routes
from anchoring.settings import AnchoringSettings
from tests.cases import for_each

SETTINGS = AnchoringSettings()
S = 1_000_000


def body(t_s: float, x_m: float, y_m: float = 0.0, **changed: float) -> Looks:
    """Look at one car that drives east at 10 m/s on road 0, or as said; `road=-1` puts it into the open."""
    row = {"speed_mps": 10.0, "heading_rad": 0.0, "length_m": 4.5, "width_m": 1.8, "whole": 1.0, "road": 0.0, **changed}
    angle = row["heading_rad"]
    return Looks(
        t_us=np.array([int(t_s * S)]),
        centre_m=np.array([[x_m, y_m]]),
        velocity_mps=row["speed_mps"] * np.array([[math.cos(angle), math.sin(angle)]]),
        heading_rad=np.array([angle]),
        has_front=np.array([bool(row.get("front", True))]),
        length_m=np.array([row["length_m"]]),
        width_m=np.array([row["width_m"]]),
        is_whole=np.array([bool(row["whole"])]),
        road=np.array([int(row["road"])], dtype=np.int32),
        along_m=np.array([x_m]),
        across_m=np.array([y_m]),
        tangent_rad=np.zeros(1),
    )


def joined(*parts: Looks) -> Looks:
    return Looks(*(np.concatenate([getattr(part, one.name) for part in parts]) for one in fields(Looks)))


def new_cars(count: int, births_per_m: float = SETTINGS.births_per_m) -> NewCars:
    return NewCars(np.full(count, births_per_m), np.array([4.5, 1.8]), np.array([0.8, 0.3]))


def ratio(start: Looks, end: Looks, routes: Routes = no_routes, births_per_m: float = SETTINGS.births_per_m) -> float:
    """Weigh one pair; -inf if it is impossible."""
    found = weigh(start, end, new_cars(1, births_per_m), routes, SETTINGS).ratios.tolist()
    return found[0] if found else -math.inf


def normal(off: float, spread: float) -> float:
    return math.exp(-0.5 * (off / spread) ** 2) / spread / math.sqrt(2 * math.pi)


def slow_ratio(start: Looks, end: Looks) -> float:
    """Work out the ratio of a pair on one straight eastward road in densities, without logarithms."""
    one = SETTINGS
    gap_s = (start.t_us[0] - end.t_us[0]) / S
    way_m, aside_m = start.centre_m[0] - end.centre_m[0]
    new_mps, old_mps = start.speed_mps[0], end.speed_mps[0]
    drove = 0.0
    for wander in (one.calm_mps, one.lively_mps):
        speed = normal(new_mps - old_mps, math.sqrt(one.pace_mps**2 + wander**2 * gap_s))
        way = normal(way_m - (new_mps + old_mps) / 2 * gap_s, math.sqrt(one.way_m**2 + wander**2 * gap_s**3 / 12))
        drove += speed * way / 2
    reach_m = one.haste_share * max(new_mps, old_mps, one.haste_mps) * gap_s + one.backwards_m
    moved = (1 - one.stop_share) * drove + one.stop_share / (reach_m + one.backwards_m) / 40
    side_m = min(one.side_m + min(one.side_mps * gap_s, one.side_share * abs(way_m)), one.side_limit_m)
    likelihood = moved * normal(aside_m, side_m)
    by_chance = one.births_per_m / 40 / 10
    for seen, known, same, usual, spread in (
        (start.length_m[0], end.length_m[0], one.same_length_m, 4.5, 0.8),
        (start.width_m[0], end.width_m[0], one.same_width_m, 1.8, 0.3),
    ):
        likelihood *= normal(seen - known, same) + one.odd_share / 20
        by_chance *= normal(seen - usual, spread) + one.other_share / 20
    possible = -one.backwards_m <= way_m <= reach_m and abs(aside_m) < 10
    return math.log(likelihood / by_chance) if possible else -math.inf


@pytest.mark.parametrize("road", [0.0, -1.0])
def test_start_of_which_the_front_is_a_guess_may_be_the_other_way_round(road: float) -> None:
    end, right = body(0.0, 0.0, speed_mps=0.3, road=road), body(2.0, 0.4, speed_mps=0.3, road=road)
    turned = [body(2.0, 0.4, speed_mps=0.3, heading_rad=math.pi, front=front, road=road) for front in (0.0, 1.0)]
    assert ratio(turned[0], end) == pytest.approx(ratio(right, end))
    assert ratio(turned[1], end) == -math.inf


@for_each("seed", range(60))
def test_ratio_is_that_of_the_densities(seed: int) -> None:
    rng = np.random.default_rng(seed)
    gap_s, speed_mps = float(rng.uniform(0.1, 9)), float(rng.uniform(0, 25))
    end = body(3.0, 0.0, 0.0, speed_mps=speed_mps, length_m=float(rng.uniform(4, 9)))
    start = body(
        3.0 + gap_s,
        speed_mps * gap_s + float(rng.normal(0, 3)),
        float(rng.normal(0, 1)),
        speed_mps=abs(speed_mps + float(rng.normal(0, 2))),
        length_m=float(rng.uniform(4, 9)),
        width_m=float(rng.uniform(1.5, 2.5)),
    )
    expected = slow_ratio(start, end)
    assert ratio(start, end) == (pytest.approx(expected) if math.isfinite(expected) else expected)


def test_who_drove_on_is_the_lost_car_and_who_comes_from_nowhere_is_not() -> None:
    end = body(0.0, 0.0)
    assert ratio(body(4.0, 40.0), end) > 5.0
    assert ratio(body(4.0, 55.0, length_m=9.0), end) < ratio(body(4.0, 55.0), end) - 2.0
    assert ratio(body(4.0, 20.0, speed_mps=25.0), end) < SETTINGS.margin_nats


def test_at_the_edge_of_the_view_a_new_car_is_likelier() -> None:
    start, end = body(4.0, 40.0), body(0.0, 0.0)
    edge = ratio(start, end, births_per_m=SETTINGS.edge_births_per_m)
    assert ratio(start, end) - edge == pytest.approx(math.log(SETTINGS.edge_births_per_m / SETTINGS.births_per_m))


@pytest.mark.parametrize(
    "start",
    [
        pytest.param(body(2.0, -6.0), id="behind"),
        pytest.param(body(2.0, 60.0), id="farther than anybody drives"),
        pytest.param(body(1.0, 10.0, heading_rad=math.pi / 2), id="faster round than tyres hold"),
        pytest.param(body(20.0, 30.0, 10.0, heading_rad=math.pi, road=1), id="back on another road"),
        pytest.param(body(-0.5, 0.0), id="seen beside it"),
    ],
)
def test_what_nobody_can_do_is_impossible(start: Looks) -> None:
    assert ratio(start, body(0.0, 0.0)) == -math.inf


def test_a_car_that_turns_is_expected_on_an_arc() -> None:
    end = body(0.0, 0.0, road=-1)
    around = body(3.0, 19.0, 19.0, heading_rad=math.pi / 2, road=-1)
    aside = body(3.0, 19.0, 19.0, heading_rad=0.0, road=-1)
    assert ratio(around, end) > 3.0 > ratio(aside, end)


def test_between_roads_the_lanes_tell_the_way() -> None:
    start, end = body(3.0, 19.0, 19.0, heading_rad=math.pi / 2, road=1), body(0.0, 0.0)

    def way(length_m: float, *, changes: bool = False) -> Routes:
        return lambda row, column: (np.full(len(row), length_m), np.full(len(row), changes))

    by_lanes = ratio(start, end, way(30.0))
    assert by_lanes > ratio(start, end, way(40.0)) > -math.inf
    assert ratio(start, end, way(math.inf)) == -math.inf
    assert by_lanes - ratio(start, end, way(30.0, changes=True)) == pytest.approx(-math.log(SETTINGS.change_share))


def test_who_went_into_a_hidden_place_first_is_expected_first() -> None:
    first, second = body(0.0, 0.0), body(1.0, 0.0)
    start = joined(body(5.0, 45.0))
    alone = weigh(start, second, new_cars(1), no_routes, SETTINGS).ratios[0]
    both = weigh(start, joined(first, second), new_cars(1), no_routes, SETTINGS)
    ratios = dict(zip(both.ends.tolist(), both.ratios.tolist(), strict=True))
    assert ratios[1] == pytest.approx(alone - SETTINGS.pass_nats)
    assert ratios[0] == pytest.approx(ratio(body(5.0, 45.0), first))


def test_who_comes_out_of_a_hidden_place_beside_the_lane_may_have_overtaken_there() -> None:
    first, second = body(0.0, 0.0), body(1.0, 0.0)
    aside = body(5.0, 45.0, 3.5)
    both = weigh(aside, joined(first, second), new_cars(1), no_routes, SETTINGS)
    ratios = dict(zip(both.ends.tolist(), both.ratios.tolist(), strict=True))
    assert ratios == {0: pytest.approx(ratio(aside, first)), 1: pytest.approx(ratio(aside, second))}


def test_a_size_that_is_not_seen_in_full_says_nothing() -> None:
    end = body(0.0, 0.0)
    assert ratio(body(1.0, 10.0, length_m=2.0, whole=0.0), end) == ratio(body(1.0, 10.0, whole=0.0), end)
