"""What is around vehicles that are none? Colours, textures and shapes that make a rendered scene less predictable.

What is learnt of a vehicle must not hang on the grey of one road, nor on the emptiness of a rendered meadow: stripes,
grids, letters, blobs, plain rectangles and poles are hard negatives.
"""

import math

import cv2
import numpy as np
from numpy.typing import NDArray

ByteArray = NDArray[np.uint8]
Single = NDArray[np.float32]
Generator = np.random.Generator

_SQUARE = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) / 2
_SHAPES = ("fill", "outline", "blob", "letter", "line")
_SUBPIXELS = 4


def noise_field(shape: tuple[int, int], cell_px: float, rng: Generator) -> Single:
    """Draw smooth noise of mean 0 and deviation 1, (h, w), whose waves are some cells long, a cell a pixel or more."""
    cells = [max(2, round(side / max(cell_px, 1.0))) for side in shape]
    return np.asarray(cv2.resize(rng.standard_normal(cells, np.float32), shape[::-1], interpolation=cv2.INTER_CUBIC))


def littered(ground: ByteArray, rng: Generator) -> ByteArray:
    """Give an empty scene, (h, w, 3), other colours and clutter: now and then little, now and then much."""
    picture = recoloured(ground, rng)
    scatter(picture, rng, count=min(120, int(rng.exponential(35))))
    return picture


def recoloured(ground: ByteArray, rng: Generator) -> ByteArray:
    """Give an empty scene, (h, w, 3), other colours, patches and grain."""
    shape = ground.shape[:2]
    picture = ground.astype(np.float32)
    if rng.random() < 0.5:
        other = rng.uniform(0.5, 1.4, 3) * picture + rng.uniform(-30, 60, 3)
        picture += (other - picture) / (1 + np.exp(-3 * noise_field(shape, rng.uniform(100, 800), rng)))[:, :, None]
    if rng.random() < 0.3:
        picture += rng.uniform(0.3, 1) * (picture.mean(axis=2, keepdims=True) - picture)
    for _ in range(int(rng.integers(0, 3))):  # woods, hedges, gravel
        leaves = np.exp(rng.uniform(0.1, 0.5) * noise_field(shape, rng.uniform(1.5, 14), rng))[:, :, None]
        cover = np.clip(4 * (noise_field(shape, rng.uniform(60, 400), rng) - rng.uniform(0, 1.5)), 0, 1)[:, :, None]
        picture += cover * (leaves * rng.uniform(20, 190, 3).astype(np.float32) - picture)
    for cell_px in rng.choice([1.0, 2.0, 4.0, 12.0, 40.0, 150.0], 2):
        picture += (rng.gamma(1.0, 2.0) * noise_field(shape, float(cell_px), rng))[:, :, None] * rng.uniform(0.6, 1, 3)
    return np.clip(picture, 0, 255).astype(np.uint8)


def scatter(picture: ByteArray, rng: Generator, *, count: int, kept: NDArray[np.bool_] | None = None) -> None:
    """Paint shapes that are no vehicles, each a bundle of equal ones.

    Parameters
    ----------
    picture : (h, w, 3), changed.
    rng : source of every choice.
    count : of bundles.
    kept : (h, w) where nothing may be painted: a bundle that reaches into it is left out.
    """
    for _ in range(count):
        size_px, slim = float(np.exp(rng.uniform(math.log(3), math.log(120)))), float(rng.uniform(0.03, 1))
        angle_rad, shape = float(rng.uniform(0, math.pi)), str(rng.choice(_SHAPES))
        axes = np.array([[math.cos(angle_rad), math.sin(angle_rad)], [-math.sin(angle_rad), math.cos(angle_rad)]])
        colour = np.clip(rng.uniform(0, 255) + rng.normal(0, rng.choice([3, 40]), 3), 0, 255)
        step_px = size_px * np.array([1.05 + rng.gamma(1, 0.4), slim * (1.2 + rng.gamma(1, 1))])
        start_px, layer = rng.uniform((0, 0), picture.shape[1::-1]), picture.copy()
        for place in np.ndindex(*rng.choice([1, 1, 2, 4, 12], 2).tolist()):
            outline_px = start_px + (_SQUARE * size_px * (1, slim) + place * step_px) @ axes
            _paint(layer, shape, outline_px, colour, rng)
        if kept is not None and (layer != picture)[kept].any():
            continue
        cv2.addWeighted(layer, strength := float(rng.uniform(0.4, 1)), picture, 1 - strength, 0, dst=picture)


def _paint(
    layer: ByteArray, shape: str, outline_px: NDArray[np.float64], colour: NDArray[np.float64], rng: Generator
) -> None:
    corners = fine(outline_px)
    middle_px, size_px = outline_px.mean(axis=0), float(np.hypot(*(outline_px[1] - outline_px[0])))
    if shape == "fill":
        cv2.fillConvexPoly(layer, corners, colour.tolist(), cv2.LINE_AA, _SUBPIXELS)
    elif shape == "letter":
        letter, thick = chr(rng.integers(33, 90)), 1 + int(size_px / 20)
        cv2.putText(layer, letter, middle_px.astype(int).tolist(), 0, size_px / 40, colour.tolist(), thick, cv2.LINE_AA)
    elif shape == "blob":
        for point_px in middle_px + rng.normal(0, 0.3, (12, 2)) * size_px:
            shade = np.clip(colour * rng.uniform(0.6, 1.3), 0, 255).tolist()
            cv2.circle(layer, point_px.astype(int).tolist(), 1 + int(size_px / 7), shade, -1, cv2.LINE_AA)
    else:
        is_closed, thick = shape == "outline", int(rng.integers(1, 4))
        line = corners if is_closed else corners[:2]
        cv2.polylines(layer, [line], is_closed, colour.tolist(), thick, cv2.LINE_AA, _SUBPIXELS)


def raise_poles(picture: ByteArray, rng: Generator, *, count: int) -> None:
    """Stand thin upright things before everything in a picture, (h, w, 3), as lamps, signs and trunks do."""
    for _ in range(count):
        size_px = np.array([rng.uniform(1.5, 14), rng.uniform(40, 400)])
        outline_px = rng.uniform((0, 0), picture.shape[1::-1]) + _SQUARE * size_px
        outline_px[:2, 0] += rng.normal(0, 0.04) * size_px[1]
        colour = np.clip(rng.uniform(20, 200) + rng.normal(0, 12, 3), 0, 255).tolist()
        cv2.fillConvexPoly(picture, fine(outline_px), colour, cv2.LINE_AA, _SUBPIXELS)


def fine(outline_px: NDArray[np.floating]) -> NDArray[np.int32]:
    """Give an outline in sixteenths of pixels, as OpenCV's drawing takes it with a shift of 4."""
    return np.round(outline_px * 2**_SUBPIXELS).astype(np.int32)
