"""The recogniser and every executor against the slow and obvious search of `oracle.py`, on random cases."""

import pytest

from chronicles import recognise
from chronicles.compilation.hierarchy import levels
from chronicles.events import Occurrence
from tests.cases import seeds
from tests.chronicles.execution.case_runner import FAR_US, check_case, disagreements, make_case


@seeds(range(1500), kept=80)
def test_executors_find_exactly_what_the_oracle_finds(seeds: range, monkeypatch: pytest.MonkeyPatch) -> None:
    cases = [check_case(seed) for seed in seeds[::2]]
    # Forget whatever can be forgotten after every event: nothing of it may be needed again.
    monkeypatch.setattr("chronicles.execution.stage._FIRST_SWEEP", 1)
    cases += [check_case(seed) for seed in seeds[1::2]]
    # Cases without matches would prove nothing.
    assert sum(bool(case.expected) for case in cases) >= len(seeds) // 10


def test_missing_occurrence_and_wrong_order_are_noticed(monkeypatch: pytest.MonkeyPatch) -> None:
    case = next(case for case in map(make_case, range(1000)) if len(case.expected) > 1)
    assert disagreements(case, ("eager",)) == []

    def spoilt(*_: object, executor: str, **__: object) -> list[Occurrence]:
        found = list(recognise(case.chronicles, case.trace, until_us=FAR_US))
        return {"eager": found, "missing": found[1:], "turned": found[::-1]}[executor]

    monkeypatch.setattr("tests.chronicles.execution.case_runner.recognise", spoilt)
    missing, turned = disagreements(case, ("eager", "missing", "turned"))
    assert missing.startswith("missing differs from the oracle")
    assert turned.startswith("turned gives another order than eager")


@pytest.mark.long
@seeds(range(1000), kept=60)
def test_every_event_is_given_within_the_bound_of_its_plan(seeds: range) -> None:
    """Whoever waits for it cannot see more of the trace than what comes by then."""
    waited = 0
    for case in map(make_case, seeds):
        placed = levels(case.chronicles.plans)
        for found in recognise(case.chronicles, case.trace, until_us=FAR_US):
            given = case.chronicles.plan(found.chronicle).given
            for event, (name, _, delay_us) in zip(found.given, given, strict=True):
                until_us = event.t_us + placed[found.chronicle][1] + delay_us
                seen = [one for one in case.trace if one.t_us <= until_us]
                assert (event.name, found.key) in [
                    (name, one.key) for one in recognise(case.chronicles, seen, until_us=until_us)
                ], case.text
                waited += delay_us > 0
    assert waited


@pytest.mark.long
@seeds(range(1000), kept=60)
def test_what_feeds_some_events_finds_them_as_the_whole_set_does(seeds: range) -> None:
    smaller = 0
    for case in map(make_case, seeds):
        for name in case.chronicles.given:
            feeding = case.chronicles.feeding({name})
            whole, part = (
                sorted(repr(it) for one in found for it in one.given if it.name == name)
                for found in (recognise(these, case.trace, until_us=FAR_US) for these in (case.chronicles, feeding))
            )
            assert part == whole, case.text
            smaller += len(feeding.plans) < len(case.chronicles.plans)
    assert smaller
