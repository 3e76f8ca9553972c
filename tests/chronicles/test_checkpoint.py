"""What a checkpoint brings back, and which are refused; the random cases of `case_runner.py` restart too."""

import json
from typing import Any  # what a checkpoint is not

import pytest

from chronicles.chronicle_set import load
from chronicles.errors import ChronicleError
from chronicles.events import Event
from chronicles.recogniser import Recogniser

RACE = "chronicle race[?x](t1, t2) { event(start[?x], t1) event(goal[?x], t2) t2 - t1 in [0s, 9s] }"
LONGER_RACE = RACE.replace("9s", "10s")


def test_restored_recogniser_counts_on_the_late_events() -> None:
    first, second = Recogniser(load(RACE)), Recogniser(load(RACE))
    first.advance(9)
    first.observe(Event("start", ("u",), 5))
    second.restore(first.checkpoint())
    assert second.late_count == 1


@pytest.mark.parametrize("executor", ["auto", "lazy"])
def test_checkpoint_of_an_executor_that_is_gone_is_refused(executor: str) -> None:
    checkpoint = Recogniser(load(RACE)).checkpoint() | {"executor": executor, "timeouts_from": None}
    with pytest.raises(ChronicleError, match=f"checkpoint: expected executor 'eager', got '{executor}'"):
        Recogniser(load(RACE)).restore(checkpoint)


def test_restored_recogniser_can_still_take_back() -> None:
    first, second = Recogniser(load(RACE)), Recogniser(load(RACE))
    first.observe(Event("start", ("u",), 0, hypotheses=("h1",)))
    first.observe(Event("goal", ("u",), 5))
    second.restore(json.loads(json.dumps(first.checkpoint())))
    assert [one.status for one in second.retract("h1")] == ["retracted"]


def test_restoring_forgets_what_the_recogniser_knew() -> None:
    empty, used = Recogniser(load(RACE)), Recogniser(load(RACE))
    used.observe(Event("start", ("u",), 0))
    used.restore(empty.checkpoint())
    assert used.partial_instances() == ()


def test_checkpoint_of_other_chronicles_is_refused() -> None:
    checkpoint = Recogniser(load(RACE)).checkpoint()
    with pytest.raises(ChronicleError, match=r"checkpoint: expected chronicles \[\['race', '\w+'\]\], got"):
        Recogniser(load(LONGER_RACE)).restore(checkpoint)


def test_checkpoint_of_another_lateness_is_refused() -> None:
    checkpoint = Recogniser(load(RACE), 5).checkpoint()
    with pytest.raises(ChronicleError, match="checkpoint: expected lateness_us 0, got 5"):
        Recogniser(load(RACE)).restore(checkpoint)


@pytest.mark.parametrize("key", ["state", "digest"])
def test_damaged_checkpoint_is_refused(key: str) -> None:
    checkpoint = Recogniser(load(RACE)).checkpoint()
    checkpoint[key] = {"events": [], "value": ["event", 3]}
    with pytest.raises(ChronicleError, match="checkpoint: expected one that a recogniser gave"):
        Recogniser(load(RACE)).restore(checkpoint)


@pytest.mark.parametrize("other", [None, {}, "text", 3])
def test_what_is_no_checkpoint_is_refused(other: Any) -> None:
    with pytest.raises(ChronicleError, match="checkpoint: expected one that a recogniser gave"):
        Recogniser(load(RACE)).restore(other)
