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
    contested_us : how much longer a vision object waits if it fits a lost car, but not clearly.
    predict_us : how long a car that is not seen is given out as predicted; at 25 m/s its place is then off by metres.
    survive_us : how long its symbol waits for it, at least ``predict_us``; a bridge of 20 m hides a slow car that long.
    edge_loss_us : how long a car may be unseen at the edge of the view before it counts as gone.
    off_road_us, odd_size_us : how long a car may be off the road, or of an impossible size, as merged vehicles are.
    road_tolerance_m : how far outside the lanes still is on the road; maps are a metre off.
    jump_m, jump_growth_mps2, jump_sigmas : a vision object further from where it was expected is another thing; grows
        with time, and by so many standard deviations of the place where tracking says how well it knows it.
    swap_us : how long a turn, a change of speed or of size beyond all reason is tolerated as noise (size: five times).
    swap_m : a body so far from where it was expected is compared with others, and refuted if another one explains it
        better by ``margin_nats``.
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
    way_m, pace_mps : how badly the way and the change of speed between two ends of tracks are measured, a standard
        deviation.
    calm_mps, lively_mps : how much the speed of a car wanders in a second: of one that drives on, and of one that
        brakes for others or drives off. Half of the lost ones are taken for either.
    side_m, side_mps, side_share, side_limit_m : how far to the side it has gone, a standard deviation: measured badly,
        a second, a metre of the way, and at most, which is a lane.
    turn_slack_rad, sideways_mps2 : nobody turns further than this and what tyres hold at the mean speed.
    stop_share, junction_stop_share : of the cars that nobody sees for a while some stop, on one road and between two.
    change_share : of those that go from road to road some change lanes at it.
    haste_mps, haste_share : nobody drives faster meanwhile than the fastest of this and its speeds, times a share.
    backwards_m : how far back a place may be measured.
    same_lane_m, pass_nats : who went into one place first comes out of it first, in one lane; another order is less
        likely by so much (e^2 is 7 to 1).
    same_length_m, same_width_m : how much two tracks of one car differ in size, a standard deviation.
    odd_share, other_share : of the sizes some are measured badly altogether, and of new cars some are of any size.
    edge_births_per_m, births_per_m : how many new cars begin in a metre of road at the edge of the view and elsewhere,
        for each lost one that begins again.
    edge_m : how wide that edge is, and how far apart cars go into one hidden place.
    outline_slack_m : how far outside of all that was seen is still inside.
    margin_nats : a link must be so much likelier than every other choice (e^1.5 is 4 to 1).
    decided_nats : a link is validated if it never was less likelier than all else than this (e^3 is 20 to 1); in the
        lost tracks of seeds 1 to 5 one in four of those below is wrong, and one in seven hundred of those above.
    open_us : how long after a track began its link may be given up for a better one, and waits for its verdict.
    overlap_us : a vision object may be older by this than the last sight of the car that it is.
    leaving_mps : a slower car at the edge of the view may be waiting there.
    lateral_s : a change of lane that has begun goes on for about this long while nobody sees it.
    trial_us : how long a link is a hypothesis that nothing else may take the place of: the longest that the usual
        maintain conditions take to find fault with it from its first moment on (off the road, no vehicle's size or
        speed); jumps and exchanged tracks show sooner.
    moved_lengths, moved_sigmas : a vision object has moved when it is so many of its lengths, and standard deviations
        of its place, ahead of where it began: what stands may be a ghost, or have its front where its rear is guessed,
        and one that was seen in part at first is shifted by nearly its length when it is seen whole.
    grown_us, recent_us, coarse_lengths : a car is surer the longer it is known, the more of the last moments it was
        seen, and the longer it is in units of its noise (which grows with the size of a pixel on the ground): one less
        the exponentials of these. By reason; what they are worth together is fitted (docs/evaluation.md).
    settle_us : how long nothing is said after a lost view: as long as it takes a vision object to become a car at all.
    name_back_us : how far the name of a car is dated back to rows of its vision object; what took longer to become a
        car has done something else before, such as parking.
    return_mps : a name that is trusted and comes back is the same car unless it came faster: 250 km/h, on no road here.
    """

    establish_us: int = 400_000
    contested_us: int = 400_000
    predict_us: int = 1_000_000
    survive_us: int = 30_000_000
    edge_loss_us: int = 200_000
    off_road_us: int = 2_000_000
    odd_size_us: int = 2_000_000
    road_tolerance_m: float = 1.0
    jump_m: float = 4.0
    jump_growth_mps2: float = 5.0
    jump_sigmas: float = 3.0
    swap_us: int = 200_000
    swap_m: float = 2.5
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
    way_m: float = 1.0
    pace_mps: float = 0.6
    calm_mps: float = 0.5
    lively_mps: float = 2.0
    side_m: float = 0.5
    side_mps: float = 0.4
    side_share: float = 0.1
    side_limit_m: float = 2.2
    stop_share: float = 0.05
    junction_stop_share: float = 0.15
    change_share: float = 0.1
    haste_mps: float = 14.0
    haste_share: float = 1.3
    backwards_m: float = 4.0
    same_lane_m: float = 2.0
    pass_nats: float = 2.0
    turn_slack_rad: float = 0.6
    sideways_mps2: float = 4.0
    back_rad: float = math.radians(150.0)
    same_length_m: float = 0.5
    same_width_m: float = 0.2
    odd_share: float = 0.02
    other_share: float = 0.2
    edge_births_per_m: float = 0.03
    births_per_m: float = 0.0005
    edge_m: float = 15.0
    outline_slack_m: float = 2.0
    margin_nats: float = 1.5
    decided_nats: float = 3.0
    open_us: int = 4_000_000
    overlap_us: int = 200_000
    leaving_mps: float = 1.0
    lateral_s: float = 0.5
    trial_us: int = 2_000_000
    moved_lengths: float = 1.0
    moved_sigmas: float = 3.0
    grown_us: int = 500_000
    recent_us: int = 2_000_000
    coarse_lengths: float = 2.0
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
