"""Can what is found on a ground that was only guessed be vehicles? Where it cannot, the run had better stop."""

from collections.abc import Iterable, Iterator, Sequence

import numpy as np

from service.errors import InputError
from vision.camera import Camera
from vision.objects import FloatArray, VisionObjects
from vision.settings import VisionSettings
from vision.video.frame import Frame

# In a standing jam a vehicle takes its length, a gap, and the width of a lane: no more of them fit on any ground.
LEAST_ROOM_M2 = 25.0
# Of so many things or more that have been there for so long, some move: even where a queue stands, others do.
MANY = 40
LONG_US = 5_000_000
STANDING_SHARE = 0.8


class DoubtedVision:
    """The vision of a camera whose ground was guessed: as that of the camera, until it cannot be true.

    Parameters
    ----------
    camera : finds the objects.
    area_m2 : of the ground in view.
    where : the clip, for the message.
    """

    def __init__(self, camera: Camera[Frame], area_m2: float, where: str) -> None:
        self._camera = camera
        self._area_m2 = area_m2
        self._where = where
        self._first: dict[str, tuple[int, FloatArray]] = {}  # when and where each object was first seen
        self._moved: set[str] = set()

    @property
    def settings(self) -> VisionSettings:
        """Return those of the camera."""
        return self._camera.settings

    def prepare(self, frame: Frame) -> Frame:
        """Do the camera's part that depends on nothing but the frame."""
        return self._camera.prepare(frame)

    def observe(self, frame: Frame) -> Iterator[VisionObjects]:
        """Take the next frame.

        Raises
        ------
        InputError
            If what is found cannot be vehicles.
        """
        return self._checked(self._camera.observe(frame))

    def finish(self) -> Iterator[VisionObjects]:
        """End the video."""
        return self._checked(self._camera.finish())

    def notes(self) -> Sequence[str]:
        """Say what the camera says."""
        return self._camera.notes()

    def _checked(self, found: Iterable[VisionObjects]) -> Iterator[VisionObjects]:
        for objects in found:
            doubt = self._doubt(objects)
            if doubt:
                raise InputError(
                    f"{self._where} at {objects.t_us / 1e6:.2f} s: expected vehicles, got {doubt}: the scale, which "
                    "was taken from what moves, is wrong, or the camera moves more than can be followed; describe the "
                    "camera in a site file (--site)"
                )
            yield objects

    def _doubt(self, objects: VisionObjects) -> str:
        """Say what is wrong with what is seen at one time; nothing while it may be true."""
        count = len(objects.ids)
        room_m2 = float(np.maximum(objects.length_m * objects.width_m, LEAST_ROOM_M2).sum())
        if room_m2 > self._area_m2:
            return f"{count} things that need {room_m2:.0f} m2 on a ground of {self._area_m2:.0f} m2"
        self._note(objects)
        old = [one for one in objects.ids if objects.t_us - self._first[one][0] >= LONG_US]
        standing = sum(one not in self._moved for one in old)
        if len(old) >= MANY and standing > STANDING_SHARE * len(old):
            return f"{standing} of {len(old)} things that have not moved in {LONG_US / 1e6:.0f} s"
        return ""

    def _note(self, objects: VisionObjects) -> None:
        present = set(objects.ids)
        self._first = {one: first for one, first in self._first.items() if one in present}
        self._moved &= present
        for one, centre_m, length_m in zip(objects.ids, objects.centre_m, objects.length_m, strict=True):
            _, first_m = self._first.setdefault(one, (objects.t_us, centre_m))
            if float(np.hypot(*(centre_m - first_m))) > length_m:
                self._moved.add(one)
