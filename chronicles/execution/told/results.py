"""What is told, without building it before somebody looks?

An instance of a chronicle without obligations, actions, selection and symmetry is told as soon as it has its events,
whatever else is told. Listing thousands of them as objects would cost more than finding them.
"""

from abc import abstractmethod
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from operator import attrgetter
from typing import overload

from chronicles.compilation.plan import Plan
from chronicles.events import Occurrence
from chronicles.execution.instances import Instance
from chronicles.execution.told.occurrences import Finding, OccurrenceBuilder


def is_told_at_once(plan: Plan) -> bool:
    """Say whether an instance with all its events is an occurrence, and nothing depends on the order of results."""
    return not (plan.counts or plan.persistences or plan.emissions or plan.is_symmetric or plan.selection.kind != "all")


class Told(Sequence[Occurrence]):
    """Occurrences in the order of results; equal to any sequence of equal occurrences.

    They are built when they are looked at; their number is known before. Adding gives a list.
    """

    @abstractmethod
    def built(self, part: slice) -> Sequence[Occurrence]:
        """Build some of them."""

    def __iter__(self) -> Iterator[Occurrence]:
        return iter(self.built(slice(None)))

    @overload
    def __getitem__(self, index: int) -> Occurrence: ...

    @overload
    def __getitem__(self, index: slice) -> Sequence[Occurrence]: ...

    def __getitem__(self, index: int | slice) -> Occurrence | Sequence[Occurrence]:
        if isinstance(index, slice):
            return self.built(index)
        place = range(len(self))[index]
        return self.built(slice(place, place + 1))[0]

    def __add__(self, other: Iterable[Occurrence]) -> list[Occurrence]:
        return [*self, *other]

    def __radd__(self, other: Iterable[Occurrence]) -> list[Occurrence]:
        return [*other, *self]

    def __eq__(self, other: object) -> bool:
        return list(self) == list(other) if isinstance(other, Sequence) else NotImplemented

    __hash__ = None  # type: ignore[assignment]  # like a list

    def __repr__(self) -> str:
        return f"<{len(self)} occurrences>"


@dataclass(slots=True, eq=False)
class Unbuilt:
    """Complete instances of one chronicle that are told together."""

    builder: OccurrenceBuilder
    instances: Sequence[Instance]
    certain_us: int
    clock_us: int

    def findings(self) -> Iterator[Finding]:
        """Build them."""
        for instance in self.instances:
            yield self.builder.plain_finding(instance, self.certain_us, self.clock_us)


class Results(Told):
    """The occurrences of one step."""

    def __init__(self, findings: list[Finding], unbuilt: list[Unbuilt]) -> None:
        self._built = findings
        self._unbuilt: list[Unbuilt] | None = unbuilt  # None: all built and in order
        self._length = len(findings) + sum([len(one.instances) for one in unbuilt])

    def __len__(self) -> int:
        return self._length

    def __repr__(self) -> str:
        return repr(list(self))

    def built(self, part: slice) -> Sequence[Occurrence]:
        """Build all of them, once; give some."""
        if self._unbuilt is not None:
            for one in self._unbuilt:
                self._built += one.findings()
            self._unbuilt = None
            self._built.sort(key=attrgetter("order"))
        return [finding.occurrence for finding in self._built[part]]
