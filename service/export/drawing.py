"""What did a run see? Cars, their trails and the events of a log, drawn on the frames of its video."""

import hashlib
import math
from collections import defaultdict, deque
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import groupby

import cv2
import numpy as np
from msgspec.structs import replace
from numpy.typing import NDArray

from gis.cameras.camera import GroundCamera
from service.export.tracks import footprint_corners
from service.records.events import EventRecord
from service.records.seen import CarState
from vision.networks.box_detector import CLASS_NAMES, ImageBoxes
from vision.objects import ByteArray, FloatArray

Colour = tuple[int, int, int]
Projection = Callable[[FloatArray], FloatArray]

TRAIL_US = 3_000_000
EVENT_LINGER_US = 2_000_000
HIDDEN_US = 300_000  # hidden cars have rows a fifth of a second apart
DASH_PX = 4
FAR_PX = 30_000  # beyond this OpenCV's fixed-point drawing overflows
FONT = cv2.FONT_HERSHEY_SIMPLEX
WHITE: Colour = (255, 255, 255)
BLACK: Colour = (0, 0, 0)
BOX: Colour = (0, 235, 255)
LEAST_WIDTH_PX = 1280  # smaller pictures are drawn larger, so that letters fit


@dataclass(frozen=True, slots=True)
class Overlay:
    """Hold what is drawn on one frame.

    Attributes
    ----------
    cars : states at the frame's time; where there is none for it, moved on from the last one.
    trails : (n, 2) ground points of the last seconds, by car.
    events : events that go on, or ended a moment ago.
    """

    cars: Sequence[CarState]
    trails: dict[str, FloatArray]
    events: Sequence[EventRecord]


class OverlayReader:
    """Walk through a log's states in step with the frames of its video.

    Parameters
    ----------
    states : ordered by time.
    events : in any order.
    """

    def __init__(self, states: Iterable[CarState], events: Sequence[EventRecord]) -> None:
        self._groups: Iterator[tuple[int, list[CarState]]] = (
            (t_us, list(group)) for t_us, group in groupby(states, key=lambda state: state.t_us)
        )
        self._next = next(self._groups, None)
        self._events = events
        self._trails: dict[str, deque[tuple[int, float, float]]] = defaultdict(deque)
        self._last: dict[str, CarState] = {}  # the last row of each car

    def at(self, t_us: int, *, looked_us: int | None = None) -> Overlay:
        """Return what to draw on the frame of this time.

        Parameters
        ----------
        t_us : must not decrease.
        looked_us : time of the newest frame that the run looked at; None for this one.
        """
        looked_us = t_us if looked_us is None else looked_us
        while self._next is not None and self._next[0] <= t_us:
            for state in self._next[1]:
                self._last[state.car] = state
                self._trails[state.car].append((state.t_us, state.x_m, state.y_m))
            self._next = next(self._groups, None)
        self._last = {car: one for car, one in self._last.items() if one.t_us > t_us - HIDDEN_US}
        cars = [_moved(one, t_us) for one in self._last.values() if one.t_us >= looked_us or not one.linked]
        events = [event for event in self._events if event.start_us <= t_us < event.end_us + EVENT_LINGER_US]
        return Overlay(cars, self._recent_trails(t_us), events)

    def _recent_trails(self, t_us: int) -> dict[str, FloatArray]:
        for car in list(self._trails):
            trail = self._trails[car]
            while trail and trail[0][0] < t_us - TRAIL_US:
                trail.popleft()
            if not trail:
                del self._trails[car]
        return {car: np.array([point[1:] for point in trail]) for car, trail in self._trails.items()}


def _moved(state: CarState, t_us: int) -> CarState:
    """Move a car on from its row, until it has the next one."""
    way_m = state.speed_mps * (t_us - state.t_us) * 1e-6
    x_m, y_m = state.x_m + way_m * math.cos(state.heading_rad), state.y_m + way_m * math.sin(state.heading_rad)
    return replace(state, t_us=t_us, x_m=x_m, y_m=y_m)


def draw_overlay(
    picture: ByteArray, overlay: Overlay, camera: GroundCamera | None, *, scale: float = 1.0, is_named: bool = True
) -> ByteArray:
    """Draw cars, trails and events on a copy of a picture.

    A car that is seen has a closed box with a dot at its front; one that is only predicted, as when something hides
    it, a dashed box and a question mark.

    Parameters
    ----------
    picture : (h, w, 3) blue, green, red.
    camera : None where that of a moving view did not know where it looked, which is then said instead of the cars.
    scale : by which the picture is larger than that of the camera.
    is_named : else boxes alone, without symbols, trails and events.
    """
    canvas = picture.copy()
    if camera is None:
        write_text(canvas, "view lost", (8, canvas.shape[0] - 10), WHITE)
    else:
        _draw_traffic(canvas, overlay, lambda m: (camera.to_pixels(m) + 0.5) * scale - 0.5, is_named=is_named)
    for line, event in enumerate(overlay.events if is_named else ()):
        roles = ", ".join(f"{role} {symbol}" for role, symbol in event.roles.items())
        write_text(canvas, f"{event.type}: {roles}", (8, 20 + 18 * line), WHITE)
    return canvas


