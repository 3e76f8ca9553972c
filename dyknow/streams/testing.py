"""What comes out when I put this in? Short ways to try a policy or a computational unit on literal samples."""

from collections.abc import Iterable
from typing import Any

from dyknow.policies.policy import Policy
from dyknow.policies.policy_pipeline import PolicyPipeline
from dyknow.sample import Sample
from dyknow.streams.process import ComputationalUnit


def samples_of(*rows: tuple[int, int, Any]) -> list[Sample[Any]]:  # Any: a stream may carry any value
    """Write samples as rows of available time, valid time and value.

    Examples
    --------
    >>> samples_of((40_000, 0, "near"))
    [Sample(available_us=40000, valid_us=0, value='near')]
    """
    return [Sample(*row) for row in rows]


def under(policy: Policy, samples: Iterable[Sample[Any]], *, told_us: int | None = None) -> list[Sample[Any]]:
    """Give what a subscriber with this policy receives of a whole stream.

    Parameters
    ----------
    told_us : the time that is told after the last sample, before the stream ends; None tells none.

    Examples
    --------
    >>> from dyknow.policies.policy import AnyChange
    >>> [one.value for one in under(Policy(AnyChange()), samples_of((0, 0, "a"), (1, 1, "a"), (2, 2, "b")))]
    ['a', 'b']
    """
    pipeline = PolicyPipeline(policy)
    received = [one for sample in samples for one in pipeline.offer(sample)]
    if told_us is not None:
        received += pipeline.advance(told_us)
    return [*received, *pipeline.finish()]


def answers(unit: ComputationalUnit, samples: Iterable[Sample[Any]]) -> list[Sample[Any]]:
    """Give what a unit makes of a whole stream.

    Examples
    --------
    >>> class Doubling:
    ...     def update(self, sample):
    ...         return [Sample(sample.available_us, sample.valid_us, 2 * sample.value)]
    ...     def finish(self):
    ...         return []
    >>> [one.value for one in answers(Doubling(), samples_of((0, 0, 1), (1, 1, 4)))]
    [2, 8]
    """
    received = [one for sample in samples for one in unit.update(sample)]
    return [*received, *unit.finish()]


class Recorder:
    """Keep the samples that a subscription delivers.

    Examples
    --------
    >>> from dyknow.node import Node
    >>> node, seen = Node(), Recorder()
    >>> source = node.add_source("pos[car1]")
    >>> _ = node.subscribe("pos[car1]", seen)
    >>> source.publish(Sample(0, 0, 1.5))
    >>> seen.values
    [1.5]
    """

    def __init__(self) -> None:
        self.samples: list[Sample[Any]] = []

    def __call__(self, sample: Sample[Any]) -> None:
        """Keep a sample."""
        self.samples.append(sample)

    @property
    def values(self) -> list[Any]:
        """Return the values that came, in order."""
        return [sample.value for sample in self.samples]
