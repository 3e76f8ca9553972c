"""Blobs of several vehicles seen from low above the road are parted by their feet."""

import numpy as np
import pytest

from tests.vision.detection.surfaces.test_image_surface import bridge_surface
from tests.vision.road.test_view import SIZE, bridge_view
from tests.vision.support import make_boxes
from vision.detection.blobs import Cells, find_blobs
from vision.detection.parting.image_lanes import ImageLanes, _is_beside, find_feet
from vision.detection.parting.lanes import LaneField, LaneStrip
from vision.detection.settings import DetectionSettings
from vision.detection.surfaces.image_surface import ImageSurface
from vision.road.grid import Grid
from vision.road.view import GroundView
from vision.settings import VisionSettings

LANES = [LaneStrip(np.array([[x, 20.0], [x, 200.0]]), 3.6) for x in (-1.8, 1.8)]


def seen(surface: ImageSurface, *cars: tuple[float, float]) -> Cells:
    boxes = make_boxes([(x, y, np.pi / 2, 4.5, 1.8) for x, y in cars])
    mask = surface.raster.grid.paint(surface.appearances(boxes).boxes.corners())
    return find_blobs(surface.raster, mask, 99 * mask)


def parts(surface: ImageSurface, cells: Cells) -> list[int]:
    found = surface.lane_field(LANES).parts(cells, lambda points: np.zeros(len(points), np.uint8))
    return np.unique(found).tolist()


def test_one_car_is_not_parted() -> None:
    surface = bridge_surface()
    cells = seen(surface, (1.8, 50.0))
    assert (cells.count, parts(surface, cells)) == (1, [0])


def test_cars_in_two_lanes_that_overlap_are_parted_where_the_nearer_one_begins() -> None:
    surface = bridge_surface()
    cells = seen(surface, (1.0, 50.0), (-0.9, 58.0))
    assert cells.count == 1
    part = surface.lane_field(LANES).parts(cells, lambda points: np.zeros(len(points), np.uint8))
    assert np.unique(part).tolist() == [1, 2]
    left, right = (cells.points[part == number] for number in (1, 2))
    assert left[:, 0].max() < right[:, 0].min()
    assert left[:, 1].max() < right[:, 1].max()  # the farther car's foot is higher up


def test_flat_thing_on_the_next_lane_is_a_shadow() -> None:
    surface = bridge_surface()
    car = surface.appearances(make_boxes([(1.8, 50.0, np.pi / 2, 4.5, 1.8)])).boxes.corners()
    view = GroundView(bridge_view(), SIZE, VisionSettings())
    shadow = view.to_pixels(make_boxes([(-0.6, 50.0, np.pi / 2, 4.5, 3.0)]).corners())
    mask = surface.raster.grid.paint([*car, *shadow])
    cells = find_blobs(surface.raster, mask, 99 * mask)
    assert (cells.count, parts(surface, cells)) == (1, [0])


def test_headings_are_those_of_the_lane_at_the_foot() -> None:
    surface = bridge_surface()
    cells = seen(surface, (1.8, 50.0))
    towards = [LaneStrip(LANES[1].centre_line_m[::-1], 3.6)]
    heading_rad, is_known = surface.lane_field(towards).headings(cells)
    assert (heading_rad[0], bool(is_known[0])) == (pytest.approx(-np.pi / 2), True)
    assert not surface.lane_field([]).headings(cells)[1][0]


def test_no_cells_have_no_parts_and_no_headings() -> None:
    surface = bridge_surface()
    mask = np.zeros(surface.raster.grid.shape, np.uint8)
    nothing = find_blobs(surface.raster, mask, mask)
    field: LaneField = surface.lane_field(LANES)
    assert isinstance(field, ImageLanes)
    assert len(field.parts(nothing, lambda points: np.zeros(len(points), np.uint8))) == 0
    assert len(field.headings(nothing)[0]) == 0


def test_strip_holds_what_its_corners_enclose() -> None:
    rng = np.random.default_rng(3)
    points = rng.uniform(-4, 8, (300, 2))
    start, end = np.array([0.0, 0.0]), np.array([3.0, 4.0])
    turned = points @ np.array([[0.6, -0.8], [0.8, 0.6]])  # along the line, and to its left
    expected = (turned[:, 0] >= 0) & (turned[:, 0] <= 5) & (np.abs(turned[:, 1]) < 1.5)
    assert _is_beside(points, start, end, 1.5).tolist() == expected.tolist()


def test_foot_behind_the_lower_border_says_little_and_does_not_confirm() -> None:
    surface = bridge_surface()
    settings = VisionSettings()
    rows = surface.raster.grid.shape[0]
    car = surface.appearances(make_boxes([(1.8, 40.0, np.pi / 2, 4.5, 1.8)])).boxes.corners()[0]
    whole = surface.raster.grid.paint([car])
    cut = surface.raster.grid.paint([car + np.array([0.0, SIZE[1] - car[:, 1].max() + 5.0])])
    assert cut[rows - 1].any()
    prints = [
        surface.footprints(find_blobs(surface.raster, mask, 99 * mask), np.array([np.pi / 2]), None)
        for mask in (whole, cut * surface.raster.road)
    ]
    assert [one.cut.tolist() for one in prints] == [[0], [1]]
    assert [one.weight.tolist() for one in prints if one.weight is not None] == [[1.0], [0.0]]
    assert np.sqrt(prints[1].noise[0, 1, 1]) == pytest.approx(2 * settings.usual_length_m, rel=0.05)


