"""Crops: the boxes move with the picture."""

import math

import cv2
import numpy as np
import pytest

from tests.cases import for_each

pytest.importorskip("torch", reason="the extra `train` is not installed")

from training.augment import LOOKS, crop_of, repainted, spoilt


def one_bright_vehicle(rng: np.random.Generator, angle_rad: float) -> tuple[np.ndarray, np.ndarray]:  # type: ignore[type-arg]
    picture = np.zeros((400, 600, 3), np.uint8)
    x, y = rng.uniform(100, 500), rng.uniform(100, 300)
    corners = cv2.boxPoints(((x, y), (90, 30), math.degrees(angle_rad)))
    cv2.fillConvexPoly(picture, np.round(corners * 16).astype(np.int32), (255,) * 3, cv2.LINE_AA, 4)
    return picture, np.array([[x, y, 90.0, 30.0, angle_rad, 0.0, 1.0]])


@for_each("seed", range(20))
def test_a_box_stays_on_its_vehicle_through_every_turn_and_scale(seed: int) -> None:
    rng = np.random.default_rng(seed)
    picture, boxes = one_bright_vehicle(rng, float(rng.uniform(-3, 3)))
    crop, moved, is_ignored = crop_of(picture, boxes, LOOKS["above"], rng)
    if len(moved) == 0 or is_ignored.any():
        return  # a crop beside it
    x, y, length, width, angle_rad = moved[0, :5]
    mask = np.zeros(crop.shape[:2], np.uint8)
    corners = cv2.boxPoints(((x, y), (length, width), math.degrees(angle_rad)))
    cv2.fillConvexPoly(mask, np.round(corners * 16).astype(np.int32), 255, cv2.LINE_AA, 4)
    is_vehicle, is_box = (crop[:, :, 0] > 127) & (crop[:, :, 0] != 114), mask > 127
    assert (is_vehicle & is_box).sum() / (is_vehicle | is_box).sum() > 0.8


def test_upright_boxes_end_at_the_border_and_lose_their_share() -> None:
    boxes = np.array([[0.0, 200.0, 80.0, 40.0, 0.0, 0.0, 1.0]])
    picture = np.full((400, 600, 3), 90, np.uint8)
    shares = []
    for seed in range(20):
        _, moved, _ = crop_of(picture, boxes, LOOKS["low"], np.random.default_rng(seed))
        low, high = moved[:, :2] - moved[:, 2:4] / 2, moved[:, :2] + moved[:, 2:4] / 2
        assert (low >= -0.51).all()
        assert (high <= LOOKS["low"].crop_px - 0.49).all()
        shares += moved[:, 6].tolist()
    assert min(shares) < 0.99


def test_the_shine_on_a_sliver_is_no_finer_than_a_pixel() -> None:
    picture, sliver = np.full((64, 64, 3), 90, np.uint8), np.array([[30.0, 30.0, 20.0, 1e-3, 0.0, 0.0, 0.02]])
    shone = [repainted(picture, sliver, np.random.default_rng(seed)) for seed in range(20)]
    assert all(one.shape == picture.shape for one in shone)


def test_the_same_numbers_spoil_a_picture_the_same_way() -> None:
    picture = np.random.default_rng(0).integers(0, 255, (64, 64, 3)).astype(np.uint8)
    first, second, other = (spoilt(picture, np.random.default_rng(seed)) for seed in (1, 1, 2))
    assert np.array_equal(first, second)
    assert not np.array_equal(first, other)
