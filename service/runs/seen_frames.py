"""What does vision make of a video, frame by frame, before any stream carries it?

In the shipped streams nothing stands between the frames and vision. So they are fed with frames that vision has looked
at already, and the vision of the stream graph only hands on what was seen: after a long start-up held frames come one
by one, and a run can tell how far it is, or be interrupted, between any two of them.
"""

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field
from functools import partial

from dyknow.streams.sample import Sample
from vision.adapter import Vision, VisionUnit
from vision.errors import VideoBroken
from vision.objects import VisionObjects
from vision.video.frame import Frame


@dataclass(frozen=True, slots=True)
class SeenFrame:
    """Hold what vision saw in one frame.

    Attributes
    ----------
    busy_ns : what it took to see this frame, and those before it that gave nothing yet.
    """

    objects: VisionObjects
    busy_ns: int = field(repr=False, compare=False)


Seen = Sample[SeenFrame]


def see(frames: Iterable[Frame], vision: Vision[Frame], clock: Callable[[], int]) -> Iterator[Seen | None]:
    """Look at the frames of a video.

    Parameters
    ----------
    clock : nanoseconds.

    Yields
    ------
    Each frame once it is seen, available at the time of the frame with which that became known; None for each that is
    held back for now, so that the caller is not kept waiting.

    Raises
    ------
    VideoBroken
        Where the video cannot be read on, after what was held.
    """
    looks = _Looks(clock)
    try:
        for frame in frames:
            yield from looks.at(frame.t_us, partial(vision.observe, frame))
    except VideoBroken:
        yield from looks.at(looks.now_us, vision.finish)
        raise
    yield from looks.at(looks.now_us, vision.finish)


class _Looks:
    """Time how long it takes to see.

    Attributes
    ----------
    now_us : of the newest frame looked at.
    """

    def __init__(self, clock: Callable[[], int]) -> None:
        self.now_us = 0
        self._clock = clock
        self._spent_ns = 0

    def at(self, t_us: int, look: Callable[[], Iterable[VisionObjects]]) -> Iterator[Seen | None]:
        """Take a look at a media time; give what is seen now, None if that is nothing."""
        self.now_us = t_us
        started_ns, is_held = self._clock(), True
        for objects in look():
            busy_ns = self._spent_ns + self._clock() - started_ns
            yield Sample(t_us, objects.t_us, SeenFrame(objects, busy_ns))
            self._spent_ns, started_ns, is_held = 0, self._clock(), False
        self._spent_ns += self._clock() - started_ns
        if is_held:
            yield None


class SeenVision:
    """Stand where vision stands, and give what was seen before."""

    def observe(self, frame: SeenFrame) -> list[VisionObjects]:
        """Give the objects of a frame."""
        return [frame.objects]

    def finish(self) -> list[VisionObjects]:
        """Give nothing: a frame comes when it has been seen."""
        return []


class SeenVisionUnit:
    """Run vision that has looked ahead as a computational unit.

    Attributes
    ----------
    busy_ns : what it took to see the frames.
    """

    def __init__(self) -> None:
        self.busy_ns = 0
        self._unit = VisionUnit(SeenVision())

    def update(self, sample: Seen) -> Iterable[Sample[VisionObjects]]:
        """Turn one frame into the vision objects that it allows to publish."""
        self.busy_ns += sample.value.busy_ns
        return self._unit.update(sample)

    def finish(self) -> Iterable[Sample[VisionObjects]]:
        """Publish that the view is lost, if it ended so."""
        return self._unit.finish()
