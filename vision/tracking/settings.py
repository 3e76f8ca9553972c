"""At which distances, speeds and times does tracking decide?"""

from dataclasses import dataclass, field


@dataclass(frozen=True, slots=True)
class TrackingSettings:
    """Tuned numbers of the tracker; each comment says what it rests on."""

    # Motion noise, as the change of speed within one second: drivers brake and steer by no more in ordinary traffic.
    acceleration_along_mps2: float = 3.0
    acceleration_across_mps2: float = 1.0
    # No tyre changes the speed of a vehicle faster; sightings of which an end is hidden may say so.
    grip_mps2: float = 8.0
    # What cars are commonly limited to, 250 km/h; limits how far a new track may jump between two frames.
    max_speed_mps: float = 70.0
    # A track at this part of it that would have to be faster is told of: slower ones seem to jump by bad luck.
    fast_share: float = 0.8
    # Below this speed the heading is kept: the direction of a small velocity is noise.
    heading_speed_mps: float = 1.5
    # The tightest that anybody drives: a small car's circle.
    turn_radius_m: float = 4.0
    # A motion is sure once it is this many standard deviations: a heading follows a low velocity only then (any higher
    # one at once), and a track has moved from where it began.
    sure_sigmas: float = 2.0
    sure_mps: float = 4.0

    # Mahalanobis distance up to which a detection may be assigned to a track.
    gate_sigmas: float = 4.0
    # Standard deviation, along, of the centre of a box that the view edge cuts.
    clipped_noise_m: float = 1.5
    # A shared blob says less about where each of its objects is: factor on the standard deviation.
    divided_noise: float = 2.0
    # A moving object does not come back by more than the noise: this keeps a name from jumping to oncoming traffic.
    reverse_speed_mps: float = 3.0
    # How many standard deviations of a measurement count as noise there, and for how far a track may jump.
    slack_sigmas: float = 3.0
    # Cells inside a predicted box are evidence by themselves: their owner may take them from this many gates away. It
    # happens when two cars that entered as one part, and the box that stood for both has to jump to one of them.
    owner_gates: float = 4.0
    # Boxes that differ from the known size by less than this have simply been seen that way.
    fit_tolerance_m: float = 0.5
    # Relative change of the learned variance in a second of one track's sightings: some seconds double it. It is never
    # taken for wilder than `most_noise` times the claim.
    noise_rate: float = 0.25
    most_noise: float = 9.0

    # What starts a track: a motorcycle is longer than the least; cars that enter side by side are below the most.
    min_length_m: float = 1.6
    max_length_m: float = 30.0
    max_width_m: float = 8.0
    # Velocity of a new track, one standard deviation: along a clearly long blob, across it, and for a blob of no shape.
    new_along_mps: float = 20.0
    new_across_mps: float = 4.0
    clear_elongation: float = 1.8
    # How fast something was seen to move is the speed of something else where it is off by more standard deviations.
    flow_sigmas: float = 3.0
    # Detections needed before a track is shown; this share of them is enough for what was seen for `long_seen_us`.
    confirm_hits: int = 4
    long_seen_us: int = 150_000
    long_seen_share: float = 0.75
    # How far a standing blob must move to be shown at once; otherwise it must last `standing_us`.
    confirm_shift_m: float = 1.0
    # Age at which an unmoved track is shown, if the picture and not the background has its outline.
    standing_us: int = field(default=600_000, metadata={"least": 0})

    # How long a track lives on prediction alone; longer gaps are anchoring's work. The same before confirmation.
    coast_us: int = 1_000_000
    tentative_us: int = 250_000
    # A driving vehicle does not vanish on the road: something hides it, and this long it is waited for.
    hidden_us: int = 3_000_000
    # Who drives no faster is hidden for longer than anybody waits for him; faster ones come out as they went in.
    driving_mps: float = 8.0
    # A track that stays within this distance stands.
    rest_radius_m: float = 0.7
    # Slower than this, a step that is less than this part ahead or back is no driving; of faster ones it is noise.
    sideways_mps: float = 3.0
    sideways_share: float = 0.7

    # What is measured counts by the time for which it was seen, so that frame rates do not matter: neighbouring frames
    # have the same errors. A sighting counts no longer than this after the one before.
    most_step_us: int = 100_000
    # The noise that detections claim is that of sightings so far apart; rarer ones tell as much in the same time, until
    # `most_step_us` makes them errors of their own. Gates believe the claim.
    claimed_us: int = 40_000
    # Sizes are averages over about this time, so that they go on correcting themselves.
    size_memory_us: int = 1_600_000
    # One measurement moves the sum behind a size by at most this much: like a median, it forgets outliers.
    size_step_m: float = 0.5
    # Measurements this far off for this long mean that the size is wrong (two cars entered as one), not they.
    size_misfit_m: float = 1.5
    size_misfit_us: int = 480_000
    # One that agrees with neither takes back the weight of this many.
    size_outlier: int = 3
    # A size that was seen whole for this long can be relied on.
    sized_us: int = 400_000

    # A track whose centre lies this deep in an older one's box for this long is a fragment of the same object.
    double_depth_m: float = 0.3
    double_us: int = 300_000
    # So is one that overlaps an older one for this long without the two ever being seen in one frame: noisy sightings
    # of one vehicle, dealt out in turns to two names. Both have been seen within `twin_seen_us`: a vehicle that is
    # hidden beside another is not its twin.
    twin_us: int = 500_000
    twin_seen_us: int = 400_000
    # So is one that has followed or led an older one for this long, closer than anybody drives: a quarter of a second
    # at one speed is no driver, nor is anything farther than `couple_gap_m` the same body. Side by side is no couple:
    # that is an overtake.
    coupled_us: int = 1_200_000
    couple_gap_s: float = 0.25
    couple_gap_m: float = 3.0
    couple_across_m: float = 1.5
    couple_change_mps: float = 2.0
    couple_speed_mps: float = 4.0
