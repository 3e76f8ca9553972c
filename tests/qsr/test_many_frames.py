"""Frames that are observed many at once are told as if they were observed one by one."""

from collections.abc import Iterator

import numpy as np
import pytest

import qsr.observer
from qsr.changes.crossings import RelationChange
from qsr.changes.line_up import Seen
from qsr.measuring.footprints import Footprints, pick_rows
from qsr.observer import RelationObserver
from qsr.relations import RANK
from qsr.settings import RelationSettings
from tests.cases import for_each
from tests.qsr.stories import road_observer
from tests.qsr.support import footprints, random_traffic

STILL = RelationSettings(gap_sigma_m=0.05, least_margin_m=0.2)


def hidden_traffic(rng: np.random.Generator, *, count: int) -> Iterator[Seen]:
    """Hide cars for some frames; of half of them it is told where they were when they are back. Some never move."""
    lost: dict[str, list[Footprints]] = {}
    since_us: dict[str, int] = {}
    for frame in random_traffic(rng, frames=60, count=count, noise_m=float(rng.choice([0.0, 0.3]))):
        moving = rng.random(len(frame.ids)) < 0.95
        whole = frame.having(has_moved=moving, sigma_m=np.full(len(frame.ids), 0.02))
        earlier: list[Footprints] = []
        for one in sorted({*whole.ids, *lost}):
            if one in lost and one in whole.ids and rng.random() < 0.3:
                earlier += lost.pop(one) if rng.random() < 0.5 else lost.pop(one)[:0]
                since_us.pop(one)
            elif one not in lost and rng.random() < 0.05:
                lost[one], since_us[one] = [], whole.t_us
            if one in lost and one in whole.ids:
                lost[one].append(whole.select([whole.ids.index(one)]))
        times_us = sorted({then.t_us for then in earlier})
        filled = [[then for then in earlier if then.t_us == t_us] for t_us in times_us]
        together = [pick_rows(some[0].t_us, [then.ids[0] for then in some], some) for some in filled]
        yield Seen(whole.select([k for k, one in enumerate(whole.ids) if one not in lost]), dict(since_us), together)


def told(observer: RelationObserver, frames: list[Seen], sizes: Iterator[int]) -> list[list[RelationChange]]:
    found, start = list[list[RelationChange]](), 0
    while start < len(frames):
        size = next(sizes)
        found += observer.observe_all(frames[start : start + size])
        start += size
    return found


@pytest.mark.long
@pytest.mark.parametrize("seed", [*range(3), *(pytest.param(one, marks=pytest.mark.slow) for one in range(3, 6))])
def test_many_frames_are_told_as_one_by_one(seed: int, monkeypatch: pytest.MonkeyPatch) -> None:
    rng = np.random.default_rng(seed)
    frames = list(hidden_traffic(rng, count=75 if seed == 0 else 10))
    one_by_one = told(road_observer(), frames, iter(lambda: 1, 0))
    assert sum(map(len, one_by_one)) > 300
    assert told(road_observer(), frames, iter(lambda: int(rng.integers(1, 40)), 0)) == one_by_one
    monkeypatch.setattr(qsr.observer, "_OBJECTS_AT_ONCE", 30)
    assert told(road_observer(), frames, iter(lambda: 60, 0)) == one_by_one


@pytest.mark.long
@for_each("name", sorted(RANK.keys() - {"turn"}))
def test_slow_changes_are_dated_alike_for_whoever_asks_for_one_relation(name: str) -> None:
    """Long stretches show nothing new here: what comes after them must not lose its time."""
    frames = [
        footprints(k * 40_000, "ab", [[0.04 * k - 6.0, 0.0], [0.0, 3.0]], speed_mps=[0.02 * k, 5.0], straight_road=True)
        for k in range(300)
    ]
    alone, at_once = (RelationObserver(("road",), (), STILL, only=[name]) for _ in range(2))
    assert at_once.observe_all([Seen(one) for one in frames]) == [alone.observe(one) for one in frames]


def test_nothing_is_told_of_no_frames() -> None:
    assert road_observer().observe_all([]) == []
