"""Operators deep inside one another: what can be paid for is paid for, and means what it says."""

import numpy as np
import pytest

from dyknow.mtl.formula import Formula
from dyknow.mtl.parser import parse_formula
from dyknow.mtl.progression.progressor import Progressor
from dyknow.mtl.progression.states import DictState
from dyknow.mtl.progression.templates import TemplateMaker, every
from tests.dyknow.mtl.support import expected_verdicts, verdicts


def deep(kind: str, depth: int) -> Formula:
    texts = {
        "eventually": "eventually[0us, 3us] " * depth + "p",
        "always": "always[0us, 3us] " * depth + "p",
        "in turn": "always eventually " * (depth // 2) + "p",
        "in turn with one window": "always eventually " * (depth // 2) + "eventually[0us, 3us] p",
        "iff": "(p iff eventually " * depth + "q" + ")" * depth,
        "until": "(p until[0us, 3us] " * depth + "q" + ")" * depth,
        "until on the left": "(" * depth + "q" + " until[0us, 3us] p)" * depth,
        "windows in turn": "always[0us, 3us] eventually[0us, 3us] " * 2 + "always[0us, 3us] p",
        "tolerate": "always tolerate(tolerate(p, 2us, 2us), 2us, 2us)",
    }
    return parse_formula(texts[kind])


KINDS = ("eventually", "always", "in turn", "in turn with one window", "iff", "until", "until on the left")
TURNS = ("windows in turn", "tolerate")


def states(seed: int, count: int) -> list[tuple[int, DictState]]:
    rng = np.random.default_rng(seed)
    share = (0.2, 0.6, 0.95)[seed % 3]
    return [(k, DictState({name: bool(rng.random() < share) for name in "pq"})) for k in range(count)]


@pytest.mark.long
@pytest.mark.parametrize("kind", [*KINDS, *TURNS])
def test_deep_formulas_agree_with_direct_evaluation(kind: str) -> None:
    for seed in range(12):
        assert verdicts(deep(kind, 4), states(seed, 9)) == expected_verdicts(deep(kind, 4), states(seed, 9)), seed


@pytest.mark.parametrize("kind", KINDS)
def test_templates_grow_with_the_text(kind: str) -> None:
    counts = [len(list(every(TemplateMaker().make(deep(kind, depth), ())))) for depth in (10, 20, 40)]
    assert counts[2] - counts[1] == 2 * (counts[1] - counts[0]) < 300


@pytest.mark.parametrize("kind", [one for one in KINDS if one != "iff"])
def test_what_is_left_of_sixty_operators_is_bounded(kind: str) -> None:
    progressor, largest = Progressor(deep(kind, 48)), 0
    for t_us, state in states(1, 40):
        progressor.progress(t_us, state)
        largest = max(largest, progressor.size)
    assert largest < 3000


def test_what_is_shown_twice_is_made_once() -> None:
    for text in ("(p iff eventually " * 40 + "q" + ")" * 40, "tolerate(" * 2 + "p" + ", 1s, 1s)" * 2):
        assert len(list(every(TemplateMaker().make(parse_formula(text), ())))) < 500
