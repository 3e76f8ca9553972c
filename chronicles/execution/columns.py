"""How are stored events kept as columns?

Months of events do not fit into objects. `EventColumns` keeps one table for each kind of event (name, number of
arguments, message or change): times in ascending order and texts as codes into one list of symbols. Rows become `Event`
objects only when somebody looks at them.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import chain
from operator import attrgetter

import numpy as np
from numpy.typing import NDArray

from chronicles.errors import ChronicleError
from chronicles.events import Event

Times = NDArray[np.int64]
Codes = NDArray[np.int32]
Kind = tuple[str, int, bool]  # name, number of arguments, whether a change

_EVENTS_AT_A_TIME = 1 << 14

NO_TEXT = -1
"""The code of an old value that an event does not tell."""


@dataclass(frozen=True, eq=False)
class EventTable:
    """The events of one kind, in the order of time.

    Attributes
    ----------
    t_us : (rows,)
    codes : (rows, fields) the arguments, then for a change the old and the new value, as codes of symbols.
    sequence : (rows,) where each event stands among all events; it ascends.
    hypotheses : by row, where an event has any.
    kept : the events themselves, if the columns were made of events that are to be kept.
    """

    t_us: Times
    codes: Codes
    sequence: Times
    hypotheses: Mapping[int, tuple[str, ...]]
    kept: Sequence[Event] | None = None

    def __len__(self) -> int:
        return len(self.t_us)

    def rows(self, start_us: int, end_us: int) -> slice:
        """Give the rows in [start, end)."""
        first, last = np.searchsorted(self.t_us, (start_us, end_us))
        return slice(int(first), int(last))

    def cut(self, rows: slice) -> EventTable:
        """Give some neighbouring rows as a table."""
        first, last, _ = rows.indices(len(self))
        labelled = {row - first: labels for row, labels in self.hypotheses.items() if first <= row < last}
        events = None if self.kept is None else self.kept[rows]
        return EventTable(self.t_us[rows], self.codes[rows], self.sequence[rows], labelled, events)


@dataclass(frozen=True, eq=False)
class EventColumns:
    """Stored events, one table for each kind.

    Attributes
    ----------
    tables : by kind.
    symbols : the texts that codes stand for, without doubles.

    Examples
    --------
    >>> columns = EventColumns.from_events([Event("honk", ("car2",), 5), Event("honk", ("car1",), 3)])
    >>> len(columns), columns.symbols
    (2, ('car1', 'car2'))
    >>> columns.tables["honk", 1, False].t_us, columns.tables["honk", 1, False].codes.tolist()
    (array([3, 5]), [[0], [1]])
    >>> [event.args for event in columns.between(4, 9).events()]
    [('car2',)]
    """

    tables: Mapping[Kind, EventTable]
    symbols: tuple[str, ...]

    @classmethod
    def from_events(cls, events: Iterable[Event], *, keep: bool = False) -> EventColumns:
        """Make columns of events in any order; simultaneous ones stay in the order given.

        Parameters
        ----------
        events : whatever happened.
        keep : whether to keep the events, so that occurrences are made of the very same objects; takes memory.
        """
        ordered = sorted(events, key=attrgetter("t_us"))
        places: dict[Kind, list[int]] = {}
        for place, event in enumerate(ordered):
            places.setdefault((event.name, len(event.args), event.new is not None), []).append(place)
        code_of: dict[str | None, int] = {None: NO_TEXT}
        tables = {kind: _table(kind, [ordered[one] for one in where], where, code_of) for kind, where in places.items()}
        if not keep:
            tables = {kind: replace(table, kept=None) for kind, table in tables.items()}
        return cls(tables, tuple([text for text in code_of if text is not None]))

    @classmethod
    def from_arrays(
        cls,
        arrays: Mapping[Kind, tuple[Times, Codes]],
        symbols: Sequence[str],
        hypotheses: Mapping[Kind, Mapping[int, tuple[str, ...]]] | None = None,
    ) -> EventColumns:
        """Make columns of arrays, as readers of files and stores have them.

        Parameters
        ----------
        arrays : by kind the times (rows,) in any order, and the codes (rows, fields) of arguments, old and new value.
        symbols : the texts that the codes stand for, without doubles.
        hypotheses : by kind and row of its arrays, where an event has any.

        Raises
        ------
        ChronicleError
            If shapes or codes do not fit.
        """
        if len(set(symbols)) != len(symbols):
            raise ChronicleError(f"event columns: expected symbols without doubles, got {len(symbols)!r} with doubles")
        for kind, (t_us, codes) in arrays.items():
            _check_arrays(kind, t_us, codes, len(symbols))
        labels = hypotheses or {}
        all_times = np.concatenate([np.empty(0, np.int64), *(t_us for t_us, _ in arrays.values())])
        sequence = np.empty(len(all_times), np.int64)
        sequence[np.argsort(all_times, kind="stable")] = np.arange(len(all_times))
        tables: dict[Kind, EventTable] = {}
        start = 0
        for kind, (t_us, codes) in arrays.items():
            part = sequence[start : start + len(t_us)]
            start += len(t_us)
            table = EventTable(np.asarray(t_us, np.int64), np.asarray(codes, np.int32), part, labels.get(kind, {}))
            tables[kind] = _sorted(table)
        return cls(tables, tuple(symbols))

    def __len__(self) -> int:
        return sum(map(len, self.tables.values()))

    @cached_property
    def times_us(self) -> Times:
        """The times of all events, ascending."""
        found = np.concatenate([np.empty(0, np.int64), *(table.t_us for table in self.tables.values())])
        found.sort(kind="stable")
        return found

    @cached_property
    def code_of(self) -> Mapping[str, int]:
        """The code of each symbol."""
        return {text: code for code, text in enumerate(self.symbols)}

    def table(self, kind: Kind) -> EventTable:
        """Give the events of a kind, an empty table if there are none."""
        return self.tables[kind] if kind in self.tables else _table(kind, (), (), {None: NO_TEXT})

    def between(self, start_us: int, end_us: int) -> EventColumns:
        """Give the events in [start, end); the arrays are views."""
        tables = {kind: table.cut(table.rows(start_us, end_us)) for kind, table in self.tables.items()}
        return EventColumns(tables, self.symbols)

    def of(self, names: Collection[str]) -> EventColumns:
        """Give the events of these names."""
        return EventColumns({kind: table for kind, table in self.tables.items() if kind[0] in names}, self.symbols)

    def events_at(self, kind: Kind, rows: NDArray[np.int64]) -> list[Event]:
        """Make the events of some rows; a row that comes twice gives one object."""
        table = self.table(kind)
        if table.kept is not None:
            return [table.kept[row] for row in rows.tolist()]
        wanted, places = np.unique(rows, return_inverse=True)
        name, arity, is_change = kind
        symbols = (*self.symbols, None)  # NO_TEXT takes the last
        texts = [[symbols[code] for code in column] for column in table.codes[wanted].T.tolist()]
        args = list(zip(*texts[:arity], strict=True)) if arity else [()] * len(wanted)
        values = list(zip(*texts[arity:], strict=True)) if is_change else [(None, None)] * len(wanted)
        hypotheses = [table.hypotheses.get(row, ()) for row in wanted.tolist()]
        times = table.t_us[wanted].tolist()
        made = [
            Event(name, arguments, t_us, old, new, labels)
            for arguments, t_us, (old, new), labels in zip(args, times, values, hypotheses, strict=True)
        ]
        return [made[place] for place in places.tolist()]

    def events(self) -> Iterator[Event]:
        """Make all events, in the order of time and `sequence`."""
        tables = list(self.tables.items())
        if not tables:
            return
        sequence, t_us = ([getattr(table, one) for _, table in tables] for one in ("sequence", "t_us"))
        order = np.lexsort((np.concatenate(sequence), np.concatenate(t_us)))
        lengths = np.array([len(table) for _, table in tables])
        ends = np.cumsum(lengths)
        for start in range(0, len(order), _EVENTS_AT_A_TIME):
            part = order[start : start + _EVENTS_AT_A_TIME]
            which = np.searchsorted(ends, part, "right")
            rows = part - (ends - lengths)[which]
            made = {
                index: iter(self.events_at(tables[index][0], rows[which == index]))
                for index in np.unique(which).tolist()
            }
            for index in which.tolist():
                yield next(made[index])

    def with_events(self, events: Sequence[Event], sequence: Times) -> EventColumns:
        """Give columns with more events, which take these places among all events."""
        if not events:
            return self
        code_of: dict[str | None, int] = {None: NO_TEXT}
        code_of.update(self.code_of)
        places: dict[Kind, list[int]] = {}
        for place, event in enumerate(events):
            places.setdefault((event.name, len(event.args), event.new is not None), []).append(place)
        tables = dict(self.tables)
        for kind, where in places.items():
            added = replace(_table(kind, [events[one] for one in where], where, code_of), sequence=sequence[where])
            tables[kind] = _merged(tables[kind], added) if kind in tables else _sorted(added)
        return EventColumns(tables, tuple([text for text in code_of if text is not None]))


def _table(kind: Kind, events: Sequence[Event], places: Sequence[int], code_of: dict[str | None, int]) -> EventTable:
    """Make the table of some events; new texts get the next code, which is one less than their number with None."""
    _, arity, is_change = kind
    texts: Iterable[str | None] = chain.from_iterable(event.args for event in events)
    if is_change:
        texts = chain.from_iterable((*event.args, event.old, event.new) for event in events)
    codes = [code_of.setdefault(text, len(code_of) - 1) for text in texts]
    return EventTable(
        np.fromiter([event.t_us for event in events], np.int64, len(events)),
        np.array(codes, np.int32).reshape(len(events), arity + 2 * is_change),
        np.asarray(places, np.int64),
        {row: event.hypotheses for row, event in enumerate(events) if event.hypotheses},
        events,
    )


def _merged(first: EventTable, second: EventTable) -> EventTable:
    hypotheses = {**first.hypotheses, **{len(first) + row: labels for row, labels in second.hypotheses.items()}}
    both = (first, second)
    kept = None if first.kept is None or second.kept is None else [*first.kept, *second.kept]
    return _sorted(
        EventTable(
            np.concatenate([one.t_us for one in both]),
            np.concatenate([one.codes for one in both]),
            np.concatenate([one.sequence for one in both]),
            hypotheses,
            kept,
        )
    )


def _sorted(table: EventTable) -> EventTable:
    order = np.lexsort((table.sequence, table.t_us))
    place_of = np.empty(len(order), np.int64)
    place_of[order] = np.arange(len(order))
    hypotheses = {int(place_of[row]): labels for row, labels in table.hypotheses.items()}
    kept = None if table.kept is None else [table.kept[row] for row in order.tolist()]
    return EventTable(table.t_us[order], table.codes[order], table.sequence[order], hypotheses, kept)


def _check_arrays(kind: Kind, t_us: Times, codes: Codes, symbols: int) -> None:
    name, arity, is_change = kind
    shape = (len(t_us), arity + 2 * is_change)
    if codes.shape != shape:
        raise ChronicleError(f"event columns {name!r}: expected codes of shape {shape!r}, got {codes.shape!r}")
    if codes.size and not (codes.min() >= NO_TEXT and codes.max() < symbols):
        raise ChronicleError(
            f"event columns {name!r}: expected codes from {NO_TEXT} to {symbols - 1},"
            f" got {int(codes.min())!r} to {int(codes.max())!r}"
        )
    needed = np.delete(codes, arity, axis=1) if is_change else codes
    if (needed == NO_TEXT).any():
        raise ChronicleError(f"event columns {name!r}: expected every argument and new value, got {NO_TEXT!r}")
