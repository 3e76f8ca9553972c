"""Explanations against the recogniser and against the try of every small relaxation, on random chronicles."""

import re
from collections import Counter

import pytest

from chronicles.chronicle_set import ChronicleSet, load
from chronicles.errors import ChronicleError
from chronicles.events import Event
from chronicles.explanation.explanations import BoundChange, NearMiss, WhyNot
from chronicles.explanation.why import why
from chronicles.explanation.why_not import why_not
from chronicles.recogniser import recognise
from tests.cases import seeds
from tests.chronicles.execution.random_cases import CaseMaker
from tests.chronicles.explanation.relaxations import relaxed_sets

LARGEST_TRIED_US = 8


def accepted_case(seed: int) -> tuple[ChronicleSet, list[Event]]:
    maker = CaseMaker(seed)
    while True:
        text = maker.text()
        try:
            # Equal events could not be told apart below.
            return load(text), list(dict.fromkeys(maker.trace()))
        except ChronicleError:
            continue


def changed_text(chronicles: ChronicleSet, name: str, change: BoundChange) -> str:
    text = dict(chronicles.texts)[name]
    found = re.search(rf"^  {re.escape(change.before)}(?=;?$)", text, re.MULTILINE)
    assert found is not None
    return f"{text[: found.start()]}  {change.after}{text[found.end() :]}"


def is_found(chronicles: ChronicleSet, miss: NearMiss, events: list[Event]) -> bool:
    wanted = Counter(one.event for one in miss.events)
    roles = {role.name: role.value for role in miss.roles}
    return any(one.roles == roles and Counter(one.events) == wanted for one in recognise(chronicles, events))


def smallest_us(answer: WhyNot) -> int | None:
    sizes = [one.change.size for one in answer.near_misses if one.change is not None and one.change.unit == "us"]
    return min(sizes, default=None)


def smallest_relaxation_us(chronicles: ChronicleSet, name: str, events: list[Event]) -> int | None:
    text = dict(chronicles.texts)[name]
    for by_us in range(1, LARGEST_TRIED_US + 1):
        if any(recognise(changed, events) for changed in relaxed_sets(text, by_us)):
            return by_us
    return None


@seeds(range(400), kept=40)
def test_every_statement_of_an_occurrence_is_read_as_met(seeds: range) -> None:
    explained = 0
    for seed in seeds:
        chronicles, events = accepted_case(seed)
        for found in recognise(chronicles, events):
            explanation = why(chronicles, found, events)
            assert {one.outcome for one in explanation.obligations} <= {"met"}, seed
            assert all(one.is_met for one in explanation.constraints), seed
            assert Counter(one.event for one in explanation.events) == Counter(found.events)
            assert {role.name: role.value for role in explanation.roles} == found.roles
            explained += 1
    assert explained > len(seeds) // 4


@pytest.mark.long
@seeds(range(1000, 1160), kept=15)
def test_near_misses_are_no_occurrences_and_their_changes_make_them_so(seeds: range) -> None:
    changes = 0
    for seed in seeds:
        chronicles, events = accepted_case(seed)
        name = chronicles.names[0]
        answer = why_not(chronicles, name, events)
        assert answer.recognised == sum(one.chronicle == name for one in recognise(chronicles, events)), seed
        for miss in answer.near_misses:
            assert not is_found(chronicles, miss, events), seed
            assert miss.unmet_count > 0
            if miss.change is not None:
                assert is_found(load(changed_text(chronicles, name, miss.change)), miss, events), seed
                changes += 1
    assert changes > len(seeds) // 4


@pytest.mark.long
@seeds(range(2000, 2120), kept=30)
def test_smallest_change_is_as_small_as_the_smallest_relaxation_that_matches(seeds: range) -> None:
    compared = 0
    for seed in seeds:
        chronicles, events = accepted_case(seed)
        name = chronicles.names[0]
        answer = why_not(chronicles, name, events)
        # Where occurrences rule each other out, and where widening an occurs also frees the order of events, a smaller
        # change may help another instance than the nearest.
        if answer.recognised or any(word in dict(chronicles.texts)[name] for word in ("select", "occurs")):
            continue
        expected = smallest_relaxation_us(chronicles, name, events)
        got = smallest_us(answer)
        assert got == expected or (expected is None and got is not None and got > LARGEST_TRIED_US), seed
        compared += expected is not None
    assert compared > 0
