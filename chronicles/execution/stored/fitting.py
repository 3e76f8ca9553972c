"""Which rows of stored columns fit an event pattern?"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chronicles.compilation.plan import EventTest
from chronicles.execution.stored.columns import Codes, EventColumns, Times, kind_of

Rows = NDArray[np.int64]
Mask = NDArray[np.bool_]


@dataclass(frozen=True, slots=True)
class Fitting:
    """The rows of a table that fit a pattern: their numbers, ascending, their times and the values of variables."""

    rows: Rows
    times_us: Times
    slots: Mapping[int, Codes]

    def cut(self, part: slice) -> Fitting:
        """Give neighbouring ones."""
        return Fitting(self.rows[part], self.times_us[part], {slot: one[part] for slot, one in self.slots.items()})


def fitting(columns: EventColumns, test: EventTest) -> Fitting:
    """Find the rows that pass a test."""
    table = columns.table(kind_of(test))
    rows = np.flatnonzero(_passing(columns, test))
    return Fitting(rows, table.t_us[rows], {slot: table.codes[rows, field] for field, slot in test.variables})


def _passing(columns: EventColumns, test: EventTest) -> Mask:
    table = columns.table(kind_of(test))
    values = table.codes.T
    passing: Mask = np.ones(len(table), bool)
    if test.is_change:
        passing &= values[test.arity] != values[test.arity + 1]  # a value stated again is no change
    for field, text in test.constants:
        passing &= values[field] == columns.code(text)
    for field, allowed in test.filters:
        passing &= np.fromiter((text in allowed for text in columns.texts), bool, len(columns.texts))[values[field]]
    for first, second in test.equal:
        passing &= values[first] == values[second]
    for first, second in test.different:
        passing &= values[first] != values[second]
    return passing
