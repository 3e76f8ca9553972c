"""What the networks are asked for, against a slow look at each cell."""

import math

import numpy as np
import pytest

from tests.cases import for_each

torch = pytest.importorskip("torch", reason="the extra `train` is not installed")

from training.crops import Boxes
from training.targets import target_maps


def maps_of(rows: np.ndarray, *, is_ignored: bool = False, is_oriented: bool = True) -> np.ndarray:  # type: ignore[type-arg]
    """Draw one picture of 64 pixels, a row that is none beside its boxes."""
    filled = torch.from_numpy(np.vstack([rows, np.zeros((1, 7))])[None])
    is_box = torch.tensor([[True] * len(rows) + [False]])
    ignored = torch.full_like(is_box, is_ignored)
    maps: np.ndarray = target_maps(Boxes(filled, is_box), ignored, (64, 64), is_oriented=is_oriented)[0].numpy()  # type: ignore[type-arg]
    return maps


def slow_heat(boxes: list[list[float]], x: int, y: int) -> float:
    """The highest peak over the middle of a cell."""
    heights = [0.0]
    for left, top, length, width, angle, *_ in boxes:
        centre_x, centre_y = (left + 0.5) / 4, (top + 0.5) / 4
        dx, dy = x + 0.5 - centre_x, y + 0.5 - centre_y
        along, across = dx * math.cos(angle) + dy * math.sin(angle), dy * math.cos(angle) - dx * math.sin(angle)
        wide, high = max(0.14 * length / 4, 0.6), max(0.14 * width / 4, 0.6)
        is_centre = (x, y) == (int(centre_x), int(centre_y))
        heights.append(1.0 if is_centre else math.exp(-((along / wide) ** 2 + (across / high) ** 2) / 2))
    return max(heights)


@for_each("seed", range(10))
def test_heat_is_highest_at_the_middle_of_each_vehicle(seed: int) -> None:
    rng = np.random.default_rng(seed)
    places, sizes = rng.uniform(2, 60, (5, 2)), rng.uniform(6, 40, (5, 2))
    boxes = np.column_stack([places, sizes, rng.uniform(-3, 3, 5), np.zeros(5), np.ones(5)])
    maps = maps_of(boxes)
    expected = [[slow_heat(boxes.tolist(), x, y) for x in range(16)] for y in range(16)]
    np.testing.assert_allclose(maps[0], expected, atol=1e-6)


def test_the_told_values_lead_back_to_the_box() -> None:
    box = np.array([[21.3, 40.9, 30.0, 12.0, 0.7, 2.0, 1.0]])
    maps = maps_of(box)
    for y, x in np.argwhere(maps[2] > 0):
        offset, size, kind, axis = np.split(maps[3:, y, x].astype(float), [2, 4, 5])
        told = [*(4 * (np.array([x, y]) + offset) - 0.5), *(4 * np.exp(size)), math.atan2(axis[1], axis[0]) / 2, *kind]
        np.testing.assert_allclose(told, box[0, :6], rtol=1e-5)


def test_of_two_that_overlap_the_smaller_tells() -> None:
    large, small = [32.0, 32.0, 60.0, 60.0, 0.0, 2.0, 1.0], [36.0, 32.0, 12.0, 12.0, 0.0, 0.0, 1.0]
    for rows in ([large, small], [small, large]):
        maps = maps_of(np.array(rows))
        assert maps[7, 8, 9] == 0  # the class, in the middle of the small one
        assert maps[7, 8, 7] == 2


def test_what_is_ignored_is_neither_asked_for_nor_held_against_the_network() -> None:
    box = np.array([[32.0, 32.0, 16.0, 16.0, 0.0, 0.0, 0.1]])
    maps = maps_of(box, is_ignored=True, is_oriented=False)
    assert maps[0].max() == 0
    assert maps[1, 8, 8] == 0
    assert maps[1, 0, 0] == 1
