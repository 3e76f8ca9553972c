"""Which parts of a picture go into a network's input, and how large? Tiles of a part, and the letterbox they lie in."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import cv2
import numpy as np

from vision.errors import VisionError
from vision.networks.box_detector import ImageBoxes
from vision.networks.onnx.settings import OnnxSettings
from vision.objects import ByteArray

# What is around a picture in the input: the grey that YOLO networks are trained with.
PADDING = 114

# Networks halve their input up to five times: sides of open inputs are multiples of this.
INPUT_STEP_PX = 32

Part = tuple[int, int, int, int]  # left, top, width, height


@dataclass(frozen=True, slots=True)
class Tile:
    """A part of the picture that is looked at by itself."""

    left_px: int
    top_px: int
    width_px: int
    height_px: int

    @property
    def size_px(self) -> tuple[int, int]:
        """Return width and height."""
        return self.width_px, self.height_px

    def filled_px(self, scale: float) -> tuple[int, int]:
        """Give the smallest input that an open network takes in which it has a scale."""
        width, height = (INPUT_STEP_PX * int(np.ceil(side * scale / INPUT_STEP_PX)) for side in self.size_px)
        return width, height

    def of(self, picture: ByteArray) -> ByteArray:
        """Cut it out of a picture."""
        rows = slice(self.top_px, self.top_px + self.height_px)
        return picture[rows, self.left_px : self.left_px + self.width_px]


@dataclass(frozen=True, slots=True)
class Letterbox:
    """How a picture lies in an input of another shape: scaled, in the middle.

    Attributes
    ----------
    scale : input pixels to a pixel of the picture.
    size_px : (width, height) of the scaled picture. offset_px : of its corner in the input.
    input_size_px : (width, height).

    Examples
    --------
    >>> Letterbox.of((1280, 720), (640, 640))
    Letterbox(scale=0.5, size_px=(640, 360), offset_px=(0, 140), input_size_px=(640, 640))
    """

    scale: float
    size_px: tuple[int, int]
    offset_px: tuple[int, int]
    input_size_px: tuple[int, int]

    @classmethod
    def of(cls, size_px: tuple[int, int], input_size_px: tuple[int, int]) -> Letterbox:
        """Fit a picture into an input."""
        scale = min(input_size_px[0] / size_px[0], input_size_px[1] / size_px[1])
        scaled = max(1, round(size_px[0] * scale)), max(1, round(size_px[1] * scale))
        offset = (input_size_px[0] - scaled[0]) // 2, (input_size_px[1] - scaled[1]) // 2
        return cls(scale, scaled, offset, input_size_px)

    def apply(self, picture: ByteArray) -> ByteArray:
        """Scale a (h, w, 3) picture and lay it into the input."""
        shrinks = self.scale < 1
        scaled = picture
        if (picture.shape[1], picture.shape[0]) != self.size_px:
            how = cv2.INTER_AREA if shrinks else cv2.INTER_LINEAR
            scaled = np.asarray(cv2.resize(picture, self.size_px, interpolation=how), np.uint8)
        canvas = np.full((self.input_size_px[1], self.input_size_px[0], 3), PADDING, np.uint8)
        left, top = self.offset_px
        canvas[top : top + self.size_px[1], left : left + self.size_px[0]] = scaled
        return canvas

    def undo(self, boxes: ImageBoxes) -> ImageBoxes:
        """Bring boxes from the input back to the picture; pixels count from their centres on both sides."""
        centre_px = (boxes.centre_px + 0.5 - np.array(self.offset_px)) / self.scale - 0.5
        return replace(boxes, centre_px=centre_px, size_px=boxes.size_px / self.scale)


def picture_scale(image_size_px: tuple[int, int], input_px: tuple[int, int], settings: OnnxSettings) -> float:
    """Give the pixels of the input for a pixel of the picture where all of it is looked at."""
    whole = next(cut_tiles((0, 0, *image_size_px), settings))
    scale = min(input_px[0] / whole.width_px, input_px[1] / whole.height_px)
    return min(scale, settings.enlarge)


def checked_part(part_px: Part | None, image_size_px: tuple[int, int]) -> Part:
    """Tell which part of the picture is looked at; the whole one if nothing was said."""
    left, top, width, height = part = part_px or (0, 0, *image_size_px)
    is_inside = left >= 0 and top >= 0 and left + width <= image_size_px[0] and top + height <= image_size_px[1]
    if not is_inside or width < 1 or height < 1:
        raise VisionError(f"expected a left, top, width, height within {image_size_px!r} px, got {part!r}")
    return part


def cut_tiles(part_px: Part, settings: OnnxSettings) -> Iterator[Tile]:
    """Cut a part of the picture into equal tiles that overlap."""
    columns, rows = settings.tiles
    for top, height in _spans(part_px[1], part_px[3], rows, settings.overlap):
        for left, width in _spans(part_px[0], part_px[2], columns, settings.overlap):
            yield Tile(left, top, width, height)


def _spans(start_px: int, size_px: int, count: int, overlap: float) -> list[tuple[int, int]]:
    """Cover a length with `count` spans of one size, each sharing a part with the next one."""
    span_px = min(size_px, int(np.ceil(size_px / (count - (count - 1) * overlap))))
    starts = start_px + np.linspace(0, size_px - span_px, count).round().astype(int)
    return [(int(start), span_px) for start in starts]
