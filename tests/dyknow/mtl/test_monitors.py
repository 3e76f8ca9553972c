"""When monitors tell that objects violated or satisfied them, and when they are silent."""

from __future__ import annotations

import gc
from collections.abc import Iterator, Mapping, Sequence
from itertools import product

import numpy as np
import pytest

from dyknow.mtl.formula import Monitor, Subject, Variable
from dyknow.mtl.monitors import MonitorEvent, Monitors
from dyknow.mtl.parser import parse_formula, parse_monitors
from dyknow.mtl.progression.states import DictState, StateError
from dyknow.mtl.structure import horizon_us
from dyknow.mtl.watching.watch import Watch
from tests.dyknow.mtl.oracle import F, Sequences, T
from tests.dyknow.mtl.support import random_formula, random_states

SECOND_US = 1_000_000
STEADY = "monitor steady per Car: always p[?c]"
Told = tuple[str, tuple[str, ...], int, int]


def world(**values: bool | None) -> DictState:
    """Build a state with these cars and the value of p for each."""
    return DictState({("p", (car,)): value for car, value in values.items()}, {"Car": list(values)})


def tell(text: str, states: Sequence[DictState], *, calm_us: int = 0) -> list[Told]:
    """Run monitors over one state a second."""
    monitors = Monitors(parse_monitors(text), calm_us=calm_us)
    return [told(one) for k, state in enumerate(states) for one in monitors.update(k * SECOND_US, state)]


def told(event: MonitorEvent) -> Told:
    return event.name, event.objects, event.since_us // SECOND_US, event.t_us // SECOND_US


def test_each_object_has_an_instance_of_its_own_from_its_first_state_on() -> None:
    states = [world(a=True), world(a=True, b=True), world(a=True, b=False), world(a=False, b=True)]
    assert tell(STEADY, states) == [("steady_violated", ("b",), 1, 2), ("steady_violated", ("a",), 0, 3)]


def test_a_violation_that_goes_on_is_told_once_and_the_next_one_again() -> None:
    states = [world(a=value) for value in (True, False, False, False, True, False)]
    assert tell(STEADY, states) == [("steady_violated", ("a",), 0, 1), ("steady_violated", ("a",), 4, 5)]


def test_a_violation_goes_on_through_gaps_shorter_than_the_calm() -> None:
    states = [world(a=value) for value in (False, True, True, False, True, True, True, True, False)]
    assert [one[3] for one in tell(STEADY, states, calm_us=3 * SECOND_US)] == [0, 8]


def test_a_violation_of_a_deadline_goes_on_until_the_longest_window_is_survived() -> None:
    text = "monitor returns per Car: always tolerate(p[?c], 2s, 0s)"
    states = [world(a=value) for value in [True, *[False] * 9, *[True] * 3, *[False] * 3]]
    assert [one[3] for one in tell(text, states)] == [3, 15]


def test_what_is_satisfied_is_told_once_as_long_as_the_object_stays() -> None:
    text = "monitor appears per Car: eventually p[?c]"
    states = [world(a=False), world(a=True), world(a=True), world(), world(a=True)]
    assert tell(text, states) == [("appears_satisfied", ("a",), 0, 1), ("appears_satisfied", ("a",), 4, 4)]


def test_what_holds_to_the_end_or_is_open_when_an_object_leaves_is_no_event_but_counted() -> None:
    monitors = Monitors(parse_monitors(f"{STEADY}\nmonitor soon per Car: eventually[0s, 9s] not p[?c]"))
    for t_us, state in enumerate([world(a=True, b=True), world(b=True), world(b=True)]):
        assert monitors.update(t_us, state) == ()
    assert [(one.running, one.undecided) for one in monitors.report()] == [(1, 1), (1, 1)]
    monitors.finish()
    assert [(one.running, one.undecided) for one in monitors.report()] == [(0, 2), (0, 2)]


def test_what_missing_values_keep_unknown_for_good_is_undecided() -> None:
    monitors = Monitors(parse_monitors("monitor first per Car: p[?c]"))
    monitors.update(0, world(a=None))
    monitors.update(1, world(a=False))
    [report] = monitors.report()
    assert (report.running, report.violated, report.undecided) == (0, 0, 1)


