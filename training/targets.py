"""What should the network say? Boxes of a picture as maps: a peak for each vehicle, and what is told around it."""

import numpy as np
from numpy.typing import NDArray

from training.centre_net import HEADS, STRIDE

_SPREAD = 0.14
"""Standard deviation of a peak, as a part of the box; 0.1 to 0.2 are usual."""
_LEAST_CELLS = 0.6
_TOLD = 0.55
"""Cells this high on a peak tell place, size and axis: a peak may be found one cell beside its place."""


def target_maps(
    boxes: NDArray[np.float64], is_ignored: NDArray[np.bool_], size_px: tuple[int, int], *, is_oriented: bool
) -> NDArray[np.float32]:
    """Draw the target of a picture.

    Parameters
    ----------
    boxes : (n, 7), as of `training.worlds`; centres lie in the picture but for ignored ones.
    is_ignored : (n,) of boxes where the network may say what it likes.
    size_px : width and height of the picture, multiples of the stride.
    is_oriented : tell the axis too.

    Returns
    -------
    (3 + maps, h / 4, w / 4): heat, 1 where the heat is believed, weight of what is told, then offset x and y, logarithm
    of length and width in cells, class, and cosine and sine of twice the angle.
    """
    width, height = size_px[0] // STRIDE, size_px[1] // STRIDE
    told_maps = HEADS["offset"] + HEADS["size"] + 1 + 2 * is_oriented
    maps = np.zeros((3 + told_maps, height, width), np.float32)
    maps[1] = 1.0
    y, x = np.mgrid[:height, :width].astype(np.float64)
    # Small boxes last: what they tell goes before that of a large one behind them.
    for row in sorted(range(len(boxes)), key=lambda row: -boxes[row, 2] * boxes[row, 3]):
        centre = (boxes[row, :2] + 0.5) / STRIDE
        extent, angle_rad = boxes[row, 2:4] / STRIDE, boxes[row, 4]
        cos, sin = np.cos(angle_rad), np.sin(angle_rad)
        away = x + 0.5 - centre[0], y + 0.5 - centre[1]
        along, across = away[0] * cos + away[1] * sin, away[1] * cos - away[0] * sin
        if is_ignored[row]:
            maps[1][(np.abs(along) < extent[0] / 2 + 1) & (np.abs(across) < extent[1] / 2 + 1)] = 0.0
            continue
        deviation = np.maximum(_SPREAD * extent, _LEAST_CELLS)
        peak = np.exp(-((along / deviation[0]) ** 2 + (across / deviation[1]) ** 2) / 2)
        column, line = min(int(centre[0]), width - 1), min(int(centre[1]), height - 1)
        peak[line, column] = 1.0
        maps[0] = np.maximum(maps[0], peak)
        is_told = peak > _TOLD
        maps[2][is_told] = peak[is_told]
        told = [-away[0] + 0.5, -away[1] + 0.5, *np.log(extent), boxes[row, 5]]
        told += [np.cos(2 * angle_rad), np.sin(2 * angle_rad)] if is_oriented else []
        for channel, values in enumerate(told, start=3):
            maps[channel][is_told] = np.broadcast_to(values, is_told.shape)[is_told]
    return maps
