"""The recogniser against the slow and obvious search of `oracle.py`, on random chronicles and traces."""

from collections import Counter
from dataclasses import replace

import pytest

from chronicles.chronicle_set import ChronicleSet, load
from chronicles.errors import ChronicleError
from chronicles.events import Event, Occurrence
from chronicles.recogniser import Recogniser
from tests.chronicles.execution.oracle import Match, Oracle, as_match
from tests.chronicles.execution.random_cases import CaseMaker

CASES_A_BLOCK = 100
BLOCKS = 16


def accepted_case(seed: int) -> tuple[CaseMaker, str, ChronicleSet]:
    """Make the first random text after a seed that is free of errors."""
    maker = CaseMaker(seed)
    while True:
        text = maker.text()
        try:
            return maker, text, load(text)
        except ChronicleError:
            continue


def run(recogniser: Recogniser, steps: list[Event | int]) -> list[Occurrence]:
    found = []
    for step in steps:
        found += recogniser.advance(step) if isinstance(step, int) else recogniser.observe(step)
    return found


def expected_recognised_us(match: Match, steps: list[Event | int], index_of: dict[int, int], lateness_us: int) -> int:
    """Give the first time at which all events had come and the watermark had reached the end of the last window."""
    clock_us, missing = -(10**9), set(match.indices)
    for step in steps:
        clock_us = max(clock_us, step if isinstance(step, int) else step.t_us)
        if not isinstance(step, int):
            missing.discard(index_of[id(step)])
        if not missing and clock_us - lateness_us >= match.closes_us:
            return clock_us
    raise AssertionError("the last step is behind everything")


def check_case(seed: int) -> int:
    """Compare one case; give its number of matches."""
    maker, text, chronicles = accepted_case(seed)
    trace = maker.trace()
    lateness_us = maker.random.choice((0, 0, 3, 20))
    steps = maker.arrival(trace, lateness_us)
    recogniser = Recogniser(chronicles, lateness_us)
    found = run(recogniser, steps)
    assert recogniser.late_count == 0
    index_of = {id(event): index for index, event in enumerate(trace)}
    expected = Oracle(text).matches(trace)
    if len(chronicles.names) == 1:
        wanted = [(one, expected_recognised_us(one, steps, index_of, lateness_us)) for one in expected]
    else:
        # Emitted events are known by what they say, not by their place in the trace.
        wanted = [(replace(one, indices=()), 0) for one in expected]
        index_of = {}
    got = [
        (as_match(one, lambda event: index_of[id(event)], 0), one.recognised_us)
        if index_of
        else (replace(as_match(one, lambda event: 0, 0), indices=()), 0)
        for one in found
    ]
    assert Counter(got) == Counter((replace(one, closes_us=0), at_us) for one, at_us in wanted), (text, steps)
    return len(expected)


@pytest.mark.parametrize("block", range(BLOCKS))
def test_recogniser_finds_exactly_what_the_oracle_finds(block: int, monkeypatch: pytest.MonkeyPatch) -> None:
    if block % 2:
        # Forget whatever can be forgotten after every event: nothing of it may be needed again.
        monkeypatch.setattr("chronicles.recogniser._FIRST_SWEEP", 1)
    matches = [check_case(seed) for seed in range(block * CASES_A_BLOCK, (block + 1) * CASES_A_BLOCK)]
    # A block without matches would prove nothing.
    assert sum(map(bool, matches)) >= CASES_A_BLOCK // 10
