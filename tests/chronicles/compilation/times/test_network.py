"""The minimal network against trying out all values, and contradictions as cycles."""

import itertools
import random

import numpy as np

from chronicles.compilation.times.network import UNBOUNDED_US, Edge, distances, minimise, negative_cycle
from dyknow.language.places import Span
from tests.cases import for_each

NOWHERE = Span("", 1, 1, 1, 1)


def random_edges(seed: int, points: int) -> list[Edge]:
    pick = random.Random(seed)
    return [
        Edge(ends[0], ends[1], pick.randint(-3, 5), NOWHERE)
        for ends in (pick.sample(range(points), 2) for _ in range(pick.randint(1, 2 * points)))
    ]


def solutions(points: int, edges: list[Edge]) -> list[tuple[int, ...]]:
    """Try all times from -12 to 12, with the first point at 0."""
    return [
        (0, *rest)
        for rest in itertools.product(range(-12, 13), repeat=points - 1)
        if all((0, *rest)[edge.target] - (0, *rest)[edge.source] <= edge.weight_us for edge in edges)
    ]


@for_each("seed", range(150))
def test_minimal_network_bounds_are_the_extremes_of_all_solutions(seed: int) -> None:
    points = 3
    edges = random_edges(seed, points)
    least = minimise(distances(points, edges))
    found = solutions(points, edges)
    assert (least is None) == (not found)
    if least is None:
        return
    for start, end in itertools.product(range(points), repeat=2):
        if least[start, end] < UNBOUNDED_US:
            assert max(times[end] - times[start] for times in found) == least[start, end]


@for_each("seed", range(150))
def test_contradiction_is_given_as_a_closed_chain_with_a_negative_sum(seed: int) -> None:
    edges = random_edges(seed, 5)
    cycle = negative_cycle(5, edges)
    assert bool(cycle) == (minimise(distances(5, edges)) is None)
    if cycle:
        assert sum(edge.weight_us for edge in cycle) < 0
        assert all(one.target == two.source for one, two in zip(cycle, (*cycle[1:], cycle[0]), strict=True))


def test_no_bound_stays_no_bound_beside_negative_ones() -> None:
    least = minimise(distances(3, [Edge(0, 1, -5, NOWHERE)]))
    assert least is not None
    assert least[1, 2] == UNBOUNDED_US
    assert least[0, 2] == UNBOUNDED_US


def test_minimising_twice_changes_nothing() -> None:
    least = minimise(distances(4, [Edge(0, 1, 5, NOWHERE), Edge(1, 2, 3, NOWHERE), Edge(2, 0, -1, NOWHERE)]))
    assert least is not None
    again = minimise(least)
    assert again is not None
    assert np.array_equal(least, again)
