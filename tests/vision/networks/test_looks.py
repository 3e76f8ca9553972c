"""What a network sees alone that looks a few times a second, from low above the road."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from tests.vision.networks.test_detection_ground import drawn, slanted, view_of
from tests.vision.support import make_boxes, make_frame
from vision.camera import Camera, fixed_camera, moving_camera
from vision.networks.box_detector import ImageBoxes
from vision.objects import VisionObjects
from vision.road.boxes import Boxes
from vision.settings import VisionSettings
from vision.video.frame import Frame

SIZE_PX = (640, 360)
CAMERA = slanted(height_m=6.0, pitch_rad=0.2, focal_px=700.0)
ROAD = np.array([(-6.0, 10.0), (6.0, 10.0), (6.0, 150.0), (-6.0, 150.0)])
STEP_US = 40_000
EDGE_SHARE = 0.1  # as of a recipe that says nothing
World = Callable[[float], Boxes]


class Lookout:
    """Sees a world as it is; what it is told to miss is not there."""

    def __init__(self, world: World, missed_us: range = range(0), weak_us: range = range(0)) -> None:
        self._world, self._missed_us, self._weak_us = world, missed_us, weak_us
        self.times_us: list[int] = []

    def detect(self, instant: Frame) -> ImageBoxes:
        self.times_us.append(instant.t_us)
        found = drawn(CAMERA, self._world(instant.t_us / 1e6))
        is_weak = np.full(len(found), instant.t_us in self._weak_us)
        found = replace(found, is_weak=is_weak, edge_share=np.full(len(found), EDGE_SHARE))
        return found.select(slice(0, 0)) if instant.t_us in self._missed_us else found


def lane(*places: tuple[float, float, float]) -> World:
    """Cars in a lane along the view: (x, y at the start, speed) each."""

    def world(t_s: float) -> Boxes:
        return make_boxes([(x, y + speed * t_s, np.pi / 2, 4.5, 1.8) for x, y, speed in places])

    return world


def watched(lookout: Lookout, seconds: float, settings: VisionSettings | None = None) -> list[VisionObjects]:
    """Show frames without anything in them: only the network tells."""
    return observed(fixed_camera(CAMERA[:, [0, 1, 3]], [ROAD], SIZE_PX, settings, knows=lookout), seconds)


def observed(vision: Camera[Frame], seconds: float) -> list[VisionObjects]:
    """Observe grey frames."""
    grey: NDArray[np.float64] = np.full(SIZE_PX[::-1], 90.0)
    results: list[VisionObjects] = []
    for k in range(round(seconds * 1e6 / STEP_US)):
        results += vision.observe(vision.prepare(make_frame(grey, index=k, t_us=STEP_US * k)))
    return [*results, *vision.finish()]


class Still:
    """The motion of a camera that might move, and does not."""

    refusal = ""

    def locate(self, instant: Frame, outlines_m: list[NDArray[np.float64]]) -> NDArray[np.float64]:
        del instant, outlines_m
        return CAMERA[:, [0, 1, 3]]


@pytest.mark.long
def test_a_camera_that_moves_is_looked_through_the_same_way() -> None:
    world = lane((1.8, 20.0, 12.0))
    vision = moving_camera(CAMERA[:, [0, 1, 3]], [ROAD], SIZE_PX, Still(), reach_m=50.0, knows=Lookout(world))
    moving = observed(vision, 3.0)
    assert all(one.pixel_from_ground is not None for one in moving)
    for one, other in zip(moving, watched(Lookout(world), 3.0), strict=True):
        assert one.ids == other.ids
        assert np.array_equal(one.centre_m, other.centre_m)


def test_a_vehicle_is_told_of_in_every_frame_though_few_are_looked_at() -> None:
    world = lane((1.8, 20.0, 12.0))
    lookout = Lookout(world)
    results = watched(lookout, 4.0)
    assert len(results) == 100
    assert len(lookout.times_us) == 16
    late = results[30:]
    assert all(one.ids == ("v1",) and one.observed.all() for one in late)
    assert max(np.hypot(*(one.centre_m[0] - world(one.t_us / 1e6).centre_m[0])) for one in late) < 1.0


def test_a_look_that_misses_a_vehicle_says_that_it_is_not_seen_until_the_next_one() -> None:
    results = watched(Lookout(lane((1.8, 20.0, 10.0)), missed_us=range(2_000_000, 2_200_000)), 4.0)
    hidden_us = [one.t_us for one in results[30:] if not one.observed.all()]
    assert hidden_us == list(range(2_000_000, 2_240_001, STEP_US))
    assert {one.ids for one in results[30:]} == {("v1",)}


@pytest.mark.long
def test_weak_boxes_show_where_a_known_vehicle_is_and_tell_of_no_other() -> None:
    world = lane((1.8, 20.0, 10.0))
    results = watched(Lookout(world, weak_us=range(1_500_000, 4_000_000)), 4.0)
    assert all(one.ids == ("v1",) and one.observed.all() for one in results[40:])
    assert np.hypot(*(results[-1].centre_m[0] - world(results[-1].t_us / 1e6).centre_m[0])) < 1.0
    assert not any(one.ids for one in watched(Lookout(world, weak_us=range(4_000_000)), 4.0))


def test_what_stands_is_seen_as_well_as_what_drives() -> None:
    results = watched(Lookout(lane((-1.8, 40.0, 0.0), (1.8, 20.0, 8.0))), 3.0)
    assert all(len(one.ids) == 2 for one in results[40:])


def test_what_stands_with_its_middle_out_of_view_is_seen_between_looks_as_well() -> None:
    middle_m = 5.8, 12.2  # the right edge of the picture lies 5.6 m aside there
    assert not view_of(CAMERA).sees(np.array([middle_m]))[0]
    results = watched(Lookout(lane((*middle_m, 0.0))), 3.0)
    assert all(one.ids == ("v1",) and one.observed.all() for one in results[40:])


def test_who_drives_out_of_the_view_between_looks_is_not_seen_there() -> None:
    results = watched(Lookout(lane((1.8, 40.0, -12.0))), 4.0)
    shown_m = [one.centre_m[one.observed, 1] for one in results]
    assert min(float(y_m.min()) for y_m in shown_m if len(y_m)) > 9.0
    assert len(results[-1].ids) == 0


@pytest.mark.long
def test_vehicles_of_a_queue_keep_their_names() -> None:
    queue = lane(*((1.8, 20.0 + 7.5 * place, 2.0) for place in range(5)))
    results = watched(Lookout(queue), 6.0)
    assert {one.ids for one in results[40:]} == {tuple(f"v{number}" for number in range(1, 6))}
