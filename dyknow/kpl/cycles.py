"""Which labels read themselves, directly or through others?"""

from __future__ import annotations

from collections.abc import Iterator, Mapping


def take_out_cycles(inputs: Mapping[str, list[str]]) -> Iterator[list[str]]:
    """Find every cycle that a depth-first search meets, and take what closes it out of the inputs.

    Parameters
    ----------
    inputs : what each label reads; afterwards there are no cycles in it. Every label that is read is a key.

    Returns
    -------
    The labels of each cycle, each read by the next and the last by the first; that which comes first in ``inputs``
    stands at the start.

    Examples
    --------
    >>> inputs = {"a": ["a", "b"], "b": ["c"], "c": ["b"]}
    >>> list(take_out_cycles(inputs)), inputs
    ([['a'], ['b', 'c']], {'a': ['b'], 'b': ['c'], 'c': []})
    """
    place = {label: index for index, label in enumerate(inputs)}
    done: set[str] = set()
    for root in inputs:
        if root not in done:
            yield from _cycles_from(root, inputs, place, done)


def _cycles_from(
    root: str, inputs: Mapping[str, list[str]], place: Mapping[str, int], done: set[str]
) -> Iterator[list[str]]:
    """Search from one label; an explicit path, as chains may be longer than any stack."""
    path, on_path, left = [root], {root: 0}, [list(inputs[root])]
    while path:
        if not left[-1]:
            done.add(path[-1])
            del on_path[path.pop()]
            left.pop()
            continue
        label = left[-1].pop(0)
        if label in on_path:
            inputs[path[-1]].remove(label)
            cycle = path[on_path[label] :][::-1]
            start = cycle.index(min(cycle, key=place.__getitem__))
            yield cycle[start:] + cycle[:start]
        elif label not in done:
            on_path[label] = len(path)
            path.append(label)
            left.append(list(inputs[label]))
