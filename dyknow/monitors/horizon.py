"""How long can it take until a violation shows? The longest way through the windows of a formula."""

from __future__ import annotations

from dyknow.mtl.formula import Always, Eventually, Formula, Next, Tolerate, Until, Window
from dyknow.mtl.structure import parts_of


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