def test_car_mostly_hidden_by_another_in_its_lane_is_parted_and_keeps_what_is_seen_above() -> None:
    surface = bridge_surface()
    near, far = (
        surface.appearances(make_boxes([(x, y, np.pi / 2, 4.5, 1.8)])).boxes.corners()[0]
        for x, y in ((0.9, 50.0), (2.5, 63.0))
    )
    mask = surface.raster.grid.paint([near, far])
    cells = find_blobs(surface.raster, mask, 99 * mask)
    assert cells.count == 1
    part = surface.lane_field(LANES).parts(cells, lambda points: np.zeros(len(points), np.uint8))
    one, other = (cells.points[part == number] for number in (1, 2))
    front, behind = sorted((one, other), key=lambda points: -float(points[:, 1].max()))
    # The farther car is as wide as it is, and begins where the nearer one ends.
    assert np.ptp(behind[:, 0]) == pytest.approx(np.ptp(far[:, 0]), rel=0.15)
    assert front[:, 1].max() == pytest.approx(near[:, 1].max(), abs=2.0)
    assert behind[:, 1].max() < far[:, 1].max() + 2.0


@pytest.mark.parametrize(("turned", "expected"), [(False, [1, 2]), (True, [0])], ids=["along the view", "across it"])
def test_known_vehicle_is_parted_only_where_lanes_run_with_the_view(turned: bool, expected: list[int]) -> None:
    surface = bridge_surface()
    cells = seen(surface, (1.0, 50.0), (-0.9, 58.0))
    across = [LaneStrip(np.array([[-20.0, y], [20.0, y]]), 7.0) for y in (48.0, 57.0)]
    field = surface.lane_field(across if turned else LANES)
    nothing_dark = np.zeros(len(cells.points), np.uint8)
    known = np.ones(cells.count, np.bool_)
    assert np.unique(field.parts(cells, lambda points: nothing_dark, known)).tolist() == expected


def test_foot_behind_another_vehicle_says_little_and_does_not_confirm() -> None:
    surface = bridge_surface()
    settings = VisionSettings()
    cells = seen(surface, (1.0, 50.0))
    rows = cells.points[:, 1]
    halves = cells.regroup((rows > np.median(rows)).astype(np.intp))
    found = surface.footprints(halves, np.full(2, np.pi / 2), None)
    assert found.weight is not None
    assert (found.cut.tolist(), found.weight.tolist()) == ([1, 0], [0.0, 1.0])
    assert np.sqrt(found.noise[:, 1, 1])[0] > 4 * settings.usual_length_m > np.sqrt(found.noise[:, 1, 1])[1]


def test_speck_below_a_vehicle_does_not_move_its_foot() -> None:
    surface = bridge_surface()
    car = surface.appearances(make_boxes([(1.8, 50.0, np.pi / 2, 4.5, 1.8)])).boxes.corners()
    clean = surface.raster.grid.paint(car)
    rows, columns = np.nonzero(clean)
    specked = clean.copy()
    specked[rows.max() : rows.max() + 12, int(np.median(columns))] = 1
    middles = [
        surface.footprints(find_blobs(surface.raster, mask, 99 * mask), np.array([np.pi / 2]), None).boxes.centre_m
        for mask in (clean, specked)
    ]
    assert middles[1] == pytest.approx(middles[0], abs=0.3)


def nowhere_dark(points: np.ndarray) -> np.ndarray:
    return np.zeros(len(points), np.uint8)


@pytest.mark.parametrize(("north_m", "expected"), [(66.0, [1, 2]), (57.0, [0])], ids=["far behind", "one outline"])
@pytest.mark.parametrize("is_known", [False, True], ids=["new", "known"])
def test_without_lanes_a_high_step_of_the_lower_outline_parts(
    north_m: float, expected: list[int], is_known: bool
) -> None:
    surface = bridge_surface()
    cells = seen(surface, (0.9, 50.0), (-0.2, north_m))
    assert cells.count == 1
    part = surface.lane_field([]).parts(cells, nowhere_dark, np.array([is_known]))
    assert np.unique(part).tolist() == expected
    if len(expected) == 2:
        left, right = (cells.points[part == number] for number in (1, 2))
        assert left[:, 1].max() < right[:, 1].max()
        assert left[:, 0].min() == cells.points[:, 0].min()


