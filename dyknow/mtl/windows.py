"""How deep do the windows of a formula change between "everywhere" and "somewhere"?

What is left of ``always[0, 1s] eventually[0, 1s] always[0, 1s] ... p`` is a conjunction over the states of a window of
disjunctions over the states of a window, and so on: with each change its size is multiplied by the states of a window,
and no merging helps. Windows of one kind inside each other, and operators without a window, merge.
"""

from __future__ import annotations

from dyknow.mtl.formula import (
    ALWAYS_OPEN,
    Always,
    Eventually,
    Formula,
    Iff,
    Implies,
    Next,
    Not,
    Tolerate,
    Until,
    Window,
)
from dyknow.mtl.structure import parts_of

MOST_CHANGES = 5


def window_changes(formula: Formula) -> int:
    """Count the longest chain of operators inside each other that are "everywhere" and "somewhere" in turn.

    Operators without a window count only around such a chain: around a single window they merge.

    Examples
    --------
    >>> from dyknow.mtl.parser import parse_formula
    >>> window_changes(parse_formula("always (not p implies eventually[0s, 1s] always[0s, 1s] p)"))
    3
    >>> window_changes(parse_formula("eventually[0s, 1s] not always[0s, 1s] p"))
    1
    >>> window_changes(parse_formula("always eventually always p"))
    0
    """
    return max(_chains(formula))


def _chains(formula: Formula) -> tuple[int, int]:  # noqa: PLR0911 - one case per kind of formula
    """Give the longest chains that begin with an operator that is universal, and with one that is existential."""
    inner = [_chains(part) for part in parts_of(formula)]
    universal = max((one[0] for one in inner), default=0)
    existential = max((one[1] for one in inner), default=0)
    match formula:
        case Not():
            return existential, universal
        case Implies():
            (left_universal, left_existential), (right_universal, right_existential) = inner
            return max(left_existential, right_universal), max(left_universal, right_existential)
        case Iff():
            return (max(universal, existential),) * 2
        case Always(window=window):
            return _around(universal, existential, window), existential
        case Eventually(window=window) | Until(window=window):
            return universal, _around(existential, universal, window)
        case Tolerate(return_us=return_us, stay_us=stay_us):
            stays = _around(universal, existential, Window(0, stay_us))
            return universal, max(existential, _around(existential, stays, Window(0, return_us)))
        case _:
            return universal, existential


def _around(same: int, other: int, window: Window) -> int:
    counts = window != ALWAYS_OPEN or max(same, other) > 1
    return max(same, other + 1) if counts else same


def horizon_us(formula: Formula) -> int:
    """Give the time after which all that one state asks is decided, as far as windows end.

    A window without an end counts up to its start. ``next`` counts a microsecond: any later state decides it.

    Examples
    --------
    >>> from dyknow.mtl.parser import parse_formula
    >>> horizon_us(parse_formula("always (stopped implies eventually[0s, 10s] always[0s, 2s] not stopped)"))
    12000000
    >>> horizon_us(parse_formula("always calm"))
    0
    """
    inner_us = max(map(horizon_us, parts_of(formula)), default=0)
    match formula:
        case Always(window=window) | Eventually(window=window) | Until(window=window):
            return _length_us(window) + inner_us
        case Tolerate(return_us=return_us, stay_us=stay_us):
            return return_us + stay_us + inner_us
        case Next():
            return 1 + inner_us
        case _:
            return inner_us


def _length_us(window: Window) -> int:
    return window.start_us if window.end_us is None else window.end_us
