"""Groups of cells and their boxes, against a loop over groups."""

import numpy as np
import pytest

from vision.detection.blobs import Cells, find_blobs, measure, principal_heading
from vision.detection.settings import DetectionSettings
from vision.road.grid import Grid
from vision.road.rectify import RoadCells


def random_cells(seed: int, *, count: int = 200, groups: int = 9) -> Cells:
    rng = np.random.default_rng(seed)
    raw = Cells(
        points=rng.uniform(-20, 20, (count, 2)),
        group=np.zeros(count, np.intp),
        strength=rng.integers(0, 255, count, dtype=np.uint8),
        at_edge=rng.random(count) < 0.02,
        starts=np.zeros(1, np.intp),
        key=np.zeros(1, np.intp),
    )
    return raw.regroup(rng.integers(0, groups, count))


def test_regrouping_sorts_by_key_and_drops_negative_keys() -> None:
    cells = random_cells(0)
    key = np.random.default_rng(1).integers(-2, 4, len(cells.group))
    regrouped = cells.regroup(key * 10)
    assert regrouped.key.tolist() == [0, 10, 20, 30]
    assert regrouped.sizes.tolist() == [int(np.sum(key == k)) for k in range(4)]
    for i, k in enumerate(range(4)):
        assert np.array_equal(regrouped.points[regrouped.group == i], cells.points[key == k])


@pytest.mark.parametrize("seed", range(3))
def test_blobs_are_the_cells_that_can_be_walked_to(seed: int) -> None:
    rng = np.random.default_rng(seed)
    grid = Grid.between(np.zeros(2), np.array([10.0, 6.0]), side=0.5, is_north_up=True)
    mask = np.asarray(rng.random(grid.shape) < 0.3, np.uint8)
    difference = rng.integers(0, 255, grid.shape, dtype=np.uint8)
    raster = RoadCells(grid, road=np.ones(grid.shape, np.bool_), view_edge=rng.random(grid.shape) < 0.1)
    blobs = find_blobs(raster, mask, difference)
    left = {(int(row), int(column)) for row, column in zip(*np.nonzero(mask), strict=True)}
    while left:
        walked, ahead = set(), [left.pop()]
        while ahead:
            row, column = ahead.pop()
            walked.add((row, column))
            near = {(row + i, column + j) for i in (-1, 0, 1) for j in (-1, 0, 1)} & left
            left -= near
            ahead += near
        places = np.array(sorted(walked))
        points = grid.to_plane(places[:, ::-1].astype(float))
        group = blobs.group[np.all(blobs.points == points[0], axis=1)]
        mine = blobs.group == group
        assert np.array_equal(blobs.points[mine], points)
        assert np.array_equal(blobs.strength[mine], difference[tuple(places.T)])
        assert np.array_equal(blobs.at_edge[mine], raster.view_edge[tuple(places.T)])


def test_nothing_marked_is_no_blob() -> None:
    grid = Grid.between(np.zeros(2), np.array([3.0, 2.0]), side=0.5, is_north_up=True)
    raster = RoadCells(grid, road=np.ones(grid.shape, np.bool_), view_edge=np.zeros(grid.shape, np.bool_))
    nothing = np.zeros(grid.shape, np.uint8)
    blobs = find_blobs(raster, nothing, nothing)
    assert (blobs.count, len(blobs.group), len(blobs.sizes)) == (0, 0, 0)


def test_kept_groups_keep_their_cells_and_keys() -> None:
    cells = random_cells(2)
    which = np.arange(cells.count) % 2 == 1
    kept = cells.keep(which)
    assert kept.key.tolist() == cells.key[which].tolist()
    assert np.array_equal(kept.points, cells.points[which[cells.group]])
    assert np.array_equal(kept.starts, np.searchsorted(kept.group, np.arange(kept.count)))


@pytest.mark.parametrize("seed", range(3))
def test_boxes_are_those_of_a_loop_over_groups(seed: int) -> None:
    cells = random_cells(seed)
    heading = np.random.default_rng(seed).uniform(-np.pi, np.pi, cells.count)
    found, _ = measure(cells, heading, 0.5, DetectionSettings())
    for i in range(cells.count):
        points = cells.points[cells.group == i]
        ahead = np.array([np.cos(heading[i]), np.sin(heading[i])])
        left = np.array([-ahead[1], ahead[0]])
        along, across = points @ ahead, points @ left
        centre = (along.min() + along.max()) / 2 * ahead + (across.min() + across.max()) / 2 * left
        border = 0.5 * (np.abs(ahead).sum() - DetectionSettings().blur_cells)
        assert found.centre_m[i] == pytest.approx(centre)
        assert found.length_m[i] == pytest.approx(np.ptp(along) + border)
        assert found.width_m[i] == pytest.approx(np.ptp(across) + border)


def test_cut_end_is_the_one_at_the_view_edge() -> None:
    points = np.stack([np.arange(8.0), np.zeros(8)], axis=-1)
    at_edge = np.arange(8) == 7
    cells = Cells(
        points, np.zeros(8, np.intp), np.full(8, 99, np.uint8), at_edge, np.zeros(1, np.intp), np.zeros(1, np.intp)
    )
    assert measure(cells, np.array([0.0]), 1.0, DetectionSettings())[1].tolist() == [1]
    assert measure(cells, np.array([np.pi]), 1.0, DetectionSettings())[1].tolist() == [-1]


def test_long_axis_is_found() -> None:
    along = np.linspace(-3, 3, 60)
    points = np.stack([along * np.cos(0.4), along * np.sin(0.4)], axis=-1)
    cells = Cells(
        points, np.zeros(60, np.intp), np.full(60, 99, np.uint8), np.zeros(60, np.bool_), np.zeros(1, np.intp),
        np.zeros(1, np.intp),
    )  # fmt: skip
    heading, elongation = principal_heading(cells)
    assert heading[0] == pytest.approx(0.4)
    assert elongation[0] > 5
