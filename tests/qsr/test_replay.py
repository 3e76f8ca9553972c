"""Who was taken for another car is told of as if that had not happened."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import pytest

from dyknow.streams.hypotheses import Hypotheses
from qsr.adapter import FrameRelations
from qsr.changes.line_up import Seen
from qsr.measuring.footprints import Footprints
from qsr.observer import RelationObserver
from qsr.replay import ReplayingObserver
from tests.cases import seeds
from tests.qsr.stories import Story, road_observer, seen_traffic, two_cars, without


@dataclass(frozen=True)
class Away:
    """Hidden from frame ``start`` on, another one taken for it from ``wrong`` to ``doubted``, seen again at ``end``."""

    start: int
    wrong: int
    doubted: int
    end: int


def plan(rng: np.random.Generator, frames: Sequence[Footprints]) -> dict[str, list[Away]]:
    plans: dict[str, list[Away]] = {}
    for name in sorted({name for frame in frames for name in frame.ids}):
        there = [name in frame.ids for frame in frames]
        start = int(rng.integers(2, 12))
        while start < len(frames):
            wrong = start + int(rng.integers(1, 8))
            doubted = wrong + int(rng.integers(1, 8))
            end = doubted + int(rng.integers(0, 5))
            if all(there[start - 1 : end + 1]) and end < len(frames) - 1:
                plans.setdefault(name, []).append(Away(start, wrong, doubted, end))
            start = end + int(rng.integers(2, 10))
    return plans


def tell(frames: Sequence[Footprints], plans: Mapping[str, Sequence[Away]]) -> tuple[Story, set[frozenset[str]]]:
    """Tell of traffic in which cars are hidden, found in a wrong place, lost again or found in their own place."""
    replaying = ReplayingObserver(road_observer())
    story, broken, before = Story(), set[frozenset[str]](), set[str]()
    for number, frame in enumerate(frames):
        away = {name: one for name, spans in plans.items() for one in spans if one.start <= number < one.end}
        back = {name: one for name, spans in plans.items() for one in spans if one.end == number}
        wrong = {name: one for name, one in away.items() if one.wrong <= number < one.doubted}
        hidden = {name: frames[one.start].t_us for name, one in away.items() if name not in wrong}
        shown = frame.select([k for k, name in enumerate(frame.ids) if name not in hidden])
        moved = np.array([name in wrong for name in shown.ids], np.bool_)[:, None]
        lane = np.where(moved[:, 0], (shown.lane + 1) % 4, shown.lane)
        shown = shown.having(centre_m=shown.centre_m + 15.0 * moved, lane=lane)
        found = back | {name: one for name, one in wrong.items() if one.wrong == number}
        filled = [
            then.select(rows)
            for past, then in enumerate(frames[:number])
            if (rows := [k for k, name in enumerate(then.ids) if name in found and found[name].start <= past])
        ]
        doubtful = {name: f"{name} in a wrong place" for name in wrong}
        refuted = [
            f"{name} in a wrong place" for name, spans in plans.items() for one in spans if one.doubted == number
        ]
        begun = {doubtful[name]: name for name, one in wrong.items() if one.wrong == number}
        changes = replaying.observe(Seen(shown, hidden, filled), begun, refuted=refuted)
        story.take(changes, [*refuted, *(f"{name} lost" for name in found)], doubtful)
        broken |= {frozenset((gone, name)) for gone in before - set(frame.ids) for name in away}
        before = set(frame.ids)
    return story, broken


@pytest.mark.long
@seeds(range(24), kept=2)
def test_the_story_in_the_end_is_that_of_cars_that_were_never_mistaken(seeds: range) -> None:
    for seed in seeds:
        rng = np.random.default_rng(seed)
        frames, expected = seen_traffic(rng)
        plans = plan(rng, frames)
        story, broken = tell(frames, plans)
        assert len(plans) > 3
        assert without(broken, story.standing()) == without(broken, expected)


def test_who_was_taken_for_another_one_is_unknown_since_it_was_lost() -> None:
    observer = ReplayingObserver(RelationObserver(("road",), ("cross",), only=["behind"]))
    for number in range(20):  # a is hidden from the fifth frame on, and what is seen from the tenth on was not a
        shown = two_cars(number, (0.0, 10.0 if number < 10 else -20.0), "b" if 5 <= number < 10 else "ab")
        hidden = {"a": 500_000} if 5 <= number < 10 else {}
        observer.observe(Seen(shown, hidden, ()), {"v2->a": "a"} if number == 10 else {})
    lost = observer.observe(Seen(two_cars(20, (0.0, -20.0), "b"), {"a": 500_000}, ()), refuted=["v2->a"])
    assert [(one.args, one.t_us, one.old, one.new, one.absent) for one in lost] == [
        (("a", "b"), 500_000, True, None, ("a",)),  # as it was when a was lost
        (("b", "a"), 500_000, False, None, ("a",)),
    ]
    assert observer.observe(Seen(two_cars(21, (0.0, -20.0), "b"), {"a": 500_000}, ())) == []


def test_that_another_one_left_meanwhile_is_told_once_more() -> None:
    observer = ReplayingObserver(RelationObserver(("road",), ("cross",), only=["behind"]))
    told = [
        change
        for number, names in enumerate(("ab", "ab", "b", "ab", "ab", "a", "a"))
        for change in observer.observe(
            Seen(two_cars(number, (0.0, 10.0), names), {"a": 200_000} if number == 2 else {}, ()),
            {"v2->a": "a"} if number == 3 else {},
            refuted=["v2->a"] if number == 6 else (),
        )
    ]
    left = [(one.t_us, one.decided_us, one.new) for one in told if one.args == ("a", "b") and not one.absent]
    assert left == [(0, 0, True), (500_000, 500_000, None), (500_000, 600_000, None)]


@pytest.mark.parametrize(("linked", "car", "labels"), [(4, "b", ("v3->b",)), (6, "a", ())])
def test_what_is_told_anew_rests_on_no_younger_link(linked: int, car: str, labels: tuple[str, ...]) -> None:
    """Another one leaves at the fifth frame, which is told at the sixth."""
    observer = ReplayingObserver(RelationObserver(("road",), ("cross",), only=["behind"]))
    link = f"v3->{car}"
    for number, names in enumerate(("ab", "ab", "b", "ab", "ab", "a", "a")):
        told = observer.observe(
            Seen(two_cars(number, (0.0, 10.0), names), {"a": 200_000} if number == 2 else {}, ()),
            ({"v2->a": "a"} if number == 3 else {}) | ({link: car} if number == linked else {}),
            refuted=["v2->a"] if number == 6 else (),
        )
    known = FrameRelations(tuple(told), Hypotheses({car: (link,)}))
    assert [(one.args, one.t_us, known.hypotheses_of(one)) for one in told] == [
        (("a", "b"), 500_000, labels),
        (("b", "a"), 500_000, labels),
    ]
