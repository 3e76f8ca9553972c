"""Where do samples come from, and who gets them? A stream generator serves any number of subscribers.

Delivery is a plain function call, in the order of subscription: the order of everything in a node is a function of
its input, so a run can be repeated to the byte. Who wants to be asked instead of called opens a buffered stream.
What a consumer raises goes to whoever published; those who come after it do not get that sample.

A process answers a sample with samples, and one loop delivers these, depth first: all that comes of the first answer
before the second one, all that comes of one subscriber before the next one is served. That is the order which nested
calls would have, but a chain may be of any length, and whoever publishes can have the control back between two answers.
"""

from collections import Counter, deque
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from typing import Any

from dyknow.errors import StreamError
from dyknow.policies.policy import Policy
from dyknow.policies.policy_pipeline import PolicyPipeline
from dyknow.sample import Sample
from dyknow.streams.buffers import History, Stream, WhenFull

Consumer = Callable[[Sample[Any]], object]  # Any: a stream may carry any value; what comes back is not looked at

EVERYTHING = Policy()


class Subscription:
    """Tie one consumer to one generator under one policy, and count what it received.

    Attributes
    ----------
    reader : label of the process that reads; None for a reader outside the node.
    buffer : where the samples of a pulled stream wait.
    is_open : whether samples are still delivered.
    """

    __slots__ = ("buffer", "consumer", "delivered", "is_open", "pipeline", "policy", "reader")

    def __init__(
        self, consumer: Consumer, policy: Policy, *, reader: str | None = None, buffer: Stream | None = None
    ) -> None:
        self.consumer = consumer
        self.policy = policy
        self.reader = reader
        self.buffer = buffer
        self.delivered = 0
        self.is_open = True
        # A policy that lets everything pass is not asked: this is the usual hop, and it is quick.
        self.pipeline = None if policy.delivers_everything else PolicyPipeline(policy)

    def passed(self, sample: Sample[Any]) -> Iterable[Sample[Any]]:
        """Return what the policy makes of a sample, oldest first; nothing once the subscription has ended."""
        if not self.is_open:
            return ()
        return (sample,) if self.pipeline is None else self.pipeline.offer(sample)

    def advance(self, available_us: int) -> None:
        """Let time pass, which may release sampled values."""
        if self.pipeline is not None:
            self.deliver(self.pipeline.advance(available_us))

    def finish(self) -> None:
        """Hand over what the policy held back, at the end of the stream."""
        if self.pipeline is not None:
            self.deliver(self.pipeline.finish())

    def dropped(self) -> Counter[str]:
        """Count by cause what this subscriber was offered and did not get."""
        counts = Counter[str]()
        if self.pipeline is not None:
            counts.update(self.pipeline.dropped)
        if self.buffer is not None:  # an empty one is false
            counts.update(self.buffer.dropped)
        return counts

    def deliver(self, samples: Iterable[Sample[Any]]) -> None:
        """Hand samples over, as they are, until the subscription has ended."""
        for sample in samples:
            if not self.is_open:
                return
            self.delivered += 1
            self.consumer(sample)


