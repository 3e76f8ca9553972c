"""Executors that give way to each other in the middle of a stream."""

import pytest

from chronicles.chronicle_set import load
from chronicles.events import Event
from chronicles.execution import executors
from chronicles.execution.executors import AutomaticExecutor
from chronicles.recogniser import Recogniser
from tests.chronicles.execution.case_runner import check_case

RARE_LAST = """
chronicle led_to_alarm[](t1, t3) {
  event(step[?], t1) event(turn[?], t2) event(alarm[?], t3)  t2 - t1 in [1s, 10s]  t3 - t2 in [1s, 10s]
}
"""
KEYED = "chronicle visit[?x](t1, t2) { event(enter[?x], t1) event(leave[?x], t2) t2 - t1 in [0s, 10s] }"


def lazy_numbers(recogniser: Recogniser) -> set[int]:
    executor = recogniser._engine._stages[0]._executor
    assert isinstance(executor, AutomaticExecutor)
    return set(executor._lazy_numbers)


def test_automatic_executor_chooses_for_each_chronicle_by_the_rates_of_its_events(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(executors, "_EVENTS_TO_CHOOSE", 100)
    recogniser = Recogniser(load(RARE_LAST + KEYED))
    assert lazy_numbers(recogniser) == {0, 1}
    for number in range(100):
        name = ("step", "turn", "enter", "leave")[number % 4]
        recogniser.observe(Event(name, (f"x{number // 4}",), number * 100_000))
    assert lazy_numbers(recogniser) == {0}


@pytest.mark.parametrize("events", [1, 3, 8])
def test_results_do_not_depend_on_when_the_choice_is_made(events: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(executors, "_EVENTS_TO_CHOOSE", events)
    matches = [len(check_case(seed, executors=("eager",)).expected) for seed in range(50_000, 50_060)]
    assert sum(map(bool, matches)) >= 6
