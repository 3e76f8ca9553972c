"""How are the cars of a run written to files?

CSV has the columns of a generated scene's `truth.csv`, as far as a recogniser can know them. MOT text is what tracker
benchmarks read: boxes in the image, with whole-numbered frames and objects.
"""

import csv
import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import TextIO

import numpy as np

from service.records import CameraRecord, CarState, ViewRecord

COLUMNS = (
    "t_us", "id", "class", "x_m", "y_m", "heading_rad", "speed_mps", "length_m", "width_m", "road", "lane", "visible",
)  # fmt: skip

Point = tuple[float, float]
Box = tuple[float, float, float, float]

# In MOT text the upper left corner of the image's first pixel is (1, 1); with us its centre is (0, 0).
_MOT_OFFSET_PX = 1.5


@dataclass(frozen=True, slots=True)
class MotReport:
    """How many states have no box: between frames, or outside the image."""

    without_frame: int
    outside: int


def write_tracks_csv(states: Iterable[CarState], out: TextIO) -> None:
    """Write car states as CSV with a header.

    `visible` is 1 where the car was seen and 0 where its position is predicted.
    """
    table = csv.writer(out, lineterminator="\n")
    table.writerow(COLUMNS)
    for one in states:
        metres = (one.x_m, one.y_m, one.heading_rad, one.speed_mps, one.length_m, one.width_m)
        numbers = [f"{value:.3f}" for value in metres]
        table.writerow([one.t_us, one.car, one.car_class, *numbers, one.road, one.lane, int(one.linked)])


def write_tracks_mot(
    states: Iterable[CarState],
    out: TextIO,
    *,
    frames: Iterable[tuple[int, int]],
    car_numbers: Mapping[str, int],
    camera: CameraRecord,
    views: Iterable[ViewRecord] = (),
) -> MotReport:
    """Write car states as MOT text: frame, id, left, top, width, height, confidence, -1, -1, -1.

    The box is drawn round the footprint on the ground, since the height of a car is not known. Confidence is 1 where
    the car was seen and 0 where its position is predicted.

    Parameters
    ----------
    states : ordered by time.
    frames : (number, t_us), ordered by time.
    car_numbers : the whole number that stands for each car symbol.
    camera : of the run.
    views : of a moving camera, ordered by time; none for a fixed one. A car has no box while the view is lost.
    """
    walk = Views(camera, iter(views))
    oriented = lru_cache(maxsize=1)(lambda numbers: _oriented(numbers, camera))
    without_frame = outside = 0
    for number, one in _numbered(states, frames):
        numbers = walk.at(one.t_us)
        box = None if numbers is None else _box(one, oriented(numbers), camera)
        if number is None:
            without_frame += 1
        elif box is None:
            outside += 1
        else:
            left, top, width, height = (f"{value:.2f}" for value in box)
            out.write(f"{number},{car_numbers[one.car]},{left},{top},{width},{height},{int(one.linked)},-1,-1,-1\n")
    return MotReport(without_frame, outside)


def footprint_corners(state: CarState) -> list[Point]:
    """Find the corners of a car's footprint in metres, counter-clockwise from the front left.

    Examples
    --------
    >>> footprint_corners(CarState(0, "car1", 10.0, 5.0, 0.0, 0.0, 4.0, 2.0))
    [(12.0, 6.0), (8.0, 6.0), (8.0, 4.0), (12.0, 4.0)]
    """
    ahead_m, left_m = state.length_m / 2, state.width_m / 2
    ahead_x, ahead_y = math.cos(state.heading_rad) * ahead_m, math.sin(state.heading_rad) * ahead_m
    left_x, left_y = -math.sin(state.heading_rad) * left_m, math.cos(state.heading_rad) * left_m
    return [
        (state.x_m + ahead * ahead_x + left * left_x, state.y_m + ahead * ahead_y + left * left_y)
        for ahead, left in ((1, 1), (-1, 1), (-1, -1), (1, -1))
    ]


class Views:
    """Walk through the views of a run in step with its frames or states.

    Parameters
    ----------
    camera : of the run, where it looked at first.
    views : where it looked later, ordered by time: of a fixed camera only where it saw nothing, and where it did again.
    """

    def __init__(self, camera: CameraRecord, views: Iterator[ViewRecord]) -> None:
        self._views = views
        self._next = next(views, None)
        looks_on = self._next is None or not self._next.pixel_from_ground
        self._last = ViewRecord(0, camera.pixel_from_ground) if looks_on else None

    def at(self, t_us: int) -> tuple[float, ...] | None:
        """Return the map from the ground to the image at this time, None if not known; times must not decrease.

        Between two views it is the mean of both, weighted by time.
        """
        while self._next is not None and self._next.t_us < t_us:
            self._last, self._next = self._next, next(self._views, None)
        last, coming = self._last, self._next
        if coming is not None and coming.t_us == t_us:
            return coming.pixel_from_ground or None
        if last is None or not last.pixel_from_ground:
            return None
        if coming is None or not coming.pixel_from_ground:
            return last.pixel_from_ground
        share = (t_us - last.t_us) / (coming.t_us - last.t_us)
        before, after = (np.array(one.pixel_from_ground) for one in (last, coming))
        mean = (1 - share) * before / np.linalg.norm(before) + share * after / np.linalg.norm(after)
        return tuple(mean.tolist())


def _numbered(states: Iterable[CarState], frames: Iterable[tuple[int, int]]) -> Iterator[tuple[int | None, CarState]]:
    """Join states and frames by time, both read once; None for a state between frames."""
    walk = iter(frames)
    number, t_us = next(walk, (0, None))
    for state in states:
        while t_us is not None and t_us < state.t_us:
            number, t_us = next(walk, (0, None))
        yield (number if t_us == state.t_us else None), state


def _oriented(pixel_from_ground: Sequence[float], camera: CameraRecord) -> Sequence[float]:
    """Give a homography, whose scale is free, the sign with which depth is positive in front of the camera.

    A point that is in front is the ground at the middle of the lower edge, which is never above the horizon.
    """
    ground_from_pixel = np.linalg.inv(np.array(pixel_from_ground).reshape(3, 3))
    is_turned = ground_from_pixel[2] @ ((camera.width_px - 1) / 2, camera.height_px - 1, 1) < 0
    return [-number for number in pixel_from_ground] if is_turned else pixel_from_ground


def _box(state: CarState, h: Sequence[float], camera: CameraRecord) -> Box | None:
    """Return left, top, width and height as MOT counts them; None if not in the image."""
    points: list[Point] = []
    for x_m, y_m in footprint_corners(state):
        depth = h[6] * x_m + h[7] * y_m + h[8]
        if depth <= 0:
            return None
        points.append(((h[0] * x_m + h[1] * y_m + h[2]) / depth, (h[3] * x_m + h[4] * y_m + h[5]) / depth))
    if (lens := camera.lens) is not None:
        points = lens.bend(points).tolist()
    left, right = min(x for x, _ in points), max(x for x, _ in points)
    top, bottom = min(y for _, y in points), max(y for _, y in points)
    if right < -0.5 or bottom < -0.5 or left > camera.width_px - 0.5 or top > camera.height_px - 0.5:
        return None
    return left + _MOT_OFFSET_PX, top + _MOT_OFFSET_PX, right - left, bottom - top
