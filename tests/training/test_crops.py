"""Crops: the boxes move with the picture."""

import math
from pathlib import Path

import cv2
import numpy as np
import pytest

from tests.cases import for_each

torch = pytest.importorskip("torch", reason="the extra `train` is not installed")

from training.crops import LOOKS, Boxes, Pictures, crops_of, load_pictures


def pictures_of(frame: np.ndarray, rows: list[list[float]]) -> Pictures:  # type: ignore[type-arg]
    boxes = Boxes(torch.tensor([rows], dtype=torch.float32), torch.ones(1, len(rows), dtype=torch.bool))
    return Pictures(torch.from_numpy(frame[None]), boxes)


@for_each("seed", range(20))
def test_a_box_stays_on_its_vehicle_through_every_turn_and_scale(seed: int) -> None:
    rng = np.random.default_rng(seed)
    frame, angle_rad = np.zeros((400, 600, 3), np.uint8), rng.uniform(-3, 3)
    x, y = rng.uniform((100, 100), (500, 300))
    corners = cv2.boxPoints(((x, y), (90, 30), math.degrees(angle_rad)))
    cv2.fillConvexPoly(frame, np.round(corners * 16).astype(np.int32), (255,) * 3, cv2.LINE_AA, 4)
    pictures = pictures_of(frame, [[x, y, 90.0, 30.0, angle_rad, 0.0, 1.0]])
    crops, boxes, is_ignored = crops_of(pictures, LOOKS["above"], 8, torch.Generator().manual_seed(seed))
    shared = []
    for crop, rows, is_box, spared in zip(crops, boxes.rows, boxes.is_box, is_ignored, strict=True):
        if not is_box[0] or spared[0]:
            continue  # a crop beside it
        x, y, length, width, angle_rad = rows[0, :5].tolist()
        mask = np.zeros(crop.shape[1:], np.uint8)
        corners = cv2.boxPoints(((x, y), (length, width), math.degrees(angle_rad)))
        cv2.fillConvexPoly(mask, np.round(corners * 16).astype(np.int32), 255, cv2.LINE_AA, 4)
        is_vehicle, is_inside = crop[0].numpy() > 0.5, mask > 127
        shared.append((is_vehicle & is_inside).sum() / (is_vehicle | is_inside).sum())
    assert shared
    assert min(shared) > 0.8


def test_upright_boxes_end_at_the_border_and_lose_their_share() -> None:
    pictures = pictures_of(np.full((500, 700, 3), 90, np.uint8), [[0.0, 200.0, 80.0, 40.0, 0.0, 0.0, 1.0]])
    _, boxes, _ = crops_of(pictures, LOOKS["low"], 20, torch.Generator().manual_seed(1))
    rows = boxes.rows[boxes.is_box]
    low, high = rows[:, :2] - rows[:, 2:4] / 2, rows[:, :2] + rows[:, 2:4] / 2
    assert (low >= -0.51).all()
    assert (high <= LOOKS["low"].crop_px - 0.49).all()
    assert rows[:, 6].min() < 0.99


def test_what_fills_up_shorter_lists_of_boxes_is_none(tmp_path: Path) -> None:
    np.save(tmp_path / "frames.npy", np.zeros((2, 200, 300, 3), np.uint8))
    one = np.array([[150.0, 100.0, 40.0, 20.0, 0.0, 0.0, 1.0]])
    np.savez(tmp_path / "boxes.npz", **{"0": one, "1": np.zeros((0, 7))})
    pictures = load_pictures([tmp_path, tmp_path], torch.device("cpu"))
    assert pictures.boxes.is_box.tolist() == [[True], [False], [True], [False]]
    _, boxes, _ = crops_of(pictures, LOOKS["above"], 12, torch.Generator().manual_seed(2))
    assert 0 < boxes.is_box.sum() <= 12
