"""What did a run see? Cars, their trails and the events of a log, drawn on the frames of its video."""

import hashlib
from collections import defaultdict, deque
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import groupby

import cv2
import numpy as np
from numpy.typing import NDArray

from service.records import CarState, EventRecord

ByteArray = NDArray[np.uint8]
FloatArray = NDArray[np.float64]
Colour = tuple[int, int, int]

TRAIL_US = 3_000_000
EVENT_LINGER_US = 2_000_000
FONT = cv2.FONT_HERSHEY_SIMPLEX
WHITE: Colour = (255, 255, 255)
BLACK: Colour = (0, 0, 0)


@dataclass(frozen=True, slots=True)
class Overlay:
    """Hold what is drawn on one frame.

    Attributes
    ----------
    cars : states at the frame's time. trails : (n, 2) ground points of the last seconds, by car.
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

    def at(self, t_us: int) -> Overlay:
        """Return what to draw on the frame of this time; times must not decrease."""
        cars: list[CarState] = []
        while self._next is not None and self._next[0] <= t_us:
            group_us, group = self._next
            cars = group if group_us == t_us else []
            for state in group:
                self._trails[state.car].append((state.t_us, state.x_m, state.y_m))
            self._next = next(self._groups, None)
        return Overlay(cars, self._recent_trails(t_us), self._current_events(t_us))

    def _recent_trails(self, t_us: int) -> dict[str, FloatArray]:
        for car in list(self._trails):
            trail = self._trails[car]
            while trail and trail[0][0] < t_us - TRAIL_US:
                trail.popleft()
            if not trail:
                del self._trails[car]
        return {car: np.array([point[1:] for point in trail]) for car, trail in self._trails.items()}

    def _current_events(self, t_us: int) -> list[EventRecord]:
        return [event for event in self._events if event.start_us <= t_us < event.end_us + EVENT_LINGER_US]


def draw_overlay(picture: ByteArray, overlay: Overlay, pixel_from_ground: FloatArray) -> ByteArray:
    """Draw cars, trails and events on a copy of a picture.

    Parameters
    ----------
    picture : (h, w, 3) blue, green, red.
    pixel_from_ground : (3, 3) homography.
    """
    canvas = picture.copy()
    for car, trail_m in overlay.trails.items():
        points = np.round(_project(trail_m, pixel_from_ground)).astype(np.int32)
        cv2.polylines(canvas, [points], isClosed=False, color=colour_of(car), thickness=1, lineType=cv2.LINE_AA)
    for state in overlay.cars:
        _draw_car(canvas, state, pixel_from_ground)
    for line, event in enumerate(overlay.events):
        roles = ", ".join(f"{role} {symbol}" for role, symbol in event.roles.items())
        _write(canvas, f"{event.type}: {roles}", (8, 20 + 18 * line), WHITE)
    return canvas


def colour_of(car: str) -> Colour:
    """Return a bright colour that is always the same for one car symbol."""
    hue = int.from_bytes(hashlib.blake2b(car.encode(), digest_size=2).digest(), "big") % 180
    blue, green, red = cv2.cvtColor(np.array([[[hue, 220, 255]]], np.uint8), cv2.COLOR_HSV2BGR)[0, 0].tolist()
    return blue, green, red


def corners_m(state: CarState) -> FloatArray:
    """Return the corners of a car's footprint, (4, 2), counter-clockwise from front left."""
    ahead = np.array([np.cos(state.heading_rad), np.sin(state.heading_rad)]) * state.length_m / 2
    left = np.array([-np.sin(state.heading_rad), np.cos(state.heading_rad)]) * state.width_m / 2
    offsets_m: FloatArray = np.array([ahead + left, left - ahead, -ahead - left, ahead - left])
    centre_m: FloatArray = np.array([state.x_m, state.y_m])
    return centre_m + offsets_m


def _draw_car(canvas: ByteArray, state: CarState, pixel_from_ground: FloatArray) -> None:
    outline = np.round(_project(corners_m(state), pixel_from_ground)).astype(np.int32)
    colour = colour_of(state.car)
    cv2.polylines(canvas, [outline], isClosed=True, color=colour, thickness=1 if state.linked else 2)
    if state.linked:
        front = (outline[0] + outline[3]) // 2
        cv2.circle(canvas, (int(front[0]), int(front[1])), 1, colour, -1)
    anchor = (int(outline[:, 0].max()) + 2, int(outline[:, 1].min()) - 2)
    _write(canvas, state.car if state.linked else f"{state.car}?", anchor, colour)


def _write(canvas: ByteArray, text: str, at_px: tuple[int, int], colour: Colour) -> None:
    cv2.putText(canvas, text, at_px, FONT, 0.4, BLACK, 3, cv2.LINE_AA)
    cv2.putText(canvas, text, at_px, FONT, 0.4, colour, 1, cv2.LINE_AA)


def _project(points_m: FloatArray, pixel_from_ground: FloatArray) -> FloatArray:
    scaled = np.column_stack((points_m, np.ones(len(points_m)))) @ pixel_from_ground.T
    return np.asarray(scaled[:, :2] / scaled[:, 2:], np.float64)
