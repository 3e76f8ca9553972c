"""What happened while a car was hidden is told when it comes back, as if it had been seen all the time."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
import pytest

from qsr.changes.crossings import RelationChange, Value
from qsr.measuring.footprints import Footprints
from qsr.observer import RelationObserver
from tests.cases import seeds
from tests.qsr.stories import Story, facts, road_observer, seen_traffic, two_cars, without
from tests.qsr.support import footprints

MOST_PREDICTED = 4

Pair = tuple[str, tuple[str, ...]]


def hide(rng: np.random.Generator, frames: Sequence[Footprints]) -> dict[str, list[tuple[int, int]]]:
    """Draw for each car from when to when it is hidden, in frames: only while it is there, and never to the end."""
    intervals: dict[str, list[tuple[int, int]]] = {}
    for name in sorted({name for frame in frames for name in frame.ids}):
        there = [name in frame.ids for frame in frames]
        start = 0
        while start < len(frames):
            start += int(rng.integers(2, 15))
            end = start + int(rng.integers(1, 14))
            if all(there[start - 1 : end + 1]) and end < len(frames) - 1:
                intervals.setdefault(name, []).append((start, end))
            start = end + 1
    return intervals


def tell(
    frames: Sequence[Footprints], intervals: Mapping[str, Sequence[tuple[int, int]]], observer: RelationObserver
) -> tuple[Story, set[frozenset[str]]]:
    """Show a car that is hidden as a wrong guess first, then not at all, and fill the time in when it comes back."""
    story, broken = Story(), set[frozenset[str]]()
    before: set[str] = set()
    for number, frame in enumerate(frames):
        away = {name: start for name, spans in intervals.items() for start, end in spans if start <= number < end}
        back = {name: start for name, spans in intervals.items() for start, end in spans if number == end}
        guessed = {name for name, start in away.items() if number < start + MOST_PREDICTED}
        hidden = {name: frames[start].t_us for name, start in away.items() if name not in guessed}
        shown = frame.select([k for k, name in enumerate(frame.ids) if name not in hidden])
        observed = np.array([name not in guessed for name in shown.ids], np.bool_)
        shown = shown.having(observed=observed, centre_m=shown.centre_m + np.where(observed, 0.0, 9.0)[:, None])
        filled = [
            then.select([k for k, name in enumerate(then.ids) if back.get(name, number) <= past])
            for past, then in enumerate(
                frames[min(back.values(), default=number) : number], min(back.values(), default=0)
            )
        ]
        changes = observer.observe(shown, hidden=hidden, filled=filled)
        story.take(changes, [f"{name} lost" for name in back])
        broken |= {frozenset((gone, name)) for gone in before - set(frame.ids) for name in away}
        before = set(frame.ids)
    return story, broken


@pytest.mark.long
@seeds(range(24), kept=4)
def test_the_story_in_the_end_is_that_of_cars_that_were_seen_all_the_time(seeds: range) -> None:
    for seed in seeds:
        rng = np.random.default_rng(seed)
        frames, expected = seen_traffic(rng)
        intervals = hide(rng, frames)
        story, broken = tell(frames, intervals, road_observer())
        assert len(intervals) > 3
        assert without(broken, story.standing()) == without(broken, expected)


def test_that_the_other_one_left_stands_when_a_car_comes_back() -> None:
    observer = RelationObserver(("road",), ("cross",), only=["behind"])
    told = [change for number in range(5) for change in observer.observe(two_cars(number, (0.0, 10.0)))]
    told += observer.observe(two_cars(5, (0.0, 10.0), "b"), hidden={"a": 500_000})
    told += observer.observe(two_cars(6, (0.0, 10.0), ""), hidden={"a": 500_000})
    told += observer.observe(two_cars(7, (0.0, 10.0), "a"), filled=[two_cars(5, (0.0, 10.0), "a")])
    behind = [(one.t_us, one.new, one.absent) for one in told if one.args == ("a", "b")]
    assert behind == [(0, True, ()), (500_000, None, ("a",)), (600_000, None, ())]


def test_nobody_nearly_met_unseen() -> None:
    def at(number: int) -> Footprints:
        x_m = [2.0 * number, 50.0]
        shown = footprints(number * 100_000, "ab", [[x_m[0], 0.0], [x_m[1], 0.0]], straight_road=True)
        return shown.having(speed_mps=np.array([20.0, 0.0]))

    def told(hidden: range) -> set[Value]:
        observer, values = RelationObserver(("road",), ("cross",), only=["conflict"]), set[Value]()
        for number in range(23):
            shown = at(number).select([1]) if number in hidden else at(number)
            away = {"a": hidden.start * 100_000} if number in hidden else {}
            filled = [at(past).select([0]) for past in hidden] if number == hidden.stop else []
            values |= {change.new for change in observer.observe(shown, hidden=away, filled=filled)}
        return values

    assert told(range(0)) == {False, True}
    assert told(range(1, 23)) == {False, None}
    assert told(range(1, 18)) == {False, None, True}  # seen again while it is about to happen


@pytest.mark.long
@seeds(range(24), kept=4)
def test_a_car_that_is_named_late_goes_on_from_what_was_true_of_it(seeds: range) -> None:
    for seed in seeds:
        rng = np.random.default_rng(100 + seed)
        frames, _ = seen_traffic(rng)
        lives = {
            name: [number for number, frame in enumerate(frames) if name in frame.ids]
            for name in {name for frame in frames for name in frame.ids}
        }
        whole = {name: sum(number - life[0] == k for k, number in enumerate(life)) for name, life in lives.items()}
        named = {name: life[min(int(rng.integers(0, 8)), whole[name] - 1)] for name, life in lives.items()}
        observer, told, at_once, begun = (
            road_observer(),
            list[RelationChange](),
            road_observer(),
            dict[Pair, RelationChange](),
        )
        expected, broken = list[RelationChange](), set[frozenset[str]]()
        for number, frame in enumerate(frames):
            shown = frame.select([k for k, name in enumerate(frame.ids) if named[name] <= number])
            former = [
                then.select([k for k, name in enumerate(then.ids) if named[name] == number])
                for then in frames[max(0, number - 8) : number]
            ]
            told += observer.observe(shown, filled=former)
            # Of the time before all names are known, the last change is told, once they are.
            for change in at_once.observe(frame):
                if number > max([named[one] for one in change.args if one in named], default=-1):
                    expected.append(change)
                else:
                    first = begun.get((change.name, change.args), change)
                    begun[change.name, change.args] = replace(change, old=first.old)
            gone = set(frames[max(0, number - 1)].ids) - set(frame.ids)
            broken |= {frozenset((one, name)) for one in gone for name in frame.ids if named[name] >= number}
        expected += [change for change in begun.values() if change.new is not change.old]
        assert sum(one > lives[name][0] for name, one in named.items()) > 3
        assert without(broken, facts(told)) == without(broken, facts(expected))
