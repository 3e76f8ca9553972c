"""The best one-to-one choice, and its margins, against trying every choice."""

import itertools

import numpy as np

from anchoring.linking.linker import MOST_MARGIN, Evidence, choose
from tests.cases import for_each


def best_of_all(gains: np.ndarray) -> tuple[float, set[tuple[int, int]]]:
    """Try every way to give each start an end of its own, or none; -inf where a pair is impossible."""
    starts, ends = gains.shape
    best: tuple[float, set[tuple[int, int]]] = (0.0, set())
    for choice in itertools.product(range(-1, ends), repeat=starts):
        taken = {(start, end) for start, end in enumerate(choice) if end >= 0}
        if len({end for _, end in taken}) == len(taken):
            best = max(best, (sum(gains[pair] for pair in taken), taken), key=lambda one: one[0])
    return best


@for_each("seed", range(200))
def test_choice_is_the_best_of_all_and_margins_are_what_the_next_best_loses(seed: int) -> None:
    rng = np.random.default_rng(seed)
    gains = rng.uniform(-1, 6, (int(rng.integers(1, 5)), int(rng.integers(1, 5))))
    gains[rng.random(gains.shape) < 0.3] = -np.inf
    starts, ends = np.isfinite(gains).nonzero()
    evidence = Evidence(starts, ends, gains[starts, ends])
    chosen, margins = choose(evidence)
    total, pairs = best_of_all(gains)
    assert set(zip(starts[chosen].tolist(), ends[chosen].tolist(), strict=True)) == pairs
    for start, end, margin in zip(starts[chosen], ends[chosen], margins, strict=True):
        without = gains.copy()
        without[start, end] = -np.inf
        assert np.isclose(margin, min(total - best_of_all(without)[0], MOST_MARGIN)), (start, end)


def test_pairs_far_from_each_other_are_chosen_each_for_itself() -> None:
    evidence = Evidence(np.array([7, 3, 3]), np.array([1, 9, 8]), np.array([2.0, 12.0, 1.0]))
    chosen, margins = choose(evidence)
    assert (chosen.tolist(), margins.tolist()) == ([0, 1], [2.0, MOST_MARGIN])


def test_nothing_is_chosen_where_nothing_speaks_for_it() -> None:
    assert [len(one) for one in choose(Evidence(np.array([0]), np.array([0]), np.array([-0.1])))] == [0, 0]
    assert [len(one) for one in choose(Evidence(*np.zeros((2, 0), int), np.zeros(0)))] == [0, 0]
