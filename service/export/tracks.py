"""How are the cars of a run written to files?

CSV and Parquet have the columns of a generated scene's `truth.csv`, as far as a recogniser can know them. MOT text is
what tracker benchmarks read: boxes in the image, with whole-numbered frames and objects.
"""

import csv
import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import groupby
from operator import attrgetter
from typing import TextIO

import numpy as np

from gis.cameras.camera import GroundCamera
from service.export.parquet import parquet
from service.records.runs import CameraRecord
from service.records.seen import MOT_OFFSET_PX, CarState, ViewRecord

COLUMNS = (
    "t_us", "id", "class", "x_m", "y_m", "heading_rad", "speed_mps", "length_m", "width_m", "road", "lane", "visible",
)  # fmt: skip

Point = tuple[float, float]
Box = tuple[float, float, float, float]

END = (0, 1 << 62)  # behind the frames


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


def tracks_parquet(states: Iterable[CarState]) -> Iterator[bytes]:
    """Write car states as Parquet, some at once; raises as `parquet`."""
    kinds = dict.fromkeys(COLUMNS, "float64") | dict.fromkeys(("id", "class", "road", "lane"), "string")
    fields = attrgetter(
        "t_us", "car", "car_class", "x_m", "y_m", "heading_rad", "speed_mps", "length_m", "width_m", "road", "lane",
        "linked",
    )  # fmt: skip
    return parquet([*(kinds | {"t_us": "int64", "visible": "bool"}).items()], map(fields, states))


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
    without_frame = outside = 0
    for number, t_us, cars in _numbered(states, frames):
        view = walk.at(t_us)
        boxes = [None] * len(cars) if view is None else _boxes(cars, view, camera)
        for one, box in zip(cars, boxes, strict=True):
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
        self._lens = camera.lens
        self._next = next(views, None)
        looks_on = self._next is None or not self._next.pixel_from_ground
        self._last = ViewRecord(0, camera.pixel_from_ground) if looks_on else None

    def at(self, t_us: int) -> GroundCamera | None:
        """Return the camera as it looks at this time, None if that is not known; times must not decrease.

        Between two views it is the mean of both, weighted by time.
        """
        numbers = self._at(t_us)
        if numbers is None:
            return None
        return GroundCamera.from_homography(np.linalg.inv(np.array(numbers).reshape(3, 3)), self._lens)

    def _at(self, t_us: int) -> tuple[float, ...] | None:
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


def _numbered(
    states: Iterable[CarState], frames: Iterable[tuple[int, int]]
) -> Iterator[tuple[int | None, int, list[CarState]]]:
    """Join states and frames by time, both read once: number, time, states; no number between frames."""
    walk = iter(frames)
    number, frame_us = next(walk, END)
    for t_us, cars in groupby(states, key=attrgetter("t_us")):
        while frame_us < t_us:
            number, frame_us = next(walk, END)
        yield (number if frame_us == t_us else None), t_us, list(cars)


def _boxes(states: Sequence[CarState], view: GroundCamera, camera: CameraRecord) -> list[Box | None]:
    """Give left, top, width and height of each as MOT counts them; None if not in the image."""
    corners_m = np.array([footprint_corners(one) for one in states])
    corners_px = view.to_pixels(corners_m.reshape(-1, 2)).reshape(corners_m.shape)
    low_px, high_px = corners_px.min(axis=1), corners_px.max(axis=1)  # nan with a corner behind the camera
    is_seen = ((high_px >= -0.5) & (low_px <= np.array([camera.width_px, camera.height_px]) - 0.5)).all(axis=1)
    boxes = np.hstack((low_px + MOT_OFFSET_PX, high_px - low_px)).tolist()
    return [tuple(box) if seen else None for box, seen in zip(boxes, is_seen, strict=True)]
