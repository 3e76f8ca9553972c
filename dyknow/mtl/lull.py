"""Which residual follows before the next deadline? Then the time of a state does not matter, only what it shows.

Between two deadlines of a residual, a state that opens no new window leaves the same behind whenever it comes. Such
steps are remembered, so that states at irregular times cost little while nothing is at stake.
"""

from __future__ import annotations

from dyknow.mtl.automaton import Values, verdict_of
from dyknow.mtl.residual import STARTED_US, Guarded, Junction, Residual, Waiting
from dyknow.mtl.templates import NEVER_US


class Lull:
    """A residual until its next deadline.

    Attributes
    ----------
    until_us : the first time at which a window of the residual opens or ends; only before it the edges are valid.
    edges : what follows a state, by the values of the tests.
    """

    __slots__ = ("edges", "residual", "until_us", "verdict")

    def __init__(self, residual: Residual) -> None:
        self.residual = residual
        self.verdict = verdict_of(residual)
        self.until_us = _next_deadline(residual)
        self.edges: dict[Values, Lull] = {}


def _next_deadline(residual: Residual) -> int:
    match residual:
        case Waiting(start_us=start_us, end_us=end_us):
            return end_us if start_us == STARTED_US else start_us
        case Guarded(inner=inner):
            return _next_deadline(inner)
        case Junction(parts=parts):
            return min(map(_next_deadline, parts))
        case _:
            return NEVER_US
