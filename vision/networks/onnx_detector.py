"""Which vehicles does a trained network see? Pictures into its input, its numbers back to boxes in the picture.

The network is one of the two that come along (`weights/`) or the user's own. The picture is scaled into the input with
its shape kept (letterbox); large pictures may be cut into tiles, so that vehicles far away keep enough pixels. Or the
part of the picture where they are far away is looked at once more, enlarged.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path

import cv2
import numpy as np

from vision.errors import VisionError
from vision.networks.box_detector import ImageBoxes, whole_boxes
from vision.networks.network import Network
from vision.networks.onnx_output import decode
from vision.networks.onnx_settings import OnnxSettings
from vision.objects import BoolArray, ByteArray, Tensor
from vision.video.frame import Frame

# What is around a picture in the input: the grey that YOLO networks are trained with.
PADDING = 114

# Networks halve their input up to five times: sides of open inputs are multiples of this.
INPUT_STEP_PX = 32

# What is small, but longer than this share of it, is taken from either look: sizes differ a little, and of what stands
# half hidden one look may see what the other one misses.
EITHER_SHARE = 1 / 2

# So much of a part of a vehicle lies in the box of the whole.
PART_SHARE = 0.85

Part = tuple[int, int, int, int]  # left, top, width, height


class OnnxDetector:
    """Finds vehicles with a network in an ONNX file.

    Parameters
    ----------
    path : of the weights.
    settings : what must be known about the network besides.
    image_size_px : (width, height) of the frames.
    part_px : (left, top, width, height) of the part of them to look at, such as where roads are; None for all.
    far_px : the part where vehicles are so far away that the settings want a closer look; None for none.

    Raises
    ------
    VisionError
        If the file is missing, is no network that the runtime can compute, or its input or output do not go with the
        settings: the network is run once, on a grey picture, to find out. Or if the part is none of the picture.
    """

    def __init__(
        self,
        path: Path,
        settings: OnnxSettings,
        image_size_px: tuple[int, int],
        part_px: Part | None = None,
        far_px: Part | None = None,
    ) -> None:
        self._path = path
        self._settings = settings
        self._image_size_px, self._part_px, self._far_px = image_size_px, part_px, far_px
        self._tiles = tuple(_tiles(_checked_part(part_px, image_size_px), settings))
        width, height = image_size_px
        with self._naming_file():
            self._network = Network(path, settings)
            input_px = _input_size(self._network.input_shape, settings)
            is_open = self._network.input_shape[2:] == (0, 0)
            if settings.closer > 1 and not is_open:
                raise VisionError(f"expected closer = 1 for weights that fix their input, got {settings.closer!r}")
            scale = picture_scale(image_size_px, input_px, settings)
            width_px, height_px = self._tiles[0].filled_px(scale)
            filled_px = min(width_px, input_px[0]), min(height_px, input_px[1])
            self._letterbox = Letterbox.of(self._tiles[0].size_px, filled_px if is_open else input_px)
            self._closer = None if far_px is None else CloserLook.at(far_px, scale, image_size_px, settings)
            grey = np.full((height, width, 3), PADDING, np.uint8)
            self._at_once = self._count_at_once(grey)
            self._look(grey)

    def __reduce__(self) -> tuple[object, ...]:
        """Go to another process by what it was made of: the runtime's network stays where it is."""
        return OnnxDetector, (self._path, self._settings, self._image_size_px, self._part_px, self._far_px)

    def on_whole_picture(self) -> OnnxDetector:
        """Make the same for a camera that has moved: a part of the picture is no part of the world any more."""
        return OnnxDetector(self._path, self._settings, self._image_size_px)

    @property
    def runtime(self) -> str:
        """What computes the network, with its version and provider."""
        return self._network.runtime

    @property
    def warnings(self) -> tuple[str, ...]:
        """What the user should know about how the network is computed."""
        return tuple(f"{self._path.name}: {one}" for one in self._network.warnings)

    @property
    def input_size_px(self) -> tuple[int, int]:
        """Width and height of the network's input."""
        return self._letterbox.input_size_px

    def detect(self, instant: Frame) -> ImageBoxes:
        """Find vehicles in a frame.

        Parameters
        ----------
        instant : the frame.

        Returns
        -------
        Boxes in its pixels, best score first.

        Raises
        ------
        VisionError
            If the frame has another size than announced, or the network fails.
        """
        picture = instant.to_bgr()
        came = (picture.shape[1], picture.shape[0])
        if came != self._image_size_px:
            raise VisionError(f"frame {instant.index}: expected {self._image_size_px!r} px, got {came!r}")
        with self._naming_file():
            return self._look(picture)

    @contextmanager
    def _naming_file(self) -> Iterator[None]:
        """Say in errors whose they are."""
        try:
            yield
        except VisionError as error:
            raise VisionError(f"{self._path}: {error}") from error

    def _count_at_once(self, picture: ByteArray) -> int:
        """Tell how many tiles the network takes as one batch; an open axis may hide a network that is built for 1."""
        axis, count = self._network.input_shape[0], min(len(self._tiles), self._settings.max_batch)
        if axis != 0 or count == 1:
            return max(axis, 1)
        try:
            self._look_at_tiles(picture, self._tiles[:count], self._letterbox)
        except VisionError:
            return 1
        return count

    def _look(self, picture: ByteArray) -> ImageBoxes:
        starts = range(0, len(self._tiles), self._at_once)
        batches = [self._tiles[start : start + self._at_once] for start in starts]
        found = ImageBoxes.joined([self._look_at_tiles(picture, tiles, self._letterbox) for tiles in batches])
        if self._closer is not None:
            closer = self._look_at_tiles(picture, [self._closer.tile], self._closer.letterbox)
            found = self._closer.joined(found, closer)
        boxes = suppress(whole_boxes(found, self._image_size_px), self._settings)
        edge_share = np.interp(boxes.score, (0.0, 1.0), self._settings.edge_noise_share)
        return replace(boxes, is_weak=boxes.score < self._settings.score_threshold, edge_share=edge_share)

    def _look_at_tiles(self, picture: ByteArray, tiles: Sequence[Tile], letterbox: Letterbox) -> ImageBoxes:
        """Look at tiles as one batch."""
        settings = self._settings
        output = self._network.run(np.stack([_planes(letterbox.apply(tile.of(picture)), settings) for tile in tiles]))
        if len(tiles) > 1 and (output.ndim != 3 or len(output) != len(tiles)):
            raise VisionError(f"network output: expected {len(tiles)} tables for as many tiles, got {output.shape!r}")
        found = []
        for tile, table in zip(tiles, output if len(tiles) > 1 else [output], strict=True):
            boxes = letterbox.undo(decode(table, settings.layout, settings.classes, settings.least_score))
            found.append(replace(boxes, centre_px=boxes.centre_px + np.array([tile.left_px, tile.top_px])))
        return ImageBoxes.joined(found)


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
        tile, scale_there = Tile(*_checked_part(far_px, image_size_px)), scale * settings.closer
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


