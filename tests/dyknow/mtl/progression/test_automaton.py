"""Progression against direct evaluation: many pairs, irregular times, shared work, beside the automaton."""

from __future__ import annotations

from dataclasses import dataclass, field
from itertools import permutations

import numpy as np
import pytest

from dyknow.mtl import formula as model
from dyknow.mtl.formula import Formula
from dyknow.mtl.parser import parse_formula
from dyknow.mtl.progression import automaton
from dyknow.mtl.progression.progressor import Progressor
from dyknow.mtl.progression.shared_work import SharedWork
from dyknow.mtl.progression.states import DictState, Verdict
from tests.dyknow.mtl.oracle import Objects, Sequences
from tests.dyknow.mtl.support import VERDICTS, pick

PAIRS = tuple(permutations("abcde", 2))
NAMES = ("near", "slow", "beside")
MEMBERS = {"Car": tuple("abcde")}

# What people write of pairs.
WRITTEN = (
    "always (near[?a, ?b] implies eventually[0us, 20us] not near[?a, ?b])",
    "always (near[?a, ?b] implies eventually[0us, 20us] always[0us, 9us] not near[?a, ?b])",
    "always (near[?a, ?b] implies (slow[?a, ?b] until[0us, 15us] beside[?a, ?b]))",
    "always tolerate(near[?a, ?b], 15us, 6us)",
    "always (always[0us, 9us] near[?a, ?b] implies eventually[0us, 20us] (slow[?a, ?b] or next beside[?a, ?b]))",
    "always (near[?a, ?b] implies eventually[0us, 20us] (slow[?a, ?b] and eventually[0us, 6us] beside[?a, ?b]))",
    (
        "always ((near[?a, ?b] implies eventually[0us, 9us] slow[?a, ?b]) "
        "and (beside[?a, ?b] implies eventually[0us, 20us] slow[?a, ?b]))"
    ),
    (
        "always ((near[?a, ?b] implies always[0us, 9us] slow[?a, ?b]) "
        "and (beside[?a, ?b] implies always[0us, 20us] slow[?a, ?b]))"
    ),
    "always (near[?a, ?b] implies always[6us, 20us] slow[?a, ?b])",
    "always (near[?a, ?b] implies eventually[6us, 20us] not near[?a, ?b])",
    "always (near[?a, ?b] implies always[0us, 9us] eventually[3us, 15us] not near[?a, ?b])",
    "always (near[?a, ?b] iff eventually[0us, 9us] always[2us, 6us] slow[?a, ?b])",
)


@dataclass(frozen=True)
class Remembering(Sequences):
    """Direct evaluation that asks for each formula in each state once, as the sequences here are long."""

    # By identity, which is faster than equality; so the formula is kept, lest another one gets its identity.
    known: dict[tuple[int, int], tuple[Formula, int]] = field(default_factory=dict)

    def holds(self, formula: Formula, i: int, objects: Objects) -> int:
        key = id(formula), i
        if key not in self.known:
            self.known[key] = formula, super().holds(formula, i, objects)
        return self.known[key][1]


class Watched:
    """A progressor of one pair, which begins anew when it is decided."""

    def __init__(self, formula: Formula, pair: tuple[str, str], shared: SharedWork) -> None:
        self.formula, self.pair, self.shared = formula, pair, shared
        self.begin()

    def begin(self) -> None:
        self.progressor = Progressor(self.formula, dict(zip("ab", self.pair, strict=True)), shared=self.shared)
        self.states: list[tuple[int, DictState]] = []

    def agrees(self, t_us: int, state: DictState) -> bool:
        """Progress, and compare with what all states since the beginning say by definition."""
        self.states.append((t_us, state))
        objects = {name: ("Car", one) for name, one in zip("ab", self.pair, strict=True)}
        expected = Remembering(self.states, has_ended=False).holds(self.formula, 0, objects)
        verdict = self.progressor.progress(t_us, state)
        if verdict is not Verdict.UNKNOWN or self.progressor.is_final:
            self.begin()
        return verdict is VERDICTS.get(expected, Verdict.UNKNOWN)


