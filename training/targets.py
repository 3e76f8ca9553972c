"""What should the network say? Boxes of crops as maps: a peak for each vehicle, and what is told around it."""

import torch
from torch import Tensor

from training.centre_net import STRIDE
from training.crops import Boxes

_SPREAD = 0.14
"""Standard deviation of a peak, as a part of the box; 0.1 to 0.2 are usual."""
_LEAST_CELLS = 0.6
_TOLD = 0.55
"""Cells this high on a peak tell place, size and axis: a peak may be found one cell beside its place."""


def target_maps(boxes: Boxes, is_ignored: Tensor, size_px: tuple[int, int], *, is_oriented: bool) -> Tensor:
    """Draw the targets of some pictures.

    Parameters
    ----------
    boxes : of n pictures; centres lie in the picture but for ignored ones.
    is_ignored : (n, k) of boxes where the network may say what it likes.
    size_px : width and height of a picture, multiples of the stride.
    is_oriented : tell the axis too.

    Returns
    -------
    (n, 3 + maps, h / 4, w / 4): heat, 1 where the heat is believed, weight of what is told, then offset x and y,
    logarithm of length and width in cells, class, and cosine and sine of twice the angle.
    """
    width, height = size_px[0] // STRIDE, size_px[1] // STRIDE
    # Small boxes first: what they tell goes before that of a large one behind them.
    order = (boxes.rows[:, :, 2] * boxes.rows[:, :, 3]).argsort(1)
    boxes, is_ignored = boxes.select(order), is_ignored.gather(1, order)
    rows, is_box = boxes.rows, boxes.is_box
    centre, extent = (rows[:, :, :2] + 0.5) / STRIDE, rows[:, :, 2:4] / STRIDE
    cos, sin = torch.cos(rows[:, :, 4])[:, :, None, None], torch.sin(rows[:, :, 4])[:, :, None, None]
    x = torch.arange(width, device=rows.device) + 0.5
    y = torch.arange(height, device=rows.device)[:, None] + 0.5
    away_x, away_y = x - centre[:, :, 0, None, None], y - centre[:, :, 1, None, None]
    along, across = away_x * cos + away_y * sin, away_y * cos - away_x * sin
    half = extent[:, :, :, None, None] / 2 + 1
    is_spared = (along.abs() < half[:, :, 0]) & (across.abs() < half[:, :, 1])
    is_spared &= (is_box & is_ignored)[:, :, None, None]
    deviation = (_SPREAD * extent).clamp(min=_LEAST_CELLS)[:, :, :, None, None]
    peaks = torch.exp(-((along / deviation[:, :, 0]) ** 2 + (across / deviation[:, :, 1]) ** 2) / 2)
    is_middle = ((x - 0.5) == centre[:, :, 0, None, None].floor()) & ((y - 0.5) == centre[:, :, 1, None, None].floor())
    peaks = peaks.masked_fill(is_middle, 1.0) * (is_box & ~is_ignored)[:, :, None, None]
    is_told = peaks > _TOLD
    teller = is_told.int().argmax(1, keepdim=True)  # the first of them
    weight = peaks.gather(1, teller) * is_told.any(1, keepdim=True)
    everywhere = [*torch.log(extent.clamp(min=1e-6)).unbind(2), rows[:, :, 5]]
    everywhere += [torch.cos(2 * rows[:, :, 4]), torch.sin(2 * rows[:, :, 4])] if is_oriented else []
    told = [0.5 - away_x, 0.5 - away_y, *(one[:, :, None, None] for one in everywhere)]
    values = [one.expand_as(peaks).gather(1, teller) * (weight > 0) for one in told]
    return torch.cat([peaks.amax(1, keepdim=True), ~is_spared.any(1, keepdim=True), weight, *values], 1)
