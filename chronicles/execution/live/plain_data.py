"""How does the state of a recogniser become text that another process can read?

A state is nested builtins with events and occurrences in it. JSON has no tuples, no keys but texts, and would write
one event as often as it is held; so containers carry a mark, and each event is written once and then referred to.
"""

from collections.abc import Callable
from dataclasses import fields
from functools import partial
from typing import Any  # nested data of any shape

from chronicles.events import Event, Occurrence
from chronicles.execution.obligations.history import FluentHistory

_ATOMS = (str, int, float, type(None))  # bool is an int


def to_plain(value: Any) -> dict[str, Any]:  # Any: nested data
    """Write nested lists, tuples, dictionaries, sets, events, occurrences and atoms as what JSON can hold.

    Raises
    ------
    TypeError
        If something else is in it.

    Examples
    --------
    >>> honk = Event("honk", ("car1",), 5)
    >>> to_plain([honk, (1, honk)])["events"], to_plain([honk, (1, honk)])["value"]
    ([['honk', ['car1'], 5, None, None, [], 1.0]], ['list', ['event', 0], ['tuple', 1, ['event', 0]]])
    """
    writer = _Writer()
    plain = writer.write(value)
    return {"events": writer.events, "value": plain}


def from_plain(plain: dict[str, Any]) -> Any:  # Any: nested data
    """Read what `to_plain` wrote.

    Raises
    ------
    KeyError, IndexError, TypeError, ValueError
        If it is not of that form.

    Examples
    --------
    >>> from_plain(to_plain({("a", 1): [None, {"b"}]}))
    {('a', 1): [None, {'b'}]}
    """
    events = [
        Event(name, tuple(args), t_us, old, new, tuple(hypotheses), confidence)
        for name, args, t_us, old, new, hypotheses, confidence in plain["events"]
    ]
    return _read(plain["value"], events)


class _Writer:
    """Writes values; invariant: `events` holds each event once, at its number."""

    def __init__(self) -> None:
        self.events: list[list[Any]] = []
        self._number_of: dict[int, int] = {}  # by identity: the events live as long as the value that is written

    def write(self, value: Any) -> Any:  # Any: nested data
        """Write one value."""
        match value:
            case str() | int() | float() | None:
                return value
            case Event():
                return ["event", self._number(value)]
            case Occurrence():
                return ["occurrence", *(self.write(getattr(value, field.name)) for field in fields(Occurrence))]
            case dict():
                return ["dict", *([self.write(key), self.write(one)] for key, one in value.items())]
            case list() | tuple() | FluentHistory():
                return [type(value).__name__, *map(self.write, value)]
            case set() | frozenset():
                return [type(value).__name__, *map(self.write, sorted(value, key=repr))]
        raise TypeError(f"checkpoint: expected plain data, got {type(value).__name__}")

    def _number(self, event: Event) -> int:
        number = self._number_of.get(id(event))
        if number is None:
            number = self._number_of[id(event)] = len(self.events)
            values = [event.t_us, event.old, event.new, list(event.hypotheses), event.confidence]
            self.events.append([event.name, list(event.args), *values])
        return number


_CONTAINERS: dict[str, Callable[[Any], Any]] = {
    "list": list,
    "tuple": tuple,
    "set": set,
    "frozenset": frozenset,
    "FluentHistory": partial(FluentHistory, None),
}


def _read(value: Any, events: list[Event]) -> Any:  # Any: nested data
    if isinstance(value, _ATOMS):
        return value
    kind, *rest = value
    if kind == "event":
        return events[rest[0]]
    if kind == "occurrence":
        return Occurrence(*(_read(one, events) for one in rest))
    if kind == "dict":
        return {_read(key, events): _read(one, events) for key, one in rest}
    return _CONTAINERS[kind](_read(one, events) for one in rest)
