"""Which samples does a subscriber want? A policy: declarative constraints on the stream it receives.

Each subscriber states its own policy, so two subscribers to one generator may see different streams. There are five
families of constraints, after Heintz (2009), chapter 4 (cause, approximation, delay, duration, order); what they do
to samples, and in which order, is `dyknow.policies.policy_pipeline`.
"""

from dataclasses import dataclass
from enum import Enum

from dyknow.errors import PolicyError
from dyknow.language.durations import format_duration


@dataclass(frozen=True, slots=True)
class AnyUpdate:
    """Deliver a sample for every sample that comes."""

    def __str__(self) -> str:
        return "any update"


@dataclass(frozen=True, slots=True)
class AnyChange:
    """Deliver a sample only when its value differs from the last one delivered; the first always counts.

    Values differ as `dyknow.policies.policy_pipeline` says: by ``==``, and arrays by any of their elements.
    """

    def __str__(self) -> str:
        return "any change"


@dataclass(frozen=True, slots=True)
class SampleEvery:
    """Deliver the value at regular valid times, taken by the policy's approximation.

    Raises
    ------
    PolicyError
        If the period is not positive.
    """

    period_us: int

    def __post_init__(self) -> None:
        if type(self.period_us) is not int or self.period_us <= 0:
            raise PolicyError(f"policy: the period of 'sample every' must be > 0 us, got {self.period_us!r}")

    def __str__(self) -> str:
        return f"sample every {format_duration(self.period_us)}"


Cause = AnyUpdate | AnyChange | SampleEvery


class Approximation(Enum):
    """Name the value of a fluent at a time for which there is no sample: unknown, the last one, or in between."""

    NONE = "no approximation"
    MOST_RECENT = "use most recent"
    LINEAR = "linear interpolation"


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
    cause : what makes a sample worth delivering.
    approximation : the value at sampled times; read by `SampleEvery` and by a synchroniser.
    max_delay_us : no sample is delivered later than this after its valid time; None accepts any delay.
    from_us, to_us : the first and the last valid time that is delivered, both included; None does not limit.
    oldest_us : on subscription, also deliver stored samples whose valid time is at most this long ago.
    order : late samples are dropped, never reordered; ``STRICT`` also drops a repeated valid time.

    Raises
    ------
    PolicyError
        If a part is of another type, if a duration is negative, if ``from_us`` is after ``to_us``, or if no sample
        could ever be delivered: the value at a sampled time is settled by what comes after it in order, or by its
        delay; without order and with any delay it never is.

    Examples
    --------
    >>> print(Policy(SampleEvery(200_000), Approximation.MOST_RECENT, max_delay_us=400_000, order=Order.STRICT))
    sample every 200ms, use most recent, max delay 400ms, strict order
    >>> print(Policy())
    any update
    """

    cause: Cause = AnyUpdate()
    approximation: Approximation = Approximation.NONE
    max_delay_us: int | None = None
    from_us: int | None = None
    to_us: int | None = None
    oldest_us: int | None = None
    order: Order = Order.ANY

    def __post_init__(self) -> None:
        for family, value, kind in (
            ("cause", self.cause, Cause),
            ("approximation", self.approximation, Approximation),
            ("order", self.order, Order),
        ):
            if not isinstance(value, kind):
                raise PolicyError(f"policy: expected {family} to be of type {kind}, got {value!r}")
        times_us = {name: getattr(self, name) for name in ("max_delay_us", "from_us", "to_us", "oldest_us")}
        for name, us in times_us.items():
            if us is not None and type(us) is not int:  # nor a float, which would make times that are not exact
                raise PolicyError(f"policy: {name} must be None or a whole number of us, got {us!r}")
        for name, us in (("max_delay_us", self.max_delay_us), ("oldest_us", self.oldest_us)):
            if us is not None and us < 0:
                raise PolicyError(f"policy: {name} must be None or >= 0 us, got {us!r}")
        if self.from_us is not None and self.to_us is not None and self.from_us > self.to_us:
            raise PolicyError(f"policy: from_us must be <= to_us, got {self.from_us!r} and {self.to_us!r}")
        if isinstance(self.cause, SampleEvery) and self.order is Order.ANY and self.max_delay_us is None:
            raise PolicyError(
                f"policy: {self.cause} must have a max delay or an order to settle its values, got neither"
            )

    def __str__(self) -> str:
        """Write the policy in the words of KPL, without what is the default; never empty."""
        constraints = [str(self.cause)]
        if self.approximation is not Approximation.NONE:
            constraints.append(self.approximation.value)
        if self.max_delay_us is not None:
            constraints.append(f"max delay {format_duration(self.max_delay_us)}")
        limits = (("from", self.from_us), ("to", self.to_us))
        duration = " ".join(f"{word} {format_duration(us)}" for word, us in limits if us is not None)
        if duration:
            constraints.append(duration)
        if self.oldest_us is not None:
            constraints.append(f"oldest {format_duration(self.oldest_us)}")
        if self.order is not Order.ANY:
            constraints.append(self.order.value)
        return ", ".join(constraints)

    @property
    def delivers_everything(self) -> bool:
        """Tell whether every sample passes unchanged, so that no state need be kept."""
        limits = (self.max_delay_us, self.from_us, self.to_us)
        return isinstance(self.cause, AnyUpdate) and self.order is Order.ANY and limits == (None, None, None)
