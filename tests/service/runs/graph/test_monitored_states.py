"""States for monitors: the cars of each frame, and the relations as they turned out to have been at its time."""

import random
from collections.abc import Callable, Iterable

import pytest

from anchoring.settings import AnchoringSettings
from qsr.changes.crossings import RelationChange, Value
from qsr.settings import RelationSettings
from service.runs.graph.monitored_states import IDLE_US, Hindsight, TrafficState, TrafficStates
from tests.cases import for_each
from tests.service.logs import state

States = list[tuple[int, TrafficState]]
Frames = dict[int, list[RelationChange]]


def beside(t_us: int, new: Value, decided_us: int | None = None) -> RelationChange:
    return RelationChange("beside", ("a", "b"), t_us, t_us if decided_us is None else decided_us, None, new)


def run(states: TrafficStates, frames: Frames) -> States:
    """Run frames with cars a and b, relations first, as the pipeline has them."""
    found: States = []
    for t_us, changes in frames.items():
        found += states.take_relations(t_us, [(one, ()) for one in changes])
        found += states.take_cars(t_us, [state(t_us, "a"), state(t_us, "b")])
    return found + states.finish()


def values(found: Iterable[tuple[int, TrafficState]]) -> list[tuple[int, Value]]:
    return [(t_us, one.value("beside", ("a", "b"))) for t_us, one in found]  # type: ignore[misc]  # no numbers here


def test_a_change_counts_from_when_it_happened_not_from_when_it_was_decided() -> None:
    frames = {0: [beside(0, False)], 10: [], 20: [], 30: [beside(10, True, decided_us=30)], 40: []}
    assert values(run(TrafficStates({"beside"}, lag_us=20), frames)) == [
        (0, False),
        (10, True),
        (20, True),
        (30, True),
        (40, True),
    ]


def test_a_pair_that_is_not_looked_at_any_more_is_unknown_again() -> None:
    frames = {0: [beside(0, True)], 10: [beside(10, None)], 20: []}
    assert values(run(TrafficStates({"beside"}, lag_us=0), frames)) == [(0, True), (10, None), (20, None)]


@for_each("seed", range(20))
def test_states_are_those_of_the_definition(seed: int) -> None:
    """Each frame has one state, with the newest value dated at or before it, whatever the frames' times."""
    rng, lag_us = random.Random(seed), 50
    frames: Frames = {}
    t_us, gap_us = 0, 40 * IDLE_US
    for _ in range(60):
        t_us += rng.choice([rng.randint(1, 30), 10, gap_us if rng.random() < 0.1 else 10])
        dates = [t_us - rng.randint(0, lag_us) for _ in range(rng.choice([0, 0, 1, 3]))]
        frames[t_us] = [beside(max(0, one), rng.choice([True, False, None]), t_us) for one in dates]
    decided = [change for changes in frames.values() for change in changes]
    expected = []
    for one_us in frames:
        known = sorted((change for change in decided if change.t_us <= one_us), key=lambda change: change.t_us)
        expected.append((one_us, known[-1].new if known else None))
    states = TrafficStates({"beside"}, lag_us=lag_us)
    assert values(run(states, frames)) == expected
    assert states.left_out == {}


def test_a_state_comes_as_soon_as_no_change_up_to_its_time_can_follow() -> None:
    states = TrafficStates({"beside"}, lag_us=20)
    came: list[list[int]] = []
    for t_us in (0, 10, 20, 35, 50):
        came.append([one for one, _ in states.take_relations(t_us, ())])
        states.take_cars(t_us, [state(t_us, "a")])
    assert came == [[], [], [0], [10], [20]]


def test_what_was_not_seen_is_unknown() -> None:
    states = TrafficStates({"speed", "seen", "on"}, lag_us=0)
    states.take_cars(0, [state(0, "a"), state(0, "b", linked=False)])
    [(_, one)] = states.finish()
    assert [one.value("speed", (car,)) for car in "abc"] == [13.9, None, None]
    assert [one.value("seen", (car,)) for car in "abc"] == [True, False, None]
    assert one.members("Car") == ("a", "b")
    assert one.members("Road") == ()


def test_what_rests_on_a_refuted_link_is_left_out_and_counted() -> None:
    states = TrafficStates({"speed", "beside"}, lag_us=20)
    states.take_relations(0, [(beside(0, False), ()), (beside(5, True), ("wrong",))])
    states.take_cars(0, [state(0, "a"), state(0, "b")], {"a": ("right", "wrong"), "b": ("right",)})
    assert states.take_relations(10, (), refuted=("wrong",)) == []
    states.take_cars(10, [state(10, "a"), state(10, "b")])
    before, after = (one for _, one in states.finish())
    assert [before.value("speed", (car,)) for car in "ab"] == [None, 13.9]
    assert [after.value("speed", (car,)) for car in "ab"] == [13.9, 13.9]
    assert after.value("beside", ("a", "b")) is False
    assert states.left_out == {"changes refuted": 1}


