"""Which value did an attribute have, since when, and on whose word?

An attribute of some things is a piecewise constant function of time, known through its changes. Changes of one fluent
(attribute and arguments) at the same time act as one: the value afterwards is the one that is entered more often than
left, or the value before if there is none such; so it does not depend on the order in which they arrived.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Iterable, Iterator
from typing import Any  # states are plain nested data

from chronicles.compilation.names.symbols import UNKNOWN
from chronicles.events import Event

Labels = tuple[str, ...]
_Index = dict[tuple[str, ...], dict[tuple[str, ...], None]]  # arguments of fluents by some of them, in the order made


class FluentHistory:
    """The values of one fluent; invariant: times ascend, and the value at times[i] lasts until times[i + 1].

    The changes at times[i] rest on the hypotheses labels[i].

    Attributes
    ----------
    owner : who may change it; a copy of an attribute history shares the fluents that it does not change.
    """

    __slots__ = ("_instant", "_labels", "_times", "_values", "owner")

    def __init__(self, owner: object, state: Iterable[Any] = ((), (), (), ())) -> None:
        times, values, instant, labels = state
        self.owner = owner
        self._times: list[int] = list(times)
        self._values: list[str] = list(values)
        self._instant: tuple[tuple[str, str], ...] = instant
        self._labels: list[Labels] = list(labels)

    def append(self, change: Event, initial: str) -> None:
        """Add a change at or after the latest one; `initial` is the value before the first."""
        assert change.new is not None
        t_us, old, new = change.t_us, change.old or UNKNOWN, change.new
        if not self._times or t_us > self._times[-1]:
            self._times.append(t_us)
            self._values.append(new)
            self._labels.append(change.hypotheses)
            self._instant = ((old, new),)
            return
        self._instant += ((old, new),)
        before = self._values[-2] if len(self._values) > 1 else initial
        self._values[-1] = value_after(before, self._instant)
        self._labels[-1] = _both(self._labels[-1], change.hypotheses)

    def assign(self, t_us: int, value: str, labels: Labels) -> None:
        """Set the value from a time on, up to the next change; all changes at that time are known already."""
        index = bisect_right(self._times, t_us)
        if index and self._times[index - 1] == t_us:
            self._values[index - 1] = value
            self._labels[index - 1] = _both(self._labels[index - 1], labels)
        else:
            self._times.insert(index, t_us)
            self._values.insert(index, value)
            self._labels.insert(index, labels)

    def value_throughout(self, start_us: int, end_us: int, initial: str) -> str | None:
        """Give the one value the fluent has in [start, end), None if it has several."""
        times, values = self._times, self._values
        index = bisect_right(times, start_us)
        value = values[index - 1] if index else initial
        while index < len(times) and times[index] < end_us:
            if values[index] != value:
                return None
            index += 1
        return value

    def values_within(self, start_us: int, end_us: int, initial: str) -> Iterator[tuple[str, Labels]]:
        """Give the values the fluent has in [start, end), each with the hypotheses of the change that brought it."""
        index = bisect_right(self._times, start_us) - 1
        value = self._values[index] if index >= 0 else initial
        yield value, self._labels[index] if index >= 0 else ()
        for later in range(index + 1, len(self._times)):
            if self._times[later] >= end_us:
                return
            if self._values[later] != value:
                value = self._values[later]
                yield value, self._labels[later]

    def is_reported_by(self, t_us: int) -> bool:
        """Say whether a change at or before a time is known."""
        return bool(self._times) and self._times[0] <= t_us

    def since(self, t_us: int) -> FluentHistory:
        """Give it without what can only be seen by looking further back than `t_us`; itself if that is nothing."""
        keep_from = bisect_right(self._times, t_us) - 1
        if keep_from <= 0:
            return self
        times, values, labels = (kept[keep_from:] for kept in (self._times, self._values, self._labels))
        return FluentHistory(self.owner, (times, values, self._instant, labels))

    def is_unknown_since(self, t_us: int) -> bool:
        """Say whether the value became unknown before `t_us` and has stayed so."""
        return self._times[-1] < t_us and self._values[-1] == UNKNOWN

    def __iter__(self) -> Iterator[Any]:
        """Give everything, as plain data, to make another one of."""
        return iter((self._times, self._values, self._instant, self._labels))


def _both(labels: Labels, others: Labels) -> Labels:
    return tuple(sorted({*labels, *others})) if others else labels


def value_after(before: str, changes: Iterable[tuple[str, str]]) -> str:
    """Give the value after changes (old, new) that happen at one time.

    Examples
    --------
    >>> value_after("false", [("true", "false"), ("false", "true")])
    'false'
    >>> value_after("false", [("true", "unknown"), ("false", "true")])
    'unknown'
    >>> value_after("unknown", [("true", "true")])    # a value stated again
    'true'
    """
    balance: dict[str, int] = {}
    for old, new in changes:
        balance[new] = balance.get(new, 0) + 1
        balance[old] = balance.get(old, 0) - 1
    entered = [value for value, count in balance.items() if count > 0]
    if entered:
        return max(entered)
    return before if before in balance else max(balance)


class AttributeHistory:
    """The fluents of some attributes, as far back as asked for.

    Invariant: changes in `_unread` are of fluents not in `_fluents`; in a log, nobody asks for half of them.

    Attributes
    ----------
    has_labels : whether any change rests on a hypothesis.
    """

    def __init__(self, watched: Iterable[str], defaults: Iterable[tuple[str, str]]) -> None:
        initial = dict(defaults)
        self._initial = {name: initial.get(name, UNKNOWN) for name in watched}
        self._fluents: dict[str, dict[tuple[str, ...], FluentHistory]] = {name: {} for name in self._initial}
        self._unread: dict[str, dict[tuple[str, ...], list[Event]]] = {name: {} for name in self._initial}
        self._indexes: dict[str, dict[tuple[int, ...], _Index]] = {name: {} for name in self._initial}
        # Changes made by `assign` come back once as events, because the stage looks at their attribute.
        self._assigned: list[Event] = []
        self._me = object()
        self._unreported = FluentHistory(None)
        self.has_labels = False

    def index_by(self, name: str, places: tuple[int, ...]) -> None:
        """Prepare `matching` for arguments known at these places."""
        self._indexes[name].setdefault(places, {})

    def append(self, event: Event) -> None:
        """Add a change; messages are ignored. Events come in the order of time."""
        if event.new is None:
            return
        if self._assigned and event in self._assigned:
            self._assigned.remove(event)
            return
        if event.hypotheses:
            self.has_labels = True
        name = event.name
        fluent = self._fluents[name].get(event.args)
        if fluent is None or fluent.owner is not self._me:
            fluent = self._own(name, event.args)
        fluent.append(event, self._initial[name])

    def fill(self, events: Iterable[Event]) -> None:
        """Add all changes that will ever come, in the order of time; a fluent is made of them when it is looked at."""
        for event in events:
            if event.new is not None and event.name in self._unread:
                self._unread[event.name].setdefault(event.args, []).append(event)
                if event.hypotheses:
                    self.has_labels = True

    def assign(self, event: Event) -> Event | None:
        """Set an attribute as an event without an old value says, after everything up to its time was added.

        Returns
        -------
        The change that it makes; None if the attribute has the value already.
        """
        assert event.new is not None
        old = self.value_throughout(event.name, event.args, event.t_us, event.t_us + 1)
        if old == event.new:
            return None
        change = Event(event.name, event.args, event.t_us, old, event.new, event.hypotheses, event.confidence)
        self.has_labels |= bool(event.hypotheses)
        self._own(event.name, event.args).assign(event.t_us, event.new, event.hypotheses)
        self._assigned.append(change)
        return change

    def value_throughout(self, name: str, args: tuple[str, ...], start_us: int, end_us: int) -> str | None:
        """Give the one value of a fluent in [start, end), None if it has several."""
        return self._kept(name, args).value_throughout(start_us, end_us, self._initial[name])

    def values_within(self, name: str, args: tuple[str, ...], start_us: int, end_us: int) -> list[tuple[str, Labels]]:
        """List the values of a fluent in [start, end), each with the hypotheses of the change that brought it.

        A value that is stated again is not brought again; the value at the start was brought by the latest change then.
        """
        return list(self._kept(name, args).values_within(start_us, end_us, self._initial[name]))

    def hypotheses_within(
        self, name: str, args: tuple[str, ...], start_us: int, end_us: int, *, of_known: bool
    ) -> Labels:
        """List the hypotheses of the changes that brought the values of a fluent in [start, end).

        With `of_known` those that made it unknown are left out.
        """
        if not self.has_labels:
            return ()
        brought = self.values_within(name, args, start_us, end_us)
        found = [labels for value, labels in brought if not (of_known and value == UNKNOWN)]
        return tuple([label for labels in found for label in labels])

    def is_reported(self, name: str, args: tuple[str, ...], t_us: int) -> bool:
        """Say whether a change of a fluent at or before a time is known."""
        return self._kept(name, args).is_reported_by(t_us)

    def matching(self, name: str, places: tuple[int, ...], key: tuple[str, ...]) -> tuple[tuple[str, ...], ...]:
        """List the arguments of all kept fluents that have `key` at `places`."""
        self._read_all(name)
        return tuple(self._indexes[name][places].get(key, ()))

    def forget_before(self, name: str, t_us: int, unknown_us: int) -> int:
        """Drop what lies before `t_us` of an attribute, and fluents unknown since before `unknown_us` or that.

        Returns
        -------
        The number of its fluents left.
        """
        self._read_all(name)
        fluents, gone = self._fluents[name], []
        for args, known in fluents.items():
            fluents[args] = fluent = known.since(t_us)
            if self._initial[name] == UNKNOWN and fluent.is_unknown_since(max(t_us, unknown_us)):
                gone.append(args)
        for args in gone:
            del fluents[args]
            for index, key in self._indexes_of(name, args):
                del index[key][args]
                if not index[key]:
                    del index[key]
        return len(fluents)

    def state(self) -> list[Any]:
        """Give everything, as plain data, events and fluents, none of which is changed any more."""
        for name in self._unread:
            self._read_all(name)
        self._me = object()
        return [{name: dict(kept) for name, kept in self._fluents.items()}, list(self._assigned), self.has_labels]

    def restore(self, state: list[Any]) -> None:
        """Take up where `state` was given, in a history of the same attributes."""
        fluents, assigned, self.has_labels = state
        self._fluents = {name: dict(kept) for name, kept in fluents.items()}
        for name, indexes in self._indexes.items():
            for index in indexes.values():
                index.clear()
            for args in self._fluents[name] if indexes else ():
                self._enter(name, args)
        self._assigned = list(assigned)
        self._me = object()

    def _read_all(self, name: str) -> None:
        for args in list(self._unread[name]):
            self._made(name, args)

    def _kept(self, name: str, args: tuple[str, ...]) -> FluentHistory:
        """Give a fluent to look at, an empty one if it was never reported."""
        kept = self._fluents[name].get(args)
        return kept or (self._made(name, args) if args in self._unread[name] else self._unreported)

    def _own(self, name: str, args: tuple[str, ...]) -> FluentHistory:
        """Give a fluent that may be changed, a copy if others share it."""
        fluent = self._made(name, args)
        if fluent.owner is not self._me:
            fluent = self._fluents[name][args] = FluentHistory(self._me, fluent)
        return fluent

    def _made(self, name: str, args: tuple[str, ...]) -> FluentHistory:
        """Give a fluent, made from its unread changes if there is none."""
        fluent = self._fluents[name].get(args)
        if fluent is None:
            fluent = self._fluents[name][args] = FluentHistory(self._me)
            for change in self._unread[name].pop(args, ()):
                fluent.append(change, self._initial[name])
            self._enter(name, args)
        return fluent

    def _enter(self, name: str, args: tuple[str, ...]) -> None:
        for index, key in self._indexes_of(name, args):
            index.setdefault(key, {})[args] = None

    def _indexes_of(self, name: str, args: tuple[str, ...]) -> Iterator[tuple[_Index, tuple[str, ...]]]:
        """Give the indexes that a fluent stands in, each with its key there."""
        for places, index in self._indexes[name].items():
            if all(place < len(args) for place in places):
                yield index, tuple(args[place] for place in places)
