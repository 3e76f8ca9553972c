"""What does the road look like without the vehicles that stand on it? The first background, from the held frames.

A median is right where a cell is bare more than half of the time. Before a red light it is not: one car stands there
for most of a minute. But the road comes back between any two vehicles, and most of it has the colour of asphalt. So
every cell chooses among the values that it took: each stretch of time at a value votes with the square root of its
length, which lets many short sights of the road outvote one long stop, and the usual colour of the road counts more.
Where something as large as a vehicle still stands out from the road afterwards, it pays to hold more frames.
"""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np
from numpy.typing import NDArray

from vision.frames import ByteArray

FloatArray = NDArray[np.float32]
BoolArray = NDArray[np.bool_]

# Values this near to each other are the same surface.
SAME_LEVELS = 8
# Among how many of its sorted values a cell chooses.
CHOICES = 9
# How many times more a vote counts for the usual colour of the road, and within how many levels of it that fades.
USUAL_FACTOR, USUAL_LEVELS = 4.0, 10.0
# A value that most samples have and that came back this often is no vehicle, if it is seen in the first and in the last
# of so many equal parts of the time.
RETURNS, ENDS = 3, 6
# Something this different from the road may be a vehicle, if it fills a square of this part of a car's width and has
# the area of a small car.
STRANGE_LEVELS = 18.0
SQUARE_SHARE = 0.8
LEAST_WIDTHS2 = 1.5
# Differences beyond this are something else in front of the cell, and no noise of it.
MOST_NOISE = 24


def empty_road(samples: Sequence[ByteArray], road: BoolArray) -> FloatArray:
    """Estimate the bare road from pictures with traffic on it.

    Parameters
    ----------
    samples : (3, n) each, in order of time, evenly spread.
    road : (n,) which cells are road; the others get their median.

    Returns
    -------
    (3, n) levels.

    Examples
    --------
    A car of level 30 stands in the first of three cells for most of the time; the road has level 100.

    >>> pictures = [np.array([[level, 100, 100]] * 3, np.uint8) for level in (100, 30, 30, 30, 30, 30, 30, 100)]
    >>> empty_road(pictures, np.ones(3, np.bool_))[0].tolist()
    [100.0, 100.0, 100.0]
    """
    planes = median_of(samples)
    usual = usual_colour(planes, road)
    lowest, highest = samples[0].copy(), samples[0].copy()
    for sample in samples[1:]:
        np.minimum(lowest, sample, out=lowest)
        np.maximum(highest, sample, out=highest)
    # Where nothing ever passed, the median is the road.
    busy = np.flatnonzero(road & ((highest - lowest).max(axis=0) > 2 * SAME_LEVELS))
    piece = 8_192
    for start in range(0, len(busy), piece):
        cells = busy[start : start + piece]
        planes[:, cells] = _elected(np.stack([sample[:, cells] for sample in samples]), usual)
    return planes


