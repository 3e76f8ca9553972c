"""How are stored events kept as columns, and which rows fit an event pattern?

`EventColumns` keeps the events in the order of time, and one table for each kind of event (name, number of arguments,
message or change) that somebody looks at: times, and texts as codes into one list.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import chain

import numpy as np
from numpy.typing import NDArray

from chronicles.compilation.names.symbols import UNKNOWN
from chronicles.compilation.plan import EventTest
from chronicles.events import Event, by_time

Times = NDArray[np.int64]
Codes = NDArray[np.int32]
Rows = NDArray[np.int64]
Mask = NDArray[np.bool_]
Kind = tuple[str, int, bool]  # name, number of arguments, whether a change

NO_CODE = -1
"""Stands for a text that no event has."""


@dataclass(frozen=True, eq=False)
class EventTable:
    """The events of one kind, in the order of time.

    Attributes
    ----------
    t_us : (rows,)
    codes : (rows, fields) the arguments, then for a change the old and the new value, as codes of symbols.
    sequence : (rows,) where each event stands among all events; it ascends.
    """

    t_us: Times
    codes: Codes
    sequence: Times

    def __len__(self) -> int:
        return len(self.t_us)


class EventColumns:
    """Stored events, one table for each kind.

    Attributes
    ----------
    events : in the order of time.
    texts : what the codes stand for, in the order in which tables were asked for; the first one is "unknown".

    Examples
    --------
    >>> columns = EventColumns.from_events([Event("honk", ("car2",), 5), Event("honk", ("car1",), 3)])
    >>> len(columns), [event.args for event in columns.events]
    (2, [('car1',), ('car2',)])
    >>> columns.table(("honk", 1, False)).t_us, columns.table(("honk", 1, False)).codes.tolist(), columns.texts
    (array([3, 5]), [[1], [2]], ['unknown', 'car1', 'car2'])
    """

    def __init__(self, events: Sequence[Event]) -> None:
        self.events = events
        self.texts = [UNKNOWN]
        self._code_of = {UNKNOWN: 0}
        self._tables: dict[Kind, EventTable] = {}
        self._places: defaultdict[Kind, list[int]] = defaultdict(list)
        for place, event in enumerate(events):
            self._places[event.name, len(event.args), event.new is not None].append(place)

    @classmethod
    def from_events(cls, events: Iterable[Event]) -> EventColumns:
        """Make columns of events in any order; simultaneous ones stay in the order given."""
        return cls(sorted(events, key=by_time))

    def __len__(self) -> int:
        return len(self.events)

    def code(self, text: str) -> int:
        """Give the code of a text, `NO_CODE` if it stands in no table yet."""
        return self._code_of.get(text, NO_CODE)

    def table(self, kind: Kind) -> EventTable:
        """Give the events of a kind, an empty table if there are none."""
        if kind not in self._tables:
            self._tables[kind] = self._table(kind)
        return self._tables[kind]

    def _table(self, kind: Kind) -> EventTable:
        _, arity, is_change = kind
        places = self._places.get(kind, [])
        mine = [self.events[place] for place in places]
        texts: Iterable[str] = chain.from_iterable(event.args for event in mine)
        if is_change:
            # A value not told, or an empty one, is unknown.
            texts = chain.from_iterable((*event.args, event.old or UNKNOWN, event.new or UNKNOWN) for event in mine)
        code_of = self._code_of
        codes = [code_of.setdefault(text, len(code_of)) for text in texts]
        self.texts += list(code_of)[len(self.texts) :]
        return EventTable(
            np.fromiter([event.t_us for event in mine], np.int64, len(mine)),
            np.array(codes, np.int32).reshape(len(mine), arity + 2 * is_change),
            np.asarray(places, np.int64),
        )


def kind_of(test: EventTest) -> Kind:
    """Give the kind of the events that can fit a pattern."""
    return test.name, test.arity, test.is_change


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
