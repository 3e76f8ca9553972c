"""The JSON form of explanations fits its schema."""

import copy
import json
from typing import Any

import pytest

from chronicles.chronicle_set import load
from chronicles.events import Event
from chronicles.explanation.explanations import Explanation, WhyNot
from chronicles.explanation.json_form import schema, to_json
from chronicles.explanation.why import why
from chronicles.explanation.why_not import why_not
from chronicles.recogniser import recognise
from tests.chronicles.explanation.schema_check import faults
from tests.chronicles.explanation.test_explanation_oracle import accepted_case
from tests.chronicles.explanation.test_why import TWO_VISITS, VISITS, events_of


def fits(explanation: Explanation | WhyNot) -> list[str]:
    plain = to_json(explanation)
    assert json.loads(json.dumps(plain)) == plain
    return faults(plain, schema(), schema())


def regular() -> Explanation:
    chronicles, events = load(VISITS), events_of(TWO_VISITS)
    return why(chronicles, recognise(chronicles, events)[-1], events)


def test_explanation_with_an_emitter_fits_the_schema() -> None:
    assert fits(regular()) == []
    assert to_json(regular())["events"][0]["emitted_by"]["chronicle"]["name"] == "visit"


@pytest.mark.long
def test_explanations_of_random_chronicles_fit_the_schema() -> None:
    for seed in range(3000, 3030):
        chronicles, events = accepted_case(seed)
        assert fits(why_not(chronicles, chronicles.names[-1], events)) == [], seed
        for found in recognise(chronicles, events)[:2]:
            assert fits(why(chronicles, found, events)) == [], seed


def test_times_are_whole_microseconds() -> None:
    [constraint] = to_json(regular())["constraints"]
    assert (constraint["value_us"], constraint["high_us"], constraint["slack_us"]) == (
        60_000_000,
        300_000_000,
        59_999_999,
    )


@pytest.mark.parametrize(
    ("path", "value"),
    [(("version",), 2), (("start_us",), 1.5), (("events", 0, "label"), None), (("constraints", 0, "surplus"), 1)],
)
def test_schema_refuses_what_is_wrong(path: tuple[Any, ...], value: object) -> None:
    wrong = copy.deepcopy(to_json(regular()))
    place: Any = wrong
    for step in path[:-1]:
        place = place[step]
    place[path[-1]] = value
    assert faults(wrong, schema(), schema()) != []


def test_message_has_no_old_and_new_value() -> None:
    chronicles = load("chronicle one[](t1) { event(a[], t1) }")
    events = [Event("a", (), 5)]
    [matched] = to_json(why(chronicles, recognise(chronicles, events)[0], events))["events"]
    words = {"name": "a", "args": [], "t_us": 5, "old": None, "new": None, "hypotheses": [], "confidence": 1.0}
    assert matched["event"] == words
