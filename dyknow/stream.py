"""Where do samples come from, and who gets them? A stream generator serves any number of subscribers.

Delivery is a plain function call, in the order of subscription: the order of everything in a node is a function of
its input, so a run can be repeated to the byte. Queues belong to the edges (the decoder thread, the network).
"""

from dataclasses import dataclass, field
from typing import Any

from dyknow.errors import StreamError
from dyknow.policy import Consumer, Policy, PolicyFilter
from dyknow.sample import Sample


@dataclass(slots=True, eq=False)
class Subscription:
    """Tie one consumer to one generator under one policy, and count what it received."""

    consumer: Consumer
    filter: PolicyFilter
    delivered: int = 0

    def offer(self, sample: Sample[Any]) -> None:
        """Hand the sample over if the policy admits it."""
        if self.filter.admits(sample):
            self.delivered += 1
            self.consumer(sample)


@dataclass(slots=True, eq=False)
class StreamGenerator:
    """Publish samples under one label to every subscriber.

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

    label: str
    published: int = 0
    last_valid_us: int | None = None
    subscriptions: list[Subscription] = field(default_factory=list)

    def subscribe(self, consumer: Consumer, policy: Policy = Policy()) -> Subscription:  # noqa: B008 - frozen value
        """Call ``consumer`` with every sample that ``policy`` admits from now on."""
        subscription = Subscription(consumer, PolicyFilter(policy))
        self.subscriptions.append(subscription)
        return subscription

    def unsubscribe(self, subscription: Subscription) -> None:
        """Stop delivering to a subscription.

        Raises
        ------
        StreamError
            If the subscription does not belong to this generator.
        """
        if subscription not in self.subscriptions:
            raise StreamError(f"stream {self.label!r}: expected one of its subscriptions, got another stream's")
        self.subscriptions.remove(subscription)

    def publish(self, sample: Sample[Any]) -> None:
        """Offer a sample to every subscriber, in the order in which they came."""
        self.published += 1
        self.last_valid_us = sample.valid_us
        # A copy: a consumer may subscribe or leave while it is being served.
        for subscription in tuple(self.subscriptions):
            subscription.offer(sample)