def drawn_formula(rng: np.random.Generator, depth: int) -> Formula:
    """Draw windows in one another, of few lengths, so that those of one shape meet."""
    if depth == 0:
        leaf = parse_formula(f"{NAMES[pick(rng, 3)]}[?a, ?b]", variables=["a", "b"])
        return model.Not(leaf) if rng.random() < 0.4 else leaf
    inner = drawn_formula(rng, depth - 1)
    window = model.Window(3 * (rng.random() < 0.1), (6, 15)[pick(rng, 2)])
    match pick(rng, 6):
        case 0 | 1:
            return model.Eventually(inner, window)
        case 2:
            return model.Always(inner, window)
        case 3:
            return model.Until(drawn_formula(rng, 0), inner, window)
        case 4:
            return model.Implies(drawn_formula(rng, 0), inner)
        case _:
            either = model.And if rng.random() < 0.5 else model.Or
            return either((drawn_formula(rng, depth - 1), inner))


def drawn_state(rng: np.random.Generator, held: dict[tuple[str, tuple[str, str]], bool]) -> DictState:
    """Change some values, most pairs staying as they were; a few values are not known."""
    held |= {key: not value for key, value in held.items() if rng.random() < 0.15}
    return DictState({key: value for key, value in held.items() if rng.random() > 0.02}, MEMBERS)


def agree(seed: int, formulas: list[Formula], *, state_count: int, pairs: tuple[tuple[str, str], ...] = PAIRS) -> None:
    """Watch all pairs for all formulas with one shared work, some pairs from a later state on."""
    rng = np.random.default_rng([11, seed])
    shared = SharedWork(least_kept=100 + pick(rng, 2000))
    held = {(name, pair): bool(rng.random() < 0.5) for name in NAMES for pair in pairs}
    for _ in range(2):  # the second stream of states finds the steps of the first one, at other times
        since_us = {pair: pick(rng, 9) for pair in pairs}
        watched = [Watched(formula, pair, shared) for formula in formulas for pair in pairs]
        for t_us in np.cumsum(rng.integers(1, 6, state_count)).tolist():
            state = drawn_state(rng, held)
            for one in watched:
                if t_us >= since_us[one.pair]:
                    assert one.agrees(t_us, state), (seed, t_us, one.pair, one.formula)


@pytest.mark.long
@pytest.mark.parametrize("text", WRITTEN)
def test_pairs_that_share_their_work_agree_with_direct_evaluation(text: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(automaton, "_MOST_STEPS", 0)
    agree(WRITTEN.index(text), [parse_formula(text, variables=["a", "b"])], state_count=14)


def test_formulas_that_share_their_work_agree_with_direct_evaluation() -> None:
    formulas = [parse_formula(text, variables=["a", "b"]) for text in WRITTEN]
    agree(0, formulas, state_count=15, pairs=PAIRS[:3])


@pytest.mark.parametrize("seed", range(6))
def test_drawn_formulas_agree_with_direct_evaluation(seed: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(automaton, "_MOST_STEPS", 0)
    rng = np.random.default_rng([12, seed])
    formulas: list[Formula] = [model.Always(drawn_formula(rng, 1 + pick(rng, 3)), model.Window(0)) for _ in range(4)]
    agree(seed, formulas, state_count=14, pairs=PAIRS[:6])


def test_a_window_that_was_superfluous_once_is_not_always(monkeypatch: pytest.MonkeyPatch) -> None:
    """A short window ends before a long one that was opened earlier, but only if it is opened early enough."""
    monkeypatch.setattr(automaton, "_MOST_STEPS", 0)
    one = Watched(parse_formula(WRITTEN[7], variables=["a", "b"]), ("a", "b"), SharedWork())
    for t_us, names in ((0, "beside slow"), (2, "near slow"), (4, "near slow"), (15, "near slow"), (22, "")):
        values = {(name, ("a", "b")): name in names for name in NAMES}
        assert one.agrees(t_us, DictState(values, MEMBERS))
    assert one.states == []  # violated at 22, within 9 after 15
