"""Which lengths, levels and angles make the road, what stands on it, and its scale?"""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class RoadSettings:
    """Tuned numbers of the road's raster; each comment says what it rests on. None was swept: they are by reason."""

    # Above this sine of the viewing angle, unequal scales say more about the calibration than about the view.
    steep_sine: float = 0.95
    # What remains of a box at least when the smear of height is cut off: a small car without its bonnet.
    least_length_m: float = 2.0
    least_width_m: float = 1.4
    # Half-width of the band of cells that counts as the edge of the view: boxes there end with the view.
    edge_cells: int = 2

    # Colours this near to the most frequent one are plain road: above its texture, below a worn marking.
    plain_levels: float = 14.0
    # The usual colour at a place is their mean within so many widths of a car: a lane to each side, and no more light.
    plain_around_widths: float = 7.0
    # It counts if plain road fills this many squared widths; else the most frequent colour of all does.
    least_plain_widths2: float = 0.5

    # Without a camera the scale is read off blobs that differ by this from the median picture: noise does not.
    scale_difference_levels: int = 22
    # So many pictures make a median without cars, and so many blobs an average.
    scale_least_pictures: int = 5
    scale_least_blobs: int = 10
    # Smaller blobs are noise, and emptier ones (of the rectangle around them) are several things, or leaves.
    scale_least_area_px: int = 30
    scale_least_fill: float = 0.4
    # What is shorter than this part of the length that long and short things share equally is no vehicle: that may be
    # the length of a lorry, of 16 m. So far apart (in logarithms) do two lengths support each other: cars differ by
    # less. Scales of uav and vertical scenes (docs/moving_camera.md) hold from .12 to .25.
    scale_least_part: float = 0.25
    scale_alike: float = 0.2
