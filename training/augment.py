"""How is a rendered picture made to look like one of a camera nobody knows? Crops, turned, scaled, lit and spoilt.

Rendered pictures are too clean: edges too sharp, areas too even, colours few. Each fault of a real camera is drawn by
itself, so that no two crops have the same ones.
"""

import math
from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from training.clutter import fine, noise_field

ByteArray = NDArray[np.uint8]
FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]
Generator = np.random.Generator


@dataclass(frozen=True, slots=True)
class Look:
    """What the pictures of one set of weights may look like.

    Attributes
    ----------
    is_oriented : boxes have an axis of their own, and pictures may be turned by any angle.
    crop_px : side of a crop.
    scale : smallest and largest.
    least_px : shorter extents of a vehicle are not asked for.
    batch : crops a step of training.
    """

    is_oriented: bool
    crop_px: int
    scale: tuple[float, float]
    least_px: float
    batch: int


LOOKS = {
    # Rendered at .09 to .25 m/px: crops have .06 to .4, and the weights are meant for .2.
    "above": Look(is_oriented=True, crop_px=192, scale=(0.6, 1.6), least_px=5.0, batch=8),
    "low": Look(is_oriented=False, crop_px=352, scale=(0.45, 1.6), least_px=7.0, batch=3),
}
_AIMED = np.array([1.0, 3.0, 6.0, 8.0, 8.0])
"""How often a crop is aimed at a vehicle of each class, beside a car: there are few of the others."""
LEAST_SHOWN = 0.3
"""Vehicles of which less is seen are neither asked for nor held against the network."""


def crop_of(
    picture: ByteArray, boxes: FloatArray, look: Look, rng: Generator
) -> tuple[ByteArray, FloatArray, BoolArray]:
    """Cut a crop out of a picture, turned and scaled.

    Parameters
    ----------
    picture : (h, w, 3).
    boxes : (n, 7), as of `training.worlds`.
    look : what may be done.
    rng : source of every choice.

    Returns
    -------
    The crop, (side, side, 3), its boxes, and which of them are to be ignored.
    """
    side = look.crop_px
    scale = float(np.exp(rng.uniform(*np.log(look.scale))))
    turn_rad = float(rng.uniform(-math.pi, math.pi) if look.is_oriented else rng.normal(0, 0.03))
    aim_px = rng.uniform((0, 0), picture.shape[1::-1])
    if len(boxes) and rng.random() < 0.8:
        chance = _AIMED[boxes[:, 5].astype(int)]
        aim_px = boxes[rng.choice(len(boxes), p=chance / chance.sum()), :2]
    flip = float(rng.choice([-1.0, 1.0]))
    turn = scale * np.array([[math.cos(turn_rad), -math.sin(turn_rad)], [math.sin(turn_rad), math.cos(turn_rad)]])
    turn = np.diag([flip, 1.0]) @ turn
    # The vehicle lies anywhere in the crop, and the crop in the picture as far as it fits.
    size_px, half_px = np.array(picture.shape[1::-1]), side / 2 / scale
    middle_px = aim_px + rng.uniform(-0.8, 0.8, 2) * half_px
    middle_px = np.clip(middle_px, np.minimum(half_px, size_px / 2), np.maximum(size_px - half_px, size_px / 2))
    # Only what may be seen: no corner of the crop is farther away.
    corner = np.maximum(middle_px - 1.5 * half_px, 0).astype(int)
    last = (middle_px + 1.5 * half_px).astype(int)
    picture = picture[corner[1] : last[1], corner[0] : last[0]]
    boxes = boxes - np.array([*corner, 0, 0, 0, 0, 0])
    to_crop = np.column_stack([turn, side / 2 - turn @ (middle_px - corner)])
    if scale < 0.9 and rng.random() < 0.8:  # a camera of few pixels has no aliasing, a thinned picture has
        picture = cv2.GaussianBlur(picture, (0, 0), 0.4 / scale).astype(np.uint8)
    border = int(rng.choice([cv2.BORDER_REPLICATE, cv2.BORDER_CONSTANT]))
    crop = cv2.warpAffine(picture, to_crop, (side, side), borderMode=border, borderValue=(114,) * 3)
    moved = boxes.copy()
    moved[:, :2] = boxes[:, :2] @ turn.T + to_crop[:, 2]
    moved[:, 2:4] *= scale
    if look.is_oriented:
        axis = np.column_stack([np.cos(boxes[:, 4]), np.sin(boxes[:, 4])]) @ turn.T
        moved[:, 4] = np.arctan2(axis[:, 1], axis[:, 0])
    else:
        moved = _clipped(moved, side)
    near = (np.abs(moved[:, :2] - side / 2) < side / 2 + moved[:, 2:4].max(axis=1, keepdims=True)).all(axis=1)
    moved = moved[near]
    is_out = ((moved[:, :2] < -0.5) | (moved[:, :2] >= side - 0.5)).any(axis=1)
    is_ignored = is_out | (moved[:, 6] < LEAST_SHOWN) | (moved[:, 2:4].min(axis=1) < look.least_px)
    # Of what fills the crop there is a wall to see: asked for, it is found in every plain corner.
    is_ignored |= moved[:, 2:4].max(axis=1) > 0.8 * side
    return np.asarray(crop, np.uint8), moved, np.asarray(is_ignored, np.bool_)


