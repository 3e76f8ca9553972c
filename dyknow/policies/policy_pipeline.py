"""What does a policy do to a stream? Four rules, one after another, for one subscriber.

1. *Duration*: a sample whose valid time lies outside ``from_us`` to ``to_us`` is dropped. Under ``sample every`` it
   limits the times that are sampled instead: a sample before ``from_us`` may be the most recent one at such a time,
   one after ``to_us`` shows that nothing earlier comes, and may be a neighbour to interpolate to.
2. *Order*: a sample whose valid time is before that of the last one that passed is dropped; ``strict order`` also
   drops a sample of the same time. Nothing is ever reordered.
3. *Cause*: ``any update`` passes every sample; ``any change`` drops one whose value equals that of the last one
   delivered; ``sample every`` delivers values at regular times instead, taken by the approximation, each as soon as
   it is settled, or ``max_delay_us`` after its time (see `dyknow.policies.sampling`).
4. *Delay*: a sample that is available later than ``max_delay_us`` after its valid time is dropped, as if it had never
   come: neither order nor change compares anything with it. Sampled values meet their delay by rule 3.

The outcome is a function of the samples with their available times and of the policy. Time that is told in between
releases sampled values sooner, but changes neither them nor their available times.
"""

from collections.abc import Mapping, Sequence
from dataclasses import fields, is_dataclass
from typing import Any

from dyknow.errors import PolicyError
from dyknow.policies.policy import AnyChange, Order, Policy, SampleEvery
from dyknow.policies.sampled_fluent import SampledFluent
from dyknow.policies.sampling import Sampling
from dyknow.sample import Sample

_NOTHING = object()

Samples = Sequence[Sample[Any]]  # Any: a stream may carry any value


class PolicyPipeline:
    """Turn the samples of a stream into what one subscriber receives, and count why the rest was dropped.

    Attributes
    ----------
    dropped : ``duration``, ``order``, ``delay``, ``no change``; under ``sample every`` also ``not sampled`` (a sample
        nearer to each sampled time is there; ``duration`` if it lies outside), ``late`` and ``repeated``.

    Examples
    --------
    >>> from dyknow.policies.policy import Approximation
    >>> strict = PolicyPipeline(Policy(order=Order.STRICT))
    >>> [len(strict.offer(Sample(t, t, "x"))) for t in (10, 20, 20, 15, 30)]
    [1, 1, 0, 0, 1]
    >>> strict.dropped
    {'order': 2}
    >>> sampled = PolicyPipeline(Policy(SampleEvery(100), Approximation.MOST_RECENT, max_delay_us=50))
    >>> sampled.offer(Sample(100, 100, "a")), sampled.offer(Sample(180, 170, "b"))
    ([Sample(available_us=100, valid_us=100, value='a')], [])
    >>> sampled.advance(300)
    [Sample(available_us=250, valid_us=200, value='b')]
    """

    def __init__(self, policy: Policy) -> None:
        self.policy = policy
        self.dropped: dict[str, int] = {}
        self._last_valid_us: int | None = None
        self._last_value: object = _NOTHING
        self._period_us = policy.cause.period_us if isinstance(policy.cause, SampleEvery) else None
        self._sampling: Sampling | None = None  # begun by the first sample

    def offer(self, sample: Sample[Any]) -> Samples:
        """Take a sample; return what the subscriber receives now, oldest first."""
        passed = _unpacked(self._sampling.advance(sample.available_us)) if self._sampling else []
        cause = self._first_objection(sample)
        if cause is not None:
            self.dropped[cause] = self.dropped.get(cause, 0) + 1
            return passed
        self._last_valid_us = sample.valid_us
        if self._period_us is not None:
            self._sampling = self._sampling or _sampling(self.policy, self._period_us, sample, self.dropped)
            return [*passed, *_unpacked(self._sampling.push(0, sample))]
        if isinstance(self.policy.cause, AnyChange):
            if self._last_value is not _NOTHING and is_same(self._last_value, sample.value):
                self.dropped["no change"] = self.dropped.get("no change", 0) + 1
                return ()
            self._last_value = sample.value
        return (sample,)

    def advance(self, available_us: int) -> Samples:
        """Let time pass: nothing that became available before this time comes any more."""
        return _unpacked(self._sampling.advance(available_us)) if self._sampling else ()

    def finish(self) -> Samples:
        """Return what was held back, at the end of the stream."""
        return _unpacked(self._sampling.finish()) if self._sampling else ()

    def _first_objection(self, sample: Sample[Any]) -> str | None:
        policy, valid_us, last_us = self.policy, sample.valid_us, self._last_valid_us
        if self._period_us is None and not _is_within(policy, valid_us):
            return "duration"
        if last_us is not None and _is_out_of_order(policy.order, last_us, valid_us):
            return "order"
        # Before the rule of cause, so that a sample that is too late leaves no trace.
        if self._period_us is None and policy.max_delay_us is not None and sample.delay_us > policy.max_delay_us:
            return "delay"
        return None


