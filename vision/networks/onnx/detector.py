"""Which vehicles does a trained network see? Pictures into its input, its numbers back to boxes in the picture.

The network is one of the two that come along (`weights/`) or the user's own. The picture is scaled into the input with
its shape kept (letterbox); large pictures may be cut into tiles, so that vehicles far away keep enough pixels. Or the
part of the picture where they are far away is looked at once more, enlarged.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np

from vision.errors import VisionError
from vision.networks.box_detector import ImageBoxes, whole_boxes
from vision.networks.onnx.closer_look import CloserLook
from vision.networks.onnx.network import Network
from vision.networks.onnx.network_input import PADDING, Letterbox, Part, Tile, checked_part, cut_tiles, picture_scale
from vision.networks.onnx.output import decode
from vision.networks.onnx.settings import OnnxSettings
from vision.objects import ByteArray, Tensor
from vision.video.frame import Frame


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
        self._tiles = tuple(cut_tiles(checked_part(part_px, image_size_px), settings))
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
