"""From where does the sun shine, how does its strength change, and where do clouds darken the scene?

Soft shadows of clouds drift over the ground with the wind.
"""

import math
from dataclasses import dataclass, replace
from typing import Literal, get_args

import cv2
import numpy as np
from numpy.typing import NDArray

from data_gen.drawing.ground.paint import fractal_noise, ground_at
from data_gen.drawing.view import CameraView
from data_gen.errors import DataGenError
from data_gen.simulation.states import FloatArray

Weather = Literal["sunny", "clouds", "overcast"]

_PERIOD_S = (55.0, 19.0)
_STRENGTH = (0.03, 0.01)
_SKY_LIGHT = 0.55
"""Light on a wall in the shade, as a part of that on a wall in full sun."""


@dataclass(frozen=True, slots=True)
class Sun:
    """A sun that stands still for the length of a clip, behind thin, slowly drifting haze."""

    shadow_rad: float
    """Direction in which shadows fall."""
    shadow_slope: float
    """Metres of shadow per metre of height."""
    phases_rad: tuple[float, float]
    is_hidden: bool = False
    """Behind a closed layer of cloud: nothing casts a shadow."""

    def shadow_offset_m(self, height_m: float) -> tuple[float, float]:
        """Tell where on the ground the shadow of a point at a height lies: east and north of its foot."""
        reach_m = self.shadow_slope * height_m
        return reach_m * math.cos(self.shadow_rad), reach_m * math.sin(self.shadow_rad)

    def gain(self, t_us: int) -> float:
        """Tell how bright the scene is at a time, about 1; it drifts by some 4 % within a minute."""
        waves = zip(_STRENGTH, _PERIOD_S, self.phases_rad, strict=True)
        return 1 + sum(
            strength * math.sin(math.tau * t_us / (period_s * 1_000_000) + phase) for strength, period_s, phase in waves
        )

    def wall_light(self, outward: FloatArray) -> float:
        """Tell how bright an upright wall is, 0.55 to 1, by the direction (2,) in which it looks."""
        return float(self.wall_lights(outward[None])[0])

    def wall_lights(self, outward: FloatArray) -> FloatArray:
        """Tell how bright upright walls are, by the directions (n, 2) in which they look."""
        if self.is_hidden:
            return np.full(len(outward), 0.8)
        facing = -(outward[:, 0] * math.cos(self.shadow_rad) + outward[:, 1] * math.sin(self.shadow_rad))
        return np.asarray(_SKY_LIGHT + (1 - _SKY_LIGHT) * np.maximum(0.0, facing), dtype=np.float64)


def draw_sun(rng: np.random.Generator, weather: Weather = "sunny") -> Sun:
    """Draw a sun that stands 40 to 60 degrees high, anywhere around.

    Parameters
    ----------
    rng : source of the choice.
    weather : "overcast" hides the sun; the other choices stay the same.

    Returns
    -------
    The sun.

    Raises
    ------
    DataGenError
        If there is no such weather.
    """
    check_weather(weather)
    elevation_rad = math.radians(rng.uniform(40, 60))
    sun = Sun(
        shadow_rad=float(rng.uniform(-math.pi, math.pi)),
        shadow_slope=1 / math.tan(elevation_rad),
        phases_rad=(float(rng.uniform(0, math.tau)), float(rng.uniform(0, math.tau))),
    )
    return replace(sun, is_hidden=weather == "overcast")


def check_weather(weather: str) -> None:
    """Refuse, with a DataGenError, a weather that there is not."""
    if weather not in get_args(Weather):
        raise DataGenError(f"weather: expected one of {', '.join(get_args(Weather))}, got {weather!r}")


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
        ground_m = ground_at(view.camera, columns, rows)
        cells = np.nan_to_num(ground_m - self._wind_mps * (t_us / 1e6)) / _CELL_M % len(self._tile)
        maps = cells.astype(np.float32)
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
