"""How are the complete instances of several chronicles found, event by event?

An executor takes the events of a stage in the order of time and gives the instances that each event completes. The
eager one (`eager.py`) keeps partial instances, the lazy one keeps events and looks back (`lazy.py`); the automatic one
begins lazily, because kept events can be given to the eager one later, and chooses for each chronicle once it has seen
how often its events come. All of them find the same instances.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any, Protocol  # Any: the state of an executor is its own affair

from chronicles.compilation.plan import Plan
from chronicles.errors import ChronicleError
from chronicles.execution.eager import EagerExecutor
from chronicles.execution.executor_choice import prefer_lazy
from chronicles.execution.instances import Instance, Record
from chronicles.execution.lazy import LazyStore

# Numbers of chronicles, each with instances that have all their events; a chronicle may come more than once.
Completed = list[tuple[int, Sequence[Instance]]]
MakeExecutor = Callable[[Mapping[int, Plan]], "Executor"]

_NAMES = ("auto", "eager", "lazy")
# So many events tell the rates well enough, and hold so few partial instances that building them is cheap.
_EVENTS_TO_CHOOSE = 2000


class Executor(Protocol):
    """What a stage needs of an executor, which names chronicles by the keys of its plans."""

    @property
    def names(self) -> frozenset[str]:
        """Names of the events that instances expect."""

    def feed(self, record: Record) -> tuple[Completed, int]:
        """Take an event, in the order of time; give the instances it completes and the number of others it made."""

    def sweep(self, now_us: int) -> int:
        """Drop what cannot be completed any more; give the number left."""

    def waiting(self, number: int, now_us: int) -> Iterator[tuple[int, Instance]]:
        """Give a chronicle's instances that may still be completed, with the set of positions they have matched."""

    def take_timed_out(self, number: int) -> list[tuple[int, Instance]]:
        """Give a chronicle's instances that died since the last call without ever being extended."""

    def state(self) -> Any:
        """Give everything the executor remembers, as plain data."""

    def restore(self, state: Any) -> None:
        """Take up where `state` was given."""


def executor_maker(name: str, timeouts_from: float | None) -> MakeExecutor:
    """Give the function that makes the executor of a stage.

    Parameters
    ----------
    name : "eager", "lazy" or "auto".
    timeouts_from : see `EagerExecutor`; only partial instances that are kept can be seen to die, so it takes an eager
        one, which "auto" then is.

    Raises
    ------
    ChronicleError
        If there is no such executor, or a lazy one is to tell what died.
    """
    if name not in _NAMES:
        raise ChronicleError(f"recogniser: expected an executor among {list(_NAMES)}, got {name!r}")
    if timeouts_from is not None and not 0 <= timeouts_from <= 1:
        raise ChronicleError(f"recogniser: expected timeouts_from between 0 and 1, got {timeouts_from!r}")
    if name == "eager" or (name == "auto" and timeouts_from is not None):
        return lambda plans: EagerExecutor(plans, timeouts_from)
    if timeouts_from is not None:
        raise ChronicleError("recogniser: expected the executor 'eager' or 'auto' with timeouts_from, got 'lazy'")
    return LazyExecutor if name == "lazy" else AutomaticExecutor


class LazyExecutor:
    """A lazy store for each chronicle."""

    def __init__(self, plans: Mapping[int, Plan]) -> None:
        self._stores = {number: LazyStore(plan) for number, plan in plans.items()}
        self._stores_of: dict[str, list[tuple[int, LazyStore]]] = {}
        for number, store in self._stores.items():
            for name in store.names:
                self._stores_of.setdefault(name, []).append((number, store))
        self.names = frozenset(self._stores_of)

    def feed(self, record: Record) -> tuple[Completed, int]:
        """Keep an event, and find the instances that it completes; nothing else is made."""
        complete: Completed = []
        for number, store in self._stores_of[record[2].name]:
            found, _ = store.feed(record)
            if found:
                complete.append((number, found))
        return complete, 0

    def sweep(self, now_us: int) -> int:
        """Drop the events that no instance can need any more; give the number left."""
        return sum(store.sweep(now_us) for store in self._stores.values())

    def waiting(self, number: int, now_us: int) -> Iterator[tuple[int, Instance]]:
        """Work out a chronicle's instances that may still be completed."""
        return self._stores[number].waiting(now_us)

    def take_timed_out(self, number: int) -> list[tuple[int, Instance]]:
        """Refuse: no instance is kept, so none is seen to die."""
        raise ChronicleError(f"lazy executor: expected an eager one to tell what died, for chronicle {number!r}")

    def records(self) -> dict[int, list[Record]]:
        """Give the kept events of each chronicle in the order in which they were fed."""
        return {number: store.state() for number, store in self._stores.items()}

    def state(self) -> Any:
        """Give the kept events of each chronicle."""
        return list(self.records().items())

    def restore(self, state: Any) -> None:
        """Take up where `state` was given; this executor is new."""
        for number, records in state:
            self._stores[number].restore(records)


