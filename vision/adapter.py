"""How does vision sit in a stream graph? A DyKnow process: frames in, tracked vision objects out."""

from collections.abc import Iterable

from dyknow.sample import Sample
from vision.fixed_camera import FixedCameraVision
from vision.frames import Frame
from vision.objects import VisionObjects


class VisionUnit:
    """Run a fixed camera's vision as a computational unit.

    During start-up it answers with nothing, then with all held frames at once: their valid times are those of the
    frames, their available time is that of the frame which ended the start-up.
    """

    __slots__ = ("_available_us", "_vision")

    def __init__(self, vision: FixedCameraVision) -> None:
        self._vision = vision
        self._available_us = 0

    def update(self, sample: Sample[Frame]) -> Iterable[Sample[VisionObjects]]:
        """Turn one frame into the vision objects that it allows to publish."""
        self._available_us = sample.available_us
        return self._samples(self._vision.observe(sample.value))

    def finish(self) -> Iterable[Sample[VisionObjects]]:
        """Publish the frames of a clip that ended during start-up."""
        return self._samples(self._vision.finish())

    def _samples(self, results: Iterable[VisionObjects]) -> list[Sample[VisionObjects]]:
        return [Sample(self._available_us, objects.t_us, objects) for objects in results]
