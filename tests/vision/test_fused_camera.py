"""Colour and thermal vision on small drawn videos."""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from tests.vision.support import ROAD_LEVEL, draw_boxes, make_boxes, make_frame, top_view, whole_view
from vision.background.background import Background
from vision.background.settings import BackgroundSettings
from vision.camera import FixedView, fixed_camera, fused_camera
from vision.detection import eye
from vision.detection.parting.lanes import LaneStrip
from vision.objects import VisionObjects
from vision.settings import VisionSettings
from vision.video.frames import Frame

SIZE, COARSE, COARSE_M = (200, 40), (100, 20), 0.94
QUICK = VisionSettings(background=BackgroundSettings(startup_us=800_000))
World = Callable[[float], tuple[float, float, float, float, float]]


def car(t: float) -> tuple[float, float, float, float, float]:
    return (12.0 * (t - 1.2), 7.5, 0.0, 4.5, 1.8)


def frames(
    world: World, count: int, size_px: tuple[int, int], *, scale_m: float, level: float, start: int = 0
) -> list[Frame]:
    """A video of one box of a given level; of road alone where that is the road's own."""
    rng = np.random.default_rng(size_px[0])
    texture = ROAD_LEVEL + rng.normal(0, 3, size_px[::-1])
    made = []
    for k in range(start, count):
        boxes = make_boxes([world(k / 25)])
        luma = draw_boxes(size_px, boxes, [level], top_view(size_px, scale_m), ground=texture)
        noisy = np.clip(luma + rng.normal(0, 1.2, luma.shape), 0, 255)
        made.append(make_frame(noisy, index=k, t_us=40_000 * k))
    return made


def watch(colour: list[Frame], thermal: list[Frame]) -> list[VisionObjects]:
    vision = fused_camera(
        FixedView(top_view(SIZE), SIZE),
        FixedView(top_view(COARSE, COARSE_M), COARSE),
        thermal,
        [whole_view(SIZE)],
        VisionSettings(background=BackgroundSettings(startup_us=800_000), max_metres_per_pixel=1.0),
    )
    seen = [objects for frame in colour for objects in vision.observe(frame)]
    return [*seen, *vision.finish()]


@functools.cache
def colour_video(level: float, count: int = 120) -> list[Frame]:
    return frames(car, count, SIZE, scale_m=0.47, level=level)


@functools.cache
def thermal_video(level: float, count: int = 120, start: int = 0) -> list[Frame]:
    return frames(car, count, COARSE, scale_m=COARSE_M, level=level, start=start)


def seen_at(results: list[VisionObjects], frame: int) -> list[list[float]]:
    return results[frame].centre_m.tolist()


@pytest.mark.long
@pytest.mark.parametrize(
    ("colour_level", "thermal_level"),
    [(200.0, 190.0), (ROAD_LEVEL, 190.0), (200.0, ROAD_LEVEL)],
    ids=["both", "thermal alone, as at night", "colour alone, as of a cold car"],
)
def test_car_is_tracked_by_whoever_sees_it(colour_level: float, thermal_level: float) -> None:
    results = watch(colour_video(colour_level), thermal_video(thermal_level))
    assert [len(results[k].ids) for k in (75, 90, 110)] == [1, 1, 1]
    assert len({name for objects in results for name in objects.ids}) == 1
    for k in (75, 90, 110):
        assert results[k].centre_m[0] == pytest.approx(np.array(car(k / 25)[:2]), abs=0.8)


def test_every_frame_gets_its_result_once_and_in_order() -> None:
    for count in (10, 60):  # shorter and longer than the start-up
        results = watch(colour_video(ROAD_LEVEL, count), thermal_video(ROAD_LEVEL, count))
        assert [r.t_us for r in results] == [40_000 * k for k in range(count)]


@pytest.mark.long
def test_thermal_video_may_end_early_or_be_missing_at_the_start() -> None:
    ended = watch(colour_video(200.0), thermal_video(190.0, 60))
    late = watch(colour_video(200.0), thermal_video(190.0, 120, start=50))
    assert [len(one[110].ids) for one in (ended, late)] == [1, 1]
    assert len(watch(colour_video(200.0), [])[110].ids) == 1


@pytest.mark.long
def test_same_videos_give_the_same_objects() -> None:
    once, again = (watch(colour_video(200.0, 80), thermal_video(190.0, 80)) for _ in range(2))
    assert [seen_at(once, k) for k in range(80)] == [seen_at(again, k) for k in range(80)]


def standing(t: float) -> tuple[float, float, float, float, float]:
    return (40.0, 7.5, 0.0, 4.5, 1.8)


@pytest.mark.long
@pytest.mark.parametrize(
    ("thermal_level", "first"), [(60.0, 3), (ROAD_LEVEL, 4)], ids=["both see it", "colour alone, so with less weight"]
)
def test_standing_car_is_shown_as_soon_as_it_was_seen_often_enough(thermal_level: float, first: int) -> None:
    colour = frames(standing, 40, SIZE, scale_m=0.47, level=60.0)
    alone = fixed_camera(top_view(SIZE), [whole_view(SIZE)], SIZE, QUICK)
    lone = [objects for frame in colour for objects in alone.observe(frame)]
    fused = watch(colour, frames(standing, 40, COARSE, scale_m=COARSE_M, level=thermal_level))
    shown = [next(k for k, one in enumerate(results) if one.ids) for results in ([*lone, *alone.finish()], fused)]
    assert shown == [3, first]


def test_lanes_keep_the_lines_of_the_road_out_of_both_backgrounds(monkeypatch: pytest.MonkeyPatch) -> None:
    given: list[bool] = []
    real = eye.Background

    def background(*arguments: Any, borders: NDArray[np.bool_] | None, **options: Any) -> Background:
        given.append(borders is not None and bool(borders.any()))
        return real(*arguments, borders=borders, **options)

    monkeypatch.setattr(eye, "Background", background)
    lane = LaneStrip(np.array([[0.0, 7.5], [90.0, 7.5]]), 3.5)
    views = FixedView(top_view(SIZE), SIZE), FixedView(top_view(COARSE, COARSE_M), COARSE)
    settings = VisionSettings(max_metres_per_pixel=1.0)
    fused_camera(*views, [], [whole_view(SIZE)], settings, lanes=[lane])
    assert given == [True, True]