class StreamGenerator:
    """Publish samples under one label to every subscriber.

    Attributes
    ----------
    published : samples published so far.
    last : the newest of them, if there is one.
    now_us : the latest available time that was told or published.
    is_open : whether samples are still published: it is neither finished nor closed.
    is_closed : whether every subscriber was let go.
    subscriptions : in the order in which they came; a new tuple whenever one joins or leaves.

    Examples
    --------
    >>> positions = StreamGenerator("pos[car1]")
    >>> received = []
    >>> subscription = positions.subscribe(lambda sample: received.append(sample.value))
    >>> positions.publish(Sample(0, 0, 1.5))
    >>> positions.unsubscribe(subscription)
    >>> positions.publish(Sample(1, 1, 2.5))
    >>> received, positions.published
    ([1.5], 2)
    """

    def __init__(self, label: str) -> None:
        self.label = label
        self.published = 0
        self.last: Sample[Any] | None = None
        self.is_open = True
        self.is_closed = False
        self.subscriptions: tuple[Subscription, ...] = ()
        self._departed_delivered = 0
        self._departed: Counter[str] = Counter()  # drops of subscriptions that have left
        self._first_us = 0
        self._told_us: int | None = None
        self._history: History | None = None

    @property
    def now_us(self) -> int | None:
        """Return the latest available time that was told or published; None before the first."""
        published_us = self.last.available_us if self.last else None
        return max((us for us in (self._told_us, published_us) if us is not None), default=None)

    @property
    def rate_hz(self) -> float:
        """Return how many samples a second became available, on average since the first; 0 before the second."""
        duration_us = self.last.available_us - self._first_us if self.last else 0
        return (self.published - 1) * 1e6 / duration_us if duration_us > 0 else 0.0

    @property
    def delivered(self) -> int:
        """Return how many samples were handed to subscribers, those that have left included."""
        return self._departed_delivered + sum(one.delivered for one in self.subscriptions)

    def dropped(self) -> dict[str, int]:
        """Count by cause what subscribers were offered and did not get, those that have left included."""
        total = Counter(self._departed)
        for subscription in self.subscriptions:
            total.update(subscription.dropped())
        if self._history is not None and self._history.overflowed:
            total["history full"] += self._history.overflowed
        return dict(total)

    def remember(self, duration_us: int, *, capacity: int = 100_000) -> None:
        """Store the samples of the last ``duration_us`` from now on, for subscribers that ask for the oldest.

        What was stored before is forgotten, and 0 stores nothing. ``capacity`` bounds the store whatever the rate.
        """
        self._forget()
        self._history = History(duration_us=duration_us, capacity=capacity) if duration_us else None

    def subscribe(self, consumer: Consumer, policy: Policy = EVERYTHING, *, reader: str | None = None) -> Subscription:
        """Call ``consumer`` with what ``policy`` makes of every sample from now on.

        A consumer that joins while a sample is delivered gets the next one. With ``oldest_us`` the stored samples of
        that age come first, before this method returns. Who asks for them before the first sample misses none: from
        then on they are stored, so that whoever asks as much later is not refused. After the end of the stream there
        are only stored samples. A consumer that raises before this method returns is not subscribed.

        Raises
        ------
        StreamError
            If the stream is closed, if the policy asks for older samples than are stored, or if ``consumer`` cannot
            be called or ``policy`` is none.
        """
        if not callable(consumer) or not isinstance(policy, Policy):
            raise StreamError(
                f"stream {self.label!r}: expected a consumer to call and a policy, got {consumer!r} and {policy!r}"
            )
        return self._join(Subscription(consumer, policy, reader=reader))

    def open(
        self, policy: Policy = EVERYTHING, capacity: int = 1_024, when_full: WhenFull = WhenFull.DROP_OLDEST
    ) -> Stream:
        """Open a stream to take samples from, instead of being called; see `subscribe`."""
        stream = Stream(self.label, capacity, when_full)
        subscription = self._join(Subscription(stream.accept, policy, buffer=stream))
        stream.leave_by(lambda: self._leave(subscription))
        return stream

    def unsubscribe(self, subscription: Subscription) -> None:
        """Stop delivering to a subscription, at once; what its policy still holds is not delivered.

        Raises
        ------
        StreamError
            If the subscription does not belong to this generator, or has ended.
        """
        if subscription not in self.subscriptions:
            came = "another stream's" if subscription.is_open else "one that has ended"
            raise StreamError(f"stream {self.label!r}: expected one of its subscriptions, got {came}")
        self._leave(subscription)

    def publish(self, sample: Sample[Any]) -> None:
        """Offer a sample to every subscriber, in the order in which they came.

        Raises
        ------
        StreamError
            If the stream is finished or closed.
        """
        exhaust(self.publish_in_steps(sample))

    def publish_in_steps(self, sample: Sample[Any]) -> Iterator[None]:
        """Do what `publish` does, and give the control back between two answers of a process.

        A process may answer one sample with many, and take its time for each. Take all steps before the next sample;
        whoever leaves off drops what has not been delivered.
        """
        self._refuse_if_over()
        return deliver(self, (sample,))

    def take_in(self, sample: Sample[Any]) -> tuple[Subscription, ...]:
        """Note that a sample is published; return those to offer it to.

        Joining and leaving replace the tuple, so these are the ones who were there when the sample came.
        """
        self._refuse_if_over()
        if self.published == 0:
            self._first_us = sample.available_us
        if self._history is not None:
            told_us = sample.available_us if self._told_us is None else self._told_us
            self._history.append(sample, now_us=max(sample.available_us, told_us))
        self.published += 1
        self.last = sample
        return self.subscriptions

    def _refuse_if_over(self) -> None:
        if not self.is_open:
            came = "a closed one" if self.is_closed else "one that was finished"
            raise StreamError(f"stream {self.label!r}: expected an open stream to publish to, got {came}")

    def advance(self, available_us: int) -> None:
        """Let time pass: nothing that became available before this time will be published any more."""
        self._told_us = available_us if self._told_us is None else max(self._told_us, available_us)
        for subscription in self.subscriptions:
            subscription.advance(available_us)

    def finish(self) -> None:
        """Hand over what the policies of the subscribers hold back: nothing can be published any more.

        Doing so again does nothing.
        """
        if self.is_open:
            self.is_open = False
            for subscription in self.subscriptions:
                subscription.finish()

    def close(self) -> None:
        """Let every subscriber go and refuse what comes after."""
        self.is_open = False
        self.is_closed = True
        self._forget()
        for subscription in self.subscriptions:
            self._leave(subscription)

    def _forget(self) -> None:
        if self._history is not None and self._history.overflowed:
            self._departed["history full"] += self._history.overflowed
        self._history = None

    def _join(self, subscription: Subscription) -> Subscription:
        if self.is_closed:
            raise StreamError(f"stream {self.label!r}: expected an open stream to subscribe to, got a closed one")
        stored = self._stored(subscription.policy.oldest_us)
        self.subscriptions = (*self.subscriptions, subscription)
        try:
            for sample in stored:
                subscription.deliver(subscription.passed(sample))
            if not self.is_open:
                subscription.finish()
        except BaseException:  # its caller gets no subscription that could be ended
            self._leave(subscription)
            raise
        return subscription

    def _stored(self, oldest_us: int | None) -> Iterable[Sample[Any]]:
        """Give the samples that a new subscriber asks for."""
        if oldest_us is None:
            return ()
        kept_us = self._history.duration_us if self._history is not None else 0
        if self.last is None:
            # Nothing was missed. Who asks as much later is not refused either: it must not depend on the moment.
            if kept_us < oldest_us:
                self.remember(oldest_us)
            return ()
        if kept_us < oldest_us:
            raise StreamError(
                f"stream {self.label!r}: expected to remember at least {oldest_us!r} us for 'oldest', "
                f"got {kept_us!r} us"
            )
        return self._history.since((self.now_us or 0) - oldest_us) if self._history is not None else ()

    def _leave(self, subscription: Subscription) -> None:
        if not subscription.is_open:
            return
        subscription.is_open = False
        self.subscriptions = tuple(one for one in self.subscriptions if one is not subscription)
        self._departed_delivered += subscription.delivered
        self._departed.update(subscription.dropped())


