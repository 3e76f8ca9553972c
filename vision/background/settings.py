"""From which differences, shares and times on is something no empty road?"""

from dataclasses import dataclass, field


@dataclass(frozen=True, slots=True)
class BackgroundSettings:
    """Tuned numbers of the background; each comment says what it rests on.

    None was swept: they are by reason, and were tried on rendered seeds 1 to 5 of `rural_overtaking` and, those of
    the start-up, on junction clips. A level is one of 256. Widths (and widths squared) are those of a car.
    """

    # How long frames are held before there is a background: the constant delay of the first result.
    startup_us: int = 5_000_000
    # The same at most, where a vehicle seems to stand all the time: a red phase. With 10 s and 20 s ghosts remained.
    startup_most_us: int = 60_000_000
    # The first background is read off so many of the held frames, evenly spread: one in a second of the longest hold.
    startup_samples: int = 61
    # Where a detector has looked: a cell without a vehicle at less than this part of the looks was never seen bare. Of
    # the looks at one that stands there a few miss it.
    least_bare_share: float = 0.3
    # Memory for held frames; the start-up ends early when they would not fit.
    startup_bytes: int = 400_000_000
    # How often the background and shadows are learned and standing vehicles are judged; 0: at every frame.
    period_us: int = field(default=200_000, metadata={"least": 0})
    # Time constant of learning where nothing is seen: faster than the sun, slower than any vehicle that creeps.
    tau_us: int = 20_000_000
    # A wrong patch (a car burned in, road revealed) is replaced after this; standing vehicles are judged well before.
    heal_us: int = 3_000_000
    # A larger part of the road in motion for this long means the view changed: traffic covers less, a flash is shorter.
    lost_fraction: float = 0.6
    lost_us: int = 1_000_000

    # The threshold of a cell is the least, and this many times what its noise exceeds 1 level, up to the most; a lower
    # least finds greyer cars, a higher factor ignores more leaves.
    least_difference_levels: float = 10.0
    most_difference_levels: float = 40.0
    noise_factor: float = 5.0
    # Larger differences are something else in front of the cell, and no noise of it.
    most_noise_levels: int = 24
    # One level of chroma counts as this many of luma: H.264 and 4:2:0 leave little of the colour of a small car.
    chroma_weight: float = 2.0
    # The gain of the light is measured on cells at least this bright: on dark ones it is mostly noise.
    gain_least_level: float = 40.0
    # The light is followed down to this part of what it was, and up to the inverse.
    least_gain: float = 0.25
    # Shadow leaves these parts of the light (full shade at noon, and noise), and changes the colour by few levels.
    shade_deepest: float = 0.25
    shade_lightest: float = 0.97
    shade_chroma_levels: float = 6.0

    # Outline contrast of picture over background that shows an object, and of background over picture that shows a
    # ghost; that is stricter: a marking under a dark car has edges too, and a car taken for a ghost is lost.
    object_ratio: float = 1.3
    ghost_ratio: float = 2.0
    # Where one of picture and background shows plain road and the other does not, that settles it: if at least this
    # part of the box is so, and this many times more of it than the other way round.
    plain_share: float = 0.15
    plain_ratio: float = 2.0
    # Bare road matches the usual colour around it up to so much in the light of the start-up; more is strange.
    strange_levels: float = 10.0

    # A cell shows one thing as long as it changes by no more than this: noise of the encoder.
    same_levels: int = 8
    # A cell is the median of this many of its calmest times; of fewer, but at least so many, if only these are calm.
    calmest_samples: int = 5
    least_calm_samples: int = 2
    # Its noise is measured at this many of its calmest times: a quarter of all, while vehicles stand there.
    noise_samples: int = 15
    # Calm is told by a neighbourhood about two cars wide: whoever covers the middle sticks out of it somewhere.
    calm_widths: float = 1.9
    # Unrest is the mean difference from the usual colour there: up to the first number one is noise, beyond the
    # second it counts no more; brightness counts little, since markings are bright.
    dark_from_levels: int = 5
    dark_most_levels: int = 40
    colour_from_levels: int = 3
    colour_most_levels: int = 20
    bright_weight: float = 0.2
    # From this unrest on a neighbourhood is not calm.
    unrest_levels: float = 3.0

    # A neighbourhood that is not calm reaches beyond what stands in it by this.
    beyond_widths: float = 1 / 3
    # A vehicle, or a queue of some, is strange in this part of such a place, and the strange part as large as a small
    # car; some of it is darker than the road, as crossings and other markings are not.
    strange_share: float = 0.3
    least_widths2: float = 1.5
    least_dark_widths2: float = 0.5
    # Larger places are crowns of leaves, or the shadows of houses.
    most_widths2: float = 40.0
    # A bridge or a gantry reaches from side to side: without it and so much beside it, the road around is cut in two.
    side_widths: float = 0.3
    around_widths: float = 1.0
    # If this part of what is strange came back after something else, it is ground: a patch that cars drive over.
    ground_share: float = 0.5
