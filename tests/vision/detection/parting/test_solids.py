"""Who is in a blob that is seen slantwise, where bodies lean over each other?"""

import numpy as np
import pytest
import shapely
from numpy.typing import NDArray

from tests.cases import seeds
from vision.detection.parting.lane_bodies import turned
from vision.detection.parting.solids import Solid, cut_rows, part_solids
from vision.detection.settings import DetectionSettings
from vision.road.kinds import KINDS, TRUCK, Kind

SETTINGS = DetectionSettings()
SIDE = 0.3
CAR = KINDS[0]
Lean = tuple[float, float]
Cut = tuple[int, int, Kind]
FloatArray = NDArray[np.float64]


def hull(x: float, y: float, kind: Kind, lean: Lean, heading_rad: float = 0.0) -> shapely.Geometry:
    """What is seen of a body that stands on the ground at x, y."""
    ahead, left = (
        np.array([np.cos(heading_rad), np.sin(heading_rad)]),
        np.array([-np.sin(heading_rad), np.cos(heading_rad)]),
    )
    foot = [
        np.array([x, y]) + i * kind.length_m / 2 * ahead + j * kind.width_m / 2 * left for i in (-1, 1) for j in (-1, 1)
    ]
    roof = [corner + kind.height_m * np.array(lean) for corner in foot]
    return shapely.convex_hull(shapely.MultiPoint([*foot, *roof]))


def parts(bodies: list[shapely.Geometry], lean: Lean, heading_rad: float = 0.0) -> tuple[FloatArray, NDArray[np.intp]]:
    """The cells of a blob of bodies, and to whom they went. Lanes run at y = 0, 3.5 and 7, turned by the heading."""
    ticks = np.arange(-30.0, 30.0, SIDE)
    points_m = np.stack(np.meshgrid(ticks, ticks), axis=-1).reshape(-1, 2)
    points_m = points_m[shapely.contains_xy(shapely.union_all(bodies), points_m)]
    across = turned(points_m, heading_rad)[1]
    lane = np.where((across > -1.75) & (across < 8.75), np.floor(across / 3.5 + 0.5).astype(np.intp) + 1, 0)
    number = part_solids(
        points_m,
        lane,
        np.full(len(lane), heading_rad),
        np.zeros(len(lane), np.bool_),
        np.array(lean),
        side=SIDE,
        settings=SETTINGS,
    )
    return points_m, number


@pytest.mark.parametrize("lean", [(0.0, 1.1), (0.3, 0.9), (-0.4, 1.2)], ids=str)
def test_truck_that_leans_over_the_next_lane_is_one(lean: Lean) -> None:
    assert not parts([hull(0, 0, TRUCK, lean)], lean)[1].any()


@pytest.mark.parametrize("lean", [(0.0, 1.1), (0.3, 0.9), (-0.4, 1.2)], ids=str)
def test_cars_side_by_side_are_two(lean: Lean) -> None:
    points_m, number = parts([hull(0, 0, CAR, lean), hull(1.5, 3.5, CAR, lean)], lean)
    assert set(number.tolist()) == {1, 2}
    near = number[np.argmin(np.hypot(*(points_m - [0.0, 0.0]).T))]
    assert near != number[np.argmin(np.hypot(*(points_m - [1.5, 3.8]).T))]


def test_car_that_shows_behind_a_truck_is_another() -> None:
    points_m, number = parts([hull(0, 0, TRUCK, (0.0, 0.6)), hull(5.5, 3.5, CAR, (0.0, 0.6))], (0.0, 0.6))
    truck, car = (number[np.argmin(np.hypot(*(points_m - place).T))] for place in ([0.0, 0.0], [7.0, 3.5]))
    assert truck != car


@pytest.mark.parametrize("count", [2, 3, 4])
@pytest.mark.parametrize("heading_rad", [np.pi / 2, -np.pi / 2], ids=["away", "towards"])
def test_queue_without_a_gap_to_be_seen_is_parted_into_its_cars(count: int, heading_rad: float) -> None:
    # Of the gap of 2.5 m, a car of 1.5 m that leans by 1.4 m a metre hides all but 0.4 m.
    lean = (0.1, 1.4)
    cars = [hull(0.0, 7.0 * k - 12.0, CAR, lean, heading_rad) for k in range(count)]
    points_m, number = parts(cars, lean, heading_rad)
    owners = [number[np.argmin(np.hypot(*(points_m - [0.0, 7.0 * k - 12.0]).T))] for k in range(count)]
    assert len(set(owners)) == count


