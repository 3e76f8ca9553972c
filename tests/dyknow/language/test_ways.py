"""Circles of names are found, each once, and the order is right but for them."""

import random

import pytest

from dyknow.errors import KplError
from dyknow.kpl.checks import check_kpl
from dyknow.language.ways import inside_first
from tests.cases import for_each


def random_inputs(seed: int) -> dict[str, list[str]]:
    rng = random.Random(seed)
    labels = [f"p{index}" for index in range(rng.randrange(1, 9))]
    return {label: rng.sample(labels, rng.randrange(min(4, len(labels)) + 1)) for label in labels}


def reads_itself(label: str, inputs: dict[str, list[str]]) -> bool:
    """Follow every way, one step at a time: the slow and obvious answer."""
    reached = set(inputs[label])
    for _ in inputs:
        reached |= {one for label in reached for one in inputs[label]}
    return label in reached


@for_each("seed", range(200))
def test_circles_are_circles_and_without_them_the_order_is_right(seed: int) -> None:
    inputs = random_inputs(seed)
    ordered, circles = inside_first(inputs)
    for circle in circles:
        assert all(label in inputs[reader] for reader, label in zip(circle, [*circle[1:], circle[0]], strict=True))
        assert len(set(circle)) == len(circle)
    assert len({(circle[-1], circle[0]) for circle in circles}) == len(circles)
    assert bool(circles) == any(reads_itself(label, inputs) for label in inputs)
    assert sorted(ordered) == sorted(inputs)
    place = {label: index for index, label in enumerate(ordered)}
    late = {(reader, label) for reader in inputs for label in inputs[reader] if place[label] >= place[reader]}
    assert late == {(circle[-1], circle[0]) for circle in circles}


@for_each("seed", range(200))
def test_names_stay_in_their_order_where_nothing_speaks_against_it(seed: int) -> None:
    names = random_inputs(seed)
    assert inside_first(dict.fromkeys(names, ())) == (list(names), [])


def test_cycle_of_thousands_is_told_in_a_line() -> None:
    count = 2000
    text = "compunit int f(int);" + "".join(f"strmgen a{i} = f(a{(i + 1) % count});" for i in range(count))
    with pytest.raises(KplError) as caught:
        check_kpl(text)
    [found] = caught.value.diagnostics
    named = " -> ".join(["a0", *(f"a{i}" for i in range(1999, 1991, -1))])
    assert found.message.endswith(f"got the cycle {named} -> ... -> a0")
