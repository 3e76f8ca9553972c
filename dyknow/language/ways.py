"""Which names lead to which others: in which order do they come, which go round in a circle, what is reached?"""

from collections.abc import Callable, Hashable, Iterable, Mapping
from typing import TypeVar

_Thing = TypeVar("_Thing", bound=Hashable)


def inside_first(made_of: Mapping[str, Iterable[str]]) -> tuple[list[str], list[list[str]]]:
    """Sort names so that each comes after those it is made of, and otherwise as they are.

    Parameters
    ----------
    made_of : what each name is made of; every name that stands there is a key.

    Returns
    -------
    The names in order, and every circle that a depth-first search meets: names of which each is made of the next one,
    and the last of the first.

    Examples
    --------
    >>> inside_first({"a": ["c"], "b": [], "c": ["b"]})
    (['b', 'c', 'a'], [])
    >>> inside_first({"a": ["b"], "b": ["b", "a"]})
    (['b', 'a'], [['b'], ['a', 'b']])
    """
    ordered: dict[str, None] = {}
    circles: list[list[str]] = []
    for name in made_of:
        # Without recursion, since a way through a text may be long; an iterator gives what is left to look at.
        path = {} if name in ordered else {name: iter(made_of[name])}
        while path:
            last, others = next(reversed(path.items()))
            following = next(others, None)
            if following is None:
                path.popitem()
                ordered[last] = None
            elif following in path:
                names = list(path)
                circles.append(names[names.index(following) :])
            elif following not in ordered:
                path[following] = iter(made_of[following])
    return list(ordered), circles


def reached(starts: Iterable[_Thing], leads_to: Callable[[_Thing], Iterable[_Thing]]) -> frozenset[_Thing]:
    """Give some things, and all that they lead to, directly or by way of others.

    Examples
    --------
    >>> sorted(reached([9], lambda number: [number // 2, number // 3]))
    [0, 1, 2, 3, 4, 9]
    """
    found = set(starts)
    waiting = list(found)
    while waiting:
        further = set(leads_to(waiting.pop())) - found
        found |= further
        waiting += further
    return frozenset(found)
