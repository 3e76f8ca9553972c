"""What motion and a network that looks now and then see together, on small drawn pictures."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from tests.vision.support import draw_boxes, make_boxes, make_frame, top_view, whole_view
from vision.background.settings import BackgroundSettings
from vision.camera import fixed_camera
from vision.networks.box_detector import ImageBoxes
from vision.objects import VisionObjects
from vision.settings import VisionSettings
from vision.video.frame import Frame

pytestmark = pytest.mark.long

SIZE, SCALE_M = (300, 60), 0.3
QUICK = VisionSettings(background=BackgroundSettings(startup_us=1_000_000))
World = Callable[[float], list[tuple[float, float, float, float, float]]]


class Lookout:
    """Sees what it is told, upright in the picture, and remembers when it looked."""

    def __init__(self, world: World) -> None:
        self._world = world
        self.times_us: list[int] = []

    def detect(self, instant: Frame) -> ImageBoxes:
        self.times_us.append(instant.t_us)
        rows = np.array(self._world(instant.t_us / 1e6)).reshape(-1, 5)
        count = len(rows)
        centre_px = np.column_stack([rows[:, 0] / SCALE_M, SIZE[1] - 1 - rows[:, 1] / SCALE_M])
        return ImageBoxes(
            centre_px=centre_px,
            size_px=rows[:, 3:] / SCALE_M,
            angle_rad=np.zeros(count),
            is_oriented=np.zeros(count, np.bool_),
            score=np.full(count, 0.7),
            class_number=np.zeros(count, np.intp),
        )


def nothing(t_s: float) -> list[tuple[float, float, float, float, float]]:
    del t_s
    return []


def watch_traffic(
    world: World, known: World | None, *, seconds: float = 4.0, settings: VisionSettings = QUICK
) -> tuple[list[VisionObjects], Lookout]:
    """Show boxes to a camera straight above; the network knows those of another world."""
    lookout = Lookout(nothing if known is None else known)
    view = top_view(SIZE, SCALE_M)
    knows = None if known is None else lookout
    vision = fixed_camera(
        view, [whole_view(SIZE, SCALE_M)], SIZE, replace(settings, background=QUICK.background), knows=knows
    )
    rng = np.random.default_rng(3)
    texture = 100 + rng.normal(0, 3, (SIZE[1], SIZE[0]))
    results: list[VisionObjects] = []
    for k in range(round(seconds * 25)):
        boxes = make_boxes(world(k / 25))
        luma = draw_boxes(SIZE, boxes, [60.0] * len(boxes), view, ground=texture)
        frame = make_frame(np.clip(luma + rng.normal(0, 1, luma.shape), 0, 255), index=k, t_us=40_000 * k)
        results += vision.observe(vision.prepare(frame))
    return [*results, *vision.finish()], lookout


def standing(t_s: float) -> list[tuple[float, float, float, float, float]]:
    del t_s
    return [(30.0, 9.0, 0.0, 4.5, 1.8)]


def leaving(t_s: float) -> list[tuple[float, float, float, float, float]]:
    return [(30.0 + 3.0 * max(0.0, t_s - 2.0) ** 2, 9.0, 0.0, 4.5, 1.8)]


def driving(t_s: float) -> list[tuple[float, float, float, float, float]]:
    return [(10.0 + 12.0 * t_s, 9.0, 0.0, 4.5, 1.8)]


def with_stranger(from_s: float) -> World:
    """Drive, and from a moment on something else comes the other way."""

    def world(t_s: float) -> list[tuple[float, float, float, float, float]]:
        stranger = [(60.0 - 6.0 * (t_s - from_s), 13.0, 0.0, 4.5, 1.8)] if t_s > from_s else []
        return driving(t_s) + stranger

    return world


def test_a_vehicle_that_stands_all_the_time_is_seen_at_its_place_in_every_frame() -> None:
    results, _ = watch_traffic(standing, standing)
    late = results[30:]
    assert all(len(one.ids) == 1 and one.observed.all() for one in late)
    assert max(np.hypot(*(one.centre_m[0] - (30.0, 9.0))) for one in late) < 0.3


def test_a_vehicle_that_drives_off_keeps_its_name_and_leaves_no_ghost() -> None:
    results, _ = watch_traffic(leaving, leaving, seconds=5.0)
    assert {one.ids for one in results[40:]} == {("v1",)}
    assert results[-1].centre_m[0, 0] > 50.0


def test_what_the_network_denies_is_no_vehicle_once_it_has_proved_reliable() -> None:
    both = with_stranger(2.5)
    believed, _ = watch_traffic(both, None, seconds=5.0)
    assert max(len(one.ids) for one in believed) == 2
    # The rate starts at one half; with one vehicle in view it is sure after some seconds.
    results, _ = watch_traffic(both, driving, seconds=5.0)
    shown = [len(one.ids) for one in results[70:]]
    assert shown.count(2) < sum(len(one.ids) == 2 for one in believed[70:])


def test_it_looks_four_times_a_second() -> None:
    _, calm = watch_traffic(nothing, nothing, seconds=4.0)
    assert set(np.diff(calm.times_us).tolist()) == {240_000, 280_000}
    assert len(calm.times_us) == 16


def test_prepared_frames_give_what_plain_ones_give() -> None:
    plain, prepared = (
        fixed_camera(top_view(SIZE, SCALE_M), [whole_view(SIZE, SCALE_M)], SIZE, QUICK, knows=Lookout(driving))
        for _ in range(2)
    )
    for k in range(75):
        boxes = make_boxes(driving(k / 25))
        luma = draw_boxes(SIZE, boxes, [60.0], top_view(SIZE, SCALE_M))
        frame = make_frame(luma, index=k, t_us=40_000 * k)
        for one, other in zip(plain.observe(frame), prepared.observe(prepared.prepare(frame)), strict=True):
            assert one.ids == other.ids
            assert np.array_equal(one.centre_m, other.centre_m)
