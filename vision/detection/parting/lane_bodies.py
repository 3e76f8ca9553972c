"""Which vehicles are in a blob that a long one and its shadow have made? Told by what is solid in each lane.

Beside a bus or a truck the next lane lies in its shadow, and who stands there, or right before and behind, is one blob
with it. But all shadows of a scene leave the same part of the light, and nothing else is so even: what remains in a
lane without the cells of that light are the bodies.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from vision.detection.settings import DetectionSettings
from vision.objects import BoolArray, FloatArray, IntArray
from vision.video.frames import ByteArray

NOBODY = -1


@dataclass(frozen=True, slots=True)
class _Body:
    """A rectangle in the direction of a lane: lowest and highest distance along and across."""

    heading_rad: float
    along_m: tuple[float, float]
    across_m: tuple[float, float]

    def distance_m(self, points_m: FloatArray) -> FloatArray:
        """Measure how far points lie outside: (p,), 0 inside."""
        sides = zip(turned(points_m, self.heading_rad), (self.along_m, self.across_m), strict=True)
        beyond_m = [np.maximum(np.maximum(low - place, place - high), 0.0) for place, (low, high) in sides]
        return np.hypot(*beyond_m)


def is_shadow(light: ByteArray, all_light: ByteArray, settings: DetectionSettings) -> BoolArray:
    """Find the cells that are evenly dark like most shadow of the frame.

    Parameters
    ----------
    light : (p,) per cent of the road's light left, 0 where it is no road in shadow.
    all_light : the same for all that differs from the background.
    settings : how even shadows are.

    Returns
    -------
    (p,).

    Examples
    --------
    >>> all_light = np.array([55, 56, 56, 57, 30, 31, 0, 0, 0, 0, 0], np.uint8)
    >>> is_shadow(np.array([0, 30, 54, 57], np.uint8), all_light, DetectionSettings())
    array([False, False,  True,  True])
    """
    counts = np.bincount(all_light, minlength=101)
    counts[0] = 0
    level = int(np.convolve(counts, np.ones(5), mode="same").argmax())
    return np.asarray((light > 0) & (np.abs(light.astype(np.intp) - level) <= settings.light_percent))


def part_bodies(
    points_m: FloatArray,
    lane: IntArray,
    heading_rad: FloatArray,
    is_shade: BoolArray,
    *,
    side: float,
    settings: DetectionSettings,
) -> IntArray:
    """Part a blob into the bodies that fill lanes, one behind the other and side by side.

    Parameters
    ----------
    points_m : (p, 2) cells of the blob.
    lane, heading_rad : (p,) number of the lane that each is in, 0 for none, and its direction.
    is_shade : (p,) cells that are shadow.
    side : of a cell, in metres.
    settings : what is a body.

    Returns
    -------
    (p,) number of the body that each cell goes to, from 1, or `NOBODY`; all 0 if there are not two.
    """
    bodies: list[_Body] = []
    for number in np.unique(lane[lane > 0]).tolist():
        mine = (lane == number) & ~is_shade
        if mine.any():
            bodies += _bodies(points_m[mine], float(heading_rad[mine][0]), side, settings)
    return nearest_body([body.distance_m(points_m) for body in bodies], is_shade, settings)


def nearest_body(distances_m: Sequence[FloatArray], is_shade: BoolArray, settings: DetectionSettings) -> IntArray:
    """Deal the cells of a blob out to its bodies.

    Parameters
    ----------
    distances_m : (p,) of the cells from each body.
    is_shade : (p,) cells that are shadow.
    settings : how far a cell may be from its body.

    Returns
    -------
    (p,) number of the body that each cell goes to, from 1, or `NOBODY`; all 0 if there are not two.
    """
    if len(distances_m) < 2:
        return np.zeros(len(is_shade), np.intp)
    all_m = np.stack(distances_m)
    is_far = all_m.min(axis=0) > np.where(is_shade, settings.own_shadow_m, settings.own_reach_m)
    return np.where(is_far, NOBODY, all_m.argmin(axis=0) + 1)


def _bodies(points_m: FloatArray, heading_rad: float, side: float, settings: DetectionSettings) -> list[_Body]:
    """Find what is solid, row after row, in the cells of one lane."""
    places = np.column_stack(turned(points_m, heading_rad))
    first = places.min(axis=0)
    row, column = np.rint((places - first) / side).astype(np.intp).T
    cells = np.zeros((row.max() + 1, column.max() + 1), np.uint8)
    cells[row, column] = 1
    # Closed first, since the cells of a slanting lane do not fall on all places. Then edges of shadows and markings,
    # which are narrow, go.
    cells = np.pad(cells, 2)
    cells = cv2.morphologyEx(cells, cv2.MORPH_CLOSE, np.ones((3, 3), np.uint8))[2:-2, 2:-2]
    wide = np.ones((1, max(1, round(settings.body_width_m / side))), np.uint8)
    cells = cv2.morphologyEx(cells, cv2.MORPH_OPEN, wide, borderType=cv2.BORDER_CONSTANT, borderValue=(0,))
    solid = np.flatnonzero(cells.any(axis=1))
    found = []
    for run in np.split(solid, np.flatnonzero(np.diff(solid) * side > settings.window_m + side) + 1):
        if len(run) == 0 or (run[-1] - run[0] + 1) * side < settings.solid_length_m:
            continue
        start, end = first[0] + side * run[[0, -1]]
        low, high = first[1] + side * np.flatnonzero(cells[run].any(axis=0))[[0, -1]]
        found.append(_Body(heading_rad, (float(start), float(end)), (float(low), float(high))))
    return found


def turned(points_m: FloatArray, heading_rad: float) -> tuple[FloatArray, FloatArray]:
    """Measure along and across a direction.

    Parameters
    ----------
    points_m : (p, 2). heading_rad : the direction.

    Returns
    -------
    (p,) along and (p,) to the left, from the origin.
    """
    cos, sin = np.cos(heading_rad), np.sin(heading_rad)
    return points_m[:, 0] * cos + points_m[:, 1] * sin, points_m[:, 1] * cos - points_m[:, 0] * sin
