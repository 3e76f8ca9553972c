"""How well must a picture fit what is known, before a moving camera believes to know where it is?"""

from dataclasses import dataclass, field


@dataclass(frozen=True, slots=True)
class RegistrationSettings:
    """Tuned numbers of registration and of the background under a moving camera; each comment says what it rests on.

    None was swept: they are there by reason. Pixels are those of the full-size picture, if nothing else is said.
    """

    # Few strong corners do better than many weak ones: an encoder lets weak texture lag behind the motion.
    corners: int = 100
    # Least distance between corners, as a part of what it would be if they filled the picture evenly.
    corner_spacing: float = 0.5
    # Strength of the weakest corner as a part of the strongest one's; a fifth of it, twice, where too few are found.
    corner_quality: float = 0.05
    enough_corners: int = 50
    # What lies nearer to the border of the picture is not followed: its surroundings would stick out.
    corner_border_px: int = 12
    # Side of the surroundings by which a corner is followed, half-size: some blocks of an encoder.
    window_px: int = field(default=21, metadata={"least": 3})
    # ORB descriptors of a picture, and how much nearer than the second one a match must be (Lowe's ratio test).
    descriptors: int = 500
    match_ratio: float = 0.8

    # Pairs this far from the best similarity still take part: a tilting camera bends a similarity by some pixels.
    rough_px: float = 6.0
    # Pairs farther than this from the homography do not belong to it; weights reach zero at twice this.
    close_px: float = 1.5
    # So many pairs make a map: twice as many as fix a homography.
    least_pairs: int = 8

    # The guard: corners that must agree, and their share of those that should be in view.
    least_inliers: int = 20
    least_share: float = 0.4
    # The part of the picture's width and height over which they must spread, or far parts of the map are guessed.
    least_spread: float = 0.3
    # How like the key frame the picture must look around them: a correlation, of which noise alone gives about 0.
    least_likeness: float = 0.5
    # No corner of the picture moves farther between two known views: a part of the diagonal, and more with time.
    jump_share: float = 0.1
    jump_share_per_s: float = 0.5

    # A key frame that shows less than this of the view is replaced by a nearer one, or by a new one.
    key_share: float = 0.6
    # So is one that is zoomed by more, in or out: corners would look different.
    key_zoom: float = 1.4
    # A new key frame is made from good registrations only, and the oldest but the first go: memory, and search time.
    key_inliers: int = 30
    most_keys: int = 40
    # The key frame is redrawn when turn, zoom and tilt have moved a corner of the picture by more, shift aside.
    redraw_px: float = 8.0
    # While the view is lost, key frames are searched this often, so many at a time: a frame must not wait for it.
    search_us: int = 120_000
    search_keys: int = 4

    # A camera that is said to stand is looked at this often; it moves when the corners of its first picture have been
    # away from where they were for so many looks, and of those that can tell this share says so.
    watch_us: int = 200_000
    watch_looks: int = 3
    # Away is by so many pixels, since masts in the wind and encoders shake by half a pixel to two, and by this part of
    # the width of a car: over an empty car park a clip of a "fixed" camera wanders by 9 px, a twentieth of a car. But
    # it need not be more than this part of it: from high above, two pixels are half a car.
    moved_px: float = 3.0
    moved_widths: float = 0.1
    moved_most_widths: float = 0.5
    moved_share: float = 0.7

    # Pixels at the border of the picture that are not used: half-seen cells, and what lens and encoder do there.
    border_px: float = 3.0
    # The smear of heights is worked out anew when the view has moved by this part of the picture.
    smear_shift: float = 0.02
    # Samples that make a cell known: fewer of the start-up's, since those are spread over all of it.
    startup_samples: int = 10
    later_samples: int = 15
    # What registration leaves, as a part of a cell: this part of the contrast around a cell adds to its threshold.
    residual_cells: float = 0.25
