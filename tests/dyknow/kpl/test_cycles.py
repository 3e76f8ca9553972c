"""Cycles are found, each once, and what is left has none."""

import random
from graphlib import TopologicalSorter

import pytest

from dyknow.errors import KplError
from dyknow.kpl.checks import check_kpl, take_out_cycles
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
def test_cycles_are_cycles_and_without_them_there_is_an_order(seed: int) -> None:
    before, inputs = random_inputs(seed), random_inputs(seed)
    cycles = list(take_out_cycles(inputs))
    for cycle in cycles:
        assert all(label in before[reader] for label, reader in zip(cycle, [*cycle[1:], cycle[0]], strict=True))
        assert cycle[0] == min(cycle, key=list(before).index)
        assert len(set(cycle)) == len(cycle)
    assert bool(cycles) == any(reads_itself(label, before) for label in before)
    assert len(list(TopologicalSorter(inputs).static_order())) == len(before)
    assert sum(map(len, before.values())) - sum(map(len, inputs.values())) == len(cycles)


def test_cycle_of_thousands_is_told_in_a_line() -> None:
    count = 2000
    text = "compunit int f(int);" + "".join(f"strmgen a{i} = f(a{(i + 1) % count});" for i in range(count))
    with pytest.raises(KplError) as caught:
        check_kpl(text)
    [found] = caught.value.diagnostics
    named = " -> ".join(["a0", *(f"a{i}" for i in range(1999, 1991, -1))])
    assert found.message.endswith(f"got the cycle {named} -> ... -> a0")