def draw_boxes(picture: ByteArray, boxes: ImageBoxes) -> ByteArray:
    """Draw the boxes of a detector with class and score on a copy of a picture.

    Parameters
    ----------
    picture : (h, w, 3) blue, green, red.
    boxes : in its pixels.

    Returns
    -------
    A picture twice as large where it is small, so that the letters fit.
    """
    factor = 1 if picture.shape[1] >= LEAST_WIDTH_PX else 2
    canvas = np.asarray(cv2.resize(picture, None, fx=factor, fy=factor, interpolation=cv2.INTER_CUBIC), np.uint8)
    centre_px, size_px = (boxes.centre_px + 0.5) * factor - 0.5, boxes.size_px * factor
    labels = [
        f"{CLASS_NAMES[number]} {score:.2f}" for number, score in zip(boxes.class_number, boxes.score, strict=True)
    ]
    for centre, size, angle, label in zip(centre_px, size_px, np.degrees(boxes.angle_rad), labels, strict=True):
        corners = cv2.boxPoints((centre.tolist(), size.tolist(), float(angle))).round().astype(np.int32)
        cv2.polylines(canvas, [corners], isClosed=True, color=BOX, thickness=1, lineType=cv2.LINE_AA)
        left, top = corners.min(axis=0).tolist()
        write_text(canvas, label, (max(left, 0), max(top - 3, 12)), WHITE)
    return canvas


def colour_of(car: str) -> Colour:
    """Return a bright colour that is always the same for one car symbol."""
    hue = int.from_bytes(hashlib.blake2b(car.encode(), digest_size=2).digest(), "big") % 180
    blue, green, red = cv2.cvtColor(np.array([[[hue, 220, 255]]], np.uint8), cv2.COLOR_HSV2BGR)[0, 0].tolist()
    return blue, green, red


def _draw_traffic(canvas: ByteArray, overlay: Overlay, project: Projection, *, is_named: bool) -> None:
    for car, trail_m in overlay.trails.items() if is_named else ():
        for piece in in_front(project(trail_m)):
            cv2.polylines(canvas, [piece], isClosed=False, color=colour_of(car), thickness=1, lineType=cv2.LINE_AA)
    for state in overlay.cars:
        _draw_car(canvas, state, project, is_named=is_named)


def _draw_car(canvas: ByteArray, state: CarState, project: Projection, *, is_named: bool) -> None:
    corners_px = project(np.array(footprint_corners(state)))
    if not np.isfinite(corners_px).all():
        return  # behind the camera
    outline = np.clip(np.round(corners_px), -FAR_PX, FAR_PX).astype(np.int32)
    colour = colour_of(state.car)
    if state.linked:
        cv2.polylines(canvas, [outline], isClosed=True, color=colour, thickness=1)
        front = (outline[0] + outline[3]) // 2
        cv2.circle(canvas, (int(front[0]), int(front[1])), 1, colour, -1)
    else:
        for start, end in zip(corners_px, np.roll(corners_px, -1, axis=0), strict=True):
            _draw_dashes(canvas, start, end, colour)
    if not is_named:
        return
    anchor = (int(outline[:, 0].max()) + 2, int(outline[:, 1].min()) - 2)
    write_text(canvas, state.car if state.linked else f"{state.car}?", anchor, colour)


def _draw_dashes(canvas: ByteArray, start: FloatArray, end: FloatArray, colour: Colour) -> None:
    count = max(1, round(float(np.hypot(*(end - start))) / DASH_PX / 2))
    cuts = np.clip(np.linspace(start, end, 2 * count + 1), -FAR_PX, FAR_PX)
    for first, second in zip(cuts[::2], cuts[1::2], strict=False):
        pair = np.round(np.array([first, second])).astype(np.int32)
        cv2.polylines(canvas, [pair], isClosed=False, color=colour, thickness=1)


def write_text(canvas: ByteArray, text: str, at_px: tuple[int, int], colour: Colour, size: float = 0.4) -> None:
    """Write with a dark edge; `at_px` is the lower left corner."""
    # An edge of its own thickness would not do: letters of another weight are of another width.
    for x_px, y_px in ((-1, 0), (1, 0), (0, -1), (0, 1)):
        cv2.putText(canvas, text, (at_px[0] + x_px, at_px[1] + y_px), FONT, size, BLACK, 1, cv2.LINE_AA)
    cv2.putText(canvas, text, at_px, FONT, size, colour, 1, cv2.LINE_AA)


def in_front(points_px: FloatArray) -> list[NDArray[np.int32]]:
    """Split a line at the points that have no place in the image, and round what is left."""
    is_there = np.isfinite(points_px[:, 0])
    pieces = np.split(np.arange(len(points_px)), np.flatnonzero(np.diff(is_there)) + 1)
    kept = (points_px[piece] for piece in pieces if is_there[piece[0]])
    return [np.clip(np.round(piece), -FAR_PX, FAR_PX).astype(np.int32) for piece in kept]
