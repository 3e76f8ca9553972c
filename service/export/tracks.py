"""How are the cars of a run written to files?

CSV has the columns of a generated scene's `truth.csv`, as far as a recogniser can know them. MOT text is what tracker
benchmarks read: boxes in the image, with whole-numbered frames and objects.
"""

import csv
import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TextIO

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
    """How many rows were written, and how many states have no box: between frames, or outside the image."""

    written: int
    without_frame: int
    outside: int


def write_tracks_csv(states: Iterable[CarState], out: TextIO) -> int:
    """Write car states as CSV with a header; return how many.

    `visible` is 1 where the car was seen and 0 where its position is predicted.
    """
    table = csv.writer(out, lineterminator="\n")
    table.writerow(COLUMNS)
    count = 0
    for one in states:
        metres = (one.x_m, one.y_m, one.heading_rad, one.speed_mps, one.length_m, one.width_m)
        numbers = [f"{value:.3f}" for value in metres]
        table.writerow([one.t_us, one.car, one.car_class, *numbers, one.road, one.lane, int(one.linked)])
        count += 1
    return count


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
    walk = _Views(camera, iter(views))
    written = without_frame = outside = 0
    for number, one in _numbered(states, frames):
        view = walk.at(one.t_us)
        box = None if view is None else view.box(one)
        if number is None:
            without_frame += 1
        elif box is None:
            outside += 1
        else:
            left, top, width, height = (f"{value:.2f}" for value in box)
            out.write(f"{number},{car_numbers[one.car]},{left},{top},{width},{height},{int(one.linked)},-1,-1,-1\n")
            written += 1
    return MotReport(written, without_frame, outside)


def footprint_corners(state: CarState) -> tuple[Point, Point, Point, Point]:
    """Find the corners of a car's footprint in metres, counter-clockwise from the front left.

    Examples
    --------
    >>> footprint_corners(CarState(0, "car1", 10.0, 5.0, 0.0, 0.0, 4.0, 2.0))
    ((12.0, 6.0), (8.0, 6.0), (8.0, 4.0), (12.0, 4.0))
    """
    ahead_x, ahead_y = (
        math.cos(state.heading_rad) * state.length_m / 2,
        math.sin(state.heading_rad) * state.length_m / 2,
    )
    left_x, left_y = -math.sin(state.heading_rad) * state.width_m / 2, math.cos(state.heading_rad) * state.width_m / 2
    x_m, y_m = state.x_m, state.y_m
    return (
        (x_m + ahead_x + left_x, y_m + ahead_y + left_y),
        (x_m - ahead_x + left_x, y_m - ahead_y + left_y),
        (x_m - ahead_x - left_x, y_m - ahead_y - left_y),
        (x_m + ahead_x - left_x, y_m + ahead_y - left_y),
    )


class _Views:
    """Walk through the views of a run in step with its states; a fixed camera has the same one all the time."""

    def __init__(self, camera: CameraRecord, views: Iterator[ViewRecord]) -> None:
        self._size_px = (camera.width_px, camera.height_px)
        self._views = views
        self._next = next(views, None)
        self._is_moving = self._next is not None
        self._present = None if self._is_moving else _View(camera.pixel_from_ground, *self._size_px)
        self._present_us = -1

    def at(self, t_us: int) -> "_View | None":
        """Return the view at this time, None if it is not known; times must not decrease."""
        while self._next is not None and self._next.t_us <= t_us:
            numbers = self._next.pixel_from_ground
            self._present = _View(numbers, *self._size_px) if numbers else None
            self._present_us = self._next.t_us
            self._next = next(self._views, None)
        return None if self._is_moving and self._present_us != t_us else self._present


def _numbered(states: Iterable[CarState], frames: Iterable[tuple[int, int]]) -> Iterator[tuple[int | None, CarState]]:
    """Join states and frames by time, both read once; None for a state between frames."""
    walk = iter(frames)
    number, t_us = next(walk, (0, None))
    for state in states:
        while t_us is not None and t_us < state.t_us:
            number, t_us = next(walk, (0, None))
        yield (number if t_us == state.t_us else None), state


class _View:
    """Where footprints lie in an image; points behind the camera have no place there."""

    def __init__(self, pixel_from_ground: Sequence[float], width_px: int, height_px: int) -> None:
        self._h = pixel_from_ground
        self._width_px, self._height_px = width_px, height_px
        # The scale of a homography is free, so which sign means "in front" is read off a point that is: the ground
        # at the middle of the lower edge, which is never above the horizon.
        x_m, y_m = self._ground((self._width_px - 1) / 2, self._height_px - 1)
        self._front = 1.0 if self._depth(x_m, y_m) > 0 else -1.0

    def box(self, state: CarState) -> Box | None:
        """Return left, top, width and height as MOT counts them; None if not in the image."""
        corners = footprint_corners(state)
        if any(self._front * self._depth(*corner) <= 0 for corner in corners):
            return None
        points = [self._pixel(*corner) for corner in corners]
        left, right = min(x for x, _ in points), max(x for x, _ in points)
        top, bottom = min(y for _, y in points), max(y for _, y in points)
        if right < -0.5 or bottom < -0.5 or left > self._width_px - 0.5 or top > self._height_px - 0.5:
            return None
        return left + _MOT_OFFSET_PX, top + _MOT_OFFSET_PX, right - left, bottom - top

    def _depth(self, x_m: float, y_m: float) -> float:
        return self._h[6] * x_m + self._h[7] * y_m + self._h[8]

    def _pixel(self, x_m: float, y_m: float) -> Point:
        h, depth = self._h, self._depth(x_m, y_m)
        return (h[0] * x_m + h[1] * y_m + h[2]) / depth, (h[3] * x_m + h[4] * y_m + h[5]) / depth

    def _ground(self, x_px: float, y_px: float) -> Point:
        """Map a pixel to the ground by the adjugate of the homography, which is its inverse up to scale."""
        a, b, c, d, e, f, g, h, i = self._h
        x = (e * i - f * h) * x_px + (c * h - b * i) * y_px + (b * f - c * e)
        y = (f * g - d * i) * x_px + (a * i - c * g) * y_px + (c * d - a * f)
        w = (d * h - e * g) * x_px + (b * g - a * h) * y_px + (a * e - b * d)
        return x / w, y / w
