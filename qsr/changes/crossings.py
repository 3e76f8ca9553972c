"""When does a noisy quantity count as having crossed its threshold, and a state as settled, and since when?

Hysteresis decides *that* a quantity has changed sides: only when it has passed the threshold by a margin, so that noise
around the threshold says nothing. It does not say *when*: the change is dated back to the moment the raw quantity last
crossed the bare threshold, found by straight interpolation between two frames. A state such as a place has no distance
to a threshold, so noise is kept out by time: an object is in a new state when it has been there for a while, and then
the change is dated back to the first frame there.
"""

from dataclasses import dataclass
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from qsr.measuring.footprints import BoolArray, FloatArray, IntArray, LongArray

Cell = TypeVar("Cell", bound=np.generic)

Value = bool | str | None


@dataclass(frozen=True, slots=True)
class RelationChange:
    """Say that one relation instance has another value than before.

    Attributes
    ----------
    name : of the relation, as in `qsr.relations`.
    args : primary object first.
    t_us : when it changed: the raw crossing, dated back from ``decided_us``; strictly increasing per (name, args).
    decided_us : the frame that decided it.
    old, new : values before and after: a truth value, or a word of relations that have more than two values. None where
        unknown: the object, or the pair, was not or is no longer looked at.
    absent : those because of whom nothing is known for the time being; empty for what is known to have changed.
    confidence : how probable it is that it really changed, 0 to 1, in thousandths: 1 if nothing says how sure the
        positions are. What becomes unknown is as sure as its objects are, and of what was unknown nothing is said.
    younger : labels of hypotheses about its arguments on which it does not rest, since they began after what shows it.
    """

    name: str
    args: tuple[str, ...]
    t_us: int
    decided_us: int
    old: Value
    new: Value
    absent: tuple[str, ...] = ()
    confidence: float = 1.0
    younger: tuple[str, ...] = ()


def rearranged(array: NDArray[Cell], columns: LongArray, fresh: IntArray | int = 0) -> NDArray[Cell]:
    """Rearrange the columns, the last axis, of an array.

    Parameters
    ----------
    columns : new column k is old column ``columns[k]``, or a fresh one where that is -1.
    fresh : what stands in fresh columns, for each column or for all.

    Examples
    --------
    >>> rearranged(np.array([[5, 6, 7]]), np.array([2, -1, 0])).tolist()
    [[7, 0, 5]]
    """
    if not array.shape[-1]:
        array = np.zeros((*array.shape[:-1], 1), dtype=array.dtype)
    return np.where(columns < 0, np.asarray(fresh, dtype=array.dtype), array.take(columns, axis=-1, mode="clip"))


