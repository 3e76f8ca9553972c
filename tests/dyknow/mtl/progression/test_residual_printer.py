"""What is left of a formula, written as a formula."""

import numpy as np
import pytest

from dyknow.errors import FormulaError
from dyknow.mtl.parser import parse_formula
from dyknow.mtl.progression.progressor import Progressor
from dyknow.mtl.progression.shared_work import SharedWork
from dyknow.mtl.progression.states import DictState, StateError
from dyknow.mtl.structure import MOST_CHANGES, window_changes
from tests.dyknow.mtl.support import pick, random_formula, random_states


def left_after(text: str, *names: str) -> str:
    """Give states at 10, 20, 30 us, ..., in each of which one letter of the names is true and the others are false."""
    progressor = Progressor(parse_formula(text))
    for k, name in enumerate(names):
        progressor.progress(10 * (k + 1), DictState({one: one in name for one in "pqr"}))
    return progressor.remaining


@pytest.mark.parametrize(
    ("text", "states", "left"),
    [
        ("not p  or q", [], "not p or q"),
        ("always p", ["p"], "always[1us, oo] p"),
        ("always p", [""], "false"),
        ("eventually[0us, 25us] p", [""], "eventually[1us, 25us] p"),
        ("eventually[0us, 25us] p", ["", ""], "eventually[1us, 15us] p"),
        ("eventually[15us, 25us] p", [""], "eventually[15us, 25us] p"),
        ("not eventually[15us, 25us] p", ["", ""], "always[5us, 15us] not p"),
        ("p until[0us, 25us] q", ["p"], "p until[1us, 25us] q"),
        ("not (p until q)", ["p"], "not (p until[1us, oo] q)"),
        ("next p", [""], "next p"),
        ("not next p", [""], "not next p"),
        ("tolerate(p, 30us, 10us)", [""], "eventually[1us, 30us] always[0s, 10us] p"),
        ("eventually[0us, 9us] p or next (q iff always r)", ["r"], "next (q iff always r) or eventually[1us, 9us] p"),
        (
            "always (p implies tolerate(q, 25us, 5us))",
            ["pq"],
            "always[1us, oo] (p implies tolerate(q, 25us, 5us))",
        ),
    ],
)
def test_what_is_left_is_written_for_the_last_state(text: str, states: list[str], left: str) -> None:
    assert left_after(text, *states) == left


def test_objects_stand_where_variables_stood() -> None:
    formula = parse_formula(
        "always forall ?b in Car: (?a != ?b implies eventually[0us, 9us] 2 * gap[?b] - v[?a] > 1)", variables=["a"]
    )
    progressor = Progressor(formula, {"a": "car 7"})
    assert progressor.remaining.startswith('always (forall ?b in Car: "car 7" != ?b implies')
    progressor.progress(5, DictState({("gap", ("c",)): 0, ("v", ("car 7",)): 0}, {"Car": ["c"]}))
    assert progressor.remaining.endswith(
        'and (forall ?it in Car: ?it = "c" implies eventually[1us, 9us] 2 * gap[c] - v["car 7"] > 1)'
    )
    parse_formula(progressor.remaining)


def test_what_will_never_be_known_is_no_word_of_the_language() -> None:
    progressor = Progressor(parse_formula("p and always[0us, 5us] q"))
    progressor.progress(0, DictState({"q": True}))
    assert progressor.remaining == "<unknown> and always[1us, 5us] q"
    with pytest.raises(FormulaError):
        parse_formula(progressor.remaining)


def test_errors_show_what_is_left() -> None:
    progressor = Progressor(parse_formula("eventually[0us, 9us] p"))
    progressor.progress(5, DictState({"p": False}))
    with pytest.raises(StateError, match=r"progressor of 'eventually\[1us, 9us\] p': expected a state later than 5 us"):
        progressor.progress(5, DictState({"p": False}))
    assert repr(progressor) == "<Progressor unknown: eventually[1us, 9us] p>"


def test_what_is_shown_of_a_long_one_is_short() -> None:
    progressor = Progressor(parse_formula(" and ".join(f"always feature_{k}" for k in range(50))))
    assert len(repr(progressor)) < 150
    assert repr(progressor).endswith("...>")


@pytest.mark.long
@pytest.mark.parametrize("remembers", [True, False])
def test_what_was_written_asks_the_same_of_the_states_to_come(remembers: bool) -> None:
    read = 0
    for seed in range(600):
        rng = np.random.default_rng([11, seed])
        formula = random_formula(rng, 1 + pick(rng, 4))
        states = random_states(rng, 7, unknown=0.02 * pick(rng, 2), step_us=1 + pick(rng, 3))
        shared = SharedWork(remembers=remembers)
        original = Progressor(formula, shared=shared)
        turn = pick(rng, 5)
        for t_us, state in states[: turn + 1]:
            verdict = original.progress(t_us, state)
        if rng.random() < 0.5:
            verdict = original.advance(t_us + pick(rng, states[turn + 1][0] - t_us + 1))
        text = original.remaining
        if original.is_final or "<unknown>" in text or window_changes(formula) > MOST_CHANGES:
            continue
        again = Progressor(parse_formula(text))
        found = [again.progress(*states[turn]), *(again.progress(*one) for one in states[turn + 1 :]), again.finish()]
        expected = [verdict, *(original.progress(*one) for one in states[turn + 1 :]), original.finish()]
        read += 1
        assert found == expected, (seed, text)
    assert read > 100
