"""What is the value of one fluent at regular times, out of samples that come at any time?

Between two sampled times only few samples can matter: the last one for `use most recent`, the first and the last one
for `linear interpolation`, and only those at the sampled times themselves for `no approximation`. The rest is dropped
when it comes, so memory does not depend on how fast the samples come.
"""

from bisect import bisect_left, bisect_right
from collections.abc import Mapping
from numbers import Real
from typing import Any

from dyknow.errors import PolicyError
from dyknow.policies.policy import Approximation, Order
from dyknow.sample import NO_VALUE, Sample

_NEVER_US = 2**80  # after everything, and negated before; an int, so that times stay ints in every comparison

# How many samples after one sampled time and up to the next can matter; without approximation only an exact one does.
_NEEDED: Mapping[Approximation, int] = {Approximation.NONE: 0, Approximation.MOST_RECENT: 1, Approximation.LINEAR: 2}


class SampledFluent:
    """Keep the samples of one fluent that sampled times may still need.

    Of several samples with the same valid time the first one counts: a value at a sampled time may have left already
    when the others come, and it is never revised.

    Parameters
    ----------
    start_us, period_us : sampled times are ``start_us + k * period_us``, k = 0, 1, ...
    order : what the samples are known to keep; with ``ANY`` only an exact sample or a promise settles a time.
    from_us, to_us : sampled times are not before the one nor after the other; None does not limit. A sample outside
        can still be the nearest one of a sampled time; of one that is not, this is the cause.

    Attributes
    ----------
    settled_us : nothing that comes later changes the value at or before this time.
    dropped : samples that never served a sampled time, by cause; after `finish` each sample has served or is here.

    Examples
    --------
    >>> height = SampledFluent(Approximation.LINEAR, Order.STRICT, start_us=0, period_us=100)
    >>> for t_us, value in ((0, 1.0), (20, 8.0), (40, 9.0), (50, 2.0), (150, 4.0)):
    ...     height.insert(Sample(t_us, t_us, value))
    >>> height.is_settled(100), height.is_settled(200), height.dropped
    (True, False, {'not sampled': 1})
    >>> height.take(0), height.take(100), height.take(200)
    (1.0, 3.0, no_value)
    >>> height.finish()
    >>> height.dropped  # of 20 and 40; the others were taken, or a neighbour
    {'not sampled': 2}
    """

    def __init__(
        self,
        approximation: Approximation,
        order: Order,
        *,
        start_us: int,
        period_us: int,
        from_us: int | None = None,
        to_us: int | None = None,
    ) -> None:
        self._approximation = approximation
        self._is_ordered = order is not Order.ANY
        self._needed = _NEEDED[approximation]
        self._start_us = start_us
        self._period_us = period_us
        self._from_us = -_NEVER_US if from_us is None else from_us
        self._to_us = _NEVER_US if to_us is None else to_us
        self._last_us = self._time_from(self._to_us + 1) - period_us
        # No time before the start is taken, so of the samples before it only the newest is needed.
        self._taken_us = start_us - period_us
        self._has_taken = False
        self._times_us: list[int] = []  # ascending, without repetition; the two below go with it
        self._values: list[Any] = []  # Any: fluents have values of any type
        self._has_served: list[bool] = []
        self.settled_us = -_NEVER_US
        self.dropped: dict[str, int] = {}

    def __len__(self) -> int:
        """Return how many samples are held."""
        return len(self._times_us)

    def insert(self, sample: Sample[Any]) -> None:
        """Take a sample in; drop the one that is not needed beside it, if there is such."""
        valid_us = sample.valid_us
        if valid_us <= self.settled_us:
            self._drop("repeated" if self._has(valid_us) else "late")
            return
        times_us = self._times_us
        at = len(times_us) if not times_us or valid_us > times_us[-1] else bisect_left(times_us, valid_us)
        if at < len(times_us) and times_us[at] == valid_us:
            self._drop("repeated")
        else:
            self._place(at, valid_us, sample.value)
        if self._is_ordered:
            self.settled_us = valid_us

    def promise(self, valid_us: int) -> None:
        """Take the producer's word that it says nothing more about this time or earlier.

        It settles nothing under linear interpolation, which needs to know what comes next.
        """
        if self._approximation is not Approximation.LINEAR:
            self.settled_us = max(self.settled_us, valid_us)

    def is_settled(self, t_us: int) -> bool:
        """Tell whether nothing that comes later changes the value at a sampled time."""
        return t_us <= self.settled_us or (not self._is_ordered and self._has(t_us))

    def take(self, t_us: int) -> Any:  # Any: see above
        """Give the value at a sampled time, and forget what no later time needs; times must increase."""
        at = self.forget(t_us)
        times_us, values = self._times_us, self._values
        if at < 0:
            return NO_VALUE
        if times_us[0] == t_us or self._approximation is Approximation.MOST_RECENT:
            self._has_served[0] = True
            return values[0]
        if self._approximation is Approximation.NONE or len(times_us) == 1:
            return NO_VALUE
        self._has_served[:2] = True, True
        return _between(times_us, values, t_us)

    def forget(self, t_us: int) -> int:
        """Forget what no time from this one on needs; return the position of the most recent sample, 0, or -1."""
        at = bisect_right(self._times_us, t_us) - 1
        self._taken_us, self._has_taken = t_us, True
        if at > 0:
            self._forget_before(at)
        return min(at, 0)

    def finish(self) -> None:
        """Count what still waits for a sampled time: none comes any more."""
        self._forget_before(len(self._times_us))

    def _forget_before(self, end: int) -> None:
        for k in range(end):
            if not self._has_served[k]:
                self._drop(self._useless(self._times_us[k]))
        del self._times_us[:end], self._values[:end], self._has_served[:end]

    def _place(self, at: int, valid_us: int, value: Any) -> None:  # Any: see above
        """Put a sample before position ``at``, or in place of one that it makes useless, or drop it."""
        after_us, until_us, needed = self._gap(valid_us)
        first, end = bisect_right(self._times_us, after_us), bisect_right(self._times_us, until_us)
        if end - first < needed:
            self._times_us.insert(at, valid_us)
            self._values.insert(at, value)
            self._has_served.insert(at, False)
        elif needed and at == end and until_us != _NEVER_US:  # the new last one
            self._replace(at - 1, valid_us, value)
        elif at == first and (needed == 2 or (needed and until_us == _NEVER_US)):  # the new first one
            self._replace(at, valid_us, value)
        else:
            self._drop("late" if until_us == self._taken_us and self._has_taken else self._useless(valid_us))

    def _gap(self, valid_us: int) -> tuple[int, int, int]:
        """Say after which time and up to which a sample competes with others, and how many of them are needed."""
        next_us = self._time_from(valid_us)
        if next_us <= self._taken_us:  # late, but perhaps still the most recent sample
            return -_NEVER_US, self._taken_us, min(self._needed, 1)
        if valid_us > self._last_us:  # between it and a sampled time only the first one can be needed
            return self._last_us, _NEVER_US, self._needed // 2 if self._taken_us < self._last_us else 0
        return next_us - self._period_us, next_us, max(self._needed, 1) if valid_us == next_us else self._needed

    def _time_from(self, us: int) -> int:
        """Return the first sampled time that is not before a time."""
        return self._start_us - (self._start_us - us) // self._period_us * self._period_us

    def _replace(self, at: int, valid_us: int, value: Any) -> None:  # Any: see above
        if not self._has_served[at]:
            self._drop(self._useless(self._times_us[at]))
        self._times_us[at] = valid_us
        self._values[at] = value
        self._has_served[at] = False

    def _useless(self, valid_us: int) -> str:
        """Name the cause for which a sample is dropped that is not the nearest one of any sampled time."""
        return "not sampled" if self._from_us <= valid_us <= self._to_us else "duration"

    def _drop(self, cause: str) -> None:
        self.dropped[cause] = self.dropped.get(cause, 0) + 1

    def _has(self, valid_us: int) -> bool:
        at = bisect_left(self._times_us, valid_us)
        return at < len(self._times_us) and self._times_us[at] == valid_us


def _between(times_us: list[int], values: list[Any], t_us: int) -> Any:  # Any: see above
    """Interpolate between the first two samples."""
    (before_us, after_us), (before, after) = times_us[:2], values[:2]
    if before is NO_VALUE or after is NO_VALUE:
        return NO_VALUE
    share = (t_us - before_us) / (after_us - before_us)
    if isinstance(before, tuple) and isinstance(after, tuple) and len(before) == len(after):
        return tuple(_mix(a, b, share) for a, b in zip(before, after, strict=True))
    return _mix(before, after, share)


def _mix(before: Any, after: Any, share: float) -> Any:  # Any: see above
    numbers = (before, after)
    if not all(isinstance(one, Real) and not isinstance(one, bool) for one in numbers):
        raise PolicyError(
            f"linear interpolation: expected numbers, or tuples of them of one length, got {before!r} and {after!r}"
        )
    return before + (after - before) * share