def suppress(boxes: ImageBoxes, settings: OnnxSettings) -> ImageBoxes:
    """Keep the best of boxes that lie on each other, whatever their classes: one place holds one vehicle.

    Parameters
    ----------
    boxes : n candidates.
    settings : which are taken for the same vehicle, and how many are looked at.

    Returns
    -------
    The boxes kept, best score first.
    """
    boxes = boxes.select(np.argsort(-boxes.score, kind="stable")[: settings.max_candidates])
    if len(boxes) == 0:
        return boxes
    scores = (boxes.score + 1e-6).tolist()  # OpenCV drops what is not above its own threshold, 0 here
    if boxes.is_oriented.any():
        degrees = np.degrees(boxes.angle_rad).tolist()
        rectangles = list(zip(boxes.centre_px.tolist(), boxes.size_px.tolist(), degrees, strict=True))
        kept = cv2.dnn.NMSBoxesRotated(rectangles, scores, 0.0, settings.nms_threshold)
    else:
        corner_and_size = np.column_stack([boxes.centre_px - boxes.size_px / 2, boxes.size_px])
        kept = cv2.dnn.NMSBoxes(corner_and_size.tolist(), scores, 0.0, settings.nms_threshold)
    return boxes.select(np.asarray(kept, np.intp).ravel())


def _input_size(shape: tuple[int, ...], settings: OnnxSettings) -> tuple[int, int]:
    """Agree on the size of the input: the weights' own, where they fix it."""
    wanted = settings.input_size_px
    channels = 1 if settings.colours == "grey" else 3
    count = settings.tiles[0] * settings.tiles[1]
    if len(shape) != 4 or shape[0] not in (0, 1, count) or shape[1] not in (0, channels):
        pictures = "1" if count == 1 else f"1 or {count}"
        expected = f"an input of ({pictures}, {channels}, height, width) for colours = {settings.colours!r}"
        raise VisionError(f"expected {expected}, got {shape!r}")
    fixed = shape[3], shape[2]
    if wanted is None:
        if 0 in fixed:
            raise VisionError("expected input_size_px for weights that take any size, got none")
        return fixed
    if any(own not in (0, one) for own, one in zip(fixed, wanted, strict=True)):
        raise VisionError(f"expected input_size_px = [{fixed[0]}, {fixed[1]}] as in the weights, got {wanted!r}")
    return wanted


def picture_scale(image_size_px: tuple[int, int], input_px: tuple[int, int], settings: OnnxSettings) -> float:
    """Give the pixels of the input for a pixel of the picture where all of it is looked at."""
    whole = next(_tiles((0, 0, *image_size_px), settings))
    scale = min(input_px[0] / whole.width_px, input_px[1] / whole.height_px)
    return scale if settings.enlarge else min(scale, 1.0)


def _checked_part(part_px: Part | None, image_size_px: tuple[int, int]) -> Part:
    """Tell which part of the picture is looked at; the whole one if nothing was said."""
    left, top, width, height = part = part_px or (0, 0, *image_size_px)
    is_inside = left >= 0 and top >= 0 and left + width <= image_size_px[0] and top + height <= image_size_px[1]
    if not is_inside or width < 1 or height < 1:
        raise VisionError(f"expected a left, top, width, height within {image_size_px!r} px, got {part!r}")
    return part


def _tiles(part_px: Part, settings: OnnxSettings) -> Iterator[Tile]:
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


def _planes(picture: ByteArray, settings: OnnxSettings) -> Tensor:
    """Bring a (h, w, 3) picture, blue first, to the (channels, h, w) numbers that the network takes."""
    if settings.colours == "grey":
        coloured = np.asarray(cv2.cvtColor(picture, cv2.COLOR_BGR2GRAY))[:, :, None]
    else:
        coloured = picture if settings.colours == "bgr" else picture[:, :, ::-1]
    planes = np.ascontiguousarray(coloured.transpose(2, 0, 1)).astype(np.float32)  # bytes turn faster than numbers
    planes *= np.float32(settings.scale)
    planes -= np.float32(settings.mean)
    planes /= np.float32(settings.deviation)
    return planes
