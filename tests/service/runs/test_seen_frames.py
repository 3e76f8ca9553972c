"""Frames that vision has looked at before a stream carries them."""

from collections.abc import Iterable, Iterator

import numpy as np
import pytest

from service.runs.seen_frames import Seen, see
from tests.vision.support import make_frame
from vision.errors import VideoBroken
from vision.objects import VisionObjects
from vision.video.frame import Frame

STEP_US = 40_000
PICTURE = np.zeros((2, 2))


class Clock:
    """Stand still, except while somebody works."""

    def __init__(self) -> None:
        self.now_ns = 0

    def __call__(self) -> int:
        return self.now_ns


class SlowVision:
    """Hold the first frames; looking at one takes 5 ns, holding it 1 ns."""

    def __init__(self, clock: Clock, held: int) -> None:
        self._clock = clock
        self._count = held
        self._held: list[int] = []

    def observe(self, frame: Frame) -> Iterable[VisionObjects]:
        self._held.append(frame.t_us)
        if len(self._held) <= self._count:
            self._clock.now_ns += 1
            return []
        self._count = 0
        return self.finish()

    def finish(self) -> Iterator[VisionObjects]:
        held, self._held = self._held, []
        for t_us in held:
            self._clock.now_ns += 5
            yield VisionObjects.lost(t_us)


def frames(count: int, *, breaks: bool = False) -> Iterator[Frame]:
    yield from (make_frame(PICTURE, index=k, t_us=STEP_US * k) for k in range(count))
    if breaks:
        raise VideoBroken(path="v.mp4", t_us=STEP_US * (count - 1), frame_index=count, reason="damage")


def look(count: int, *, held: int, breaks: bool = False) -> Iterator[Seen | None]:
    clock = Clock()
    return see(frames(count, breaks=breaks), SlowVision(clock, held), clock)


def told(samples: Iterable[Seen | None]) -> list[tuple[int, int, int] | None]:
    """Give (number of the frame with which it was known, its own number, nanoseconds)."""
    return [
        None if one is None else (one.available_us // STEP_US, one.valid_us // STEP_US, one.value.busy_ns)
        for one in samples
    ]


def test_held_frames_come_one_by_one_as_known_with_the_frame_that_released_them() -> None:
    assert told(look(5, held=2)) == [None, None, (2, 0, 7), (2, 1, 5), (2, 2, 5), (3, 3, 5), (4, 4, 5), None]


def test_frames_held_to_the_end_are_known_with_the_last_one() -> None:
    assert told(look(2, held=9)) == [None, None, (1, 0, 7), (1, 1, 5)]


def test_only_what_is_taken_is_looked_at() -> None:
    clock = Clock()
    seen = see(frames(9), SlowVision(clock, 4), clock)
    assert told(next(seen) for _ in range(6))[4:] == [(4, 0, 9), (4, 1, 5)]
    assert clock.now_ns == 4 + 2 * 5


def test_what_was_held_comes_before_the_break() -> None:
    samples = []
    with pytest.raises(VideoBroken, match="damage"):
        samples.extend(look(3, held=9, breaks=True))
    assert told(samples[3:]) == [(2, 0, 8), (2, 1, 5), (2, 2, 5)]
