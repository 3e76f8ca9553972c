"""How fast does what a network has just seen move? By the flow of the picture since a frame shortly before.

A network that looks four times a second says where vehicles are, and nothing of their speeds before it has seen each
twice. In dense traffic the second look has the next vehicle where the first had this one; what moves by a few pixels
from one frame to the next cannot be mistaken. Points in each box are followed back to the frame before (pyramidal
Lucas-Kanade; Bouguet, 2001). What moves on a road towards a camera, or away, grows or shrinks in the picture: the shift
and growth that most points of a box agree on tell how far its foot has moved.
"""

from __future__ import annotations

import cv2
import numpy as np

from vision.networks.box_detector import ImageBoxes, Shifts
from vision.networks.settings import NetworkSettings
from vision.objects import BoolArray, ByteArray, FloatArray
from vision.video.frame import Frame

# Where points lie in a box, as parts of its width and height: its upper corners show what is behind.
COLUMNS = (0.2, 0.35, 0.5, 0.65, 0.8)
ROWS = (0.3, 0.45, 0.6, 0.75, 0.9)
GRID = np.stack(np.meshgrid(COLUMNS, ROWS), axis=-1).reshape(-1, 2)
WINDOW_PX = (15, 15)
LEVELS = 4
# Around all boxes, this is as far as anything is looked for.
MARGIN_PX = 64
# A point goes with something else if it is off the median by more than so many median distances, and so many pixels.
ODD_MEDIANS = 4.0
ODD_PX = 0.3
# A picture is another one if a block of so many pixels is other by so many levels in the mean, as where a car drives
# it is by some fifty. The same one, coded once more, differs by up to seven.
BLOCK_PX = 8
OTHER_LEVELS = 8


class BoxFlow:
    """Measures how far boxes have moved in the picture of a camera that stands.

    Parameters
    ----------
    settings : over which time, and how well points are followed.
    """

    def __init__(self, settings: NetworkSettings) -> None:
        self._settings = settings
        self._before: Frame | None = None
        self._latest: Frame | None = None
        self._repeats = False

    def keep(self, instant: Frame, next_us: int) -> None:
        """Keep the first frame that is near enough to the next look, at `next_us`."""
        self._compare(instant)
        if self._before is None and next_us - instant.t_us <= self._settings.flow_us:
            self._before = instant

    def shifts(self, instant: Frame, boxes: ImageBoxes) -> Shifts | None:
        """Measure how far boxes of a frame have moved since the frame that was kept for this look.

        Returns
        -------
        None if no frame was kept, or frames are missing since then, or pictures have repeated since the look before:
        cameras may send fewer than they say, and nobody knows when these were taken.
        """
        self._compare(instant)
        before, repeats = self._before, self._repeats
        self._before, self._repeats = None, False
        if before is None or repeats or len(boxes) == 0:
            return None
        over_us = instant.t_us - before.t_us
        if over_us > 2 * self._settings.flow_us:
            return None
        shift_px, noise_px = foot_shifts(before.luma, instant.luma, boxes.bounds_px())
        noise_px = np.hypot(noise_px, self._settings.flow_noise_px)
        return Shifts(shift_px, noise_px, np.full(len(boxes), over_us / 1_000_000))

    def _compare(self, instant: Frame) -> None:
        latest, self._latest = self._latest, instant
        if latest is not None:
            self._repeats |= not _is_other(latest.luma, instant.luma)


def _is_other(before: ByteArray, now: ByteArray) -> bool:
    """Tell whether a picture is another one of the same size: where anything drives, each is."""
    if before.shape != now.shape:
        return False
    height, width = (max(1, size // BLOCK_PX) for size in now.shape)
    change = cv2.resize(cv2.absdiff(before, now), (width, height), interpolation=cv2.INTER_AREA)
    return bool(change.max() >= OTHER_LEVELS)


def foot_shifts(before: ByteArray, now: ByteArray, bounds_px: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Measure how far the feet of boxes have moved from one picture to the next.

    Parameters
    ----------
    before, now : (h, w) of the same size.
    bounds_px : (n, 4) left, top, right, bottom in the later one; at least one.

    Returns
    -------
    (n, 2) shifts of the middle of the lower edge, nan where hardly any points agree; and (n,) how far, by coordinate,
    the points that agree are off what they agree on.

    Examples
    --------
    >>> now = np.random.default_rng(1).integers(0, 256, (60, 80), np.uint8)
    >>> now = cv2.GaussianBlur(now, (0, 0), 2.0)
    >>> shift_px, _ = foot_shifts(np.roll(now, (-2, 3), axis=(0, 1)), now, np.array([[20.0, 20.0, 50.0, 40.0]]))
    >>> shift_px.round(1).tolist()
    [[-3.0, 2.0]]
    """
    last_px = np.array(now.shape[::-1]) - 1.0
    low_px, high_px = np.clip(bounds_px[:, :2], 0.0, last_px), np.clip(bounds_px[:, 2:], 0.0, last_px)
    points_px = low_px[:, None] + GRID * (high_px - low_px)[:, None]
    moved_px, is_found = _followed(before, now, points_px)
    weight = (is_found & _agree(moved_px)).astype(np.float64)
    is_known = weight.sum(axis=1) >= len(GRID) / 2
    weight /= np.maximum(weight.sum(axis=1), 1.0)[:, None]
    middle_px, mean_px = (np.einsum("nk,nki->ni", weight, one) for one in (points_px, moved_px))
    away_px, rest_px = points_px - middle_px[:, None], moved_px - mean_px[:, None]
    growth = np.einsum("nk,nki,nki->n", weight, away_px, rest_px)
    growth /= np.maximum(np.einsum("nk,nki,nki->n", weight, away_px, away_px), 1e-9)
    off_px = rest_px - growth[:, None, None] * away_px
    noise_px = np.sqrt(np.einsum("nk,nki,nki->n", weight, off_px, off_px) / 2)
    foot_px = np.column_stack([bounds_px[:, [0, 2]].mean(axis=1), bounds_px[:, 3]])
    shift_px = mean_px + growth[:, None] * (foot_px - middle_px)
    return np.where(is_known[:, None], shift_px, np.nan), noise_px


def _followed(before: ByteArray, now: ByteArray, points_px: FloatArray) -> tuple[FloatArray, BoolArray]:
    """Say how far points, (n, k, 2), have come since the picture before, and which of them were found there, (n, k)."""
    flat = points_px.reshape(-1, 2)
    left, top = np.maximum(np.floor(flat.min(axis=0)).astype(int) - MARGIN_PX, 0)
    right, bottom = np.ceil(flat.max(axis=0)).astype(int) + MARGIN_PX
    part = np.s_[top:bottom, left:right]
    start = (flat - (left, top)).astype(np.float32)
    found, status, _ = cv2.calcOpticalFlowPyrLK(
        now[part], before[part], start, np.empty_like(start), winSize=WINDOW_PX, maxLevel=LEVELS
    )
    return (start - found).reshape(points_px.shape).astype(np.float64), status.reshape(points_px.shape[:2]) > 0


def _agree(moved_px: FloatArray) -> BoolArray:
    """Tell which points, (n, k, 2), have come about as far as most of those of their box."""
    off_px = np.abs(moved_px - np.median(moved_px, axis=1, keepdims=True))
    usual_px = np.median(off_px, axis=1, keepdims=True)
    return np.asarray((off_px <= np.maximum(ODD_MEDIANS * usual_px, ODD_PX)).all(axis=2))
