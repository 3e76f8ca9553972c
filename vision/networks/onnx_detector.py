"""Which vehicles does a trained network see? Pictures into its input, its numbers back to boxes in the picture.

The network is the user's own: no weights come with the package. The picture is scaled into the input with its shape
kept (letterbox); large pictures may be cut into tiles, so that vehicles far away keep enough pixels.
"""

from __future__ import annotations

from collections.abc import Iterator
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
from vision.objects import ByteArray, Tensor
from vision.video.frame import Frame

# What is around a picture in the input: the grey that YOLO networks are trained with.
PADDING = 114


class OnnxDetector:
    """Finds vehicles with a network in an ONNX file.

    Parameters
    ----------
    path : of the weights.
    settings : what must be known about the network besides.
    image_size_px : (width, height) of the frames.

    Raises
    ------
    VisionError
        If the file is missing, is no network that the runtime can compute, or its input or output do not go with the
        settings: the network is run once, on a grey picture, to find out.
    """

    def __init__(self, path: Path, settings: OnnxSettings, image_size_px: tuple[int, int]) -> None:
        self._path = path
        self._settings = settings
        self._image_size_px = image_size_px
        self._tiles = tuple(_tiles(image_size_px, settings))
        width, height = image_size_px
        with self._naming_file():
            self._network = Network(path, settings.output)
            self._input_size_px = _input_size(self._network.input_shape, settings)
            self._look(np.full((height, width, 3), PADDING, np.uint8))

    @property
    def runtime(self) -> str:
        """What computes the network, with its version."""
        return self._network.runtime

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

    def _look(self, picture: ByteArray) -> ImageBoxes:
        found = [self._look_at_tile(picture, tile) for tile in self._tiles]
        return suppress(whole_boxes(ImageBoxes.joined(found), self._image_size_px), self._settings)

    def _look_at_tile(self, picture: ByteArray, tile: Tile) -> ImageBoxes:
        settings = self._settings
        part = picture[tile.top_px : tile.top_px + tile.height_px, tile.left_px : tile.left_px + tile.width_px]
        box = Letterbox.of((tile.width_px, tile.height_px), self._input_size_px)
        output = self._network.run(_planes(box.apply(part), settings))
        boxes = box.undo(decode(output, settings.layout, settings.classes, settings.score_threshold))
        return replace(boxes, centre_px=boxes.centre_px + np.array([tile.left_px, tile.top_px]))


@dataclass(frozen=True, slots=True)
class Tile:
    """A part of the picture that is looked at by itself."""

    left_px: int
    top_px: int
    width_px: int
    height_px: int


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
    if len(shape) != 4 or shape[0] not in (0, 1) or shape[1] not in (0, channels):
        expected = f"an input of (1, {channels}, height, width) for colours = {settings.colours!r}"
        raise VisionError(f"expected {expected}, got {shape!r}")
    fixed = shape[3], shape[2]
    if wanted is None:
        if 0 in fixed:
            raise VisionError("expected input_size_px for weights that take any size, got none")
        return fixed
    if any(own not in (0, one) for own, one in zip(fixed, wanted, strict=True)):
        raise VisionError(f"expected input_size_px = [{fixed[0]}, {fixed[1]}] as in the weights, got {wanted!r}")
    return wanted


def _tiles(image_size_px: tuple[int, int], settings: OnnxSettings) -> Iterator[Tile]:
    """Cut the picture into equal tiles that overlap."""
    spans = [_spans(size, count, settings.overlap) for size, count in zip(image_size_px, settings.tiles, strict=True)]
    for top, height in spans[1]:
        for left, width in spans[0]:
            yield Tile(left, top, width, height)


def _spans(size_px: int, count: int, overlap: float) -> list[tuple[int, int]]:
    """Cover a length with `count` spans of one size, each sharing a part with the next one."""
    span_px = min(size_px, int(np.ceil(size_px / (count - (count - 1) * overlap))))
    starts = np.linspace(0, size_px - span_px, count).round().astype(int)
    return [(int(start), span_px) for start in starts]


def _planes(picture: ByteArray, settings: OnnxSettings) -> Tensor:
    """Bring a (h, w, 3) picture, blue first, to the numbers that the network takes."""
    if settings.colours == "grey":
        coloured = np.asarray(cv2.cvtColor(picture, cv2.COLOR_BGR2GRAY))[:, :, None]
    else:
        coloured = picture if settings.colours == "bgr" else picture[:, :, ::-1]
    values = (coloured.astype(np.float32) * np.float32(settings.scale) - np.float32(settings.mean)) / np.float32(
        settings.deviation
    )
    return np.ascontiguousarray(values.transpose(2, 0, 1)[None])