class AutomaticExecutor:
    """Begins lazily, and goes on for each chronicle in the way that does less work for it."""

    def __init__(self, plans: Mapping[int, Plan]) -> None:
        self._plans = plans
        self._counts: dict[str, int] = {}
        self._first_us: int | None = None
        self._left_to_count = _EVENTS_TO_CHOOSE
        self._use(frozenset(plans))
        self.names = self._lazy.names

    def feed(self, record: Record) -> tuple[Completed, int]:
        """Take an event; give the instances that it completes and the number of others it made."""
        name, created = record[2].name, 0
        complete: Completed = []
        if name in self._eager.names:
            complete, created = self._eager.feed(record)
        if name in self._lazy.names:
            complete += self._lazy.feed(record)[0]
        if self._left_to_count:
            self._count(record)
        return complete, created

    def sweep(self, now_us: int) -> int:
        """Drop what cannot be completed any more; give the number left."""
        return self._eager.sweep(now_us) + self._lazy.sweep(now_us)

    def waiting(self, number: int, now_us: int) -> Iterator[tuple[int, Instance]]:
        """Give a chronicle's instances that may still be completed."""
        part = self._lazy if number in self._lazy_numbers else self._eager
        return part.waiting(number, now_us)

    def take_timed_out(self, number: int) -> list[tuple[int, Instance]]:
        """Refuse, see `executor_maker`."""
        return self._lazy.take_timed_out(number)

    def state(self) -> Any:
        """Give everything both parts remember, and what was counted."""
        return {
            "lazy_numbers": sorted(self._lazy_numbers),
            "lazy": self._lazy.state(),
            "eager": self._eager.state(),
            "counts": self._counts,
            "first_us": self._first_us,
            "left_to_count": self._left_to_count,
        }

    def restore(self, state: Any) -> None:
        """Take up where `state` was given; this executor is new."""
        self._use(frozenset(state["lazy_numbers"]))
        self._lazy.restore(state["lazy"])
        self._eager.restore(state["eager"])
        self._counts = dict(state["counts"])
        self._first_us = state["first_us"]
        self._left_to_count = state["left_to_count"]

    def _use(self, lazy_numbers: frozenset[int]) -> None:
        self._lazy_numbers = lazy_numbers
        self._lazy = LazyExecutor({n: plan for n, plan in self._plans.items() if n in lazy_numbers})
        self._eager = EagerExecutor({n: plan for n, plan in self._plans.items() if n not in lazy_numbers})

    def _count(self, record: Record) -> None:
        t_us, _, event = record
        if self._first_us is None:
            self._first_us = t_us
        self._counts[event.name] = self._counts.get(event.name, 0) + 1
        self._left_to_count -= 1
        if not self._left_to_count:
            self._choose(max(1, t_us - self._first_us))

    def _choose(self, span_us: int) -> None:
        """Give the kept events to the part that goes on with them."""
        kept = self._lazy.records()
        self._use(frozenset(n for n, plan in self._plans.items() if prefer_lazy(plan, self._counts, span_us)))
        self._lazy.restore((number, kept[number]) for number in self._lazy_numbers)
        records = {record[1]: record for number in kept.keys() - self._lazy_numbers for record in kept[number]}
        for _, record in sorted(records.items()):
            if record[2].name in self._eager.names:
                self._eager.feed(record)