def test_a_monitor_without_objects_runs_once() -> None:
    states = [DictState({"green": value}) for value in (True, False)]
    assert tell("monitor lights: always green", states) == [("lights_violated", (), 0, 1)]


def test_several_subjects_mean_every_combination_in_the_order_of_the_sorts() -> None:
    text = "monitor apart per ?x in Car, ?y in Car: always (?x = ?y or p[?x])"
    states = [world(a=False, b=True, c=False)]
    assert [one[1] for one in tell(text, states)] == [("a", "b"), ("a", "c"), ("c", "a"), ("c", "b")]


def test_an_event_names_its_roles_and_the_version_of_the_text() -> None:
    monitors = Monitors(parse_monitors(STEADY))
    [event] = monitors.update(0, world(a=False))
    [same] = Monitors(parse_monitors(f"# layout\n{STEADY} ;")).update(0, world(a=False))
    [other] = Monitors(parse_monitors("monitor steady per Car: always[0s, 1s] p[?c]")).update(0, world(a=False))
    assert event.roles == (("c", "a"),)
    assert event == same
    assert event.version != other.version


def test_a_state_that_is_not_later_is_refused() -> None:
    monitors = Monitors(parse_monitors(STEADY))
    monitors.update(5, world(a=True))
    with pytest.raises(StateError, match="expected a state later than 5 us, got one at 5 us"):
        monitors.update(5, world(a=True))


@pytest.mark.long
def test_nothing_is_kept_of_objects_that_have_left() -> None:
    before = watch_count()
    monitors = Monitors(parse_monitors("monitor back per Car: always (p[?c] or eventually[0s, 9s] p[?c])"))
    for t_us in range(300):
        monitors.update(t_us, world(**{f"car{t_us}": True, f"car{t_us + 1}": False}))
    assert watch_count() - before == 2
    assert monitors.report()[0].running == 2


def watch_count() -> int:
    gc.collect()
    return sum(isinstance(one, Watch) for one in gc.get_objects())


@pytest.mark.parametrize(
    ("text", "expected_us"),
    [
        ("p", 0),
        ("always p", 0),
        ("always[2s, 3s] p", 3 * SECOND_US),
        ("always (p implies eventually[1s, 4s] (q until[0s, 2s] p))", 6 * SECOND_US),
        ("always (p implies (next p or eventually[0s, 1s] q))", SECOND_US),
        ("always tolerate(p, 2s, 500ms)", 2_500_000),
        ("always (p implies next q)", 1),
        ("eventually[3s, oo] p", 3 * SECOND_US),
    ],
)
def test_the_horizon_is_the_longest_way_through_the_windows(text: str, expected_us: int) -> None:
    assert horizon_us(parse_formula(text)) == expected_us


# ---- against the definition, evaluated directly


def test_events_are_those_of_the_definition() -> None:
    rng = np.random.default_rng(4)
    outcomes: dict[str, int] = {}
    for number in range(200):
        names = ("x0",) if number % 2 else ("x0", "x1")
        formula = random_formula(rng, 2, names)
        monitor = Monitor("m", tuple(Subject(Variable(name), "Car") for name in names), formula)
        states = random_states(rng, 12)
        calm_us = int(rng.integers(6))
        monitors = Monitors([monitor], calm_us=calm_us)
        events = [one for t_us, state in states for one in monitors.update(t_us, state)]
        got = sorted((one.objects, one.t_us, one.since_us, one.outcome) for one in events)
        assert got == sorted(defined(monitor, states, calm_us)), monitor
        for one in events:
            outcomes[one.outcome] = outcomes.get(one.outcome, 0) + 1
    assert min(outcomes["violated"], outcomes["satisfied"]) > 100


def defined(
    monitor: Monitor, states: Sequence[tuple[int, DictState]], calm_us: int
) -> Iterator[tuple[tuple[str, ...], int, int, str]]:
    """Give the events by definition: every instance is evaluated anew at every state of its stretch."""
    names = [one.variable.name for one in monitor.subjects]
    for objects in product("abc", repeat=len(names)):
        bound = {name: ("Car", one) for name, one in zip(names, objects, strict=True)}
        for stretch, left_us in stretches(states, objects):
            for t_us, since_us, outcome in verdicts(monitor, stretch, bound, calm_us, left_us):
                yield objects, t_us, since_us, outcome


