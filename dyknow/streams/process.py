"""How does one stream become another? Processes read streams under policies and publish to a stream of their own.

There are four kinds, after Heintz (2009), chapter 3: *primitive* processes are sources, which the host feeds;
*refinement* feeds its inputs to a computational unit; *mediation* (`dyknow.streams.mediation`) passes on a changing
set of streams; *configuration* (`dyknow.streams.configuration`) creates and removes processes.

A computational unit is a value-in, values-out object with its own state: it may answer a sample with none, one, or
several samples, or with `NOT_YET` (still starting up): then it *owes* the answer, and gives it with a later one or at
the end. Answers may be made while they are taken: each is delivered, with all that comes of it, before the next one is
asked for. Units know nothing of labels, policies or each other.
"""

from collections import deque
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from functools import partial
from typing import Any, Protocol, TypeVar, runtime_checkable

from dyknow.policies.policy import Policy
from dyknow.sample import NOT_YET, Sample
from dyknow.streams.stream import Consumer, Relay, StreamGenerator, Subscription, deliver, exhaust

Clock = Callable[[], int]
Samples = Iterable[Sample[Any]]  # Any: a stream may carry any value
Update = Callable[[Sample[Any]], Samples]
_Result = TypeVar("_Result")


class ComputationalUnit(Protocol):
    """Turn samples of one stream into samples."""

    def update(self, sample: Sample[Any]) -> Samples:
        """Take one input sample; return the output samples it causes, oldest first, or `NOT_YET`."""
        ...

    def finish(self) -> Samples:
        """Return what was held back, at the end of the input."""
        ...


class JoiningUnit(Protocol):
    """Turn samples of several streams into samples."""

    def update(self, index: int, sample: Sample[Any], /) -> Samples:
        """Take one sample of the input with this index; return the samples it causes, oldest first, or `NOT_YET`."""
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
    busy_ns : time spent inside its code, without the time of its subscribers, by the clock of the node.
    """

    def __init__(self, output: StreamGenerator, *, kind: str = "source") -> None:
        self.kind = kind
        self.output = output
        self.inputs: list[Input] = []
        self.is_finished = False
        self.updates = 0
        self.busy_ns = 0

    @property
    def label(self) -> str:
        """Return the label of the process and of its stream."""
        return self.output.label

    @property
    def left_out(self) -> Mapping[str, int]:
        """Return by cause what the code of the process took in and made nothing of."""
        return {}

    @property
    def owes_from_us(self) -> int | None:
        """Return the valid time of the first sample to which its code owes an answer; None if there is none."""
        return None

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
        exhaust(self.finish_in_steps())

    def finish_in_steps(self) -> Iterator[None]:
        """Do what `finish` does, and give the control back as `StreamGenerator.publish_in_steps` does."""
        if not self.is_finished:
            self.is_finished = True
            try:
                yield from self._flush()
            finally:  # the end is told once: who failed is not asked again
                self.output.finish()

    def forgive(self) -> None:
        """Let go what the code of the process owes: it is not asked for it at the end."""

    def close(self) -> None:
        """Stop to read, and publish what the process and the policies around it hold back."""
        with ExitStack() as steps:  # each is taken, last one first, also when another one fails
            steps.callback(self.finish)
            for one in reversed(self.inputs):
                steps.callback(self.stop_reading, one)

    def _advance(self, available_us: int) -> None:
        """Publish what the time releases."""

    def _flush(self) -> Iterator[None]:
        """Publish what the process holds back."""
        return iter(())


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
        self._owed_us: deque[int] = deque()  # valid times of the samples that the unit will answer later
        self._is_forgiven = False

    @property
    def left_out(self) -> Mapping[str, int]:
        """Return what the unit counts."""
        return self._unit.left_out if isinstance(self._unit, SelectiveUnit) else {}

    @property
    def owes_from_us(self) -> int | None:
        """Return the valid time of the first sample to which the unit owes an answer; None if there is none."""
        return self._owed_us[0] if self._owed_us else None

    def follow(self, inputs: Sequence[tuple[StreamGenerator, Policy]]) -> None:
        """Begin to read the inputs, each under its own policy."""
        for index, (stream, policy) in enumerate(inputs):
            update = self._update if len(inputs) == 1 else partial(self._update, index)
            self.read(stream, Relay(partial(self._answer, update), self.output), policy)

    def forgive(self) -> None:
        """Let go what the unit owes: it is not told the end."""
        self._is_forgiven = bool(self._owed_us)

    def _answer(self, update: Update, sample: Sample[Any]) -> Samples:
        """Feed a sample to the unit."""
        self.updates += 1
        answers = self._timed(update, sample)
        if answers is NOT_YET:
            self._owed_us.append(sample.valid_us)
            return ()
        return self._given(answers)

    def _advance(self, available_us: int) -> None:
        if self._tell is not None:
            exhaust(deliver(self.output, self._made(self._timed(self._tell, available_us))))

    def _flush(self) -> Iterator[None]:
        if not self._is_forgiven:
            yield from deliver(self.output, self._given(self._timed(self._unit.finish)))

    def _given(self, answers: Samples) -> Samples:
        """Give the answers; with the last of them the unit owes nothing any more."""
        if not self._owed_us and isinstance(answers, list | tuple):  # the usual answer, and quick
            return answers
        return self._paid(answers)

    def _paid(self, answers: Samples) -> Iterator[Sample[Any]]:
        owed_us = self._owed_us
        for answer in self._made(answers):
            yield answer  # and go on when it has been delivered with all that comes of it
            while owed_us and owed_us[0] <= answer.valid_us:
                owed_us.popleft()
        owed_us.clear()

    def _made(self, answers: Samples) -> Iterator[Sample[Any]]:
        """Take answers out of the unit, each when it is asked for: it may be made only then."""
        left = iter(answers)
        while (answer := self._timed(next, left, None)) is not None:
            yield answer

    def _timed(self, code: Callable[..., _Result], *arguments: Any) -> _Result:  # Any: see `Samples`
        started_ns = self._clock()
        result = code(*arguments)
        self.busy_ns += self._clock() - started_ns
        return result
