"""How long, how far and how fast? The numbers of anchoring."""

import math
from dataclasses import dataclass, fields

from anchoring.errors import AnchoringError


@dataclass(frozen=True, slots=True, kw_only=True)
class AnchoringSettings:
    """Hold every number of anchoring.

    Attributes
    ----------
    establish_us : how long a vision object must be seen, on the road and plausible before it becomes a car.
    reestablish_us : how long a vision object must fit a lost car before it is taken for it.
    contested_us : how much longer a vision object waits if it fits a lost car, but not clearly.
    predict_us : how long a car that is not seen is given out as predicted.
    survive_us : how long its symbol waits for it; at least ``predict_us``.
    edge_loss_us : how long a car may be unseen at the edge of the view before it counts as gone.
    off_road_us, odd_size_us : how long a car may be off the road, or of an impossible size.
    road_tolerance_m : how far outside the lanes still is on the road.
    jump_m, jump_growth_mps2 : a vision object further from where it was expected is another thing; grows with time.
    swap_us : how long a turn, a change of speed or of size beyond all reason is tolerated as noise (size: five times).
    swap_m, swap_cost : a body so far from where it was expected is compared with others, and refuted if it fits another
        one better by so much.
    turn_rad : nobody turns further within a second, above ``turn_mps``.
    acceleration_mps2, speed_slack_mps : nobody changes speed faster.
    size_ratio : nobody grows or shrinks by more.
    along_m, along_mps, along_mps2 : arrival window along the road, growing with the time since a car was last seen.
    across_m, across_mps, across_limit_m : the same across the road, up to a limit.
    fit_heading_rad, fit_speed_mps, fit_acceleration_mps2 : largest differences between a lost car and what is seen.
    fit_length_m, fit_length_share : the same for lengths; the second of the length.
    unmatched_cost, margin_cost : a link may not cost more, and must be cheaper than the next best choice by so much.
    """

    establish_us: int = 400_000
    reestablish_us: int = 120_000
    contested_us: int = 400_000
    predict_us: int = 1_000_000
    survive_us: int = 3_000_000
    edge_loss_us: int = 200_000
    off_road_us: int = 2_000_000
    odd_size_us: int = 2_000_000
    road_tolerance_m: float = 1.0
    jump_m: float = 4.0
    jump_growth_mps2: float = 5.0
    swap_us: int = 200_000
    swap_m: float = 2.5
    swap_cost: float = 0.75
    turn_rad: float = math.radians(100.0)
    turn_mps: float = 3.0
    acceleration_mps2: float = 9.0
    speed_slack_mps: float = 4.0
    size_ratio: float = 2.0
    along_m: float = 2.5
    along_mps: float = 1.0
    along_mps2: float = 1.0
    across_m: float = 1.5
    across_mps: float = 1.0
    across_limit_m: float = 4.5
    fit_heading_rad: float = 0.6
    fit_speed_mps: float = 4.0
    fit_acceleration_mps2: float = 2.5
    fit_length_m: float = 1.5
    fit_length_share: float = 0.25
    unmatched_cost: float = 3.0
    margin_cost: float = 0.5

    def __post_init__(self) -> None:
        """Refuse what cannot be meant."""
        for field in fields(self):
            value = getattr(self, field.name)
            if not (math.isfinite(value) and value >= 0):
                raise AnchoringError(f"anchoring settings: {field.name} must be a number >= 0, got {value!r}")
        if self.survive_us < self.predict_us:
            raise AnchoringError(
                f"anchoring settings: survive_us must be at least predict_us ({self.predict_us!r}), "
                f"got {self.survive_us!r}"
            )
