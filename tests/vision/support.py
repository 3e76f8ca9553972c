"""Builders for tests of `vision`: frames, roads and videos made on the spot."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path

import av
import numpy as np
from numpy.typing import NDArray

from vision.road.boxes import Boxes
from vision.video.frames import Frame

FloatArray = NDArray[np.float64]
ByteArray = NDArray[np.uint8]

METRES_PER_PIXEL = 0.47
ROAD_LEVEL = 100


def top_view(size_px: tuple[int, int], metres_per_pixel: float = METRES_PER_PIXEL) -> FloatArray:
    """Homography of a camera straight above, north up, ground (0, 0) in the middle of the lower left pixel."""
    s = metres_per_pixel
    return np.array([[1 / s, 0.0, 0.0], [0.0, -1 / s, size_px[1] - 1.0], [0.0, 0.0, 1.0]])


def whole_view(size_px: tuple[int, int], metres_per_pixel: float = METRES_PER_PIXEL) -> FloatArray:
    """The outline of what `top_view` sees, as a road polygon reaching past the view."""
    east, north = size_px[0] * metres_per_pixel, size_px[1] * metres_per_pixel
    return np.array([[-5.0, -5.0], [east + 5, -5.0], [east + 5, north + 5], [-5.0, north + 5]])


def make_frame(luma: FloatArray | ByteArray, *, index: int = 0, t_us: int = 0, chroma: int = 128) -> Frame:
    """A grey frame from luma values."""
    height, width = luma.shape
    half = np.full(((height + 1) // 2, (width + 1) // 2), chroma, np.uint8)
    return Frame(index, t_us, np.rint(luma).astype(np.uint8), half, half)


def draw_boxes(
    size_px: tuple[int, int],
    boxes: Boxes,
    levels: Sequence[float],
    pixel_from_ground: FloatArray | None = None,
    *,
    ground: FloatArray | float = ROAD_LEVEL,
) -> FloatArray:
    """Paint boxes of ground on a road, every pixel averaged over 8 x 8 points."""
    matrix = top_view(size_px) if pixel_from_ground is None else pixel_from_ground
    fine = (np.arange(8) + 0.5) / 8 - 0.5
    luma = np.broadcast_to(np.asarray(ground, np.float64), (size_px[1], size_px[0])).copy()
    for i, level in enumerate(levels):
        corners = np.column_stack([boxes.corners()[i], np.ones(4)]) @ matrix.T
        pixels = corners[:, :2] / corners[:, 2:]
        left, top = np.clip(np.floor(pixels.min(axis=0)).astype(int), 0, size_px)
        right, bottom = np.clip(np.ceil(pixels.max(axis=0)).astype(int) + 1, 0, size_px)
        if left >= right or top >= bottom:
            continue
        x = (np.arange(left, right)[:, None] + fine).ravel()
        y = (np.arange(top, bottom)[:, None] + fine).ravel()
        points = np.stack([*np.meshgrid(x, y), np.ones((len(y), len(x)))], axis=-1) @ np.linalg.inv(matrix).T
        offset = points[..., :2] / points[..., 2:] - boxes.centre_m[i]
        cos, sin = np.cos(boxes.heading_rad[i]), np.sin(boxes.heading_rad[i])
        along, across = offset[..., 0] * cos + offset[..., 1] * sin, offset[..., 1] * cos - offset[..., 0] * sin
        is_inside = (np.abs(along) <= boxes.length_m[i] / 2) & (np.abs(across) <= boxes.width_m[i] / 2)
        share = is_inside.reshape(bottom - top, 8, right - left, 8).mean(axis=(1, 3))
        window = luma[top:bottom, left:right]
        window += share * (level - window)
    return luma


def make_boxes(rows: Sequence[tuple[float, float, float, float, float]]) -> Boxes:
    """Boxes from rows of east, north, heading, length, width."""
    table = np.array(rows, np.float64).reshape(-1, 5)
    return Boxes(table[:, :2].copy(), table[:, 2].copy(), table[:, 3].copy(), table[:, 4].copy())


def write_video(
    path: Path,
    pictures: Iterable[ByteArray],
    *,
    rate_hz: int = 25,
    times: Sequence[int] | None = None,
    options: dict[str, str] | None = None,
) -> None:
    """Encode grey pictures as H.264, the header in front; `times` are time stamps in frames."""
    # Without B frames, time stamps and packets go side by side.
    codec_options = {"preset": "ultrafast", "g": "10", "bf": "0", "crf": "18"}
    with av.open(str(path), "w", options=options or {"movflags": "faststart"}) as container:
        stream = container.add_stream("libx264", rate=rate_hz, options=codec_options)
        for i, picture in enumerate(pictures):
            if i == 0:
                stream.height, stream.width = picture.shape
                stream.pix_fmt = "yuv420p"
            frame = av.VideoFrame.from_ndarray(picture, format="gray").reformat(format="yuv420p")
            frame.pts = i if times is None else times[i]
            container.mux(stream.encode(frame))
        container.mux(stream.encode(None))


def flip_first_picture(path: Path) -> None:
    """Flip bits in the middle of a video's first picture, so that its decoder gives it up."""
    with av.open(str(path)) as container:
        first = next(container.demux(video=0))
        assert first.pos is not None
        middle = first.pos + first.size // 2
    content = bytearray(path.read_bytes())
    for place in range(middle, middle + 16):
        content[place] ^= 0xFF
    path.write_bytes(content)
