"""What nobody sees changes no relation and makes no event."""

from collections.abc import Mapping, Sequence

import numpy as np
import pytest

from chronicles import library
from chronicles.events import Event
from chronicles.recogniser import Recogniser
from qsr.changes.crossings import RelationChange
from qsr.measuring.footprints import Footprints
from qsr.observer import RelationObserver
from tests.qsr.support import changes_of, footprints

PERIOD_US = 40_000


def passing(frame: int, observed: Sequence[bool], *, gone: bool = False) -> Footprints:
    """Let a come from 20 m behind b, a metre a frame, and pass it; bodies 4 m long overlap within 4 m."""
    x_m = [frame - 20.0 + 0.4 * frame, 0.4 * frame]
    xy_m, ids = np.column_stack((x_m, [3.0, 0.0])), ("a", "b")
    count = 0 if gone else 2
    return footprints(frame * PERIOD_US, ids[:count], xy_m[:count], straight_road=True, observed=list(observed)[:count])


def changes(frames: Sequence[Footprints]) -> list[RelationChange]:
    observer = RelationObserver(("road",), ("cross",))
    return [change for frame in frames for change in observer.observe(frame)]


def seen_until(frame: int, observed: Sequence[bool] = (False, False), again: int = 1000) -> list[Footprints]:
    return [passing(k, (True, True) if k < frame or k >= again else observed) for k in range(60)]


@pytest.mark.parametrize(
    ("observed", "is_told"),
    [((True, True), True), ((True, False), False), ((False, True), False), ((False, False), False)],
    ids=["both seen", "a seen", "b seen", "nobody seen"],
)
def test_a_pass_is_told_if_both_are_seen(observed: tuple[bool, bool], is_told: bool) -> None:
    told = changes_of(changes(seen_until(10, observed)), "beside", "a", "b")
    assert [new for _, _, new in told] == [False, *([True, False] if is_told else [])]


def test_what_happened_unseen_is_told_when_both_are_seen_again_and_dated_in_between() -> None:
    told = changes(seen_until(10, again=20))  # at frame 20 they are level
    [_, (at_us, old, new)] = changes_of(told, "behind", "a", "b")
    assert (old, new) == (True, False)
    # From -11 m at frame 9 to 0 m at frame 20, through -4 m.
    assert at_us == 16 * PERIOD_US
    (decided_us,) = (one.decided_us for one in told if (one.name, one.args, one.new) == ("behind", ("a", "b"), False))
    assert decided_us == 20 * PERIOD_US


def test_who_never_comes_back_is_unknown_from_the_loss_on() -> None:
    frames = [*seen_until(10)[:15], passing(15, (), gone=True)]
    assert changes_of(changes(frames), "behind", "a", "b")[-1] == (10 * PERIOD_US, True, None)


def test_nobody_begins_with_a_guess() -> None:
    frames = [footprints(k * 100_000, "ab", [[0.0, 0.0], [20.0, 0.0]], observed=[True, k >= 3]) for k in range(5)]
    told = changes(frames)
    assert min(one.t_us for one in told if "b" in one.args) == 300_000


def test_a_pair_does_not_come_together_unseen() -> None:
    frames = [
        footprints(k * 100_000, "ab", [[0.0, 0.0], [60.0 - 5.0 * k, 0.0]], observed=k == 0 or k >= 8) for k in range(10)
    ]
    told = [one for one in changes(frames) if one.name == "behind" and one.args == ("a", "b")]
    assert [(one.t_us, one.old, one.new) for one in told] == [(800_000, None, True)]


def recognised(frames: Sequence[Footprints], names: Sequence[str]) -> list[str]:
    chronicles = library.load_library(names)
    recogniser = Recogniser(chronicles, lateness_us=2_000_000)
    occurrences = []
    words: Mapping[object, str] = {True: "true", False: "false", None: "unknown"}
    for change in changes(frames):
        event = Event(change.name, change.args, change.t_us, words[change.old], words[change.new])
        occurrences += recogniser.observe(event)
    occurrences += recogniser.advance(frames[-1].t_us + 2_000_000)
    return [one.chronicle for one in occurrences]


@pytest.mark.parametrize(("leaves_at", "events"), [(60, ["overtake", "pass"]), (10, [])], ids=["in view", "left it"])
def test_two_cars_that_left_the_view_do_not_overtake_each_other(leaves_at: int, events: list[str]) -> None:
    assert sorted(recognised(seen_until(leaves_at), ["overtake", "pass"])) == events
