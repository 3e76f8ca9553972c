"""Where do clouds darken the scene? Soft shadows of clouds that drift over the ground with the wind."""

import math

import cv2
import numpy as np
from numpy.typing import NDArray

from data_gen.drawing.ground.paint import fractal_noise
from data_gen.drawing.view import CameraView

_TILE_PX = 256
_CELL_M = 6.0
"""Ground under a pixel of the tile; the pattern repeats after 1.5 km."""
_LARGEST_M = 220.0
_DARKEST = 0.66
_WIND_MPS = (5.0, 11.0)
_STEP_PX = 16
"""The shadow's edge is tens of metres wide: one value for so many pixels is enough."""


class Clouds:
    """Scattered clouds; they cover about half of the sky.

    Parameters
    ----------
    rng : source of pattern and wind.
    """

    def __init__(self, rng: np.random.Generator) -> None:
        noise = fractal_noise(rng, (_TILE_PX, _TILE_PX), largest_px=_LARGEST_M / _CELL_M, octaves=4)
        # Mirrored, so that the tile repeats without a seam.
        tile = np.block([[noise, noise[:, ::-1]], [noise[::-1], noise[::-1, ::-1]]])
        cover = 1 / (1 + np.exp(-4 * tile))
        self._tile = (255 * (1 - (1 - _DARKEST) * cover)).astype(np.float32)
        speed_mps, wind_rad = float(rng.uniform(*_WIND_MPS)), float(rng.uniform(0, math.tau))
        self._wind_mps = np.array([speed_mps * math.cos(wind_rad), speed_mps * math.sin(wind_rad)])

    def light(self, view: CameraView, t_us: int) -> NDArray[np.uint8]:
        """Tell how much light reaches each pixel.

        Parameters
        ----------
        view : the camera.
        t_us : time.

        Returns
        -------
        (h, w): 255 is full sun.
        """
        width_px, height_px = view.size_px
        columns = np.linspace(0, width_px - 1, width_px // _STEP_PX + 2)
        rows = np.linspace(0, height_px - 1, height_px // _STEP_PX + 2)
        x_px, y_px = np.meshgrid(columns, rows)
        ground_m = view.camera.to_ground(np.column_stack((x_px.ravel(), y_px.ravel())))
        cells = np.nan_to_num(ground_m - self._wind_mps * (t_us / 1e6)) / _CELL_M % len(self._tile)
        maps = cells.astype(np.float32).reshape(*x_px.shape, 2)
        coarse = cv2.remap(self._tile, maps[:, :, 0], maps[:, :, 1], cv2.INTER_LINEAR, borderMode=cv2.BORDER_WRAP)
        fine = cv2.resize(coarse, (width_px, height_px), interpolation=cv2.INTER_LINEAR)
        return np.asarray(fine, dtype=np.uint8)


def darken(picture: NDArray[np.uint8], light: NDArray[np.uint8]) -> None:
    """Put a picture under clouds: brightness and colour fade alike.

    Parameters
    ----------
    picture : (h * 3 / 2, w), I420, changed.
    light : (h, w): 255 is full sun.
    """
    height_px, width_px = light.shape
    luma, chroma = picture[:height_px], picture[height_px:].reshape(2, height_px // 2, width_px // 2)
    cv2.multiply(luma, light, dst=luma, scale=1 / 255)
    half = cv2.resize(light, (width_px // 2, height_px // 2), interpolation=cv2.INTER_NEAREST)
    towards_grey = cv2.LUT(half, np.round((255 - np.arange(256)) * (128 / 255)).astype(np.uint8))
    for plane in chroma:
        cv2.multiply(plane, half, dst=plane, scale=1 / 255)
        cv2.add(plane, towards_grey, dst=plane)
