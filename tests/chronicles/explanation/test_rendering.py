"""The texts of explanations, against `golden/`; rewrite with UPDATE_GOLDEN=1 and read the diff."""

import os
from collections.abc import Callable
from pathlib import Path

import pytest

from chronicles.chronicle_set import load
from chronicles.explanation.explanations import BoundChange, ConstraintReading, Explanation, WhyNot
from chronicles.explanation.rendering import render
from chronicles.explanation.sentences import of_change, of_constraint
from chronicles.explanation.why import why
from chronicles.explanation.why_not import why_not
from chronicles.recogniser import recognise
from tests.chronicles.explanation.test_why import TWO_VISITS, VISITS, events_of

GOLDEN = Path(__file__).parent / "golden"
PARKED = """chronicle parked[?car, ?place](t1, t2) {
  event(stop[?car], t1)  event(go[?car], t2)  t2 - t1 in [2s, 1min]
  hold(in_bay[?car, ?place]:true, (t1, t2))
  noevent(honk[?car], (t1, t2 + 1s))
  occurs((1, 2), blink[?car], (t1 - 5s, t1))
  when recognised { emit left_bay[?car, ?place] at t2 }
}"""
GOOD = "0s in_bay[a, p4] unknown -> true\n1s blink[a]\n3s stop[a]\n7.5s go[a]\n9s honk[a]\n20s tick[]"
BAD = """
0s in_bay[a, p4] unknown -> true
3s stop[a]
4s in_bay[a, p4] true -> unknown
5s honk[a]
7.5s go[a]
30s stop[b]
85s blink[c]
86s in_bay[c, p7] unknown -> true
90s stop[c]
91.5s go[c]
200s tick[]
"""


def parked() -> Explanation:
    chronicles, events = load(PARKED), events_of(GOOD)
    return why(chronicles, recognise(chronicles, events)[0], events)


def regular() -> Explanation:
    chronicles, events = load(VISITS), events_of(TWO_VISITS)
    return why(chronicles, recognise(chronicles, events)[-1], events)


def not_parked() -> WhyNot:
    return why_not(load(PARKED), "parked", events_of(BAD), end_us=100_000_000)


@pytest.mark.parametrize("make", [parked, regular, not_parked], ids=lambda make: make.__name__)
def test_text_is_as_agreed(make: Callable[[], Explanation | WhyNot]) -> None:
    text, path = render(make()), GOLDEN / f"{make.__name__}.txt"
    if os.environ.get("UPDATE_GOLDEN"):
        path.write_text(text, encoding="utf-8")
    assert text == path.read_text(encoding="utf-8")


@pytest.mark.parametrize(
    ("value_us", "low_us", "high_us", "said"),
    [
        (61_200_000, 100_000, 60_000_000, "too long by 1.200 s: it was 61.200 s, allowed 0.100 s to 60.000 s"),
        (50_000, 100_000, 60_000_000, "too short by 0.050 s: it was 0.050 s, allowed 0.100 s to 60.000 s"),
        (1, 1, None, "allowed at least 0.000001 s: 0.000 s above the least"),
        (-5_000_000, None, 0, "allowed at most 0.000 s: 5.000 s below the most"),
        (7, None, None, "allowed any time: no bound"),
    ],
)
def test_constraint_is_said_with_its_room(value_us: int, low_us: int | None, high_us: int | None, said: str) -> None:
    assert of_constraint(ConstraintReading("", 1, "t2", "t1", value_us, low_us, high_us)).endswith(said)


def test_change_of_a_count_is_said_in_events() -> None:
    said = of_change(BoundChange(3, "occurs((2, 5), a[], (t1, t2))", "occurs((1, 5), a[], (t1, t2))", 1, "events"))
    assert said.endswith("(line 3): a change of 1 event")
