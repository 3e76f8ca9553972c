"""How does one stream become another? Processes read streams under policies and publish to a stream of their own.

There are four kinds, after Heintz (2009), chapter 3: *primitive* processes are sources, which the host feeds;
*refinement* feeds its inputs to a computational unit; *mediation* (`dyknow.streams.mediation`) passes on a changing
set of streams; *configuration* (`dyknow.streams.configuration`) creates and removes processes.

A computational unit is a value-in, values-out object with its own state: it may answer a sample with none (still
starting up), one, or several samples. Units know nothing of labels, policies or each other.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from functools import partial
from typing import Any, Protocol, runtime_checkable

from dyknow.policies.policy import Policy
from dyknow.streams.relay import Relay, deliver, nests
from dyknow.streams.sample import Sample
from dyknow.streams.stream import Consumer, StreamGenerator, Subscription

Clock = Callable[[], int]
Samples = Iterable[Sample[Any]]  # Any: a stream may carry any value
Update = Callable[[Sample[Any]], Samples]


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


@runtime_checkable
class SelectiveUnit(Protocol):
    """Count by cause what was left out; what a unit of either kind may do besides."""

    @property
    def left_out(self) -> Mapping[str, int]: ...  # noqa: D102


@runtime_checkable
class BusyUnit(Protocol):
    """Count nanoseconds that others worked for a unit before it was called; what a unit may do besides."""

    @property
    def busy_ns(self) -> int: ...  # noqa: D102


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
    is_finished : whether the end of the input was told.
    inputs : what it reads, in the order in which it began.
    updates : how often its code was called with a sample.
    """

    def __init__(self, output: StreamGenerator, *, kind: str = "source") -> None:
        self.kind = kind
        self.output = output
        self.inputs: list[Input] = []
        self.is_finished = False
        self.updates = 0
        self._busy_ns = 0

    @property
    def busy_ns(self) -> int:
        """Return the time spent inside its code, without the time of its subscribers, by the clock of the node."""
        return self._busy_ns

    @property
    def label(self) -> str:
        """Return the label of the process and of its stream."""
        return self.output.label

    @property
    def left_out(self) -> Mapping[str, int]:
        """Return by cause what the code of the process took in and made nothing of."""
        return {}

    def read(self, stream: StreamGenerator, consumer: Consumer, policy: Policy) -> None:
        """Begin to read a stream."""
        one = Input(stream, stream.subscribe(consumer, policy, reader=self.label))
        self.inputs.append(one)
        if self.output.is_closed:  # a reader of what came of stored samples has removed this process
            self.stop_reading(one)

    def stop_reading(self, one: Input) -> None:
        """Stop to read a stream, after what its policy held back; doing so again does nothing."""
        if one not in self.inputs:  # what the policy held back can have ended it
            return
        self.inputs.remove(one)
        try:
            one.subscription.finish()
        finally:
            if one.subscription.is_open:
                one.stream.unsubscribe(one.subscription)

    def advance(self, available_us: int) -> None:
        """Let time pass, until the end; inputs have been told before."""
        if not self.is_finished:
            self._advance(available_us)
            self.output.advance(available_us)

    def finish(self) -> None:
        """Publish what is held back, here and by those who read the stream; inputs have been finished before.

        Nothing can be published afterwards. Doing so again does nothing.
        """
        if not self.is_finished:
            self.is_finished = True
            try:
                self._flush()
            finally:  # the end is told once: who failed is not asked again
                self.output.finish()

    def close(self) -> None:
        """Stop to read, and publish what the process and the policies around it hold back."""
        with ExitStack() as steps:  # each is taken, last one first, also when another one fails
            steps.callback(self.finish)
            for one in reversed(self.inputs):
                steps.callback(self.stop_reading, one)

    def _advance(self, available_us: int) -> None:
        """Publish what the time releases."""

    def _flush(self) -> None:
        """Publish what the process holds back."""


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
        self._tell = unit.advance if isinstance(unit, TimedUnit) else None
        # Any: which of the two signatures `update` has follows from the number of inputs.
        self._update: Any = unit.update

    @property
    def busy_ns(self) -> int:
        """Return the time spent inside the unit, and before by others who work for it."""
        return self._busy_ns + (self._unit.busy_ns if isinstance(self._unit, BusyUnit) else 0)

    @property
    def left_out(self) -> Mapping[str, int]:
        """Return what the unit counts."""
        return self._unit.left_out if isinstance(self._unit, SelectiveUnit) else {}

    def follow(self, inputs: Sequence[tuple[StreamGenerator, Policy]]) -> None:
        """Begin to read the inputs, each under its own policy."""
        self.output.depth = 1 + max(stream.depth for stream, _ in inputs)
        for index, (stream, policy) in enumerate(inputs):
            update = self._update if len(inputs) == 1 else partial(self._update, index)
            if nests(self.output):
                self.read(stream, partial(self._consume, update), policy)
            else:
                self.read(stream, Relay(partial(self._answer, update), self.output), policy)

    def _consume(self, update: Update, sample: Sample[Any]) -> None:
        output = self.output
        for answer in self._answer(update, sample):
            if not output.is_closed:  # a reader of the first answer may remove this process
                output.publish(answer)

    def _answer(self, update: Update, sample: Sample[Any]) -> tuple[Sample[Any], ...]:
        """Feed a sample to the unit."""
        self.updates += 1
        return self._timed(update, sample)

    def _advance(self, available_us: int) -> None:
        if self._tell is not None:
            deliver(self.output, self._timed(self._tell, available_us))

    def _flush(self) -> None:
        deliver(self.output, self._timed(lambda _: self._unit.finish(), None))

    def _timed(self, code: Callable[[Any], Samples], argument: Any) -> tuple[Sample[Any], ...]:  # Any: see `Samples`
        started_ns = self._clock()
        results = tuple(code(argument))
        self._busy_ns += self._clock() - started_ns
        return results
