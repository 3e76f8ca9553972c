"""From where does the sun shine, and how does its strength change?"""

import math
from dataclasses import dataclass

import numpy as np

_PERIOD_S = (55.0, 19.0)
_STRENGTH = (0.03, 0.01)


@dataclass(frozen=True, slots=True)
class Sun:
    """A sun that stands still for the length of a clip, behind thin, slowly drifting haze."""

    shadow_rad: float
    """Direction in which shadows fall."""
    shadow_slope: float
    """Metres of shadow per metre of height."""
    phases_rad: tuple[float, float]

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


def draw_sun(rng: np.random.Generator) -> Sun:
    """Draw a sun that stands 40 to 60 degrees high, anywhere around.

    Parameters
    ----------
    rng : source of the choice.

    Returns
    -------
    The sun.
    """
    elevation_rad = math.radians(rng.uniform(40, 60))
    return Sun(
        shadow_rad=float(rng.uniform(-math.pi, math.pi)),
        shadow_slope=1 / math.tan(elevation_rad),
        phases_rad=(float(rng.uniform(0, math.tau)), float(rng.uniform(0, math.tau))),
    )