Answer = Callable[[Sample[Any]], Iterable[Sample[Any]]]


@dataclass(frozen=True, slots=True)
class Relay:
    """Consume samples for a process: answer each with samples, which the loop of `deliver` publishes.

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
        exhaust(deliver(self.output, self.answer(sample)))


def deliver(stream: StreamGenerator, samples: Iterable[Sample[Any]]) -> Iterator[None]:
    """Publish samples one after another, each with all that comes of it, until the stream is closed.

    Yields
    ------
    Nothing, between two answers of one process, so that whoever delivers can do something else, or leave off.

    Raises
    ------
    StreamError
        If a stream was finished.
    """
    waiting = [_deliveries(stream, samples)]
    while waiting:
        for delivery in waiting[-1]:
            if delivery is None:
                yield
                continue
            subscription, sample = delivery
            subscription.delivered += 1
            consumer = subscription.consumer
            if not isinstance(consumer, Relay):
                consumer(sample)
            elif answers := consumer.answer(sample):
                waiting.append(_deliveries(consumer.output, answers))
                break
        else:
            waiting.pop()


def exhaust(steps: Iterable[None]) -> None:
    """Take all steps at once."""
    deque(steps, maxlen=0)


def _deliveries(
    stream: StreamGenerator, samples: Iterable[Sample[Any]]
) -> Iterator[tuple[Subscription, Sample[Any]] | None]:
    """Say who gets what, None between two samples; lazily, for each delivery may end subscriptions, close streams."""
    is_first = True
    for sample in samples:
        if not is_first:
            yield None
        is_first = False
        if stream.is_closed:
            return
        for subscription in stream.take_in(sample):
            for passed in subscription.passed(sample):
                if subscription.is_open:
                    yield subscription, passed
