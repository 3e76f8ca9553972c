"""Do executors on a stored trace, and the recogniser on the trace as it arrives, find what the oracle finds?"""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TypeVar

from chronicles import Recogniser, recognise
from chronicles.chronicle_set import ChronicleSet, load
from chronicles.errors import ChronicleError
from chronicles.events import Event, Occurrence
from tests.chronicles.execution.oracle import Match, Oracle, as_match
from tests.chronicles.execution.random_cases import CaseMaker

Kind = TypeVar("Kind")
EXECUTORS = ("eager", "backfill")
FAR_US = 10_000  # behind everything that a case can wait for


@dataclass(frozen=True)
class Case:
    """A text, its trace in the order of arrival, steps that bring the trace, and what must be found."""

    text: str
    chronicles: ChronicleSet
    trace: list[Event]
    steps: list[Event | int]
    lateness_us: int
    restart_at: int
    expected: list[Match]
    refused: int

    @property
    def is_single(self) -> bool:
        """Whether there is one chronicle, so that no chronicle looks at emitted events."""
        return len(self.chronicles.names) == 1


def make_case(seed: int) -> Case:
    """Make the first random text after a seed that is free of errors, and find its matches the slow way."""
    maker = CaseMaker(seed)
    refused = 0
    while True:
        text = maker.text()
        try:
            chronicles = load(text)
            break
        except ChronicleError:
            refused += 1
    lateness_us = maker.random.choice((0, 0, 3, 20))
    steps = maker.arrival(maker.trace(), lateness_us)
    trace = [step for step in steps if isinstance(step, Event)]
    restart_at = maker.random.randrange(len(steps))
    return Case(text, chronicles, trace, steps, lateness_us, restart_at, Oracle(text).matches(trace), refused)


def check_case(seed: int, executors: Sequence[str] = EXECUTORS) -> Case:
    """Compare every executor, and the recogniser on the arriving trace, with the oracle; fail if one differs."""
    case = make_case(seed)
    assert disagreements(case, executors) == []
    return case


def disagreements(case: Case, executors: Sequence[str]) -> list[str]:
    """Describe where an executor, or the recogniser on the arriving trace, finds something else than the oracle.

    Executors must also give equal occurrences in the same order.
    """
    wanted = Counter(_without_places(case, [replace(one, closes_us=0) for one in case.expected]))
    found = {name: recognise(case.chronicles, case.trace, until_us=FAR_US, executor=name) for name in executors}
    described = []
    for name, occurrences in found.items():
        got = Counter(_without_places(case, [as_match(one, Places(case.trace), 0) for one in occurrences]))
        if got != wanted:
            described.append(_difference(case, name, got, wanted))
        elif list(occurrences) != list(found[executors[0]]):
            described.append(f"{name} gives another order than {executors[0]} on\n{case.text}\n{case.trace}")
    wanted_in_time = _wanted_in_time(case)
    told = _told(Recogniser(case.chronicles, case.lateness_us), case.steps)
    if _in_time(case, told) != wanted_in_time:
        described.append(_difference(case, "the recogniser on arrival", _in_time(case, told), wanted_in_time))
    elif _restarted(case) != told:
        described.append(f"the recogniser gives others when restarted at step {case.restart_at} of\n{case.text}")
    return described


def _told(recogniser: Recogniser, steps: Sequence[Event | int]) -> list[Occurrence]:
    found: list[Occurrence] = []
    for step in steps:
        found += recogniser.advance(step) if isinstance(step, int) else recogniser.observe(step)
    return found


def _restarted(case: Case) -> list[Occurrence]:
    """Observe the trace as it arrives, with another recogniser that goes on from a checkpoint."""
    first, second = (Recogniser(case.chronicles, case.lateness_us) for _ in range(2))
    found = _told(first, case.steps[: case.restart_at])
    second.restore(first.checkpoint())
    return found + _told(second, case.steps[case.restart_at :])


def _in_time(case: Case, told: Sequence[Occurrence]) -> Counter[tuple[Match, int]]:
    """Give each match with the time at which it was told."""
    matches = _without_places(case, [as_match(one, Places(case.trace), 0) for one in told])
    told_us = [one.recognised_us if case.is_single else 0 for one in told]
    return Counter(zip(matches, told_us, strict=True))


def _wanted_in_time(case: Case) -> Counter[tuple[Match, int]]:
    matches = _without_places(case, [replace(one, closes_us=0) for one in case.expected])
    told_us = [_first_certain_us(one, case) if case.is_single else 0 for one in case.expected]
    return Counter(zip(matches, told_us, strict=True))


def _difference(case: Case, name: str, got: Counter[Kind], wanted: Counter[Kind]) -> str:
    lines = [f"{name} differs from the oracle on", case.text, f"lateness {case.lateness_us}; steps:"]
    lines += [repr(step) for step in case.steps]
    lines += [f"too many: {one}" for one in (got - wanted).elements()]
    lines += [f"missing: {one}" for one in (wanted - got).elements()]
    return "\n".join(lines)


def _without_places(case: Case, matches: list[Match]) -> list[Match]:
    """Leave out indices where events are emitted: those are known by what they say, not by a place in the trace."""
    return matches if case.is_single else [replace(one, indices=()) for one in matches]


class Places:
    """Where events stand in a trace, by identity: equal events are different events."""

    def __init__(self, trace: list[Event]) -> None:
        self._place_of = {id(event): index for index, event in enumerate(trace)}

    def __call__(self, event: Event) -> int:
        """Give the place, -1 for an event that was emitted."""
        return self._place_of.get(id(event), -1)


def _first_certain_us(match: Match, case: Case) -> int:
    """Give the first time told at which all events had come and the watermark had reached the last window's end."""
    place = Places(case.trace)
    clock_us, missing = -(10**9), set(match.indices)
    for step in case.steps:
        clock_us = max(clock_us, step if isinstance(step, int) else step.t_us)
        if not isinstance(step, int):
            missing.discard(place(step))
        if not missing and clock_us - case.lateness_us >= match.closes_us:
            return clock_us
    raise AssertionError("the last step is behind everything")