def _elected(values: ByteArray, usual: FloatArray) -> FloatArray:
    """Let the values of every cell vote: (times, 3, n) to (3, n)."""
    values = values.astype(np.int16)
    order = np.argsort(values[:, 0], axis=0, kind="stable")
    middle = np.take_along_axis(values, order[len(values) // 2][None, None], axis=0)[0]
    best = np.where(_returns(np.abs(values - middle).max(axis=1) <= SAME_LEVELS), np.inf, -1.0).astype(np.float32)
    elected: FloatArray = middle.astype(np.float32)
    for place in np.unique(np.linspace(0, len(values) - 1, CHOICES).round().astype(np.intp)):
        choice = np.take_along_axis(values, order[place][None, None], axis=0)[0]
        is_same = np.abs(values - choice).max(axis=1) <= SAME_LEVELS
        votes = _votes(is_same) * _weight(choice - usual[:, None])
        mean = np.where(is_same[:, None], values, 0).sum(axis=0) / is_same.sum(axis=0)
        is_better = votes > best
        best[is_better] = votes[is_better]
        elected[:, is_better] = mean[:, is_better]
    return elected


def _weight(from_usual: FloatArray) -> FloatArray:
    """Say how much a vote for colours counts, by their difference from the usual one: (3, n) to (n,)."""
    distance = np.abs(from_usual).max(axis=0)
    weight = 1 + (USUAL_FACTOR - 1) * np.exp(-((distance / USUAL_LEVELS) ** 2))
    return np.asarray(weight, np.float32)


def _returns(is_same: BoolArray) -> BoolArray:
    """Find cells that are the same for most of the time, at its ends and again and again: markings, not vehicles."""
    begins = is_same[0] + (is_same[1:] & ~is_same[:-1]).sum(axis=0)
    ends = -(-len(is_same) // ENDS)
    is_lasting = is_same[:ends].any(axis=0) & is_same[-ends:].any(axis=0)
    return np.asarray(is_lasting & (begins >= RETURNS) & (2 * is_same.sum(axis=0) > len(is_same)))


def _votes(is_same: BoolArray) -> FloatArray:
    """Sum up the square roots of the lengths of all runs of True: (times, n) to (n,)."""
    run = np.zeros(is_same.shape[1], np.intp)
    votes = np.zeros(is_same.shape[1], np.float32)
    growth = np.diff(np.sqrt(np.arange(len(is_same) + 1, dtype=np.float32)), prepend=0.0).astype(np.float32)
    for row in is_same:
        run = (run + 1) * row
        votes += growth[run]
    return votes


def usual_colour(planes: FloatArray, road: BoolArray) -> FloatArray:
    """Find the most frequent level of the road in every plane.

    Parameters
    ----------
    planes : (3, n). road : (n,) which cells are road.

    Returns
    -------
    (3,).
    """
    return np.array([np.bincount(plane[road].astype(np.intp)).argmax() for plane in planes], np.float32)


def strange(planes: FloatArray, road: BoolArray) -> ByteArray:
    """Mark cells that do not have the usual colour of the road.

    Parameters
    ----------
    planes : (3, n). road : (n,) which cells are road.

    Returns
    -------
    (n,) 1 or 0.
    """
    difference = np.abs(planes - usual_colour(planes, road)[:, None]).max(axis=0)
    return np.asarray(road & (difference > STRANGE_LEVELS), np.uint8)


def holds_vehicle(mask: ByteArray, car_cells: float) -> bool:
    """Tell whether a mask holds something as wide and as large as a vehicle; markings are thinner.

    Parameters
    ----------
    mask : (rows, columns). car_cells : width of a car in cells.

    Examples
    --------
    >>> mask = np.zeros((20, 40), np.uint8)
    >>> mask[5, :] = 1
    >>> holds_vehicle(mask, 4)
    False
    >>> mask[10:14, 10:20] = 1
    >>> holds_vehicle(mask, 4)
    True
    """
    side = max(2, round(SQUARE_SHARE * car_cells))
    square = np.ones((side, side), np.uint8)
    wide = cv2.morphologyEx(mask, cv2.MORPH_OPEN, square, borderType=cv2.BORDER_CONSTANT, borderValue=0)
    statistics = cv2.connectedComponentsWithStats(wide, connectivity=8)[2]
    return bool(np.any(statistics[1:, cv2.CC_STAT_AREA] >= LEAST_WIDTHS2 * car_cells**2))


def median_of(samples: Sequence[ByteArray]) -> FloatArray:
    """Take the median per cell; in pieces, since sorting wants each cell's samples side by side.

    Parameters
    ----------
    samples : (k, n) each.

    Returns
    -------
    (k, n).
    """
    result = np.empty((len(samples[0]), samples[0].shape[-1]), np.float32)
    piece = 65_536
    for start in range(0, result.shape[-1], piece):
        cells = np.stack([sample[:, start : start + piece] for sample in samples], axis=-1)
        cells.partition(cells.shape[-1] // 2, axis=-1)
        result[:, start : start + piece] = cells[..., cells.shape[-1] // 2]
    return result


def noise_of(differences: Sequence[ByteArray]) -> FloatArray:
    """Take the median difference per cell over the times at which nothing stood in front of it.

    Parameters
    ----------
    differences : (1, n) each.

    Returns
    -------
    (1, n); `MOST_NOISE` where something always differed more.
    """
    result = np.empty((1, differences[0].shape[-1]), np.float32)
    piece = 65_536
    for start in range(0, result.shape[-1], piece):
        cells = np.sort(np.concatenate([one[:, start : start + piece] for one in differences]), axis=0)
        count = (cells <= MOST_NOISE).sum(axis=0)
        middle = np.take_along_axis(cells, (count // 2)[None] * (count > 0), axis=0)
        result[:, start : start + piece] = np.where(count > 0, middle, MOST_NOISE)
    return result
