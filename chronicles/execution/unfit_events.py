"""Which events of a stream fit nothing that chronicles declare or look at, and why?

They are counted beside recognition, which passes over them without a word.
"""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Literal

from chronicles.chronicle_set import ChronicleSet
from chronicles.compilation.names.domains import ValueSet
from chronicles.compilation.names.symbols import UNKNOWN
from chronicles.events import Event

Reason = Literal["unknown name", "other shape", "value outside its domain"]

_Shape = tuple[int, bool]  # number of arguments, whether a change


@dataclass(frozen=True, slots=True)
class UnfitEvents:
    """Events of one name that do not fit for one reason: how many, and the first that came."""

    name: str
    reason: Reason
    count: int
    first: Event


class UnfitCounter:
    """Counts the events that cannot fit.

    Where texts declare attributes and messages, these names are known, with their arguments and domains; otherwise
    those that a chronicle looks at. What chronicles give each other is known too.

    Examples
    --------
    >>> from chronicles.chronicle_set import load
    >>> text = "domain D = {a, b} message honk[?c] { ?c in D } chronicle h[]() { event(honk[?], t1) }"
    >>> counter = UnfitCounter(load(text))
    >>> for number, args in enumerate([("a",), ("z",), ("a", "b"), ("y",)]):
    ...     counter.count(Event("honk", args, number))
    >>> counter.count(Event("honks", ("a",), 9))
    >>> [(one.name, one.reason, one.count, one.first.t_us) for one in counter.found]
    [('honk', 'other shape', 1, 2), ('honk', 'value outside its domain', 2, 1), ('honks', 'unknown name', 1, 9)]
    """

    def __init__(self, chronicles: ChronicleSet) -> None:
        self.shapes: dict[str, set[_Shape]] = {}
        self._domains: dict[str, list[tuple[int, ValueSet]]] = {}
        for name, arity, is_change in _looked_at(chronicles):
            self.shapes.setdefault(name, set()).add((arity, is_change))
        for one in chronicles.signatures:
            fields = [*one.arguments] if one.value is None else [*one.arguments, one.value, one.value]
            self.shapes[one.name] = {(len(one.arguments), one.value is not None)}
            self._domains[one.name] = [(place, field.values) for place, field in enumerate(fields)]
        self._found: dict[tuple[str, Reason], tuple[int, Event]] = {}

    @property
    def found(self) -> tuple[UnfitEvents, ...]:
        """What was counted so far, by name and reason."""
        return tuple(UnfitEvents(name, reason, *one) for (name, reason), one in sorted(self._found.items()))

    def count(self, event: Event) -> None:
        """Look at an event."""
        reason = self._reason(event)
        if reason is not None:
            count, first = self._found.get((event.name, reason), (0, event))
            self._found[event.name, reason] = count + 1, first

    def _reason(self, event: Event) -> Reason | None:
        shapes = self.shapes.get(event.name)
        if shapes is None:
            return "unknown name"
        if (len(event.args), event.new is not None) not in shapes:
            return "other shape"
        values = event.args if event.new is None else (*event.args, event.old or UNKNOWN, event.new or UNKNOWN)
        for place, allowed in self._domains.get(event.name, ()):
            # Every attribute may be unknown, whatever its domain.
            if values[place] not in allowed and (place < len(event.args) or values[place] != UNKNOWN):
                return "value outside its domain"
        return None


def _looked_at(chronicles: ChronicleSet) -> Iterator[tuple[str, int, bool]]:
    for plan in chronicles.plans:
        for test in plan.tests:
            yield test.name, test.arity, test.is_change
        for hold in plan.persistences:
            yield hold.attribute, hold.arity, True
        for emission in plan.emissions:
            yield emission.name, len(emission.arguments), emission.change is not None


def unfit_events(chronicles: ChronicleSet, events: Iterable[Event]) -> tuple[UnfitEvents, ...]:
    """Count the events of a list that cannot fit."""
    counter = UnfitCounter(chronicles)
    for event in events:
        counter.count(event)
    return counter.found
