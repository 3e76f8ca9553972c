"""Which of several states has an object settled in, and since when?

A state such as a place has no distance to a threshold, so noise is kept out by time: an object is in a new state when
it has been there for a while, and then the change is dated back to the first frame there.
"""

import numpy as np
from numpy.typing import NDArray

IndexArray = NDArray[np.int64]
IntArray = NDArray[np.int32]


class Dwell:
    """Keep the settled state of many objects; states are whole numbers.

    Parameters
    ----------
    dwell_us : how long an object must be in a new state.
    backdate_us : a change is dated back at most this far.

    Attributes
    ----------
    current : (objects,) the settled states.

    Examples
    --------
    >>> dwell = Dwell(dwell_us=200, backdate_us=1000)
    >>> dwell.keep(np.array([-1]), np.array([7]), 0)                 # one new object, in state 7
    >>> for t_us, state in ((100, 8), (200, 7), (300, 8), (400, 8), (500, 8)):
    ...     settled = dwell.update(t_us, np.array([state]))
    >>> settled                                                      # object, state before and now, since when
    [(0, 7, 8, 300)]
    """

    __slots__ = ("_backdate_us", "_candidate", "_dwell_us", "_since_us", "current")

    def __init__(self, *, dwell_us: int, backdate_us: int) -> None:
        self._dwell_us = dwell_us
        self._backdate_us = backdate_us
        self.current: IndexArray = np.zeros(0, dtype=np.int64)
        self._candidate: IndexArray = self.current
        self._since_us: IndexArray = self.current

    def keep(self, columns: NDArray[np.intp], states: IntArray, t_us: int) -> None:
        """Rearrange the objects as in `SwitchBank.keep`; fresh ones have settled in their state."""
        fresh = columns < 0
        if len(self.current):
            self.current = np.where(fresh, states, self.current.take(columns))
            self._candidate = np.where(fresh, states, self._candidate.take(columns))
            self._since_us = np.where(fresh, t_us, self._since_us.take(columns))
        else:
            self.current, self._candidate = states.astype(np.int64), states.astype(np.int64)
            self._since_us = np.full(len(states), t_us, dtype=np.int64)

    def update(self, t_us: int, states: IntArray) -> list[tuple[int, int, int, int]]:
        """Take the state of every object; list who has settled in a new one: object, before, now, since when."""
        moved = states != self._candidate
        if moved.any():
            self._candidate = states.astype(np.int64)
            self._since_us = np.where(moved, t_us, self._since_us)
        settled = (self._candidate != self.current) & (t_us - self._since_us >= self._dwell_us)
        if not settled.any():
            return []
        columns = np.flatnonzero(settled)
        since_us = np.maximum(self._since_us[columns], t_us - self._backdate_us)
        rows = (columns, self.current[columns], self._candidate[columns], since_us)
        self.current = np.where(settled, self._candidate, self.current)
        return list(zip(*(row.tolist() for row in rows), strict=True))