def test_gap_in_the_lower_side_of_a_vehicle_does_not_part_it() -> None:
    surface = bridge_surface()
    truck = surface.appearances(make_boxes([(0.0, 50.0, 0.0, 12.0, 2.5)])).boxes.corners()
    mask = surface.raster.grid.paint([truck[0] - np.array([0.0, step]) for step in range(0, 30, 5)])
    rows, columns = np.nonzero(mask)
    low, middle = rows.max(), int(np.median(columns))
    mask[low - 28 : low + 1, middle - 30 : middle + 30] = 0  # under the trailer, between the axles
    cells = find_blobs(surface.raster, mask, 99 * mask)
    field = surface.lane_field([])
    assert (cells.count, np.unique(field.parts(cells, nowhere_dark)).tolist()) == (1, [0])
    # Without the rear axle, the same step is the end of a vehicle.
    mask[low - 28 : low + 1, middle:] = 0
    cells = find_blobs(surface.raster, mask, 99 * mask)
    assert np.unique(field.parts(cells, nowhere_dark)).tolist() == [1, 2]


@pytest.mark.parametrize(("width_m", "expected"), [(2.6, [0]), (4.4, [1, 2])], ids=["one with its shadow", "two"])
def test_what_stands_across_the_line_between_two_lanes_is_one_unless_it_is_wide(
    width_m: float, expected: list[int]
) -> None:
    surface = bridge_surface()
    boxes = make_boxes([(0.0, 50.0, np.pi / 2, 4.5, width_m)])
    mask = surface.raster.grid.paint(surface.appearances(boxes).boxes.corners())
    assert parts(surface, find_blobs(surface.raster, mask, 99 * mask)) == expected


def test_walkers_are_narrow_and_go_along_no_lane() -> None:
    surface = bridge_surface()
    field = surface.lane_field(LANES)
    boxes = make_boxes([(x, 50.0, np.pi / 2, 0.6, width) for x, width in ((-4.8, 0.7), (-1.8, 0.7), (1.8, 1.8))])
    masks = [surface.raster.grid.paint([one]) for one in surface.appearances(boxes).boxes.corners()]
    cells = find_blobs(surface.raster, (sum(masks) > 0).astype(np.uint8), 99 * np.maximum.reduce(masks))
    order = np.argsort(np.minimum.reduceat(cells.points[:, 0], cells.starts))
    ahead, aside, yes = np.full(3, np.pi / 2), np.zeros(3), np.ones(3, np.bool_)
    # Beside the lanes, in a lane, and a car.
    assert field.walkers(cells, ahead, yes)[order].tolist() == [True, False, False]
    assert field.walkers(cells, aside, yes)[order].tolist() == [True, True, False]
    assert field.walkers(cells, ahead, ~yes)[order].tolist() == [True, True, False]
    from_above: LaneField = LaneField(surface.raster.grid, [], DetectionSettings())
    assert not from_above.walkers(cells, aside, yes).any()


SHAPE = (12, 15)

BELOW_CELLS = DetectionSettings().below_cells


def some_cells(seed: int, *, side: float) -> tuple[Cells, Grid]:
    rng = np.random.default_rng(seed)
    grid = Grid.between(np.zeros(2), np.array([SHAPE[1], SHAPE[0]]) * side, side=side, is_north_up=False)
    row, column = np.nonzero(rng.random(SHAPE) < 0.4)
    points = grid.to_plane(np.column_stack([column, row]).astype(np.float64))
    everything = Cells(
        points,
        np.zeros(len(row), np.intp),
        np.ones(len(row), np.uint8),
        np.zeros(len(row), np.bool_),
        np.zeros(1, np.intp),
        np.zeros(1, np.intp),
    )
    return everything.regroup(rng.integers(0, 4, len(row))), grid


@pytest.mark.parametrize("seed", range(8))
def test_feet_are_those_of_a_walk_over_all_columns(seed: int) -> None:
    side = 1.0 + seed % 2
    cells, grid = some_cells(seed, side=side)
    places = np.rint(grid.to_cells(cells.points)).astype(int).tolist()
    owner = {tuple(place): int(group) for place, group in zip(places, cells.group, strict=True)}
    expected = []
    for group in range(cells.count):
        for column in range(SHAPE[1]):
            rows = [row for row in range(SHAPE[0]) if owner.get((column, row)) == group]
            if rows:
                below = [owner.get((column, max(rows) + step), group) for step in range(1, BELOW_CELLS + 1)]
                height_px = (max(rows) - min(rows) + 1) * side
                expected.append((group, column, max(rows), height_px, any(one != group for one in below)))
    feet = find_feet(cells, grid, BELOW_CELLS)
    lowest = np.rint(grid.to_cells(feet.points)).astype(int)[:, 1]
    found = zip(
        feet.group.tolist(),
        feet.column.tolist(),
        lowest.tolist(),
        feet.height_px.tolist(),
        feet.is_hidden.tolist(),
        strict=True,
    )
    assert list(found) == expected
    assert {one[4] for one in expected} == {True, False}


def test_no_cells_have_no_feet() -> None:
    cells, grid = some_cells(1, side=1.0)
    assert len(find_feet(cells.keep(np.zeros(cells.count, np.bool_)), grid, BELOW_CELLS).column) == 0