def test_truck_is_not_cut_into_a_queue() -> None:
    lean = (0.1, 1.3)
    assert not parts([hull(0.0, 0.0, TRUCK, lean, np.pi / 2)], lean, np.pi / 2)[1].any()


def price(cut: list[Cut], width_m: FloatArray, seen_m: FloatArray, lean: Lean) -> float:
    """What bodies cost, row by row, as `cut_rows` says in words."""
    reach, rows = round(SETTINGS.waist_reach_m / SIDE), len(width_m)
    waist = [
        1 - seen_m[i] / max(min(max(seen_m[max(0, i - reach) : i + 1]), max(seen_m[i : i + reach + 1])), 1e-6)
        for i in range(rows)
    ]
    is_solid = width_m >= SETTINGS.body_width_m
    in_body = np.zeros(rows, np.bool_)
    total, last = 0.0, -1
    for start, end, kind in cut:
        solid = width_m[start:end][is_solid[start:end]]
        wide_m = (solid.mean() if len(solid) else 0.0) - SIDE
        total += (((end - start) * SIDE - kind.height_m * abs(lean[0]) - kind.length_m) / kind.differs_m) ** 2
        if abs(lean[1]) < SETTINGS.upright_lean:
            usual_m = min(kind.width_m + kind.height_m * abs(lean[1]), max(seen_m.max() - SIDE, TRUCK.width_m))
            total += ((wide_m - usual_m) / SETTINGS.width_differs_m) ** 2
        for i in range(start, end):
            total += SIDE * (SETTINGS.waist_cost * waist[i] ** 2 + SETTINGS.shade_cost * (not is_solid[i]))
        if last >= 0:
            near = max(0.0, 1 - (start - last) / round(SETTINGS.window_m / SIDE))
            total += SETTINGS.cut_cost * near * (1 - max(waist[last - 1 : start + 1])) ** 2
        in_body[start:end], last = True, end
    return total + SETTINGS.nobody_cost * SIDE * float((is_solid & ~in_body).sum())


def cuts(rows: int, start: int = 0) -> list[list[tuple[int, int]]]:
    """All ways to lay bodies over rows."""
    found: list[list[tuple[int, int]]] = [[]]
    for first in range(start, rows):
        for end in range(first + 1, rows + 1):
            found += [[(first, end), *rest] for rest in cuts(rows, end)]
    return found


@pytest.mark.long
@seeds(range(30), kept=6)
def test_no_other_cut_is_cheaper(seeds: range) -> None:
    for seed in seeds:
        rng = np.random.default_rng(seed)
        rows, lean = 7, (float(rng.uniform(-0.5, 0.5)), float(rng.uniform(0, 1)))
        seen_m = rng.uniform(0, 3.3, rows) * (rng.random(rows) < 0.8)
        width_m = seen_m * rng.uniform(0.3, 1, rows)
        found = price(cut_rows(width_m, seen_m, lean, side=SIDE, settings=SETTINGS), width_m, seen_m, lean)
        # Each body is of the kind that is cheapest for it.
        least = min(
            price([], width_m, seen_m, lean)
            if not cut
            else price(
                [(a, b, min(KINDS, key=lambda kind: price([(a, b, kind)], width_m, seen_m, lean))) for a, b in cut],
                width_m,
                seen_m,
                lean,
            )
            for cut in cuts(rows)
        )
        assert found == pytest.approx(least), seed


def test_hull_is_footprint_and_roof() -> None:
    lean = (0.2, 1.0)
    body = Solid((-2.25, 2.25), (-0.9, 0.9), (CAR.height_m * lean[0], CAR.height_m * lean[1]))
    points_m = np.random.default_rng(0).uniform((-4, -3), (4, 5), (2000, 2))
    outline = hull(0, 0, CAR, lean)
    is_in = shapely.contains_xy(outline, points_m)
    is_clear = shapely.distance(shapely.points(points_m), outline.boundary) > 0.1
    assert np.array_equal((body.distance_m(*points_m.T) == 0)[is_clear], is_in[is_clear])
