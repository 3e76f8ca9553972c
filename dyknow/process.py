"""How does one stream become another? A refinement process feeds its inputs to a computational unit.

A computational unit is a value-in, values-out object with its own state: it may answer a sample with none (still
starting up), one, or several samples. Units know nothing of labels, policies or each other.
"""

from collections.abc import Callable, Iterable
from typing import Any, Protocol

from dyknow.sample import Sample
from dyknow.stream import StreamGenerator

Clock = Callable[[], int]


class ComputationalUnit(Protocol):
    """Turn samples into samples."""

    def update(self, sample: Sample[Any]) -> Iterable[Sample[Any]]:
        """Take one input sample; return the output samples it causes, oldest first."""
        ...

    def finish(self) -> Iterable[Sample[Any]]:
        """Return what was held back, at the end of the input."""
        ...


class Refinement:
    """Run a computational unit between an input stream and its own stream generator.

    Attributes
    ----------
    label : label of the output stream.
    updates : how often the unit was called.
    busy_ns : time spent inside the unit, without the time of its subscribers, by the clock that was given.
    """

    __slots__ = ("_clock", "_unit", "busy_ns", "output", "updates")

    def __init__(self, output: StreamGenerator, unit: ComputationalUnit, clock: Clock) -> None:
        self.output = output
        self.updates = 0
        self.busy_ns = 0
        self._unit = unit
        self._clock = clock

    @property
    def label(self) -> str:
        """Return the label of the output stream."""
        return self.output.label

    def consume(self, sample: Sample[Any]) -> None:
        """Feed one sample to the unit and publish what comes out."""
        started_ns = self._clock()
        results = tuple(self._unit.update(sample))
        self.busy_ns += self._clock() - started_ns
        self.updates += 1
        self._publish(results)

    def finish(self) -> None:
        """Publish what the unit still holds; the node calls this once, inputs first."""
        started_ns = self._clock()
        results = tuple(self._unit.finish())
        self.busy_ns += self._clock() - started_ns
        self._publish(results)

    def _publish(self, results: tuple[Sample[Any], ...]) -> None:
        for result in results:
            self.output.publish(result)
