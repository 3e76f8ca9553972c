"""A textured ground with cars, seen by a camera that moves: frames for tests of registration and of moving cameras."""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np
from numpy.typing import NDArray

from tests.vision.support import FloatArray, make_boxes, make_frame
from vision.registration.key_frames import KeyFrame, corners_of
from vision.registration.settings import RegistrationSettings
from vision.video.frames import Frame

SIZE = (320, 180)
METRES_PER_PIXEL = 0.47
GROUND_PX = (640, 420)
ROAD = np.array([[-20.0, 45.0], [320.0, 45.0], [320.0, 56.0], [-20.0, 56.0]])
Car = tuple[float, float, float, float, float]


class MovingWorld:
    """Fields of smooth noise and a smooth grey road; ground (0, 0) m lies 60 m inside the painted ground."""

    def __init__(self, seed: int = 3) -> None:
        rng = np.random.default_rng(seed)
        self._rng = rng
        width, height = GROUND_PX
        field = 110 + cv2.GaussianBlur(rng.normal(0, 160, (height, width)), (0, 0), 2.2)
        self.ground_from_paint = np.array([[0.47, 0, -60.0], [0, -0.47, 0.47 * height - 40], [0, 0, 1]])
        self._paint_from_ground = np.linalg.inv(self.ground_from_paint)
        road = cv2.fillPoly(np.zeros((height, width), np.uint8), [self._to_paint(ROAD)], (1,))
        grey = 100 + cv2.GaussianBlur(rng.normal(0, 20, (height, width)), (0, 0), 1.5)
        self._paint = np.clip(np.where(road > 0, grey, field), 20, 235).astype(np.float32)

    def frame(self, matrix: FloatArray, k: int, cars: Sequence[Car] = (), levels: Sequence[float] = ()) -> Frame:
        """Show the world from a view, given as pixel_from_ground."""
        paint = self._paint.copy()
        for corners, level in zip(make_boxes(list(cars)).corners(), levels, strict=True):
            places = np.rint(self._exact(corners) * 16).astype(np.int32)
            cv2.fillPoly(paint, [places], (level,), lineType=cv2.LINE_AA, shift=4)
        luma = cv2.warpPerspective(paint, matrix @ self.ground_from_paint, SIZE, flags=cv2.INTER_LINEAR)
        return make_frame(np.clip(luma + self._rng.normal(0, 1.2, luma.shape), 0, 255), index=k, t_us=40_000 * k)

    def _exact(self, points_m: FloatArray) -> FloatArray:
        mapped = np.column_stack([points_m, np.ones(len(points_m))]) @ self._paint_from_ground.T
        return np.asarray(mapped[:, :2])

    def _to_paint(self, points_m: FloatArray) -> NDArray[np.int32]:
        return np.rint(self._exact(points_m)).astype(np.int32)


def view(*, east_m: float = 0.0, north_m: float = 0.0, turn_rad: float = 0.0, zoom: float = 1.0) -> FloatArray:
    """Give the pixel_from_ground of a camera above, turned and zoomed about the middle of the picture."""
    scale = zoom / METRES_PER_PIXEL
    middle_m = np.array([75.0 + east_m, 50.0 + north_m])
    cos, sin = scale * np.cos(turn_rad), scale * np.sin(turn_rad)
    linear = np.array([[cos, -sin], [-sin, -cos]])
    matrix = np.eye(3)
    matrix[:2, :2] = linear
    matrix[:2, 2] = (np.array(SIZE) - 1) / 2 - linear @ middle_m
    return matrix


def drift(k: int) -> FloatArray:
    """Move the view as a drone in light wind does, frame by frame at 25 a second."""
    t = k / 25
    return view(
        east_m=10 * np.sin(0.5 * t),
        north_m=2 * np.sin(0.8 * t),
        turn_rad=0.08 * np.sin(0.45 * t),
        zoom=1 + 0.04 * np.sin(0.6 * t),
    )


def first_key(luma: NDArray[np.uint8], vehicles_px: Sequence[FloatArray], settings: RegistrationSettings) -> KeyFrame:
    """Make a key frame of a half-size picture of the first view."""
    return KeyFrame(luma, view(), corners_of(luma, vehicles_px, settings))
