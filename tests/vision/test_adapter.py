"""Vision in a stream graph: what is published, and what is held back while the view is lost."""

from collections.abc import Sequence

import numpy as np

from dyknow.sample import Sample
from tests.vision.support import make_frame
from vision.adapter import VisionUnit
from vision.objects import VisionObjects
from vision.settings import VisionSettings
from vision.video.frames import Frame

STEP_US = 40_000


class Script:
    """Vision that is lost in some frames."""

    def __init__(self, lost: Sequence[int], settings: VisionSettings) -> None:
        self._lost = lost
        self.settings = settings

    def observe(self, frame: Frame) -> list[VisionObjects]:
        lost = VisionObjects.lost(frame.t_us)
        seen = VisionObjects(frame.t_us, *[getattr(lost, name) for name in VisionObjects.__slots__[1:9]])
        return [lost if frame.index in self._lost else seen]

    def finish(self) -> list[VisionObjects]:
        return []


def published(lost: Sequence[int], count: int, settings: VisionSettings | None = None) -> list[tuple[int, int, bool]]:
    """Run frames through the unit: (number of the frame at which a sample came, its frame, whether it is lost)."""
    unit, told = VisionUnit(Script(lost, settings or VisionSettings())), []
    picture = np.zeros((2, 2))
    for k in range(count):
        for sample in unit.update(Sample(STEP_US * k, STEP_US * k, make_frame(picture, index=k, t_us=STEP_US * k))):
            told.append((k, sample.valid_us // STEP_US, sample.value.is_lost))
    return told + [(count, one.valid_us // STEP_US, one.value.is_lost) for one in unit.finish()]


def test_nothing_is_published_while_the_view_is_lost() -> None:
    told = published(range(3, 20), 22)
    assert told == [(0, 0, False), (1, 1, False), (2, 2, False), (20, 3, True), (20, 20, False), (21, 21, False)]


def test_short_loss_is_passed_over() -> None:
    assert [frame for _, frame, _ in published(range(3, 9), 11)] == [0, 1, 2, 9, 10]


def test_loss_at_the_end_is_told_at_the_end() -> None:
    assert published([2, 3, 4], 5)[2:] == [(5, 2, True)]


def times_told(times_us: Sequence[int]) -> list[tuple[int, bool, str]]:
    unit = VisionUnit(Script((), VisionSettings()))
    frames = [make_frame(np.zeros((2, 2)), index=k, t_us=t_us) for k, t_us in enumerate(times_us)]
    samples = [one for frame in frames for one in unit.update(Sample(frame.t_us, frame.t_us, frame))]
    return [(one.valid_us, one.value.is_lost, one.value.why_lost) for one in samples]


def test_a_hole_in_the_frames_is_a_lost_view() -> None:
    assert times_told([0, 80_000, 160_000, 9_160_000, 9_240_000]) == [
        (0, False, ""),
        (80_000, False, ""),
        (160_000, False, ""),
        (240_000, True, "no picture came for 9.0 s"),
        (9_160_000, False, ""),
        (9_240_000, False, ""),
    ]


def test_frames_that_come_seldom_or_a_little_late_are_no_hole() -> None:
    for times_us in ([0, 2_000_000, 4_000_000, 9_000_000], [0, 40_000, 80_000, 360_000, 400_000]):
        assert times_told(times_us) == [(t_us, False, "") for t_us in times_us]
