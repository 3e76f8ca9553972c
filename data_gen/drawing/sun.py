"""From where does the sun shine, and how does its strength change?"""

import math
from dataclasses import dataclass, replace
from typing import Literal, get_args

import numpy as np

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
        if self.is_hidden:
            return 0.8
        facing = -(outward[0] * math.cos(self.shadow_rad) + outward[1] * math.sin(self.shadow_rad))
        return _SKY_LIGHT + (1 - _SKY_LIGHT) * max(0.0, float(facing))


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
