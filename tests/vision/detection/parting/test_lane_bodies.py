"""Who is in the blob that a long vehicle and its shadow have made?"""

import numpy as np
import pytest
from numpy.typing import NDArray

from tests.vision.support import make_boxes
from vision.detection.parting.lane_bodies import NOBODY, is_shadow, part_bodies, turned
from vision.detection.settings import DetectionSettings
from vision.road.boxes import Boxes
from vision.road.grid import Grid

SETTINGS = DetectionSettings()
SIDE = 0.3
GRID = Grid.between(np.array([-20.0, -20.0]), np.array([20.0, 20.0]), side=SIDE, is_north_up=True)
# A truck in the right lane, its shadow over the left one; there a car in it, and another one behind.
TRUCK, CAR, CAR_BEHIND = (0.0, 0.0, 0.0, 11.0, 2.4), (2.5, 3.3, 0.0, 4.2, 1.8), (-4.5, 3.3, 0.0, 4.2, 1.8)
SHADOW = (0.0, 3.0, 0.0, 13.5, 5.5)
Row = tuple[float, float, float, float, float]


def inside(rows: list[Row], points_m: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Which points are in any of some boxes."""
    boxes: Boxes = make_boxes(rows)
    result = np.zeros(len(points_m), np.bool_)
    for centre_m, heading_rad, length_m, width_m in zip(
        boxes.centre_m, boxes.heading_rad, boxes.length_m, boxes.width_m, strict=True
    ):
        along, across = turned(points_m - centre_m, heading_rad)
        result |= (np.abs(along) <= length_m / 2) & (np.abs(across) <= width_m / 2)
    return result


def rotated(rows: list[Row], heading_rad: float) -> list[Row]:
    """The same boxes, the whole scene turned about the origin."""
    cos, sin = float(np.cos(heading_rad)), float(np.sin(heading_rad))
    return [(x * cos - y * sin, x * sin + y * cos, turn + heading_rad, *size) for x, y, turn, *size in rows]  # type: ignore[misc]


def part(bodies: list[Row], heading_rad: float = 0.0) -> tuple[NDArray[np.float64], NDArray[np.intp]]:
    """The cells of bodies in a shadow, and to whom they went."""
    columns, rows = np.meshgrid(np.arange(GRID.shape[1]), np.arange(GRID.shape[0]))
    points_m = GRID.to_plane(np.column_stack([columns.ravel(), rows.ravel()]).astype(np.float64))
    is_body = inside(rotated(bodies, heading_rad), points_m)
    is_blob = is_body | inside(rotated([SHADOW], heading_rad), points_m)
    _, across = turned(points_m, heading_rad)
    lane = np.select([np.abs(across) <= 1.6, np.abs(across - 3.3) <= 1.6], [1, 2], 0)
    number = part_bodies(
        points_m[is_blob],
        lane[is_blob],
        np.full(is_blob.sum(), heading_rad),
        ~is_body[is_blob],
        side=SIDE,
        settings=SETTINGS,
    )
    return points_m[is_blob], number


@pytest.mark.parametrize("heading_rad", [0.0, 0.4, np.pi / 2, -2.0])
def test_truck_and_cars_in_its_shadow_are_parted_whichever_way_the_road_goes(heading_rad: float) -> None:
    points_m, number = part([TRUCK, CAR, CAR_BEHIND], heading_rad)
    own = [number[inside(rotated([one], heading_rad), points_m)] for one in (TRUCK, CAR, CAR_BEHIND)]
    assert [len(np.unique(one)) for one in own] == [1, 1, 1]
    assert len({int(one[0]) for one in own}) == 3


def test_shadow_far_from_all_bodies_is_nobodys() -> None:
    points_m, number = part([TRUCK, CAR])
    middles = [
        (x, y, 0.0, length + 2 * SETTINGS.own_shadow_m, width + 2 * SETTINGS.own_shadow_m)
        for x, y, _, length, width in (TRUCK, CAR)
    ]
    is_near = inside(middles, points_m)
    assert set(number[~is_near].tolist()) == {NOBODY}
    assert NOBODY not in number[inside([TRUCK, CAR], points_m)]


def test_truck_with_nothing_but_shadow_and_a_marking_beside_it_is_one() -> None:
    assert not part([TRUCK])[1].any()
    assert not part([TRUCK, (2.0, 3.3, 0.0, 6.0, 0.6)])[1].any()


def test_window_does_not_divide_a_car_and_a_gap_divides_two() -> None:
    front = (2.5, 3.3, 0.0, 2.4, 1.8)
    parts = [part([TRUCK, front, (x_m, 3.3, 0.0, 2.4, 1.8)])[1] for x_m in (-0.7, -2.2)]
    assert [int(one.max()) for one in parts] == [2, 3]


def test_shadow_has_the_most_frequent_light() -> None:
    light = np.array([0, 20, 45, 58, 60, 62, 80], np.uint8)
    frame = np.concatenate([np.full(500, 60), np.full(100, 30), np.zeros(900), light]).astype(np.uint8)
    assert is_shadow(light, frame, SETTINGS).tolist() == [False, False, False, True, True, True, False]


def test_nothing_dark_is_no_shadow() -> None:
    assert not is_shadow(np.zeros(9, np.uint8), np.zeros(9, np.uint8), SETTINGS).any()
