"""What does a second look see better? Vehicles far away: their part of the picture, enlarged, beside the plain look."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vision.networks.box_detector import ImageBoxes
from vision.networks.onnx.network_input import Letterbox, Part, Tile, checked_part
from vision.networks.onnx.settings import OnnxSettings
from vision.objects import BoolArray

# What is small, but longer than this share of it, is taken from either look: sizes differ a little, and of what stands
# half hidden one look may see what the other one misses.
EITHER_SHARE = 1 / 2

# So much of a part of a vehicle lies in the box of the whole.
PART_SHARE = 0.85


@dataclass(frozen=True, slots=True)
class CloserLook:
    """A second look at the far part of the picture, enlarged.

    Attributes
    ----------
    tile : the part. letterbox : how it lies in its input.
    small_px : the length of the longer side below which vehicles are taken from this look.
    image_size_px : (width, height) of the picture.
    """

    tile: Tile
    letterbox: Letterbox
    small_px: float
    image_size_px: tuple[int, int]

    @classmethod
    def at(cls, far_px: Part, scale: float, image_size_px: tuple[int, int], settings: OnnxSettings) -> CloserLook:
        """Plan the look at a part, for pictures that are seen at a scale otherwise."""
        tile, scale_there = Tile(*checked_part(far_px, image_size_px)), scale * settings.closer
        letterbox = Letterbox.of(tile.size_px, tile.filled_px(scale_there))
        return cls(tile, letterbox, settings.closer_below_px / scale, image_size_px)

    def joined(self, plain: ImageBoxes, closer: ImageBoxes) -> ImageBoxes:
        """Take small boxes from this look, others and those elsewhere from the plain one; some are in both.

        What is small and lies in a large one is a part of it: enlarged, the boot of a blurred car is a car.
        """
        left_top = np.array([self.tile.left_px, self.tile.top_px])
        right_bottom = left_top + self.tile.size_px
        is_elsewhere = ((plain.centre_px < left_top) | (plain.centre_px > right_bottom)).any(axis=1)
        is_large = plain.size_px.max(axis=1) >= EITHER_SHARE * self.small_px
        # What the part cuts is whole in the plain look, unless the picture itself ends there.
        bounds = closer.bounds_px()
        is_whole = (left_top == 0) | (bounds[:, :2] > left_top)
        is_whole &= (right_bottom == self.image_size_px) | (bounds[:, 2:] < right_bottom - 1)
        is_small = closer.size_px.max(axis=1) < self.small_px
        is_part = _lies_in(closer, plain.select(plain.size_px.max(axis=1) >= self.small_px))
        kept = plain.select(np.flatnonzero(is_elsewhere | is_large))
        return ImageBoxes.joined([kept, closer.select(np.flatnonzero(is_small & ~is_part & is_whole.all(axis=1)))])


def _lies_in(boxes: ImageBoxes, others: ImageBoxes) -> BoolArray:
    """Tell which boxes, (n,), lie nearly whole in one of the others."""
    one, other = boxes.bounds_px()[:, None], others.bounds_px()
    shared_px = np.minimum(one[..., 2:], other[:, 2:]) - np.maximum(one[..., :2], other[:, :2])
    shared_px2 = np.prod(np.maximum(shared_px, 0.0), axis=2)
    area_px2 = np.prod(one[..., 2:] - one[..., :2], axis=2)
    return np.asarray((shared_px2 > PART_SHARE * area_px2).any(axis=1))
