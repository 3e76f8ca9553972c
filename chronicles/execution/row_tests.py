"""Which rows of stored columns fit an event pattern?"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chronicles.compilation.plan import EventTest
from chronicles.compilation.symbols import UNKNOWN
from chronicles.execution.columns import NO_TEXT, Codes, EventColumns, Kind, Times

Rows = NDArray[np.int64]
Mask = NDArray[np.bool_]


def known_texts(columns: EventColumns) -> tuple[str, ...]:
    """Give the texts that values stand for as codes: the symbols, and always "unknown"."""
    return columns.symbols if UNKNOWN in columns.code_of else (*columns.symbols, UNKNOWN)


def values_at(columns: EventColumns, kind: Kind, field: int, rows: Rows | slice) -> Codes:
    """Give a field of some rows as codes of `known_texts`; a value not told, or an empty one, is "unknown"."""
    codes: Codes = columns.table(kind).codes[rows, field]
    _, arity, _ = kind
    if field < arity:
        return codes
    unknown = columns.code_of.get(UNKNOWN, len(columns.symbols))
    empty = columns.code_of.get("", NO_TEXT)
    return np.where((codes == NO_TEXT) | (codes == empty), np.int32(unknown), codes)


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
    kind = (test.name, test.arity, test.is_change)
    table = columns.table(kind)
    if not (test.is_change or test.constants or test.filters or test.equal or test.different):
        slots = {slot: values_at(columns, kind, field, slice(None)) for field, slot in test.variables}
        return Fitting(np.arange(len(table)), table.t_us, slots)
    rows = np.flatnonzero(_passing(columns, test))
    slots = {slot: values_at(columns, kind, field, rows) for field, slot in test.variables}
    return Fitting(rows, table.t_us[rows], slots)


def _passing(columns: EventColumns, test: EventTest) -> Mask:
    kind = (test.name, test.arity, test.is_change)
    values = [values_at(columns, kind, field, slice(None)) for field in range(test.arity + 2 * test.is_change)]
    passing: Mask = np.ones(len(columns.table(kind)), bool)
    if test.is_change:
        passing &= values[test.arity] != values[test.arity + 1]  # a value stated again is no change
    for field, text in test.constants:
        passing &= values[field] == columns.code_of.get(text, len(columns.symbols) if text == UNKNOWN else NO_TEXT)
    texts = known_texts(columns)
    for field, allowed in test.filters:
        passing &= np.fromiter((text in allowed for text in texts), bool, len(texts))[values[field]]
    for first, second in test.equal:
        passing &= values[first] == values[second]
    for first, second in test.different:
        passing &= values[first] != values[second]
    return passing
