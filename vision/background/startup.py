"""What does the road look like without the vehicles that stand on it? The first background, from the held frames.

A median is right where a cell is bare more than half of the time. Before a red light it is not: one car stands there
for most of a minute. But the road comes back between any two vehicles, and it is the calmest that a place ever looks:
a vehicle brings dark windows, a shadow, perhaps a colour into a neighbourhood as wide as itself, whatever its roof
looks like. So every cell takes the median over its few calmest times. Where it is not calm even then, a vehicle may
have stood there all the time (`standing.py`).

In a slanting image a car is many cells wide near by and few far away, and lanes touch: no neighbourhood is a car's, so
there the road is the plain median.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import reduce

import cv2
import numpy as np
from numpy.typing import NDArray

from vision.background.settings import BackgroundSettings
from vision.objects import BoolArray
from vision.road.rectify import RoadCells
from vision.road.road_colour import RoadColour
from vision.video.frames import ByteArray

FloatArray = NDArray[np.float32]

# Unrest is kept in parts of a level.
LEVEL = 6
# Black in video levels: light multiplies what lies above it.
BLACK_LEVEL = 16.0
# No difference: something else is in front of the cell.
IN_FRONT = 255


@dataclass(frozen=True, slots=True, eq=False)
class FirstSight:
    """What is read off held frames.

    Attributes
    ----------
    samples : of the frames, (3, packed_size) each, in order of time and in the light of `planes`.
    planes : (3, packed_size) levels of the road.
    unrest : (packed_size,) mean difference from the usual colour around, at the calmest times, in 1 / `LEVEL` levels.
    is_calm : (samples, packed_size) the calmer times of every cell: its noise is measured at these.
    """

    samples: Sequence[ByteArray]
    planes: FloatArray
    unrest: ByteArray
    is_calm: BoolArray


def first_sight(samples: Sequence[ByteArray], colour: RoadColour, settings: BackgroundSettings) -> FirstSight:
    """Estimate the bare road from pictures with traffic on it.

    Parameters
    ----------
    samples : (3, packed_size) each, in order of time, evenly spread.
    colour : of the road.
    settings : of this room.

    Returns
    -------
    The road; where nothing ever passed, the median.
    """
    planes, cells = median_of(samples), colour.cells
    samples = in_one_light(samples, planes[0], colour.road, settings.least_gain)
    tables = _tables(settings)
    usual = np.rint(colour.around(planes)).astype(np.uint8)
    side = 2 * round(settings.calm_widths * colour.car_cells / 2) + 1
    unrest = [_unrest(sample, usual, cells, tables, side) for sample in samples]
    change = reduce(np.maximum, samples) - reduce(np.minimum, samples)
    busy = np.flatnonzero(change.max(axis=0) > 2 * settings.same_levels)
    least = np.median(np.stack(unrest), axis=0).astype(np.uint8)
    is_calm = np.ones((len(samples), cells.packed_size), np.bool_)
    is_beyond = ~cells.pack(cells.ground)
    piece = 8_192
    for start in range(0, len(busy), piece):
        where = busy[start : start + piece]
        values = np.stack([sample[:, where] for sample in samples], axis=-1)
        around = np.stack([one[where] for one in unrest], axis=-1)
        calm_planes, least[where] = calmest(values, around, settings)
        # In shade that stays nothing is calm, and a bright car less strange than the road: what comes back is the road.
        is_shade = least[where] > LEVEL * settings.unrest_levels
        is_shade &= came_back([sample[:, where] for sample in samples], planes[:, where], settings.same_levels)
        # Beyond the road the road's colour says nothing: a grey lorry that leans over grass would be calmer than it.
        planes[:, where] = np.where(is_shade | is_beyond[where], planes[:, where], calm_planes)
        calm = np.sort(around, axis=-1)[:, min(settings.noise_samples, len(samples)) - 1, None]
        is_calm[:, where] = (around <= calm).T
    return FirstSight(samples, planes, least, is_calm)


def plain_sight(samples: Sequence[ByteArray], is_bare: BoolArray | None = None) -> FirstSight:
    """Take the bare road for what is seen most of the time, where vehicles have no size to look for.

    Parameters
    ----------
    samples : (3, packed_size) each, in order of time, evenly spread.
    is_bare : (samples, packed_size) when no vehicle is known to be in front of a cell; None if nobody knows of any.

    Returns
    -------
    The median of the bare times, of all where there is none; nothing is known of unrest.
    """
    size = samples[0].shape[-1]
    if is_bare is None:
        is_bare = np.ones((len(samples), size), np.bool_)
    return FirstSight(samples, median_of(samples, is_bare), np.zeros(size, np.uint8), is_bare)


def in_one_light(samples: Sequence[ByteArray], luma: FloatArray, road: BoolArray, least_gain: float) -> list[ByteArray]:
    """Make up for the sun that comes and goes: a darker road is not a less calm one.

    Parameters
    ----------
    samples : (3, n) each. luma : (n,) the level that each cell gets on average.
    road : (n,) the cells by which light is measured; vehicles among them do no harm as long as they are fewer.
    least_gain : the light is taken for no darker.

    Returns
    -------
    The samples with that light.

    Examples
    --------
    >>> shades = [np.full((3, 4), level, np.uint8) for level in (116, 96, 136)]
    >>> lit = in_one_light(shades, np.full(4, 116, np.float32), np.ones(4, np.bool_), 0.25)
    >>> [int(sample[0, 0]) for sample in lit]
    [116, 116, 116]
    """
    where = np.flatnonzero(road & (luma > BLACK_LEVEL + 1))
    known = luma[where] - BLACK_LEVEL
    result = []
    for sample in samples:
        gain = float(np.median((sample[0, where] - BLACK_LEVEL) / known)) if len(where) else 1.0
        factor = 1 / max(gain, least_gain)
        one = sample.copy()
        one[:1] = cv2.convertScaleAbs(sample[:1], alpha=factor, beta=BLACK_LEVEL * (1 - factor))
        result.append(one)
    return result


def calmest(values: ByteArray, unrest: ByteArray, settings: BackgroundSettings) -> tuple[FloatArray, ByteArray]:
    """Find what is seen at the calmest times.

    Parameters
    ----------
    values : (planes, cells, times) levels.
    unrest : (cells, times).
    settings : of this room.

    Returns
    -------
    (planes, cells) levels: the mean of all that are near that median, since a few times alone are noisy; and (cells,)
    the median unrest of the calmest times.

    Examples
    --------
    A car of level 30 stands in a cell most of the time; the road has level 100.

    >>> levels = np.array([[[100, 30, 30, 30, 30, 30, 100, 101, 30, 99, 102]]], np.uint8)
    >>> planes, least = calmest(levels, np.where(levels[0] > 50, 1, 9).astype(np.uint8), BackgroundSettings())
    >>> planes.tolist(), least.tolist()
    ([[100.4000015258789]], [1])
    """
    most = min(settings.calmest_samples, unrest.shape[-1])
    # Stable, so that among equally calm times the earlier ones count.
    times = np.argsort(unrest, axis=-1, kind="stable")[:, :most]
    ordered = np.take_along_axis(unrest, times, axis=-1)
    calm = (ordered <= LEVEL * settings.unrest_levels).sum(axis=-1)
    count = np.where(calm >= settings.least_calm_samples, calm, most)
    least = np.take_along_axis(ordered, (count - 1)[:, None] // 2, axis=-1)[:, 0]
    # What is not among the times that count goes to the end.
    chosen = np.take_along_axis(values, times[None], axis=-1)
    chosen[:, np.arange(most) >= count[:, None]] = 255
    middle = np.take_along_axis(np.sort(chosen, axis=-1), count[None, :, None] // 2, axis=-1)
    is_near = (cv2.absdiff(values, np.broadcast_to(middle, values.shape)) <= settings.same_levels).all(axis=0)
    mean = np.where(is_near, values, 0).sum(axis=-1, dtype=np.float32) / np.maximum(is_near.sum(axis=-1), 1)
    return np.where(is_near.any(axis=-1), mean, middle[..., 0]).astype(np.float32), least


def came_back(samples: Sequence[ByteArray], planes: FloatArray, same_levels: int) -> BoolArray:
    """Tell whether each cell took a value in several stretches of time.

    Parameters
    ----------
    samples : (3, n) each, in order of time. planes : (3, n) the value. same_levels : it may be off by so much.

    Returns
    -------
    (n,).

    Examples
    --------
    >>> seen = [np.array([[first, second]], np.uint8) for first, second in ((60, 60), (110, 60), (61, 110))]
    >>> came_back(seen, np.full((1, 2), 60, np.float32), 8).tolist()
    [True, False]
    """
    levels = np.rint(planes).astype(np.uint8)
    is_same = np.stack([cv2.absdiff(sample, levels).max(axis=0) <= same_levels for sample in samples])
    begins = np.diff(is_same.astype(np.int8), axis=0, prepend=0) > 0
    return np.asarray(begins.sum(axis=0) > 1)


def _unrest(
    sample: ByteArray, usual: ByteArray, cells: RoadCells, tables: tuple[ByteArray, ByteArray, ByteArray], side: int
) -> ByteArray:
    """Measure by how much the neighbourhood of every cell differs from the usual colour: (packed_size,)."""
    dark, bright, colour = tables
    levels = cv2.max(
        cv2.LUT(cv2.subtract(usual[0], sample[0]), dark), cv2.LUT(cv2.subtract(sample[0], usual[0]), bright)
    )
    for seen, known in zip(sample[1:], usual[1:], strict=True):
        levels = cv2.max(levels, cv2.LUT(cv2.absdiff(seen, known), colour))
    strange = cells.unpack(np.asarray(levels, np.uint8).ravel()) * cells.road
    return cells.pack(np.asarray(cv2.blur(strange, (side, side), borderType=cv2.BORDER_CONSTANT), np.uint8))


def _tables(settings: BackgroundSettings) -> tuple[ByteArray, ByteArray, ByteArray]:
    """Look up by how much a difference in darkness, brightness and colour counts."""
    levels = np.arange(256)
    dark = np.clip(levels - settings.dark_from_levels, 0, settings.dark_most_levels)
    colour = np.clip(levels - settings.colour_from_levels, 0, settings.colour_most_levels)
    weighted = (dark, settings.bright_weight * dark, settings.chroma_weight * colour)
    first, second, third = (np.rint(LEVEL * one).clip(0, 255).astype(np.uint8) for one in weighted)
    return first, second, third


def median_of(samples: Sequence[ByteArray], counts: BoolArray | None = None) -> FloatArray:
    """Take the median per cell; in pieces, since sorting wants each cell's samples side by side.

    Parameters
    ----------
    samples : (k, n) each, m of them.
    counts : (m, n) which samples of each cell count, all where none does; None if all do.

    Returns
    -------
    (k, n).

    Examples
    --------
    >>> levels = [np.array([[level, level]], np.uint8) for level in (100, 30, 30)]
    >>> median_of(levels, np.array([[True, True], [True, False], [True, False]])).tolist()
    [[30.0, 100.0]]
    """
    result = np.empty((len(samples[0]), samples[0].shape[-1]), np.float32)
    piece = 65_536
    for start in range(0, result.shape[-1], piece):
        cells = np.stack([sample[:, start : start + piece] for sample in samples], axis=-1)
        if counts is None or counts[:, start : start + piece].all():
            cells.partition(cells.shape[-1] // 2, axis=-1)
            result[:, start : start + piece] = cells[..., cells.shape[-1] // 2]
            continue
        is_out = ~counts[:, start : start + piece].T
        is_out[is_out.all(axis=1)] = False
        cells[:, is_out] = 255
        cells.sort(axis=-1)
        middle = (~is_out).sum(axis=1) // 2
        result[:, start : start + piece] = np.take_along_axis(cells, middle[None, :, None], axis=-1)[..., 0]
    return result


def noise_of(differences: Sequence[ByteArray], is_calm: BoolArray, most_levels: int) -> FloatArray:
    """Take the median difference per cell over the times at which nothing stood in front of it.

    Parameters
    ----------
    differences : (1, n) each.
    is_calm : (k, n) the times that count.
    most_levels : larger differences do not.

    Returns
    -------
    (1, n); `most_levels` where something always differed more.
    """
    result = np.empty((1, differences[0].shape[-1]), np.float32)
    piece = 65_536
    for start in range(0, result.shape[-1], piece):
        cells = np.concatenate([one[:, start : start + piece] for one in differences])
        cells[~is_calm[:, start : start + piece]] = IN_FRONT
        cells.sort(axis=0)
        count = (cells <= most_levels).sum(axis=0)
        middle = np.take_along_axis(cells, (count // 2)[None] * (count > 0), axis=0)
        result[:, start : start + piece] = np.where(count > 0, middle, most_levels)
    return result
