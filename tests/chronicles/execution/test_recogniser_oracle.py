"""The recogniser and every executor against the slow and obvious search of `oracle.py`, on random cases."""

import pytest

from chronicles import recognise
from chronicles.events import Occurrence
from tests.cases import seeds
from tests.chronicles.execution.case_runner import FAR_US, check_case, disagreements, make_case


@seeds(range(1500), kept=200)
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
