"""How far boxes have moved in the picture, against pictures moved by a known amount."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from tests.vision.support import FloatArray, make_frame
from vision.networks.box_detector import ImageBoxes
from vision.networks.optical_flow import BoxFlow, foot_shifts
from vision.networks.settings import NetworkSettings

SIZE_PX = (320, 180)
SETTINGS = NetworkSettings()


def texture(seed: int = 1) -> FloatArray:
    """Details of several sizes, as vehicles and roads have them."""
    rng = np.random.default_rng(seed)
    blurred = [cv2.GaussianBlur(rng.normal(0, 30 * sigma, SIZE_PX[::-1]), (0, 0), sigma) for sigma in (1.0, 3.0, 9.0)]
    return np.asarray(np.clip(128 + sum(blurred), 0, 255), np.float64)


def with_patch(road: FloatArray, patch: FloatArray, left: float, top: float, scale: float = 1.0) -> FloatArray:
    """Lay a patch, scaled about its upper left corner, on the road."""
    matrix = np.array([[scale, 0.0, left], [0.0, scale, top]])
    moved = cv2.warpAffine(patch, matrix, SIZE_PX, flags=cv2.INTER_CUBIC)
    mask = cv2.warpAffine(np.ones_like(patch), matrix, SIZE_PX)
    return np.asarray(np.where(mask > 0.5, moved, road), np.float64)


def shift_of(before: FloatArray, now: FloatArray, *bounds_px: tuple[float, float, float, float]) -> FloatArray:
    pictures = (np.rint(one).astype(np.uint8) for one in (before, now))
    return foot_shifts(*pictures, np.array(bounds_px))[0]


@pytest.mark.parametrize(("right_px", "down_px"), [(0.0, 0.0), (0.4, -0.3), (6.0, 2.5), (-9.0, 5.0)])
def test_what_moves_over_the_road_is_followed_back(right_px: float, down_px: float) -> None:
    road, patch = texture(1), texture(2)[:40, :60]
    before = with_patch(road, patch, 100.0 - right_px, 80.0 - down_px)
    now = with_patch(road, patch, 100.0, 80.0)
    moved, stood = shift_of(before, now, (100, 80, 160, 120), (20, 20, 60, 50))
    assert moved == pytest.approx([right_px, down_px], abs=0.1)
    assert stood == pytest.approx([0.0, 0.0], abs=0.02)


def test_the_foot_of_what_grows_moves_farther_than_its_middle() -> None:
    road, patch = texture(1), texture(2)[:40, :60]
    before = with_patch(road, patch, 100.0, 80.0)
    now = with_patch(road, patch, 100.0, 80.0, scale=1.1)  # the foot from 120 to 124, the middle to the right by 3
    assert shift_of(before, now, (100, 80, 166, 124))[0] == pytest.approx([3.0, 4.0], abs=0.2)


def test_a_vehicle_partly_behind_another_one_has_the_speed_of_most_of_it() -> None:
    road, patch, other = texture(1), texture(2)[:40, :60], texture(3)[:40, :20]
    before = with_patch(with_patch(road, patch, 104.0, 80.0), other, 100.0, 80.0)
    now = with_patch(with_patch(road, patch, 100.0, 80.0), other, 100.0, 80.0)
    assert shift_of(before, now, (100, 80, 160, 120))[0] == pytest.approx([-4.0, 0.0], abs=0.1)


def test_nothing_is_said_of_what_has_no_texture_or_was_not_there() -> None:
    grey = np.full(SIZE_PX[::-1], 90.0)
    assert np.isnan(shift_of(grey, grey, (100, 80, 160, 120))).all()


def test_boxes_may_reach_beyond_the_picture() -> None:
    before, now = texture(), np.roll(texture(), (0, 3), axis=(0, 1))
    shifts_px = shift_of(before, now, (-30, 100, 40, 200), (300, -5, 330, 50), (-0.4, -0.4, 319.4, 179.4))
    assert np.allclose(shifts_px, [3.0, 0.0], atol=0.3)


def box(left: float, top: float, width: float, height: float) -> ImageBoxes:
    one = np.ones(1)
    centre_px, size_px = np.array([[left + width / 2, top + height / 2]]), np.array([[width, height]])
    return ImageBoxes(centre_px, size_px, 0 * one, one < 0, one, np.zeros(1, np.intp))


def test_the_frame_to_start_from_is_the_first_one_near_enough_to_the_look() -> None:
    flow = BoxFlow(SETTINGS)
    for t_us in range(0, 240_000, 40_000):
        flow.keep(make_frame(np.roll(texture(), t_us // 40_000, axis=1), t_us=t_us), 240_000)
    now = make_frame(np.roll(texture(), 6, axis=1), t_us=240_000)
    shifts = flow.shifts(now, box(100, 80, 60, 40))
    assert shifts is not None
    assert shifts.over_s == pytest.approx([0.08])
    assert shifts.shift_px[0] == pytest.approx([2.0, 0.0], abs=0.05)
    assert shifts.noise_px[0] == pytest.approx(SETTINGS.flow_noise_px, abs=0.02)
    assert flow.shifts(now, box(100, 80, 60, 40)) is None  # each frame is started from once


def test_a_camera_that_repeats_pictures_tells_no_speeds() -> None:
    flow, rng = BoxFlow(SETTINGS), np.random.default_rng(4)
    for k, moved_px in enumerate((0, 2, 2, 4)):  # the third picture is the second one, coded once more
        coded = np.clip(np.roll(texture(), moved_px, axis=1) + rng.normal(0, 3, SIZE_PX[::-1]), 0, 255)
        flow.keep(make_frame(coded, index=k, t_us=40_000 * k), 160_000)
    now = make_frame(np.roll(texture(), 6, axis=1), t_us=160_000)
    assert flow.shifts(now, box(100, 80, 60, 40)) is None


def test_over_missing_frames_nothing_is_said() -> None:
    flow = BoxFlow(SETTINGS)
    flow.keep(make_frame(texture(), t_us=0), 80_000)
    late = make_frame(np.roll(texture(), 3, axis=1), t_us=400_000)
    assert flow.shifts(late, box(100, 80, 60, 40)) is None


def test_without_boxes_or_with_another_size_nothing_is_said() -> None:
    for now, boxes in ((texture(), box(0, 0, 9, 9).select(slice(0, 0))), (texture()[:90], box(0, 0, 9, 9))):
        flow = BoxFlow(SETTINGS)
        flow.keep(make_frame(texture(), t_us=0), 80_000)
        assert flow.shifts(make_frame(now, t_us=80_000), boxes) is None