@pytest.mark.parametrize("next_us", [20, 21, 20 + 100 * IDLE_US])
def test_a_link_that_is_refuted_by_the_frame_that_completes_a_state_is_left_out(next_us: int) -> None:
    states = TrafficStates({"speed"}, lag_us=20)
    states.take_relations(0, ())
    states.take_cars(0, [state(0, "a")], {"a": ("wrong",)})
    [(t_us, one)] = states.take_relations(next_us, (), refuted=("wrong",))
    assert (t_us, one.value("speed", ("a",))) == (0, None)


def test_states_that_were_given_out_do_not_change() -> None:
    states = TrafficStates({"beside"}, lag_us=0)
    states.take_relations(0, [(beside(0, True), ())])
    [(_, first)] = states.take_cars(0, [state(0, "a")])
    states.take_relations(10, [(beside(10, False), ())])
    [(_, second)] = states.take_cars(10, [state(10, "a")])
    assert (first.value("beside", ("a", "b")), second.value("beside", ("a", "b"))) == (True, False)


def test_links_are_decided_before_a_state_on_them_is_judged() -> None:
    assert RelationSettings().backdate_us >= AnchoringSettings().trial_us


# ---- silence


def test_states_go_on_where_no_relations_come() -> None:
    states = TrafficStates({"beside"}, lag_us=20)
    found = states.take_relations(0, [(beside(0, True), ())])
    for t_us in range(0, 3 * IDLE_US, IDLE_US // 4):
        found += states.take_cars(t_us, [state(t_us, "a")])
    assert values(found) == [(t_us, None) for t_us in range(0, 7 * IDLE_US // 4, IDLE_US // 4)]


def test_relations_that_come_when_their_state_has_left_are_dropped_and_counted() -> None:
    states = TrafficStates({"beside"}, lag_us=20)
    states.take_relations(0, [(beside(0, True), ())])
    states.take_cars(0, [state(0, "a")])
    assert values(states.take_cars(2 * IDLE_US, [state(2 * IDLE_US, "a")])) == [(0, None)]
    states.take_relations(2 * IDLE_US, ())
    assert values(states.take_relations(2 * IDLE_US + 20, ())) == [(2 * IDLE_US, True)]
    states.take_cars(10, [state(10, "a")])
    assert states.left_out == {"cars late": 1, "relations not sampled": 1}


def test_time_alone_completes_a_state_once_the_lag_is_over() -> None:
    states = TrafficStates({"beside"}, lag_us=20)
    states.take_relations(0, [(beside(0, True), ())])
    states.take_cars(0, [state(0, "a")])
    assert states.advance(20) == []  # a frame of this very time may still come
    assert values(states.advance(21)) == [(0, True)]


@pytest.mark.parametrize(
    "feed",
    [
        lambda states, t_us: states.take_relations(t_us, [(beside(t_us, bool(t_us % 20)), ("link",))]),
        lambda states, t_us: states.take_cars(t_us, [state(t_us, "a")]),
    ],
    ids=["relations", "cars"],
)
def test_memory_does_not_grow_while_one_side_is_silent(feed: Callable[[TrafficStates, int], States]) -> None:
    states = TrafficStates({"beside"}, lag_us=1_000)
    held = []
    for t_us in range(0, 6 * IDLE_US, 10_000):
        feed(states, t_us)
        held.append(sum(states._synchroniser.held.values()))
    assert max(held) == max(held[: len(held) // 2])
    assert max(held) < 2 * IDLE_US // 10_000


def test_changes_of_one_time_count_in_the_order_in_which_they_came() -> None:
    hindsight = Hindsight({"beside"}, lag_us=0)
    [(_, past)] = hindsight.take(5, [(beside(5, True), ()), (beside(5, False), ())])
    assert past.relations["beside"] == {("a", "b"): False}


def test_what_was_unknown_for_the_time_being_is_known_again_when_the_car_comes_back() -> None:
    gone = RelationChange("beside", ("a", "b"), 20, 30, True, None, absent=("a",))
    for verdict, known in (("refuted", True), ("validated", None)):
        hindsight = Hindsight({"beside"}, lag_us=10)
        past = dict(hindsight.take(10, [(beside(10, True), ())]))
        past |= dict(hindsight.take(30, [(gone, ("a lost#1",))]))
        past |= dict(hindsight.take(40, ()))
        refuted, validated = (["a lost#1"] if verdict == one else [] for one in ("refuted", "validated"))
        past |= dict(hindsight.take(60, (), refuted, validated))
        past |= dict(hindsight.take(80, ()))
        values = {t_us: one.relations["beside"].get(("a", "b")) for t_us, one in past.items()}
        assert values == {10: True, 30: None, 40: known, 60: known}


def test_little_is_kept_of_what_has_passed() -> None:
    states = TrafficStates({"moving"}, lag_us=50)
    for t_us in range(0, 5000, 10):
        car = f"car{t_us}"
        gone = RelationChange("moving", (f"car{t_us - 10}",), t_us, t_us, True, None)
        came = RelationChange("moving", (car,), t_us, t_us, None, True)
        released = states.take_relations(t_us, [(gone, ()), (came, ())]) + states.take_cars(t_us, [state(t_us, car)])
        assert len(released) <= 1
        assert max(states._synchroniser.held.values()) <= 7
    rest = states.finish()
    assert len(rest) == 5
    assert [rest[-1][1].value("moving", (f"car{t_us}",)) for t_us in (4970, 4980, 4990)] == [None, None, True]
