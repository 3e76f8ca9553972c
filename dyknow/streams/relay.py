"""How do samples get through a long chain of processes? Without nesting calls, in the order that nested calls have.

A process calls its subscribers, which call theirs: the quickest way, but each hop nests a few calls, and Python has
room for some hundred hops. So only the first processes of a chain do so (`nests`). Those behind them answer a sample
with samples instead of publishing, and one loop delivers these, depth first: all that comes of the first answer
before the second one, all that comes of one subscriber before the next one is served.
"""

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any, Final

from dyknow.streams.sample import Sample
from dyknow.streams.stream import StreamGenerator, Subscription

NESTED_HOPS: Final = 50
"""How many processes behind each other call each other: some 150 calls of the 1,000 that Python nests."""

Answer = Callable[[Sample[Any]], Sequence[Sample[Any]]]  # Any: a stream may carry any value


def nests(stream: StreamGenerator) -> bool:
    """Tell whether the process that publishes this stream may call its subscribers."""
    return stream.depth <= NESTED_HOPS


@dataclass(frozen=True, slots=True)
class Relay:
    """Consume samples for a process that is far from its sources.

    Attributes
    ----------
    answer : the samples that one sample causes; publishes nothing itself.
    output : the stream they go to.

    Examples
    --------
    >>> doubled, seen = StreamGenerator("doubled"), []
    >>> _ = doubled.subscribe(lambda sample: seen.append(sample.value))
    >>> Relay(lambda sample: [Sample(0, 0, 2 * sample.value)], doubled)(Sample(0, 0, 21))
    >>> seen
    [42]
    """

    answer: Answer
    output: StreamGenerator

    def __call__(self, sample: Sample[Any]) -> None:
        """Answer a sample and deliver what comes of it, for a caller that knows nothing of relays."""
        deliver(self.output, self.answer(sample))


def deliver(stream: StreamGenerator, samples: Iterable[Sample[Any]]) -> None:
    """Publish samples one after another, each with all that comes of it, until the stream is closed.

    Raises
    ------
    StreamError
        If a stream was finished.
    """
    waiting = [_deliveries(stream, samples)]
    while waiting:
        for subscription, sample in waiting[-1]:
            subscription.delivered += 1
            consumer = subscription.consumer
            if not isinstance(consumer, Relay):
                consumer(sample)
            elif answers := consumer.answer(sample):
                waiting.append(_deliveries(consumer.output, answers))
                break
        else:
            waiting.pop()


def _deliveries(stream: StreamGenerator, samples: Iterable[Sample[Any]]) -> Iterator[tuple[Subscription, Sample[Any]]]:
    """Say who gets what; lazily, for each delivery may end subscriptions and close streams."""
    for sample in samples:
        if stream.is_closed:
            return
        for subscription in stream.take_in(sample):
            for passed in subscription.passed(sample):
                if subscription.is_open:
                    yield subscription, passed
