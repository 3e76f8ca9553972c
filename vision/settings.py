"""Which constants does vision use? One place, in metres, seconds and grey levels, with the reason for each default."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class VisionSettings:
    """Constants of the fixed-camera pipeline.

    Attributes
    ----------
    car_width_m, car_width_cells : a raster cell is their quotient, or what the camera gives if that is coarser.
    road_margin_m : how far around the road polygons is watched too; cars lean over the line.
    max_metres_per_pixel : ground seen more coarsely than this is left out.
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
    strong_ratio : a blob must hold a cell this many times over its threshold (hysteresis against noise).
    chroma_weight : how much one level of chroma counts against one level of luma.
    min_area_m2 : smaller blobs are noise.
    min_length_m : shorter blobs start no track, unless the view edge cuts them: a motorcycle is longer.
    max_length_m, max_width_m : a blob beyond these starts no track; cars that enter side by side still do.
    split_share : part of its own area that a predicted box must own in a blob to claim it.
    position_noise_m : standard deviation of a detected centre, along and across the same.
    clipped_noise_m : the same, along, for a box cut by the view edge.
    usual_length_m, usual_width_m, usual_height_m : assumed of an object where they cannot be seen.
    acceleration_along_mps2, acceleration_across_mps2 : motion noise, as the change of speed within one second.
    gate_sigmas : Mahalanobis distance up to which a detection may be assigned to a track.
    max_speed_mps : nothing on the road is faster; limits how far a new track may jump between two frames.
    confirm_hits : detections needed before a track is shown.
    confirm_shift_m : how far a standing blob must move to be shown at once; otherwise it must last `standing_us`.
    standing_us : age at which an unmoved track is shown, if the picture and not the background has its outline.
    coast_us : how long a track lives on prediction alone; longer gaps are anchoring's work.
    tentative_us : the same before confirmation.
    heading_speed_mps : below this speed the heading is kept.
    """

    car_width_m: float = 1.8
    car_width_cells: float = 6.0
    road_margin_m: float = 1.0
    max_metres_per_pixel: float = 0.9
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
    strong_ratio: float = 1.5
    chroma_weight: float = 2.0
    min_area_m2: float = 1.2
    min_length_m: float = 1.6
    max_length_m: float = 30.0
    max_width_m: float = 8.0
    split_share: float = 0.3
    position_noise_m: float = 0.3
    clipped_noise_m: float = 1.5
    usual_length_m: float = 4.5
    usual_width_m: float = 1.8
    usual_height_m: float = 1.5
    acceleration_along_mps2: float = 3.0
    acceleration_across_mps2: float = 1.0
    gate_sigmas: float = 4.0
    max_speed_mps: float = 45.0
    confirm_hits: int = 4
    confirm_shift_m: float = 1.0
    standing_us: int = 600_000
    coast_us: int = 1_000_000
    tentative_us: int = 250_000
    heading_speed_mps: float = 1.5
