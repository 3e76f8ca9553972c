"""Which rows have certain values and lie in a window of time?

Values are numbered together; number times the span of time, plus the time, is one whole number for each row, and these
are sorted. Then both ends of all windows are found by binary search.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chronicles.errors import ChronicleError
from chronicles.execution.stored.columns import Codes, Mask, Rows, Times

Numbers = NDArray[np.int64]

_MOST_KEYS = 1 << 62
_MOST_COMBINATIONS = 1 << 31  # times the number of texts it is still exact


def is_too_long(rows: int, span_us: int) -> bool:
    """Say whether an index of so many rows in so long a time would not be exact."""
    return rows * span_us >= _MOST_KEYS


@dataclass(slots=True)
class Partners:
    """For each row of a table: where its partners begin in the order of an index, and how many there are."""

    index: RowIndex
    starts: Rows
    counts: Rows

    def picked(self, rows: Mask | slice) -> Partners:
        """Give those of some rows of the table."""
        return Partners(self.index, self.starts[rows], self.counts[rows])


class RowIndex:
    """Rows by the values of some columns, then by time.

    Parameters
    ----------
    times_us : ascending, at least one.
    columns : codes of the values that are asked for, none to ask for times only.

    Raises
    ------
    ChronicleError
        If there are so many rows in so long a time that the numbers would not be exact.
    """

    def __init__(self, times_us: Times, columns: Sequence[Codes]) -> None:
        self._first_us = int(times_us[0])
        self._order: Rows | None = None
        self._numbering: Numbering | None = None
        self._keys = times_us
        if not columns:
            return
        self._span_us = int(times_us[-1]) - self._first_us + 1
        if is_too_long(len(times_us), self._span_us):
            raise ChronicleError(
                f"row index: expected less than {_MOST_KEYS} rows times microseconds,"
                f" got {len(times_us)!r} rows in {self._span_us!r} us"
            )
        self._numbering = Numbering(columns, _MOST_KEYS // self._span_us)
        numbers = self._numbering.own
        # Rows are in the order of time, so a stable sort by the number is enough; numpy sorts small ones faster.
        small = numbers.astype(np.uint16) if self._numbering.count <= 1 << 16 else numbers
        self._order = np.argsort(small, kind="stable")
        self._keys = (numbers * self._span_us + (times_us - self._first_us))[self._order]

    def partners(self, values: Sequence[Codes], low_us: Times, high_us: Times) -> Partners:
        """Find for each row of a table the rows with its values in its window [low, high]."""
        if self._numbering is not None:
            base = self._numbering.numbers(values) * self._span_us
            low_us = base + np.clip(low_us - self._first_us, 0, self._span_us)
            high_us = base + np.clip(high_us - self._first_us, -1, self._span_us - 1)
        starts = np.searchsorted(self._keys, low_us)
        counts = np.searchsorted(self._keys, high_us, "right") - starts
        return Partners(self, starts, np.maximum(counts, 0))

    def places(self, ordered: Rows) -> Rows:
        """Turn places in the index into places among the fitting rows."""
        return ordered if self._order is None else self._order[ordered]


class Numbering:
    """Numbers combinations of values from 0 on; `own` are the numbers of the combinations it was made of.

    Where there are more than `most` conceivable combinations, only those that occur get a number.
    """

    def __init__(self, columns: Sequence[Codes], most: int) -> None:
        self._steps: list[tuple[Numbers, int, Numbers | None]] = []
        self.own: Numbers = np.zeros(len(columns[0]), np.int64)
        self.count = 1
        for values in columns:
            rank_of, size = _ranks(values)
            self.own = self.own * size + rank_of[values]
            self.count *= size
            occurring = None
            if self.count > min(most, _MOST_COMBINATIONS):
                occurring, self.own = np.unique(self.own, return_inverse=True)
                self.count = len(occurring)
            self._steps.append((rank_of, size, occurring))

    def numbers(self, columns: Sequence[Codes]) -> Numbers:
        """Give the numbers of combinations, -1 where one does not occur."""
        found: Numbers = np.zeros(len(columns[0]), np.int64)
        missing: Mask = np.zeros(len(found), bool)
        for values, (rank_of, size, occurring) in zip(columns, self._steps, strict=True):
            ranks = rank_of[np.minimum(values, len(rank_of) - 1)]
            missing |= ranks < 0
            found = found * size + ranks
            if occurring is not None:
                wanted = found
                found = np.minimum(np.searchsorted(occurring, wanted), len(occurring) - 1)
                missing |= occurring[found] != wanted
        return np.where(missing, -1, found)


def _ranks(values: Codes) -> tuple[Numbers, int]:
    """Give for each code its rank among the values, -1 where it is not among them, and the number of ranks.

    The last entry is -1 and stands for all codes beyond the greatest value.
    """
    occurs: Mask = np.zeros(int(values.max()) + 2, bool)
    occurs[values] = True
    rank_of = np.full(len(occurs), -1, np.int64)
    size = int(np.count_nonzero(occurs))
    rank_of[occurs] = np.arange(size)
    return rank_of, size
