from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from tests.vision.support import make_boxes
from vision.detection.detector import Detections
from vision.detection.fusion import Channel, DetectionRate, Fusion, fuse
from vision.detection.settings import DetectionSettings

SETTINGS = DetectionSettings()
FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]
Row = tuple[float, float, float, float, float]


def everywhere(points_m: FloatArray) -> BoolArray:
    return np.ones(len(points_m), np.bool_)


def nowhere(points_m: FloatArray) -> BoolArray:
    return np.zeros(len(points_m), np.bool_)


def found(*rows: Row, sigma_m: float = 0.3, owner: list[int] | None = None) -> Detections:
    boxes = make_boxes(rows)
    count = len(boxes)
    return Detections(
        boxes=boxes,
        noise=np.broadcast_to(sigma_m**2 * np.eye(2), (count, 2, 2)).copy(),
        elongation=np.full(count, 2.5),
        owner=np.full(count, -1) if owner is None else np.array(owner, np.intp),
        divided=np.zeros(count, np.bool_),
        directed=np.zeros(count, np.bool_),
        cut=np.zeros(count, np.int8),
        borders_m=np.full((count, 4), np.nan),
    )


def channel(
    detections: Detections,
    *,
    rate: float = 0.9,
    holds: Callable[[FloatArray], BoolArray] = everywhere,
    is_open: bool = True,
) -> Channel:
    return Channel(detections, holds, rate, is_open)


def test_what_both_see_is_one_detection_between_them_by_their_noise() -> None:
    colour, thermal = found((10.0, 5.0, 0.0, 5.0, 2.0), sigma_m=0.6), found((10.5, 5.0, 0.0, 4.5, 1.8), sigma_m=0.3)
    fused = fuse(channel(colour), channel(thermal), SETTINGS)
    assert fused.boxes.centre_m == pytest.approx(np.array([[10.4, 5.0]]))
    assert fused.boxes.length_m == pytest.approx([4.6])
    assert fused.noise[0] == pytest.approx(np.eye(2) / (1 / 0.36 + 1 / 0.09))
    assert fused.weights().tolist() == [1.0]


def test_bias_moves_the_place_and_not_the_noise() -> None:
    colour, thermal = found((10.0, 5.0, 0.0, 5.0, 2.0)), found((10.5, 5.0, 0.0, 5.0, 2.0))
    fused = fuse(replace(channel(colour), bias_m=0.6), channel(thermal), SETTINGS)
    assert fused.boxes.centre_m[0, 0] == pytest.approx(10.5 - 0.5 * 0.09 / (0.09 + 0.45))
    assert fused.noise[0] == pytest.approx(0.045 * np.eye(2))


def test_covariance_weighs_each_direction_by_itself() -> None:
    colour, thermal = found((10.0, 5.0, 0.0, 5.0, 2.0)), found((10.6, 5.6, 0.0, 5.0, 2.0))
    colour.noise[0], thermal.noise[0] = np.diag([0.01, 1.0]), np.diag([1.0, 0.01])
    centre_m = fuse(channel(colour), channel(thermal), SETTINGS).boxes.centre_m[0]
    assert centre_m == pytest.approx([10.0 + 0.6 * 0.01 / 1.01, 5.6 - 0.6 * 0.01 / 1.01])


def test_neighbours_are_not_mixed_up() -> None:
    colour = found((0.0, 0.0, 0.0, 4.5, 1.8), (0.0, 3.5, 0.0, 4.5, 1.8))
    thermal = found((0.2, 3.4, 0.0, 4.5, 1.8), (0.1, 0.1, 0.0, 4.5, 1.8))
    fused = fuse(channel(colour), channel(thermal), SETTINGS)
    assert sorted(fused.boxes.centre_m[:, 1].tolist()) == pytest.approx([0.05, 3.45])


def test_cars_far_apart_stay_two() -> None:
    assert len(fuse(channel(found((0, 0, 0, 4.5, 1.8))), channel(found((9, 0, 0, 4.5, 1.8))), SETTINGS)) == 2


def test_detections_of_different_tracks_are_never_joined() -> None:
    colour, thermal = found((0, 0, 0, 4.5, 1.8), owner=[0]), found((0.2, 0, 0, 4.5, 1.8), owner=[1])
    assert sorted(fuse(channel(colour), channel(thermal), SETTINGS).owner.tolist()) == [0, 1]


def test_common_track_joins_even_what_lies_apart() -> None:
    colour, thermal = found((0, 0, 0, 9.0, 1.8), owner=[3]), found((2.4, 0, 0, 4.5, 1.8), owner=[3])
    assert fuse(channel(colour), channel(thermal), SETTINGS).owner.tolist() == [3]


