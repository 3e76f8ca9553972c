"""Does an attribute have the wanted value throughout each of many intervals, in stored columns?

The changes of an attribute, sorted by what it is about and by time, are stretches of equal values; for each interval
one binary search finds the stretch it begins in, which must last to its end. Only `hold`s whose arguments and value
are known from events are tested here, and only where no change rests on a hypothesis, which an occurrence would have
to name.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from chronicles.compilation.network import UNBOUNDED_US
from chronicles.compilation.plan import Persistence
from chronicles.compilation.symbols import UNKNOWN
from chronicles.execution.columns import Codes, EventColumns, Kind, Times
from chronicles.execution.history import value_after
from chronicles.execution.row_index import Numbering, is_too_long
from chronicles.execution.row_tests import Mask, Rows, known_texts, values_at

_ABSENT = -2  # the code of a text that no event has


def is_about_changes(one: Persistence, columns: EventColumns, event_slots: int) -> bool:
    """Say whether a `hold` can be tested in columns."""
    binds = one.binds or one.equal or one.different or one.filters or one.value_binds >= 0
    if one.is_assumed or one.is_reading or binds or not one.is_complete:
        return False
    table = columns.table(_kind(one))
    span_us = int(table.t_us[-1] - table.t_us[0]) + 1 if len(table) else 1
    is_known = all(slot < event_slots for _, slot in one.bound) and one.value_slot < event_slots
    return is_known and not table.hypotheses and "" not in columns.code_of and not is_too_long(len(table), span_us)


class HoldColumns:
    """The values of one attribute; invariant: keys ascend, and `_values[i]` lasts until `_until_us[i]`.

    Parameters
    ----------
    columns : with all changes of the attribute.
    one : the `hold`.
    default : the value before the first change.
    """

    def __init__(self, columns: EventColumns, one: Persistence, default: str) -> None:
        self._hold = one
        self._texts = known_texts(columns)
        self._code_of = {text: code for code, text in enumerate(self._texts)}
        self._default = default
        table = columns.table(_kind(one))
        self._is_empty = not len(table)
        if self._is_empty:
            return
        arguments = [values_at(columns, _kind(one), field, slice(None)) for field in range(one.arity)]
        self._first_us = int(table.t_us[0])
        self._span_us = int(table.t_us[-1]) - self._first_us + 1
        self._numbering = Numbering(arguments, len(table)) if arguments else None
        numbers = self._numbering.own if self._numbering is not None else np.zeros(len(table), np.int64)
        keys = numbers * self._span_us + (table.t_us - self._first_us)
        order = np.argsort(keys, kind="stable")
        old, new = (values_at(columns, _kind(one), one.arity + place, order) for place in (0, 1))
        self._set_stretches(keys[order], old, new)

    def right(self, values: Mapping[int, Codes], start_us: Times, end_us: Times) -> Mask:
        """Say for each interval [start, end) whether the attribute has the value in it.

        Parameters
        ----------
        values : by slot the values of variables, one for each interval.
        start_us, end_us : the intervals.
        """
        one = self._hold
        found, until_us, is_reported = self._stretch(values, start_us)
        right: Mask = until_us >= end_us
        if one.needs_report:
            right &= is_reported
        if one.needs_known:
            right &= found != self._code(UNKNOWN)
        if one.value is not None:
            right &= found == self._code(one.value)
        elif one.value_slot >= 0:
            right &= found == values[one.value_slot]
        return right

    def _stretch(self, values: Mapping[int, Codes], start_us: Times) -> tuple[Rows, Times, Mask]:
        """Give the value at the start of each interval, until when it lasts, and whether it was reported by then."""
        found = np.full(len(start_us), self._code(self._default), np.int64)
        until_us = np.full(len(start_us), UNBOUNDED_US, np.int64)
        if self._is_empty:
            return found, until_us, np.zeros(len(start_us), bool)
        numbers = self._numbers(values, len(start_us))
        base = numbers * self._span_us
        place = np.searchsorted(self._keys, base + np.clip(start_us - self._first_us, -1, self._span_us - 1), "right")
        is_reported: Mask = (place > 0) & (numbers >= 0)
        is_reported &= self._keys[np.maximum(place - 1, 0)] >= base
        found[is_reported] = self._values[place[is_reported] - 1]
        until_us[is_reported] = self._until_us[place[is_reported] - 1]
        # Before the first change the default lasts until a change to another value.
        following = np.minimum(place, len(self._keys) - 1)
        comes: Mask = ~is_reported & (numbers >= 0) & (self._keys[following] // self._span_us == numbers)
        first = following[comes]
        begins_us = self._keys[first] - base[comes] + self._first_us
        until_us[comes] = np.where(self._values[first] == self._code(self._default), self._until_us[first], begins_us)
        return found, until_us, is_reported

    def _numbers(self, values: Mapping[int, Codes], count: int) -> Rows:
        if self._numbering is None:
            return np.zeros(count, np.int64)
        one = self._hold
        codes = {place: self._code_of.get(text, len(self._texts)) for place, text in one.constants}
        known = {place: np.full(count, code, np.int32) for place, code in codes.items()}
        known |= {place: values[slot] for place, slot in one.bound}
        return self._numbering.numbers([known[place] for place in range(one.arity)])

    def _set_stretches(self, keys: Rows, old: Codes, new: Codes) -> None:
        starts = np.flatnonzero(np.append(True, keys[1:] != keys[:-1]))
        self._keys = keys[starts]
        self._values = new[starts].astype(np.int64)
        owners = self._keys // self._span_us
        ends = np.append(starts[1:], len(keys))
        for group in np.flatnonzero(ends - starts > 1).tolist():
            # Simultaneous changes act as one, by the rule of the attribute history.
            is_first = group == 0 or owners[group - 1] != owners[group]
            before = self._default if is_first else self._text(int(self._values[group - 1]))
            part = slice(starts[group], ends[group])
            changes = [
                (self._texts[left], self._texts[entered]) for left, entered in zip(old[part], new[part], strict=True)
            ]
            self._values[group] = self._code(value_after(before, changes))
        differs = np.append(True, (self._values[1:] != self._values[:-1]) | (owners[1:] != owners[:-1]))
        begins = np.append(np.flatnonzero(differs), len(self._keys))
        following = begins[np.cumsum(differs)]
        inside = np.minimum(following, len(self._keys) - 1)
        goes_on = (following < len(self._keys)) & (owners[inside] == owners)
        next_us = self._keys[inside] - owners * self._span_us + self._first_us
        self._until_us = np.where(goes_on, next_us, UNBOUNDED_US)

    def _code(self, text: str) -> int:
        return self._code_of.get(text, _ABSENT if text == self._default else _ABSENT - 1)

    def _text(self, code: int) -> str:
        return self._texts[code] if code >= 0 else self._default


def _kind(one: Persistence) -> Kind:
    return one.attribute, one.arity, True
