"""What is looked at in a step? Crops of rendered pictures, turned, scaled and flipped, many at once.

All of it is arithmetic on tensors, so that a graphics card makes the crops that it learns from.
"""

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import torch
from torch import Tensor
from torch.nn import functional


@dataclass(frozen=True, slots=True)
class Look:
    """What the pictures of one set of weights may look like.

    Attributes
    ----------
    is_oriented : boxes have an axis of their own, and pictures may be turned by any angle.
    crop_px : side of a crop, a multiple of 32.
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
    "low": Look(is_oriented=False, crop_px=416, scale=(0.45, 1.6), least_px=7.0, batch=4),
}
_AIMED = (1.0, 3.0, 6.0, 8.0, 8.0)
"""How often a crop is aimed at a vehicle of each class, beside a car: there are few of the others."""
LEAST_SHOWN = 0.3
"""Vehicles of which less is seen are neither asked for nor held against the network."""
_EMPTY = 114 / 255
"""Grey of what lies outside the picture: that of `vision.networks.onnx.detector`."""


@dataclass(frozen=True, slots=True, eq=False)
class Boxes:
    """Boxes of some pictures.

    Attributes
    ----------
    rows : (n, k, 7), as of `training.worlds`.
    is_box : (n, k); the others only fill up.
    """

    rows: Tensor
    is_box: Tensor

    def select(self, columns: Tensor) -> "Boxes":
        """Take some boxes of each picture, (n, j)."""
        return Boxes(self.rows.take_along_dim(columns[:, :, None], 1), self.is_box.gather(1, columns))


@dataclass(frozen=True, slots=True, eq=False)
class Pictures:
    """Rendered pictures.

    Attributes
    ----------
    frames : (n, h, w, 3), bytes, blue first.
    boxes : of each.
    """

    frames: Tensor
    boxes: Boxes


def load_pictures(folders: list[Path], device: torch.device) -> Pictures:
    """Load worlds as `training.worlds.write_worlds` leaves them; on the processor they stay in their file."""
    parts, rows = [], []
    for folder in folders:
        # To be read alone, though PyTorch knows no such tensors: "c" copies what is written to.
        parts.append(torch.from_numpy(np.load(folder / "frames.npy", mmap_mode="c")).to(device))
        boxes = np.load(folder / "boxes.npz")
        rows += [torch.from_numpy(boxes[str(nth)]).float() for nth in range(len(boxes.files))]
    filled = torch.nn.utils.rnn.pad_sequence(rows, batch_first=True).to(device)
    counts = torch.tensor([len(one) for one in rows], device=device)
    is_box = torch.arange(filled.shape[1], device=device) < counts[:, None]
    return Pictures(parts[0] if len(parts) == 1 else torch.cat(parts), Boxes(filled, is_box))


def crops_of(pictures: Pictures, look: Look, count: int, rng: torch.Generator) -> tuple[Tensor, Boxes, Tensor]:
    """Cut crops out of pictures drawn at random, turned and scaled.

    Parameters
    ----------
    pictures, look : what may be looked at, and how.
    count : of crops.
    rng : source of every choice, on the pictures' device.

    Returns
    -------
    Crops, (count, 3, side, side), red first, 0 to 1; their boxes, and (count, k) which of them are to be ignored.
    """
    device, side = pictures.frames.device, look.crop_px
    size_px = torch.tensor(pictures.frames.shape[2:0:-1], device=device, dtype=torch.float32)

    def uniform(low: float, high: float, *shape: int) -> Tensor:
        return low + (high - low) * torch.rand(count, *shape, generator=rng, device=device)

    nth = torch.randint(len(pictures.frames), (count,), generator=rng, device=device)
    rows, is_box = pictures.boxes.rows[nth], pictures.boxes.is_box[nth]
    scale = torch.exp(uniform(math.log(look.scale[0]), math.log(look.scale[1])))
    normal = torch.randn(count, generator=rng, device=device)
    turn_rad = uniform(-math.pi, math.pi) if look.is_oriented else 0.03 * normal
    flip = torch.where(uniform(0, 1) < 0.5, -1.0, 1.0)
    cos, sin = scale * torch.cos(turn_rad), scale * torch.sin(turn_rad)
    turn = torch.stack([torch.stack([flip * cos, -flip * sin], 1), torch.stack([sin, cos], 1)], 1)
    # The vehicle lies anywhere in the crop, and the crop in the picture as far as it fits.
    aimed = torch.tensor(_AIMED, device=device)[rows[:, :, 5].long()] * is_box
    chosen = torch.multinomial(aimed + (~is_box.any(1, keepdim=True)), 1, generator=rng)
    vehicle_px = rows.gather(1, chosen[:, :, None].expand(-1, -1, 2))[:, 0]
    is_aimed = (uniform(0, 1) < 0.8) & is_box.any(1)
    aim_px = torch.where(is_aimed[:, None], vehicle_px, uniform(0, 1, 2) * size_px)
    half_px = side / 2 / scale[:, None]
    middle_px = aim_px + uniform(-0.8, 0.8, 2) * half_px
    middle_px = middle_px.clamp(torch.minimum(half_px, size_px / 2), torch.maximum(size_px - half_px, size_px / 2))
    shift = side / 2 - 0.5 - (turn @ middle_px[:, :, None])[:, :, 0]
    crops = _cut(pictures.frames[nth], turn, shift, side)
    is_thin = (scale < 0.9) & (uniform(0, 1) < 0.2)  # a camera of few pixels has no aliasing, a thinned picture has
    smooth = functional.avg_pool2d(crops, 2)
    crops = torch.where(is_thin[:, None, None, None], crops[:, :, ::2, ::2], smooth)
    return crops, *_moved(Boxes(rows, is_box), turn, shift, scale, look)


def _cut(frames: Tensor, turn: Tensor, shift: Tensor, side: int) -> Tensor:
    """Take crops at twice their size; outside a picture its border goes on, or is grey."""
    planes = frames.flip(3).permute(0, 3, 1, 2).float() / 255
    height, width = planes.shape[2:]
    fine = (torch.arange(2 * side, device=frames.device) + 0.5) / 2 - 0.5
    crop_px = torch.stack(torch.meshgrid(fine, fine, indexing="xy"), 2).reshape(1, -1, 2)
    seen_px = (crop_px - shift[:, None]) @ torch.linalg.inv(turn).transpose(1, 2)
    seen = (2 * seen_px + 1) / torch.tensor([width, height], device=frames.device) - 1
    seen = seen.reshape(-1, 2 * side, 2 * side, 2)
    crops = functional.grid_sample(planes, seen, padding_mode="border", align_corners=False)
    is_grey = (seen.abs() > 1).any(3)[:, None]
    is_grey[1::2] = False  # of every other crop the border goes on
    return crops.masked_fill(is_grey, _EMPTY)


def _moved(boxes: Boxes, turn: Tensor, shift: Tensor, scale: Tensor, look: Look) -> tuple[Boxes, Tensor]:
    """Move boxes with their pictures, drop those outside, and tell which of the others are to be ignored."""
    side, rows, is_box = look.crop_px, boxes.rows, boxes.is_box
    middle, extent = rows[:, :, :2] @ turn.transpose(1, 2) + shift[:, None], rows[:, :, 2:4] * scale[:, None, None]
    angle_rad, kind, share = rows[:, :, 4], rows[:, :, 5], rows[:, :, 6]
    if look.is_oriented:
        axis = torch.stack([torch.cos(angle_rad), torch.sin(angle_rad)], 2) @ turn.transpose(1, 2)
        angle_rad = torch.atan2(axis[:, :, 1], axis[:, :, 0])
    else:  # cut at the border; what is left of each counts as its visible share
        low = (middle - extent / 2).clamp(-0.5, side - 0.5)
        high = (middle + extent / 2).clamp(-0.5, side - 0.5)
        left = ((high - low) / extent.clamp(min=1e-6)).prod(2)
        middle, extent, share = (low + high) / 2, high - low, share * left
        is_box = is_box & (left > 0.02)
    reach = side / 2 + extent.amax(2, keepdim=True)
    is_box = is_box & ((middle - side / 2).abs() < reach).all(2)
    is_out = ((middle < -0.5) | (middle >= side - 0.5)).any(2)
    is_ignored = is_out | (share < LEAST_SHOWN) | (extent.amin(2) < look.least_px)
    # Of what fills the crop there is a wall to see: asked for, it is found in every plain corner.
    is_ignored |= extent.amax(2) > 0.8 * side
    moved = torch.cat([middle, extent, torch.stack([angle_rad, kind, share], 2)], 2)
    # Those that count first, so that no more are kept than the crop with most of them has.
    order = is_box.int().argsort(dim=1, descending=True, stable=True)[:, : max(1, int(is_box.sum(1).max()))]
    return Boxes(moved, is_box).select(order), is_ignored.gather(1, order)
