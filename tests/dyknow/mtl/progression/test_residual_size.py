"""What is left of a formula stays small, however long it runs."""

import numpy as np
import pytest

from dyknow.mtl.parser import parse_formula
from dyknow.mtl.progression.progressor import Progressor
from dyknow.mtl.progression.shared_work import SharedWork
from dyknow.mtl.progression.states import DictState, Verdict

NESTED = "always (not p implies eventually[0s, 1s] always[0s, 1s] p)"


def flickering(count: int, *, is_steady: bool, seed: int = 3) -> list[tuple[int, bool]]:
    """Make readings that are false for less than a second and then true for more than two, with single flips."""
    rng = np.random.default_rng(seed)
    t_us, readings = 0, []
    while len(readings) < count:
        for value, least_us, most_us in ((False, 100_000, 900_000), (True, 2_300_000, 4_000_000)):
            end_us = t_us + int(rng.integers(least_us, most_us))
            while t_us < end_us:
                t_us += 10_000 if is_steady else int(rng.integers(1_000, 30_000))
                readings.append((t_us, value))
    return readings[:count]


@pytest.mark.parametrize("is_steady", [True, False], ids=["steady", "irregular"])
@pytest.mark.parametrize("remembers", [True, False])
@pytest.mark.parametrize(("text", "most"), [("always eventually[0s, 1s] p", 6), (NESTED, 13)])
def test_size_stays_bounded(text: str, most: int, remembers: bool, is_steady: bool) -> None:
    progressor = Progressor(parse_formula(text), shared=SharedWork(remembers=remembers))
    sizes = set()
    for t_us, value in flickering(5_000, is_steady=is_steady):
        assert progressor.progress(t_us, DictState({"p": value})) is Verdict.UNKNOWN
        sizes.add(progressor.size)
    assert max(sizes) == most <= 20


@pytest.mark.parametrize("step_us", [20_000, 5_000])
@pytest.mark.parametrize(
    ("text", "most"),
    [
        ("always (p implies always[0s, 1s] q)", 8),
        ("always (p implies q until[0s, 1s] r)", 10),
        ("always eventually[1ms, 1s] p", 8),
        ("always (p implies eventually[0s, 1s] (q and eventually[0s, 1s] r))", 22),
    ],
)
def test_size_does_not_depend_on_how_many_states_a_window_has(text: str, most: int, step_us: int) -> None:
    assert largest_size(text, step_us, q=0.9, r=0.8) == most


@pytest.mark.long
def test_size_of_what_cannot_be_merged_is_bounded_by_the_states_of_a_window() -> None:
    text = "always (p implies (eventually[0s, 1s] q or always[0s, 1s] r))"
    assert 50 < largest_size(text, 20_000, q=0.02, r=0.995) <= 7 * 50


def largest_size(text: str, step_us: int, *, q: float, r: float) -> int:
    """Run through a minute of random readings, starting anew after each violation."""
    rng = np.random.default_rng(5)
    progressor = Progressor(parse_formula(text))
    largest = 0
    for t_us in range(0, 60_000_000, step_us):
        if progressor.is_final:
            progressor = Progressor(parse_formula(text))
        values = {"p": bool(rng.random() < 0.3), "q": bool(rng.random() < q), "r": bool(rng.random() < r)}
        progressor.progress(t_us, DictState(values))
        largest = max(largest, progressor.size)
    return largest


def test_table_forgets_what_nobody_needs() -> None:
    shared = SharedWork(remembers=False, least_kept=500)
    formula = parse_formula("always eventually[0us, 30us] p[?c]", variables=["c"])
    largest = 0
    for k in range(300):
        progressor = Progressor(formula, {"c": f"car{k}"}, shared=shared)
        for t_us in range(100 * k, 100 * (k + 1), 3):
            verdict = progressor.progress(t_us, DictState({("p", (f"car{k}",)): t_us % 30 < 10}))
            largest = max(largest, len(shared.table))
        assert verdict is Verdict.UNKNOWN
    assert shared.table.generation >= 3
    assert largest < 600


@pytest.mark.long
def test_table_keeps_what_is_in_use_however_much_that_is() -> None:
    shared = SharedWork(remembers=False, least_kept=50)
    formula = parse_formula("always eventually[0us, 30us] p[?c]", variables=["c"])
    progressors = {f"car{k}": Progressor(formula, {"c": f"car{k}"}, shared=shared) for k in range(200)}
    for t_us in range(0, 1400, 7):
        state = DictState({("p", (name,)): (t_us // 7 + k) % 4 == 0 for k, name in enumerate(progressors)})
        assert {one.progress(t_us, state) for one in progressors.values()} == {Verdict.UNKNOWN}
    assert 10 < shared.table.generation < 120  # of 200 states: what is made anew outweighs what is brought along
