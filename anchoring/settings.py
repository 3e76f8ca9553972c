"""How long, how far and how fast? The numbers of anchoring."""

import math
from dataclasses import dataclass, fields

from anchoring.errors import AnchoringError


@dataclass(frozen=True, slots=True, kw_only=True)
class AnchoringSettings:
    """Hold every tuned number of anchoring.

    Each is there "by reason" unless it says what it was measured on; none was swept, and the range in which it works is
    not known but for the defaults of the shipped scenes.

    Attributes
    ----------
    establish_us : how long a vision object must be seen, on the road and plausible before it becomes a car; shadows and
        pieces of vehicles live for some frames.
    reestablish_us : how long a vision object must fit a lost car before it is taken for it: three frames at 25 Hz.
    contested_us : how much longer a vision object waits if it fits a lost car, but not clearly.
    predict_us : how long a car that is not seen is given out as predicted; at 25 m/s its place is then off by metres.
    survive_us : how long its symbol waits for it, at least ``predict_us``; a bridge of 20 m hides a slow car that long.
    edge_loss_us : how long a car may be unseen at the edge of the view before it counts as gone.
    off_road_us, odd_size_us : how long a car may be off the road, or of an impossible size, as merged vehicles are.
    road_tolerance_m : how far outside the lanes still is on the road; maps are a metre off.
    jump_m, jump_growth_mps2 : a vision object further from where it was expected is another thing; grows with time.
    swap_us : how long a turn, a change of speed or of size beyond all reason is tolerated as noise (size: five times).
    swap_m, swap_cost : a body so far from where it was expected is compared with others, and refuted if it fits another
        one better by so much.
    slip_us : a track slips on to another vehicle when that one's own track is lost, not longer after than this.
    turn_rad : nobody turns further within a second, above ``turn_mps``.
    acceleration_mps2, speed_slack_mps : nobody changes speed faster: full braking, and noise of a speed.
    size_ratio : nobody grows or shrinks by more.
    snapshot_us : how far apart snapshots of a body are; exchanged tracks show within two of them.
    oldest_us : older snapshots say nothing about what is possible since.
    settled_us : younger links have no sure speed yet, as its filter needs some frames.
    size_samples, eager_samples, size_period_us : a size is the median of the last samples, taken at each frame until it
        can be relied on, and then once a period.
    class_sigmas : a size this many standard deviations off (both together) belongs to no class.
    least_length_m, most_length_m, least_width_m, most_width_m : of a vehicle; 25.25 m is the longest truck.
    along_m, along_mps, along_mps2 : arrival window along the road, growing with the time since a car was last seen.
    across_m, across_mps, across_limit_m : the same across the road, up to a limit: the next lane but one.
    same_lane_m : two cars with less between them sideways are in one lane and keep their order.
    fit_heading_rad, fit_speed_mps, fit_acceleration_mps2 : largest differences between a lost car and what is seen.
    fit_slow_mps : below this speed a heading says little.
    fit_length_m, fit_length_share : the same for lengths; the second of the length.
    unmatched_cost, margin_cost : a link may not cost more, and must be cheaper than the next best choice by so much.
    overlap_us : a vision object may be older by this than the last sight of the car that it is.
    leaving_mps : a slower car at the edge of the view may be waiting there.
    lateral_s : a change of lane that has begun goes on for about this long while nobody sees it.
    trial_us : how long a link is a hypothesis: the longest that the usual maintain conditions take to find fault with
        it from its first moment on (off the road, no vehicle's size or speed); jumps and exchanged tracks show sooner.
    settle_us : how long nothing is said after a lost view: as long as it takes a vision object to become a car at all.
    name_back_us : how far the name of a car is dated back to rows of its vision object; what took longer to become a
        car has done something else before, such as parking.
    return_mps : a name that is trusted and comes back is the same car unless it came faster: 250 km/h, on no road here.
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
    slip_us: int = 600_000
    turn_rad: float = math.radians(100.0)
    turn_mps: float = 3.0
    acceleration_mps2: float = 9.0
    speed_slack_mps: float = 4.0
    size_ratio: float = 2.0
    snapshot_us: int = 500_000
    oldest_us: int = 1_200_000
    settled_us: int = 400_000
    size_samples: int = 15
    eager_samples: int = 5
    size_period_us: int = 200_000
    class_sigmas: float = 4.0
    least_length_m: float = 1.0
    most_length_m: float = 26.0
    least_width_m: float = 0.3
    most_width_m: float = 4.5
    along_m: float = 2.5
    along_mps: float = 1.0
    along_mps2: float = 1.0
    across_m: float = 1.5
    across_mps: float = 1.0
    across_limit_m: float = 4.5
    same_lane_m: float = 2.0
    fit_heading_rad: float = 0.6
    fit_speed_mps: float = 4.0
    fit_acceleration_mps2: float = 2.5
    fit_slow_mps: float = 1.5
    fit_length_m: float = 1.5
    fit_length_share: float = 0.25
    unmatched_cost: float = 3.0
    margin_cost: float = 0.5
    overlap_us: int = 200_000
    leaving_mps: float = 1.0
    lateral_s: float = 0.5
    trial_us: int = 2_000_000
    settle_us: int = 400_000
    name_back_us: int = 2_000_000
    return_mps: float = 70.0

    def __post_init__(self) -> None:
        """Refuse what cannot be meant."""
        for field in fields(self):
            value = getattr(self, field.name)
            if not (math.isfinite(value) and value >= 0):
                raise AnchoringError(f"anchoring settings: {field.name} must be a number >= 0, got {value!r}")
        if not 1 <= self.eager_samples <= self.size_samples:
            raise AnchoringError(
                f"anchoring settings: eager_samples must be from 1 to size_samples ({self.size_samples!r}), "
                f"got {self.eager_samples!r}"
            )
        if self.survive_us < self.predict_us:
            raise AnchoringError(
                f"anchoring settings: survive_us must be at least predict_us ({self.predict_us!r}), "
                f"got {self.survive_us!r}"
            )
