"""Which value did an attribute have, and since when?

An attribute of some things is a piecewise constant function of time, known through its changes. Changes of one fluent
(attribute and arguments) at the same time act as one: the value afterwards is the one that is entered more often than
left, or the value before if there is none such; so it does not depend on the order in which they arrived.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Iterable

from chronicles.compilation.symbols import UNKNOWN
from chronicles.events import Event


class FluentHistory:
    """The values of one fluent; invariant: times ascend, and the value at times[i] lasts until times[i + 1]."""

    __slots__ = ("_instant", "_times", "_values")

    def __init__(self) -> None:
        self._times: list[int] = []
        self._values: list[str] = []
        self._instant: list[tuple[str, str]] = []

    def append(self, t_us: int, old: str, new: str, initial: str) -> None:
        """Add a change at or after the latest one; `initial` is the value before the first."""
        if not self._times or t_us > self._times[-1]:
            self._times.append(t_us)
            self._values.append(new)
            self._instant = [(old, new)]
            return
        self._instant.append((old, new))
        before = self._values[-2] if len(self._values) > 1 else initial
        self._values[-1] = value_after(before, self._instant)

    def value_throughout(self, start_us: int, end_us: int, initial: str) -> str | None:
        """Give the one value the fluent has in [start, end), None if it has several."""
        index = bisect_right(self._times, start_us) - 1
        value = self._values[index] if index >= 0 else initial
        for later in range(index + 1, len(self._times)):
            if self._times[later] >= end_us:
                break
            if self._values[later] != value:
                return None
        return value

    def is_reported_by(self, t_us: int) -> bool:
        """Say whether a change at or before a time is known."""
        return bool(self._times) and self._times[0] <= t_us

    def forget_before(self, t_us: int) -> None:
        """Drop what can only be seen by looking further back than `t_us`."""
        keep_from = bisect_right(self._times, t_us) - 1
        if keep_from > 0:
            del self._times[:keep_from]
            del self._values[:keep_from]

    def is_unknown_since(self, t_us: int) -> bool:
        """Say whether the value is unknown at `t_us` and ever after."""
        return self._times[-1] <= t_us and self._values[-1] == UNKNOWN


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
    """The fluents of some attributes, as far back as asked for."""

    def __init__(self, watched: Iterable[str], defaults: Iterable[tuple[str, str]]) -> None:
        initial = dict(defaults)
        self._initial = {name: initial.get(name, UNKNOWN) for name in watched}
        self._fluents: dict[str, dict[tuple[str, ...], FluentHistory]] = {name: {} for name in self._initial}
        self._indexes: dict[tuple[str, tuple[int, ...]], dict[tuple[str, ...], dict[tuple[str, ...], None]]] = {}

    def index_by(self, name: str, places: tuple[int, ...]) -> None:
        """Prepare `matching` for arguments known at these places."""
        self._indexes.setdefault((name, places), {})

    def append(self, event: Event) -> None:
        """Add a change; messages are ignored. Events come in the order of time."""
        if event.new is None:
            return
        fluents = self._fluents[event.name]
        fluent = fluents.get(event.args)
        if fluent is None:
            fluent = fluents[event.args] = FluentHistory()
            self._add_to_indexes(event.name, event.args)
        fluent.append(event.t_us, event.old or UNKNOWN, event.new, self._initial[event.name])

    def value_throughout(self, name: str, args: tuple[str, ...], start_us: int, end_us: int) -> str | None:
        """Give the one value of a fluent in [start, end), None if it has several."""
        fluent = self._fluents[name].get(args)
        if fluent is None:
            return self._initial[name]
        return fluent.value_throughout(start_us, end_us, self._initial[name])

    def is_reported(self, name: str, args: tuple[str, ...], t_us: int) -> bool:
        """Say whether a change of a fluent at or before a time is known."""
        fluent = self._fluents[name].get(args)
        return fluent is not None and fluent.is_reported_by(t_us)

    def matching(self, name: str, places: tuple[int, ...], key: tuple[str, ...]) -> tuple[tuple[str, ...], ...]:
        """List the arguments of all kept fluents that have `key` at `places`."""
        return tuple(self._indexes[name, places].get(key, ()))

    def forget_before(self, t_us: int) -> int:
        """Drop what lies further back than `t_us`; give the number of fluents left."""
        for name, fluents in self._fluents.items():
            gone = []
            for args, fluent in fluents.items():
                fluent.forget_before(t_us)
                if self._initial[name] == UNKNOWN and fluent.is_unknown_since(t_us):
                    gone.append(args)
            for args in gone:
                del fluents[args]
                self._remove_from_indexes(name, args)
        return sum(map(len, self._fluents.values()))

    def _add_to_indexes(self, name: str, args: tuple[str, ...]) -> None:
        for (indexed, places), index in self._indexes.items():
            if indexed == name and all(place < len(args) for place in places):
                index.setdefault(tuple(args[place] for place in places), {})[args] = None

    def _remove_from_indexes(self, name: str, args: tuple[str, ...]) -> None:
        for (indexed, places), index in self._indexes.items():
            if indexed == name and all(place < len(args) for place in places):
                key = tuple(args[place] for place in places)
                del index[key][args]
                if not index[key]:
                    del index[key]
