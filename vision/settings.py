"""Which constants does vision use? One place, in metres, seconds and grey levels, with the reason for each default."""

from __future__ import annotations

from dataclasses import dataclass, field

from vision.detection.settings import DetectionSettings
from vision.networks.settings import NetworkSettings
from vision.tracking.settings import TrackingSettings


@dataclass(frozen=True, slots=True)
class VisionSettings:
    """Constants of the fixed-camera pipeline.

    Attributes
    ----------
    car_width_m, car_width_cells : a raster cell is their quotient, or what the camera gives if that is coarser.
    road_margin_m : how far around the road polygons is watched too; cars lean over the line.
    max_metres_per_pixel, thermal_metres_per_pixel : ground seen more coarsely than this is left out; by its warmth, a
        car as wide as one or two pixels still stands out.
    startup_us : how long frames are held before the first background exists; the constant delay of the first result.
    startup_most_us : the same at most: where a vehicle seems to stand all the time, more frames are held.
    startup_samples : how many of the held frames, evenly spread, the first background is read off.
    startup_bytes : memory cap for held frames; start-up ends early when they would not fit.
    background_period_us : how often the background learns.
    background_tau_us : time constant of learning where nothing is seen.
    heal_us : how long a wrong patch of background (a car burned in, road revealed) lives before the present picture
        replaces it.
    lost_fraction, lost_us : a larger part of the road in motion for this long means the view changed: learn it anew.
    least_difference, most_difference : grey levels between which the threshold of a cell lies; in between it is
        `least_difference` and `noise_factor` times what the cell's noise exceeds 1 level.
    chroma_weight : how much one level of chroma counts against one level of luma.
    usual_length_m, usual_width_m, usual_height_m : assumed of an object where they cannot be seen.
    outline_margin_m : around tracks, when they are told to who follows a moving camera: shadows, and what a vehicle
        drives in a frame.
    bridged_us : a lost view is passed over if shorter, as dropped frames are that nobody notices.
    detection, networks, tracking : of the rooms of that name.
    """

    car_width_m: float = 1.8
    car_width_cells: float = 6.0
    road_margin_m: float = 1.0
    max_metres_per_pixel: float = 0.9
    thermal_metres_per_pixel: float = 1.5
    startup_us: int = 5_000_000
    startup_most_us: int = 60_000_000
    startup_samples: int = 61
    startup_bytes: int = 400_000_000
    background_period_us: int = 200_000
    background_tau_us: int = 20_000_000
    heal_us: int = 3_000_000
    lost_fraction: float = 0.6
    lost_us: int = 1_000_000
    least_difference: float = 10.0
    most_difference: float = 40.0
    noise_factor: float = 5.0
    chroma_weight: float = 2.0
    usual_length_m: float = 4.5
    usual_width_m: float = 1.8
    usual_height_m: float = 1.5
    outline_margin_m: float = 2.0
    bridged_us: int = 300_000
    detection: DetectionSettings = field(default_factory=DetectionSettings)
    networks: NetworkSettings = field(default_factory=NetworkSettings)
    tracking: TrackingSettings = field(default_factory=TrackingSettings)
