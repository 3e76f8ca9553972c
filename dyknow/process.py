"""How does one stream become another? Processes read streams under policies and publish to a stream of their own.

There are four kinds, after Heintz (2009), chapter 3: *primitive* processes are sources, which the host feeds;
*refinement* feeds its inputs to a computational unit; *mediation* (`dyknow.mediation`) passes on a changing set of
streams; *configuration* (`dyknow.configuration`) creates and removes processes.

A computational unit is a value-in, values-out object with its own state: it may answer a sample with none (still
starting up), one, or several samples. Units know nothing of labels, policies or each other.
"""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any, Protocol, runtime_checkable

from dyknow.policy import Policy
from dyknow.sample import Sample
from dyknow.stream import Consumer, StreamGenerator, Subscription

Clock = Callable[[], int]
Samples = Iterable[Sample[Any]]  # Any: a stream may carry any value


class ComputationalUnit(Protocol):
    """Turn samples of one stream into samples."""

    def update(self, sample: Sample[Any]) -> Samples:
        """Take one input sample; return the output samples it causes, oldest first."""
        ...

    def finish(self) -> Samples:
        """Return what was held back, at the end of the input."""
        ...


class JoiningUnit(Protocol):
    """Turn samples of several streams into samples."""

    def update(self, index: int, sample: Sample[Any], /) -> Samples:
        """Take one sample of the input with this index; return the output samples it causes, oldest first."""
        ...

    def finish(self) -> Samples:
        """Return what was held back, at the end of all inputs."""
        ...


@runtime_checkable
class TimedUnit(Protocol):
    """Answer to time that passes without samples; what a unit of either kind may do besides."""

    def advance(self, available_us: int) -> Samples:
        """Learn that nothing which became available before this time comes any more."""
        ...


@dataclass(frozen=True, slots=True)
class Input:
    """Tie a process to a stream that it reads."""

    stream: StreamGenerator
    subscription: Subscription


class Process:
    """Read some streams and publish to one; by itself, a primitive process that the host feeds through `output`.

    Attributes
    ----------
    kind : one word for reports.
    output : the stream of this process; a configuration publishes nothing to its own.
    inputs : what it reads, in the order in which it began.
    updates : how often its code was called with a sample.
    busy_ns : time spent inside that code, without the time of its subscribers, by the clock of the node.
    """

    def __init__(self, output: StreamGenerator, *, kind: str = "source") -> None:
        self.kind = kind
        self.output = output
        self.inputs: list[Input] = []
        self.updates = 0
        self.busy_ns = 0

    @property
    def label(self) -> str:
        """Return the label of the process and of its stream."""
        return self.output.label

    def read(self, stream: StreamGenerator, consumer: Consumer, policy: Policy) -> None:
        """Begin to read a stream."""
        self.inputs.append(Input(stream, stream.subscribe(consumer, policy, reader=self.label)))

    def stop_reading(self, one: Input) -> None:
        """Stop to read a stream, after what its policy held back."""
        self.inputs.remove(one)
        one.subscription.finish()
        one.stream.unsubscribe(one.subscription)

    def advance(self, available_us: int) -> None:
        """Let time pass; inputs have been told before."""

    def finish(self) -> None:
        """Publish what is held back; inputs have been finished before."""

    def close(self) -> None:
        """Stop to read, and publish what the process and the policies around it hold back."""
        for one in tuple(self.inputs):
            self.stop_reading(one)
        self.finish()
        self.output.finish()


class Refinement(Process):
    """Run a computational unit between some streams and its own.

    Parameters
    ----------
    unit : a `ComputationalUnit` for one input, a `JoiningUnit` for several; either may be a `TimedUnit`.
    clock : nanoseconds.
    """

    def __init__(self, output: StreamGenerator, unit: ComputationalUnit | JoiningUnit, clock: Clock) -> None:
        super().__init__(output, kind="refinement")
        self._clock = clock
        self._unit = unit
        self._advance = unit.advance if isinstance(unit, TimedUnit) else None
        # Any: which of the two signatures `update` has follows from the number of inputs.
        self._update: Any = unit.update

    def follow(self, inputs: Sequence[tuple[StreamGenerator, Policy]]) -> None:
        """Begin to read the inputs, each under its own policy."""
        for index, (stream, policy) in enumerate(inputs):
            self.read(stream, self.consume if len(inputs) == 1 else partial(self.consume_from, index), policy)

    def consume(self, sample: Sample[Any]) -> None:
        """Feed a sample of the only input to the unit and publish what comes out."""
        self.updates += 1
        self._publish(self._timed(self._update, sample))

    def consume_from(self, index: int, sample: Sample[Any]) -> None:
        """Feed a sample of one of several inputs to the unit and publish what comes out."""
        self.updates += 1
        self._publish(self._timed(self._update, index, sample))

    def advance(self, available_us: int) -> None:
        """Tell a timed unit the time, and publish what comes out."""
        if self._advance is not None:
            self._publish(self._timed(self._advance, available_us))

    def finish(self) -> None:
        """Publish what the unit still holds."""
        self._publish(self._timed(self._unit.finish))

    def _timed(self, code: Callable[..., Samples], *arguments: Any) -> tuple[Sample[Any], ...]:  # Any: see `Samples`
        started_ns = self._clock()
        results = tuple(code(*arguments))
        self.busy_ns += self._clock() - started_ns
        return results

    def _publish(self, results: tuple[Sample[Any], ...]) -> None:
        output = self.output
        for result in results:
            if output.is_open:  # a reader of the first result may remove this process
                output.publish(result)