class SwitchBank:
    """Keep many quantities with a threshold at zero, as an array of switches with hysteresis.

    Row r holds one kind of quantity with its own margin, column k one object or pair. A new column starts on the side
    where its quantity is, without a margin.

    Parameters
    ----------
    margins : (rows,) how far a quantity must pass zero before its switch turns.
    backdate_us : a change is dated back at most this far.

    Attributes
    ----------
    is_on : (rows, columns) the switches.
    since_us : (rows, columns) when each last turned, or first was seen.

    Examples
    --------
    >>> bank = SwitchBank(np.array([0.5]), backdate_us=2_000_000)
    >>> bank.keep(np.array([-1]))                           # one new column
    >>> for t_us, gap_m in ((0, -1.0), (100_000, 0.0), (200_000, 0.4), (300_000, 0.9)):
    ...     turned = bank.update(t_us, np.array([[gap_m]]))
    >>> bool(turned[0, 0]), int(bank.since_us[0, 0])        # decided at 300 ms, crossed at 100 ms
    (True, 100000)
    """

    def __init__(self, margins: FloatArray, *, backdate_us: int) -> None:
        rows = len(margins)
        self._margins = np.asarray(margins, dtype=np.float64).reshape(rows, 1)
        self._backdate_us = backdate_us
        self._last_us: LongArray = np.zeros(0, dtype=np.int64)  # (columns,) when each was last measured
        self._last_values: FloatArray = np.zeros((rows, 0))
        self._crossed_us: LongArray = np.zeros((rows, 0), dtype=np.int64)
        self._fresh: LongArray | None = None
        self.is_on: BoolArray = np.zeros((rows, 0), dtype=np.bool_)
        self.since_us: LongArray = np.zeros((rows, 0), dtype=np.int64)

    def values(self, column: int) -> FloatArray:
        """Give the latest quantities of a column, (rows,)."""
        return self._last_values[:, column]

    def sides(self, values: FloatArray) -> IntArray:
        """Say where quantities, (rows, columns), are: 2 above the margin, 1 above zero, 0 below it, -1 below both.

        While they all stay there, no switch turns and no crossing is dated.
        """
        margins = self._margins
        return np.asarray((values > margins).astype(np.int32) + (values > 0) - (values < -margins))

    def keep(self, columns: LongArray) -> None:
        """Rearrange the columns: new column k is old column ``columns[k]``, or a fresh one where that is -1."""
        for name in ("_last_us", "_last_values", "_crossed_us", "since_us", "is_on"):
            setattr(self, name, rearranged(getattr(self, name), columns))
        fresh = np.flatnonzero(columns < 0)
        self._fresh = fresh if len(fresh) else None

    def update(self, t_us: int, values: FloatArray, held: BoolArray | None = None) -> BoolArray:
        """Take the quantities of one frame; later than the last.

        Parameters
        ----------
        t_us : time of the frame.
        values : (rows, columns) the quantities; kept, so do not write into them afterwards.
        held : (columns,) True where nothing was measured: such a column stays as it is, and what it crosses until it is
            measured again is dated between the two measurements. None if all were measured.

        Returns
        -------
        (rows, columns) True where a switch turned. Fresh columns start and never turn.
        """
        if self._fresh is not None:
            self._start(self._fresh, t_us, values)
            self._fresh = None
        if held is not None and held.any():
            values = np.where(held, self._last_values, values)
        crossed = ((values > 0) != (self._last_values > 0)).ravel().nonzero()[0]
        if len(crossed):
            before, after = self._last_values.take(crossed), values.take(crossed)
            share = before / (before - after)
            last_us = self._last_us.take(crossed % values.shape[1])
            self._crossed_us.put(crossed, last_us + np.rint(share * (t_us - last_us)).astype(np.int64))
        turned = np.where(self.is_on, values < -self._margins, values > self._margins)
        if turned.any():
            self.is_on ^= turned
            self.since_us[turned] = np.maximum(self._crossed_us[turned], t_us - self._backdate_us)
        self._last_values = values
        self._last_us = np.full(values.shape[1], t_us) if held is None else np.where(held, self._last_us, t_us)
        return turned

    def _start(self, fresh: LongArray, t_us: int, values: FloatArray) -> None:
        started = values[:, fresh]
        self._last_values[:, fresh] = started
        self._crossed_us[:, fresh] = t_us
        self.since_us[:, fresh] = t_us
        self.is_on[:, fresh] = started > 0


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

    def __init__(self, *, dwell_us: int, backdate_us: int) -> None:
        self._dwell_us = dwell_us
        self._backdate_us = backdate_us
        self.current: LongArray = np.zeros(0, dtype=np.int64)
        self._candidate: LongArray = self.current
        self._since_us: LongArray = self.current

    def keep(self, columns: LongArray, states: IntArray, t_us: int) -> None:
        """Rearrange the objects as in `SwitchBank.keep`; fresh ones have settled in their state."""
        self.current = rearranged(self.current, columns, states)
        self._candidate = rearranged(self._candidate, columns, states)
        self._since_us = rearranged(self._since_us, columns, t_us)

    def update(self, t_us: int, states: IntArray, measured: BoolArray | None = None) -> list[tuple[int, int, int, int]]:
        """Take the state of every object; list who has settled in a new one: object, before, now, since when.

        Parameters
        ----------
        measured : (objects,) False where the state is not known: such an object stays as it is. None if all are known.
        """
        moved = states != self._candidate
        if measured is not None:
            moved &= measured
        if moved.any():
            self._candidate = np.where(moved, states, self._candidate)
            self._since_us = np.where(moved, t_us, self._since_us)
        settled = self._candidate != self.current
        if not settled.any():
            return []
        settled &= t_us - self._since_us >= self._dwell_us
        if measured is not None:
            settled &= measured
        columns = np.flatnonzero(settled)
        since_us = np.maximum(self._since_us[columns], t_us - self._backdate_us)
        rows = (columns, self.current[columns], self._candidate[columns], since_us)
        self.current = np.where(settled, self._candidate, self.current)
        return list(zip(*(row.tolist() for row in rows), strict=True))
