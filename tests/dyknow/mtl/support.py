"""Random formulas and random sequences of states, from a seed."""

from __future__ import annotations

from collections.abc import Sequence
from decimal import Decimal

import numpy as np

from dyknow.mtl import formula as model
from dyknow.mtl.formula import Formula, Quantifier
from dyknow.mtl.progression.progressor import Progressor, SharedWork
from dyknow.mtl.progression.states import DictState, Verdict
from tests.dyknow.mtl.oracle import F, Sequences, T

OBJECTS = ("a", "b", "c")
VERDICTS = {F: Verdict.FALSE, T: Verdict.TRUE}


def pick(rng: np.random.Generator, count: int) -> int:
    return int(rng.integers(count))


def random_formula(  # noqa: PLR0911 - one kind of formula after another
    rng: np.random.Generator, depth: int, variables: tuple[str, ...] = ()
) -> Formula:
    """Draw a formula; leaves are p, q, r[x] and v[x] compared with 1."""
    if depth == 0 or rng.random() < 0.1:
        return random_leaf(rng, variables)

    def inner() -> Formula:
        return random_formula(rng, depth - 1, variables)

    kind = pick(rng, 13)
    if kind < 2:
        window = random_window(rng)
        return model.Always(inner(), window) if kind else model.Eventually(inner(), window)
    if kind < 5:
        return model.Until(inner(), inner(), random_window(rng))
    if kind < 7 and len(variables) < 2:
        name = f"x{len(variables)}"
        body = random_formula(rng, depth - 1, (*variables, name))
        return model.Quantified(list(Quantifier)[kind - 5], model.Variable(name), "Car", body)
    if kind == 7:
        return model.Next(inner())
    if kind == 8:
        return model.Tolerate(inner(), pick(rng, 4), pick(rng, 4))
    if kind == 9:
        return model.Not(inner())
    if kind == 10:
        return model.Implies(inner(), inner()) if rng.random() < 0.7 else model.Iff(inner(), inner())
    parts = tuple(inner() for _ in range(2 + pick(rng, 2)))
    return model.And(parts) if kind == 11 else model.Or(parts)


def random_leaf(rng: np.random.Generator, variables: tuple[str, ...]) -> Formula:
    kind = pick(rng, 12)
    if kind == 0:
        return model.Truth(rng.random() < 0.5)
    if variables and kind > 4:
        argument = model.Variable(variables[pick(rng, len(variables))])
        if kind == 5:
            return model.Comparison(argument, "!=", model.Text("a"))
        feature = model.Feature("r" if kind < 9 else "v", (argument,))
        return model.Proposition(feature) if kind < 9 else model.Comparison(feature, ">=", model.Number(Decimal(1)))
    return model.Proposition(model.Feature("p" if kind % 2 else "q"))


def random_window(rng: np.random.Generator) -> model.Window:
    start_us = pick(rng, 3) if rng.random() < 0.5 else 0
    return model.Window(start_us, None if rng.random() < 0.3 else start_us + pick(rng, 5))


def random_states(
    rng: np.random.Generator, count: int, *, unknown: float = 0.05, step_us: int = 2
) -> list[tuple[int, DictState]]:
    """Draw states at irregular times; a few values are not known, and objects come, leave and come back."""
    states, t_us = [], pick(rng, 3)
    for _ in range(count):
        members = [one for one in OBJECTS if rng.random() < 0.8]
        values: dict[object, object] = {name: bool(rng.random() < 0.6) for name in "pq"}
        for one in members:
            values["r", (one,)] = bool(rng.random() < 0.6)
            values["v", (one,)] = pick(rng, 3)
        known = {key: value for key, value in values.items() if rng.random() >= unknown}
        states.append((t_us, DictState(known, {"Car": members})))
        t_us += 1 + pick(rng, step_us)
    return states


def expected_verdicts(formula: Formula, states: Sequence[tuple[int, DictState]]) -> list[Verdict]:
    """Ask the oracle after every state, and at last at the end of the sequence."""
    after_each = [Sequences(states[: k + 1], has_ended=False).holds(formula, 0, {}) for k in range(len(states))]
    at_the_end = Sequences(states, has_ended=True).holds(formula, 0, {})
    return [VERDICTS.get(value, Verdict.UNKNOWN) for value in (*after_each, at_the_end)]


def verdicts(
    formula: Formula, states: Sequence[tuple[int, DictState]], shared: SharedWork | None = None
) -> list[Verdict]:
    """Progress a formula through states, and end the sequence."""
    progressor = Progressor(formula, shared=shared)
    return [*(progressor.progress(t_us, state) for t_us, state in states), progressor.finish()]


def agrees_with_the_oracle(seed: int, *, remembers: bool) -> None:
    """Compare the verdicts on one random formula over two random sequences, the second with what the first left."""
    rng = np.random.default_rng(seed)
    formula = random_formula(rng, 1 + pick(rng, 4))
    shared = SharedWork(remembers=remembers, least_kept=10 + pick(rng, 100))
    for _ in range(2):
        states = random_states(rng, 3 + pick(rng, 7), unknown=0.05 * pick(rng, 3), step_us=1 + pick(rng, 3))
        assert verdicts(formula, states, shared) == expected_verdicts(formula, states), (seed, formula)


def agrees_with_the_oracle_while_time_passes(seed: int, *, remembers: bool) -> None:
    """Compare the verdicts on one random formula where time also passes without states."""
    rng = np.random.default_rng([9, seed])
    formula = random_formula(rng, 1 + pick(rng, 4))
    shared = SharedWork(remembers=remembers, least_kept=10 + pick(rng, 100))
    for _ in range(2):
        states = random_states(rng, 3 + pick(rng, 5), unknown=0.05 * pick(rng, 3), step_us=1 + pick(rng, 5))
        progressor = Progressor(formula, shared=shared)
        for k, (t_us, state) in enumerate(states):
            found = [progressor.progress(t_us, state)]
            end_us = states[k + 1][0] if k + 1 < len(states) else t_us + 6
            promises = sorted(int(one) for one in rng.integers(t_us - 1, end_us + 1, pick(rng, 4)))
            found += [progressor.advance(one) for one in promises]
            asked = [Sequences(states[: k + 1], has_ended=False, least_us=one) for one in (0, *promises)]
            expected = [VERDICTS.get(one.holds(formula, 0, {}), Verdict.UNKNOWN) for one in asked]
            assert found == expected, (seed, t_us, promises, formula)
        at_the_end = Sequences(states, has_ended=True).holds(formula, 0, {})
        assert progressor.finish() is VERDICTS.get(at_the_end, Verdict.UNKNOWN), (seed, formula)