def stretches(
    states: Sequence[tuple[int, DictState]], objects: Sequence[str]
) -> Iterator[tuple[list[tuple[int, DictState]], int]]:
    """Cut out the runs of states that have all the objects; with each, when they had left, or 0."""
    stretch: list[tuple[int, DictState]] = []
    for one in [*states, (0, DictState({}))]:
        if set(objects) <= set(one[1].members("Car")):
            stretch.append(one)
        elif stretch:
            yield stretch, one[0]
            stretch = []


def verdicts(
    monitor: Monitor,
    stretch: list[tuple[int, DictState]],
    bound: Mapping[str, tuple[str, str]],
    calm_us: int,
    left_us: int,
) -> Iterator[tuple[int, int, str]]:
    recovery_us = max(calm_us, horizon_us(monitor.formula))
    goes_on, first = False, 0
    for last in range(len(stretch)):
        since_us, t_us = stretch[first][0], stretch[last][0]
        verdict = Sequences(stretch[first : last + 1], False).holds(monitor.formula, 0, dict(bound))
        if verdict == T:
            yield t_us, since_us, "satisfied"
            return
        if verdict == F:
            if not goes_on:
                yield t_us, since_us, "violated"
            goes_on, first = True, last + 1
        elif t_us - since_us >= recovery_us:
            goes_on = False
    if first < len(stretch):
        verdict = Sequences(stretch[first:], False, left_us).holds(monitor.formula, 0, dict(bound))
        if verdict == T or (verdict == F and not goes_on):
            yield left_us, stretch[first][0], "satisfied" if verdict == T else "violated"


# ---- time without states

STARTS = "monitor starts per Car: eventually[0s, 3s] p[?c]"


def test_a_deadline_that_passed_before_an_object_was_missed_is_decided() -> None:
    monitors = Monitors(parse_monitors(STARTS))
    monitors.update(0, world(a=False, b=False))
    assert monitors.update(2 * SECOND_US, world(b=False)) == ()  # a might have started yet
    assert [told(one) for one in monitors.update(4 * SECOND_US, world())] == [("starts_violated", ("b",), 0, 4)]
    [report] = monitors.report()
    assert (report.violated, report.undecided) == (1, 1)


def test_time_that_passes_decides_deadlines_once() -> None:
    monitors = Monitors(parse_monitors(STARTS))
    monitors.update(0, world(a=False))
    assert monitors.advance(3 * SECOND_US) == ()
    assert [told(one) for one in monitors.advance(5 * SECOND_US)] == [("starts_violated", ("a",), 0, 5)]
    assert monitors.advance(60 * SECOND_US) == ()
    monitors.finish()
    assert [(one.violated, one.undecided) for one in monitors.report()] == [(1, 0)]


def test_the_instance_after_a_violation_by_time_begins_with_the_next_state() -> None:
    monitors = Monitors(parse_monitors(STARTS))
    monitors.update(0, world(a=False))
    monitors.advance(5 * SECOND_US)
    assert [told(one) for one in monitors.update(9 * SECOND_US, world(a=True))] == [("starts_satisfied", ("a",), 9, 9)]


def test_a_state_before_the_time_told_is_refused() -> None:
    monitors = Monitors(parse_monitors(STARTS))
    monitors.update(0, world(a=False))
    monitors.advance(2 * SECOND_US)
    with pytest.raises(StateError, match="expected a state at 2000000 us or later"):
        monitors.update(SECOND_US, world(a=True))


def test_time_told_in_between_loses_nothing() -> None:
    rng = np.random.default_rng(5)
    for _ in range(100):
        monitor = Monitor("m", (Subject(Variable("x0"), "Car"),), random_formula(rng, 2, ("x0",)))
        states = random_states(rng, 12)
        plain, hurried = Monitors([monitor]), Monitors([monitor])
        for t_us, state in states:
            plain.update(t_us, state)
            hurried.advance(t_us)
            hurried.update(t_us, state)
        [one], [other] = plain.report(), hurried.report()
        # A failure that is known before a state leaves that state to the next instance, so there may be more of them.
        assert bool(one.violated) == bool(other.violated)
