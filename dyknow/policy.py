"""Which samples does a subscriber want? A policy: declarative constraints on the stream it receives.

Each subscriber states its own policy, so two subscribers to one generator may see different streams. A policy is a
pure function of the samples offered so far; the three steps always run in the order *order, cause, delay*.
"""

from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum
from typing import Any

from dyknow.errors import PolicyError
from dyknow.sample import Sample


class Cause(Enum):
    """Name what makes a sample worth delivering."""

    ANY_UPDATE = "any update"
    ANY_CHANGE = "any change"


class Order(Enum):
    """Name the order of valid times that a subscriber relies on."""

    ANY = "any order"
    MONOTONE = "monotone order"
    STRICT = "strict order"


@dataclass(frozen=True, slots=True)
class Policy:
    """State what a subscriber wants of a stream.

    Attributes
    ----------
    cause : every sample, or only those whose value differs from the last one delivered.
    order : late samples are dropped, never reordered; ``STRICT`` also drops a repeated valid time.
    max_delay_us : samples that arrive later than this after their valid time are dropped; None accepts any delay.

    Raises
    ------
    PolicyError
        If ``max_delay_us`` is negative.
    """

    cause: Cause = Cause.ANY_UPDATE
    order: Order = Order.ANY
    max_delay_us: int | None = None

    def __post_init__(self) -> None:
        if self.max_delay_us is not None and self.max_delay_us < 0:
            raise PolicyError(f"policy: max_delay_us must be None or >= 0 us, got {self.max_delay_us!r}")


class PolicyFilter:
    """Decide sample by sample what one subscriber receives, and count why the rest was dropped.

    Examples
    --------
    >>> strict = PolicyFilter(Policy(order=Order.STRICT))
    >>> [strict.admits(Sample(t, t, "x")) for t in (10, 20, 20, 15, 30)]
    [True, True, False, False, True]
    >>> strict.dropped
    {'order': 2}
    """

    __slots__ = ("_last_valid_us", "_last_value", "dropped", "policy")

    def __init__(self, policy: Policy) -> None:
        self.policy = policy
        self.dropped: dict[str, int] = {}
        self._last_valid_us: int | None = None
        self._last_value: object = _NOTHING

    def admits(self, sample: Sample[Any]) -> bool:  # Any: a stream may carry any value
        """Tell whether the subscriber receives this sample; remember it if so."""
        cause = self._first_objection(sample)
        if cause is not None:
            self.dropped[cause] = self.dropped.get(cause, 0) + 1
            return False
        self._last_valid_us = sample.valid_us
        self._last_value = sample.value
        return True

    def _first_objection(self, sample: Sample[Any]) -> str | None:
        policy, last_us = self.policy, self._last_valid_us
        if policy.order is not Order.ANY and last_us is not None and _is_out_of_order(policy, last_us, sample.valid_us):
            return "order"
        if policy.cause is Cause.ANY_CHANGE and self._last_value is not _NOTHING and self._last_value == sample.value:
            return "no change"
        if policy.max_delay_us is not None and sample.delay_us > policy.max_delay_us:
            return "delay"
        return None


def _is_out_of_order(policy: Policy, last_us: int, valid_us: int) -> bool:
    return valid_us < last_us or (policy.order is Order.STRICT and valid_us == last_us)


_NOTHING = object()

Consumer = Callable[[Sample[Any]], None]
