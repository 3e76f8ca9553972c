"""What is assumed of boxes that somebody else drew, and of the vehicles in them?"""

from dataclasses import dataclass, field


@dataclass(frozen=True, slots=True)
class UsualSize:
    """How large vehicles of a class usually are: mean and standard deviation."""

    length_m: float
    width_m: float
    height_m: float
    length_spread_m: float
    width_spread_m: float
    height_spread_m: float


@dataclass(frozen=True, slots=True)
class UsualSizes:
    """What may be assumed of a vehicle before it has been measured; the names are the words for classes."""

    car: UsualSize = UsualSize(4.5, 1.8, 1.5, 0.5, 0.15, 0.15)
    van: UsualSize = UsualSize(5.4, 2.0, 2.2, 0.7, 0.15, 0.4)
    truck: UsualSize = UsualSize(10.0, 2.5, 3.3, 4.0, 0.2, 0.6)
    bus: UsualSize = UsualSize(12.0, 2.5, 3.1, 2.5, 0.2, 0.4)
    motorcycle: UsualSize = UsualSize(2.2, 0.8, 1.4, 0.3, 0.2, 0.3)
    unknown: UsualSize = UsualSize(4.8, 1.9, 1.6, 1.5, 0.3, 0.4)


@dataclass(frozen=True, slots=True)
class NetworkSettings:
    """Tuned numbers for boxes of networks and files; each comment says what it rests on."""

    # By class; they fill in what a box cannot tell, the more the less the view tells.
    usual_sizes: UsualSizes = field(default_factory=UsualSizes)
    # The drawn edges of a box are off by about this much, and by this part of its size, unless a recipe says it.
    edge_noise_px: float = 1.0
    edge_noise_share: float = 0.03
    # A box this near to the edge of the picture, or nearer than its own noise, is taken to go on beyond it.
    cut_px: float = 2.0
    # No vehicle is shorter or narrower than this, whatever a box says.
    smallest_m: float = 0.3
    # A direction is clear if it explains a box within so many sigmas, and better than the one across it by so many.
    explained_sigmas: float = 3.0
    better_sigmas: float = 2.0
    # How often a network looks: what it tells, that this is a vehicle, does not change. A tentative track lives for
    # 0.25 s, so that at this rate it outlives one look that misses it.
    looks_hz: float = 4.0
    # A look is evidence for a vehicle as so many sightings by motion are, and against what it does not see; of a look
    # alone its score times as many.
    look_evidence: float = 2.0
    # Points are followed from a look to the first frame so near before it. At 12.5 frames a second that is the one
    # before; of more, one farther back, since what is measured per frame gets worse with their number.
    flow_us: int = 100_000
    # How well they are followed, and by which part of the speed the growth of a vehicle misleads.
    flow_noise_px: float = 0.12
    flow_share: float = 0.05
    # After a gap in a file, that long is told of as empty: enough for all tracks to end.
    told_gap_us: int = 2_000_000
    # What a file of a single moment says of the distance to the next one: that of frames of 25 Hz.
    usual_step_us: int = 40_000