def test_silence_of_a_good_camera_counts_against_and_of_a_blind_one_does_not() -> None:
    shadow = found((0, 0, 0, 4.5, 1.8))
    weights = [
        fuse(channel(shadow), channel(Detections.none(), rate=rate), SETTINGS).weights()[0]
        for rate in (0.0, 0.5, 0.9, 0.98)
    ]
    assert weights == pytest.approx([0.8, 2 / 3, 2 / 7, 0.016 / 0.216])


@pytest.mark.parametrize(
    "other",
    [channel(Detections.none(), rate=0.98, holds=nowhere), channel(Detections.none(), rate=0.98, is_open=False)],
    ids=["looks elsewhere", "sees nothing at all"],
)
def test_camera_that_does_not_look_there_does_not_count(other: Channel) -> None:
    assert fuse(channel(found((0, 0, 0, 4.5, 1.8))), other, SETTINGS).weights().tolist() == [0.8]


def test_known_tracks_need_no_proof() -> None:
    lone = found((0, 0, 0, 4.5, 1.8), owner=[0])
    assert fuse(channel(lone), channel(Detections.none(), rate=0.98), SETTINGS).weights().tolist() == [1.0]


def test_box_cut_by_one_view_gives_way_to_the_whole_one() -> None:
    half = replace(found((1.0, 0, 0, 2.0, 1.8)), cut=np.array([-1], np.int8))
    fused = fuse(channel(half), channel(found((0.0, 0, 0, 4.5, 1.8))), SETTINGS)
    assert fused.boxes.length_m == pytest.approx([4.5], abs=0.01)
    assert fused.cut.tolist() == [0]


def test_pieces_that_one_camera_sees_of_a_whole_vehicle_are_dropped() -> None:
    pieces = found((-2.6, 0, 0, 2.0, 1.0), (3.0, 0.2, 0, 1.0, 1.0), (0.3, 3.0, 0, 4.5, 1.8))
    fused = fuse(channel(found((0, 0, 0, 5.0, 1.8))), channel(pieces), SETTINGS)
    assert sorted(fused.boxes.centre_m[:, 1].round(1).tolist()) == [0.0, 3.0]  # the car beside it stays


def test_nothing_and_nothing_is_nothing() -> None:
    assert len(fuse(channel(Detections.none()), channel(Detections.none()), SETTINGS)) == 0


@pytest.mark.parametrize("seed", range(6))
def test_order_of_cameras_does_not_matter(seed: int) -> None:
    rng = np.random.default_rng(seed)

    def crowd(count: int) -> Detections:
        rows = np.column_stack(
            [rng.uniform(0, 40, (count, 2)), np.zeros(count), np.full(count, 4.5), np.full(count, 2)]
        )
        return found(*map(tuple, rows.tolist()))

    one, other = channel(crowd(12)), channel(crowd(9))
    there, back = fuse(one, other, SETTINGS), fuse(other, one, SETTINGS)
    assert len(there) + 9 >= 12  # no detection is used twice
    assert len(there) == len(back)
    assert np.sort(there.boxes.centre_m[:, 0]) == pytest.approx(np.sort(back.boxes.centre_m[:, 0]))


def test_rate_follows_what_is_detected_of_the_tracks_in_view() -> None:
    rate = DetectionRate(SETTINGS)
    assert rate.value == 0.5
    is_seen = np.array([True, True, True, False])
    for _ in range(3000):
        rate.learn(np.array([True, False, False, True]), is_seen)
    assert rate.value == pytest.approx(1 / 3, abs=0.01)
    for _ in range(3000):
        rate.learn(np.array([True, True, True, False]), is_seen)
    assert rate.value == SETTINGS.most_rate
    rate.learn(np.zeros(0, np.bool_), np.zeros(0, np.bool_))
    assert rate.value == SETTINGS.most_rate


def test_silence_of_a_camera_that_has_missed_the_tracks_in_its_view_says_little() -> None:
    known, fusion = make_boxes([(0.0, 0.0, 0.0, 4.5, 1.8)]), Fusion(SETTINGS)
    seeing, blind = channel(found((0.0, 0.0, 0.0, 4.5, 1.8), owner=[0])), channel(found())
    stranger = channel(found((30.0, 0.0, 0.0, 4.5, 1.8)))
    at_first = fusion.join(stranger, blind, known=known).weights()
    for _ in range(1000):
        fusion.join(seeing, blind, known=known)
    assert fusion.join(stranger, blind, known=known).weights() > at_first
    closed = channel(found(), is_open=False)
    assert fusion.join(stranger, closed, known=known).weights() == pytest.approx(SETTINGS.lone_trust)
