"""Which constants does vision use? One place, in metres, seconds and grey levels, with the reason for each default."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, fields, is_dataclass
from typing import Any

from vision.background.settings import BackgroundSettings
from vision.errors import VisionError
from vision.registration.settings import RegistrationSettings
from vision.road.settings import RoadSettings
from vision.tracking.settings import TrackingSettings


@dataclass(frozen=True, slots=True)
class VisionSettings:
    """Constants of the fixed-camera pipeline.

    Attributes
    ----------
    car_width_m, car_width_cells : a raster cell is their quotient, or what the camera gives if that is coarser.
    road_margin_m : how far around the road polygons is watched too; cars lean over the line.
    max_metres_per_pixel : ground seen more coarsely than this is left out.
    strong_ratio : a blob must hold a cell this many times over its threshold (hysteresis against noise).
    min_area_m2 : smaller blobs are noise.
    split_share : part of its own area that a predicted box must own in a blob to claim it.
    position_noise_m : standard deviation of a detected centre, along and across the same.
    usual_length_m, usual_width_m, usual_height_m : assumed of an object where they cannot be seen.
    background, road, registration, tracking : of these rooms.
    """

    car_width_m: float = 1.8
    car_width_cells: float = 6.0
    road_margin_m: float = field(default=1.0, metadata={"least": 0})
    max_metres_per_pixel: float = 0.9
    strong_ratio: float = 1.5
    min_area_m2: float = 1.2
    split_share: float = 0.3
    position_noise_m: float = 0.3
    usual_length_m: float = 4.5
    usual_width_m: float = 1.8
    usual_height_m: float = 1.5
    background: BackgroundSettings = field(default_factory=BackgroundSettings)
    road: RoadSettings = field(default_factory=RoadSettings)
    registration: RegistrationSettings = field(default_factory=RegistrationSettings)
    tracking: TrackingSettings = field(default_factory=TrackingSettings)

    def __post_init__(self) -> None:
        """Refuse what cannot be meant."""
        _check(self)


def _check(settings: Any, room: str = "") -> None:  # Any: there is no type for dataclasses
    """Refuse, in all rooms, numbers that are not finite and above 0, or the `least` of a field's metadata."""
    for one in fields(settings):
        value, name, least = getattr(settings, one.name), room + one.name, one.metadata.get("least")
        if is_dataclass(value):
            _check(value, f"{name}.")
        elif not math.isfinite(value) or (value <= 0 if least is None else value < least):
            words = "above 0" if least is None else f">= {least}"
            raise VisionError(f"vision settings: {name} must be a number {words}, got {value!r}")
