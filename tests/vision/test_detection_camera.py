from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from tests.vision.networks.test_detection_ground import SIZE_PX, drawn, projection_of
from tests.vision.support import make_boxes, top_view
from vision.camera import box_camera
from vision.detection.parting.lanes import LaneStrip
from vision.networks.box_detector import GroundBoxes, ImageBoxes, Instant
from vision.networks.stored_detections import StoredInstant
from vision.objects import VisionObjects

FloatArray = NDArray[np.float64]

VIEW = top_view(SIZE_PX, 0.2)
ROAD = np.array([[-10.0, 30.0], [200.0, 30.0], [200.0, 50.0], [-10.0, 50.0]])
Rows = Sequence[tuple[float, float, float, float, float]]


class Seer:
    """A detector that draws boxes around what a function of seconds says, and more besides."""

    def __init__(self, world: Callable[[float], Rows], *, score: float = 0.9, extra: ImageBoxes | None = None) -> None:
        self._world, self._score, self._extra = world, score, extra

    def detect(self, instant: Instant) -> ImageBoxes | GroundBoxes:
        if self._extra is not None:
            return self._extra
        boxes = drawn(projection_of(VIEW), make_boxes(list(self._world(instant.t_us / 1e6))))
        return replace(boxes, score=np.full(len(boxes), self._score))


class Blinking:
    """A camera that does not know where it looks for a while."""

    refusal = "told to be lost"

    def locate(self, frame: Instant, vehicles_m: Sequence[FloatArray]) -> FloatArray | None:
        return None if 40 <= frame.index < 60 else VIEW


def watch(
    detector: Seer, *, count: int = 100, motion: Blinking | None = None, lanes: Sequence[LaneStrip] = ()
) -> list[VisionObjects]:
    vision = box_camera(detector, [ROAD], SIZE_PX, pixel_from_ground=VIEW, motion=motion, lanes=lanes)
    instants = (StoredInstant(k, 40_000 * k) for k in range(count))
    seen = [objects for instant in instants for objects in vision.observe(instant)]
    return [*seen, *vision.finish()]


def test_moving_and_standing_cars_are_tracked_from_the_first_second() -> None:
    results = watch(Seer(lambda t: [(20 + 12 * t, 38.0, 0.0, 4.5, 1.8), (60.0, 44.0, np.pi, 4.5, 1.8)]))
    assert [len(objects.ids) for objects in results[10:]] == [2] * 90
    assert len({name for objects in results for name in objects.ids}) == 2
    moving = int(np.argmin(results[-1].centre_m[:, 1]))
    assert results[-1].velocity_mps[moving] == pytest.approx([12.0, 0.0], abs=0.3)
    assert results[-1].centre_m[moving] == pytest.approx([20 + 12 * 3.96, 38.0], abs=0.2)


@pytest.mark.long
def test_diagonal_car_gets_its_heading_and_length_from_its_way() -> None:
    results = watch(Seer(lambda t: [(20 + 7 * t, 32 + 4 * t, 0.519, 5.0, 1.8)]))
    assert results[-1].heading_rad[0] == pytest.approx(0.519, abs=0.05)
    assert results[-1].length_m[0] == pytest.approx(5.0, abs=0.4)


@pytest.mark.long
def test_car_that_never_moved_lies_along_its_lane() -> None:
    standing = Seer(lambda t: [(60.0, 40.0, 0.519, 4.5, 1.8)])
    lane = LaneStrip(np.array([[60.0, 40.0], [60.0, 40.0]]) + np.outer([-20, 20], [np.cos(0.519), np.sin(0.519)]), 3.5)
    assert abs(watch(standing)[-1].heading_rad[0] - 0.519) > 0.3
    assert watch(standing, lanes=[lane])[-1].heading_rad[0] == pytest.approx(0.519)


@pytest.mark.long
def test_what_is_off_the_road_is_no_vehicle() -> None:
    assert all(objects.ids == () for objects in watch(Seer(lambda t: [(60.0, 60.0, 0.0, 4.5, 1.8)])))


@pytest.mark.long
def test_unsure_detections_need_longer_to_be_believed() -> None:
    def first_shown(score: float) -> int:
        results = watch(Seer(lambda t: [(20 + 12 * t, 38.0, 0.0, 4.5, 1.8)], score=score))
        return next(index for index, objects in enumerate(results) if objects.ids)

    assert first_shown(0.3) > 2 * first_shown(0.9)


@pytest.mark.long
def test_lost_view_is_told_and_tracks_end() -> None:
    results = watch(Seer(lambda t: [(20 + 12 * t, 38.0, 0.0, 4.5, 1.8)]), motion=Blinking())
    assert [objects.is_lost for objects in results] == [40 <= k < 60 for k in range(100)]
    assert len(results[99].ids) == 1


@pytest.mark.long
@pytest.mark.parametrize("count", [0, 10_000])
def test_no_box_and_ten_thousand_boxes_are_survived(count: int) -> None:
    rng = np.random.default_rng(3)
    wild = ImageBoxes(
        rng.uniform(-400, 1000, (count, 2)),
        rng.uniform(-5, 300, (count, 2)),
        np.where(rng.random(count) < 0.1, np.nan, 0.0),
        np.zeros(count, np.bool_),
        np.where(rng.random(count) < 0.1, np.nan, 0.5),
        np.zeros(count, np.intp),
    )
    results = watch(Seer(lambda t: [], extra=wild), count=1)
    assert len(results) == 1