def _is_within(policy: Policy, valid_us: int) -> bool:
    return (policy.from_us is None or policy.from_us <= valid_us) and (policy.to_us is None or valid_us <= policy.to_us)


def _is_out_of_order(order: Order, last_us: int, valid_us: int) -> bool:
    return order is not Order.ANY and (valid_us < last_us or (order is Order.STRICT and valid_us == last_us))


def _sampling(policy: Policy, period_us: int, first: Sample[Any], dropped: dict[str, int]) -> Sampling:
    """Begin to deliver the value of one stream at regular times.

    The times are ``from_us + k * period_us``, or multiples of the period where the policy does not say from when, so
    that two subscribers get the same times whenever they joined. The first is the earliest that is neither before the
    first sample or ``from_us``, nor too late to be delivered in time when that sample comes.
    """
    phase_us = policy.from_us or 0
    earliest_us = first.valid_us if policy.from_us is None else max(first.valid_us, policy.from_us)
    if policy.max_delay_us is not None:
        earliest_us = max(earliest_us, first.available_us - policy.max_delay_us)
    start_us = phase_us - (phase_us - earliest_us) // period_us * period_us
    fluent = SampledFluent(
        policy.approximation,
        policy.order,
        start_us=start_us,
        period_us=period_us,
        from_us=policy.from_us,
        to_us=policy.to_us,
    )
    fluent.dropped = dropped
    return Sampling(
        [fluent],
        start_us=start_us,
        period_us=period_us,
        max_delay_us=policy.max_delay_us,
        end_us=policy.to_us,
    )


def _unpacked(states: Samples) -> Samples:
    return [Sample(state.available_us, state.valid_us, state.value[0]) for state in states]


def is_same(before: Any, after: Any) -> bool:  # Any: a stream may carry any value
    """Tell whether two values of a stream are the same, as `any change` has it.

    What ``==`` calls equal is the same, so NaN never is. Arrays are the same if their shapes and all their elements
    are; so are they inside tuples, lists, mappings and dataclasses.

    Raises
    ------
    PolicyError
        If ``==`` gives neither true nor false, and the values are nothing of the above.

    Examples
    --------
    >>> import numpy as np
    >>> is_same(np.array([1, 2]), np.array([1, 2])), is_same(np.array([1, 2]), np.array([1, 2, 3]))
    (True, False)
    >>> is_same(("car1", np.array([1, 2])), ("car1", np.array([1, 3])))
    False
    """
    try:
        equal = before == after
        if equal is True or equal is False:
            return equal
        if _shape(equal) in (None, ()):  # a single answer, such as that of numbers out of arrays
            return bool(equal)
        return _shape(before) == _shape(after) and bool(equal.all())
    except (ValueError, TypeError) as error:  # arrays of different shapes, or something with arrays in it
        return _are_parts_same(before, after, error)


def _shape(value: Any) -> Any:  # Any: see above
    return getattr(value, "shape", None)


def _are_parts_same(before: Any, after: Any, error: Exception) -> bool:  # Any: see above
    if _shape(before) != _shape(after) or type(before) is not type(after):
        return False
    if isinstance(before, tuple | list):
        return len(before) == len(after) and all(map(is_same, before, after))
    if isinstance(before, Mapping):
        return before.keys() == after.keys() and all(is_same(before[key], after[key]) for key in before)
    if is_dataclass(before):
        compared = [field.name for field in fields(before) if field.compare]
        return all(is_same(getattr(before, name), getattr(after, name)) for name in compared)
    kind = type(before).__name__
    raise PolicyError(f"policy: 'any change' expected values that == compares, got {kind!r} and {error}") from error
