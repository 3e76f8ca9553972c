"""What comes out when I put this in? Short ways to try a policy on literal samples."""

from collections.abc import Iterable
from typing import Any

from dyknow.policies.policy import Policy
from dyknow.policies.policy_pipeline import PolicyPipeline
from dyknow.sample import Sample


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
