"""Of two symbols on one vehicle, and of what never moved, nothing is said."""

from collections.abc import Iterator

import numpy as np
import pytest

from qsr.measuring.footprints import Footprints
from qsr.observer import RelationObserver
from tests.qsr.support import changes_of, footprints

PERIOD_US = 100_000


def side_by_side(apart_m: list[float], *, sigma_m: float) -> Iterator[Footprints]:
    """Drive two cars 2 m wide beside each other, so far apart in each frame; a is a little ahead."""
    for number, lateral_m in enumerate(apart_m):
        frame = footprints(number * PERIOD_US, "ab", [[number + 1.0, 0.0], [number, lateral_m]], straight_road=True)
        yield frame.having(sigma_m=np.full(2, sigma_m))


def told_beside(apart_m: list[float], *, sigma_m: float = 0.1) -> list[tuple[int, object, object]]:
    observer = RelationObserver(("road",), (), only=["beside"])
    changes = [one for frame in side_by_side(apart_m, sigma_m=sigma_m) for one in observer.observe(frame)]
    return changes_of(changes, "beside", "a", "b")


def test_two_that_are_in_each_other_are_unknown_to_each_other_until_long_after() -> None:
    told = told_beside([*[3.0] * 5, *[0.5] * 5, *[3.0] * 30])
    first_us, again_us = 700_000, 2_900_000  # in each other for 0.2 s; 2 s after they last were
    assert told == [(0, None, True), (first_us, True, None), (again_us, None, True)]


@pytest.mark.parametrize(
    ("apart_m", "sigma_m"),
    [([*[3.0] * 5, 1.0, 3.0, 1.0, *[3.0] * 5], 0.1), ([1.6] * 9, 0.1), ([1.0] * 9, 0.4), ([0.5] * 9, float("nan"))],
    ids=["a moment", "by less than the margin", "by no more than noise explains", "nobody knows the noise"],
)
def test_two_that_seem_to_overlap_a_little_are_two(apart_m: list[float], sigma_m: float) -> None:
    assert told_beside(apart_m, sigma_m=sigma_m) == [(0, None, True)]


def test_who_never_moved_is_in_no_relation_to_others_but_on_a_road() -> None:
    observer = RelationObserver(("road",), (), only=["behind", "oncoming", "on"])
    told = []
    for number in range(6):
        xy_m = [[0.0, 0.0], [30.0, 0.0], [60.0, 3.0]]
        frame = footprints(number * PERIOD_US, "abc", xy_m, heading_rad=[0.0, 0.0, np.pi], straight_road=True)
        told += observer.observe(frame.having(has_moved=np.array([True, number > 3, True])))
    assert changes_of(told, "on", "b", "road") == [(0, None, True)]
    assert changes_of(told, "behind", "a", "b") == [(400_000, None, True)]
    assert changes_of(told, "oncoming", "b", "c") == [(400_000, None, True)]
    assert changes_of(told, "oncoming", "a", "c")[0] == (0, None, True)


def test_who_never_moved_does_not_move_and_faces_nowhere_however_fast_noise_makes_it() -> None:
    observer = RelationObserver(("road",), (), only=["moving", "forward"])
    told = []
    for number in range(12):
        goes = number > 6
        speed_mps = 5.0 * (goes or number % 2)
        frame = footprints(number * PERIOD_US, "a", [[0.0, 0.0]], speed_mps=speed_mps, straight_road=True)
        told += observer.observe(frame.having(has_moved=np.array([goes])))
    [begin, (t_us, *after)] = changes_of(told, "moving", "a")
    assert (begin, after) == ((0, None, False), [False, True])
    assert 600_000 < t_us <= 700_000
    assert changes_of(told, "forward", "a") == [(700_000, None, True)]
