"""How does vision sit in a stream graph? A DyKnow process: frames in, tracked vision objects out.

While a moving camera does not know where it looks, nothing is published: whatever follows would conclude from missing
objects. When the view is back (or the video ends) one sample without objects, valid from the first frame without a
view, says that nothing is known from then on; a loss so short that tracks bridge it is passed over.
"""

from collections.abc import Iterable, Iterator, Sequence
from itertools import chain
from typing import Generic, Protocol, TypeVar

from dyknow.sample import NOT_YET, Sample
from vision.objects import VisionObjects
from vision.settings import VisionSettings

HOLE_STEPS = 5
"""Frames that come late by less are no hole, however seldom they come."""

FrameT = TypeVar("FrameT")
FrameT_contra = TypeVar("FrameT_contra", contravariant=True)


class Vision(Protocol[FrameT_contra]):
    """Vision of one camera, fixed or moving: one result for each frame, sooner or later.

    Results may be made while they are taken: take them all before the next call.
    """

    @property
    def settings(self) -> VisionSettings:
        """Its constants."""
        ...

    def observe(self, frame: FrameT_contra, /) -> Iterable[VisionObjects]:
        """Take the next frame and give the results that are ready."""
        ...

    def notes(self) -> Sequence[str]:
        """Say what people should know of what was seen so far."""
        ...

    def finish(self) -> Iterable[VisionObjects]:
        """Give the results still held at the end of the video."""
        ...


class VisionUnit(Generic[FrameT]):
    """Run a camera's vision as a computational unit.

    During start-up it answers "not yet", then with all held frames, one when it is asked for after the other: their
    valid times are those of the frames, their available time is that of the frame which ended the start-up.
    """

    def __init__(self, vision: Vision[FrameT]) -> None:
        self._last_us: int | None = None
        self._step_us: int | None = None  # between the last two frames that had no hole between them
        self._vision = vision
        self._available_us = 0
        self._lost: VisionObjects | None = None  # the first frame without a view, while nobody has been told

    def update(self, sample: Sample[FrameT]) -> Iterable[Sample[VisionObjects]]:
        """Turn one frame into the vision objects that it allows to publish."""
        self._available_us = sample.available_us
        results = iter(self._vision.observe(sample.value))
        first = next(results, None)
        return NOT_YET if first is None else self._samples(chain((first,), results))

    def finish(self) -> Iterator[Sample[VisionObjects]]:
        """Publish the frames of a clip that ended during start-up, or that the view is lost."""
        yield from self._samples(self._vision.finish())
        if self._lost is not None:
            yield self._sample(self._lost)

    def _samples(self, results: Iterable[VisionObjects]) -> Iterator[Sample[VisionObjects]]:
        return map(self._sample, self._told(results))

    def _sample(self, objects: VisionObjects) -> Sample[VisionObjects]:
        return Sample(self._available_us, objects.t_us, objects)

    def _told(self, results: Iterable[VisionObjects]) -> Iterator[VisionObjects]:
        """Hold back what has no view; tell of it when the view is back."""
        for objects in results:
            if hole := self._hole_before(objects.t_us):
                yield hole
            if objects.is_lost:
                self._lost = self._lost or objects
                continue
            if self._lost is not None:
                if objects.t_us - self._lost.t_us > self._vision.settings.bridged_us:
                    yield self._lost
                self._lost = None
            yield objects

    def _hole_before(self, t_us: int) -> VisionObjects | None:
        """Take note of the time of a frame; give the frame without a view that was missing before it, if any."""
        last_us, self._last_us = self._last_us, t_us
        if last_us is None:
            return None
        since_us = t_us - last_us
        if self._step_us is None or since_us <= max(self._vision.settings.bridged_us, HOLE_STEPS * self._step_us):
            self._step_us = since_us
            return None
        if self._lost is not None:  # and has been since before
            return None
        return VisionObjects.lost(last_us + self._step_us, f"no picture came for {since_us / 1e6:.1f} s")