def _clipped(boxes: FloatArray, side: int) -> FloatArray:
    """Cut upright boxes at the border; what is left of each counts as its visible share."""
    low = np.clip(boxes[:, :2] - boxes[:, 2:4] / 2, -0.5, side - 0.5)
    high = np.clip(boxes[:, :2] + boxes[:, 2:4] / 2, -0.5, side - 0.5)
    left = np.prod((high - low) / np.maximum(boxes[:, 2:4], 1e-6), axis=1)
    cut = np.column_stack([(low + high) / 2, high - low, boxes[:, 4:6], boxes[:, 6] * left])
    return cut[left > 0.02]


def repainted(crop: ByteArray, boxes: FloatArray, rng: Generator) -> ByteArray:
    """Give some vehicles, (n, 7), another colour, (h, w, 3), and a shine: most paints are not in the palette."""
    picture = crop.astype(np.float32)
    for box in boxes[rng.random(len(boxes)) < 0.35]:
        cover = mask_of(box[None] * (1, 1, 0.94, 0.9, 1, 1, 1), crop.shape[:2])[:, :, None]
        part = picture * rng.uniform(0.55, 1.35, 3).astype(np.float32) + np.float32(rng.uniform(-25, 40))
        if rng.random() < 0.6:  # what shines in paint and glass: the sky, trees, other vehicles
            shine = noise_field(crop.shape[:2], float(rng.uniform(0.15, 0.8)) * box[2:4].min(), rng)
            part = part * np.exp(np.float32(rng.uniform(0.05, 0.4)) * shine)[:, :, None]
        picture = np.where(cover, part, picture)
    return np.clip(picture, 0, 255).astype(np.uint8)


def mask_of(boxes: FloatArray, shape: tuple[int, ...]) -> BoolArray:
    """Tell which pixels (h, w) lie in one of some boxes, (n, 7)."""
    mask = np.zeros(shape, np.uint8)
    for x, y, length, width, angle_rad, *_ in boxes:
        corners = cv2.boxPoints(((x, y), (length, width), math.degrees(angle_rad)))
        cv2.fillConvexPoly(mask, fine(corners), 255, cv2.LINE_8, 4)
    return mask > 0


def spoilt(crop: ByteArray, rng: Generator) -> ByteArray:
    """Light, blur, sharpen, grain and compress a picture at random, (h, w, 3)."""
    shape = crop.shape[:2]
    picture = crop.astype(np.float32) / 255

    def happens(chance: float) -> bool:
        return bool(rng.random() < chance)

    def single(values: FloatArray | float) -> Any:  # Any: NumPy's type of a single number of 32 bits is another one
        return np.asarray(values, np.float32)

    if happens(0.3):
        picture = picture[:, :, rng.permutation(3)]
    grey = picture @ single([[0.3], [0.4], [0.3]])
    picture = grey + single(0.0 if happens(0.15) else rng.uniform(0.2, 1.4)) * (picture - grey)
    if happens(0.3):  # shade and light in large patches, as of clouds, walls and haze
        light = single(rng.uniform(0.1, 0.4)) * noise_field(shape, rng.uniform(20, 200), rng)
        picture = picture * np.exp(light)[:, :, None]
    picture = np.clip(picture, 0, 1) ** single(np.exp(rng.normal(0, 0.35)))
    gain = np.exp(rng.normal(-0.15, 0.3)) * rng.uniform(0.88, 1.12, 3)
    picture = (picture - single(0.5)) * single(gain) + single(0.5 + rng.normal(0, 0.1))
    if happens(0.3):
        grain = noise_field(shape, float(rng.choice([1.5, 3, 6])), rng)
        picture = picture + (single(rng.uniform(0, 0.06)) * grain)[:, :, None]
    if happens(0.4):  # fewer pixels than it has now
        smaller = float(rng.uniform(0.35, 0.95))
        how = int(rng.choice([cv2.INTER_AREA, cv2.INTER_LINEAR, cv2.INTER_CUBIC]))
        small = cv2.resize(picture, None, fx=smaller, fy=smaller, interpolation=how)
        picture = cv2.resize(small, shape[::-1], interpolation=int(rng.choice([cv2.INTER_LINEAR, cv2.INTER_CUBIC])))
    if happens(0.6):
        picture = cv2.GaussianBlur(picture, (0, 0), float(rng.uniform(0.3, 1.6)))
    if happens(0.1):
        length = int(rng.integers(2, 6))
        picture = cv2.filter2D(picture, -1, np.full((1, length) if happens(0.5) else (length, 1), 1 / length))
    if happens(0.4):  # the sharpening of cheap cameras, halos included
        soft = cv2.GaussianBlur(picture, (0, 0), float(rng.uniform(0.7, 2)))
        picture = picture + single(rng.uniform(0.3, 1.8)) * (picture - soft)
    noise = rng.standard_normal((*shape, 1 if happens(0.5) else 3), np.float32)
    picture = picture + single(rng.exponential(0.01)) * noise
    out = np.clip(255 * picture, 0, 255).astype(np.uint8)
    if happens(0.7):
        quality = [cv2.IMWRITE_JPEG_QUALITY, int(rng.integers(20, 96))]
        out = np.asarray(cv2.imdecode(cv2.imencode(".jpg", out, quality)[1], cv2.IMREAD_COLOR), np.uint8)
    return out
