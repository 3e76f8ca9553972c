"""Which numbers does vision decide by? A tree with a branch for each room; in metres, seconds and grey levels."""

import math
from dataclasses import dataclass, field, fields, is_dataclass
from typing import Any

from vision.background.settings import BackgroundSettings
from vision.detection.settings import DetectionSettings
from vision.errors import VisionError
from vision.networks.settings import NetworkSettings
from vision.registration.settings import RegistrationSettings
from vision.road.settings import RoadSettings
from vision.tracking.settings import TrackingSettings


@dataclass(frozen=True, slots=True)
class VisionSettings:
    """Tuned numbers that several rooms share, and those of each room; each comment says what it rests on.

    Raises
    ------
    VisionError
        If a number anywhere in the tree is not finite, or not above 0 (or its `least`, where it may be less).
    """

    # A cell of the road raster is their quotient, or what the camera gives if that is coarser: a narrow car of 1.8 m
    # is then six cells wide, enough for its outline after smoothing.
    car_width_m: float = 1.8
    car_width_cells: float = 6.0
    # How far around the road polygons is watched too; cars lean over the line.
    road_margin_m: float = field(default=1.0, metadata={"least": 0})
    # Ground seen more coarsely than this is left out: a car is then two pixels wide. By its warmth, a car as wide as
    # one or two pixels still stands out.
    max_metres_per_pixel: float = 0.9
    thermal_metres_per_pixel: float = 1.5
    # Assumed of an object where they cannot be seen: the usual car.
    usual_length_m: float = 4.5
    usual_width_m: float = 1.8
    usual_height_m: float = 1.5
    # Around tracks, when they are told to who follows a moving camera: shadows, and what a vehicle drives in a frame.
    outline_margin_m: float = 2.0
    # A lost view is passed over if shorter, as dropped frames are that nobody notices.
    bridged_us: int = 300_000

    background: BackgroundSettings = field(default_factory=BackgroundSettings)
    road: RoadSettings = field(default_factory=RoadSettings)
    detection: DetectionSettings = field(default_factory=DetectionSettings)
    networks: NetworkSettings = field(default_factory=NetworkSettings)
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
