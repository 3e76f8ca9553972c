"""What does a stream carry? Samples: a value, when it holds and when it could be known.

After Heintz (2009), chapters 3 and 4: a fluent stream approximates a fluent by samples ``<available, valid, value>``.
Where a time was asked for and nothing is known of it, a sample says so with `NO_VALUE`. *No sample* is no value at all:
it is an empty answer, such as `()`, or `NOT_YET` where the answer is still to come.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from enum import Enum
from typing import Final, Generic, Never, TypeVar

Value_co = TypeVar("Value_co", covariant=True)


class NoValue(Enum):
    """The type of `NO_VALUE`; an enumeration of one, so that copies and pickles are still the same object."""

    NO_VALUE = "no_value"

    def __repr__(self) -> str:
        return "no_value"

    __str__ = __repr__


NO_VALUE: Final = NoValue.NO_VALUE
"""What a fluent has at a time of which nothing is known: compare with ``is``."""


class NotYet(Enum):
    """The type of `NOT_YET`: an answer without samples."""

    NOT_YET = "not yet"

    def __iter__(self) -> Iterator[Never]:
        """Give no sample."""
        return iter(())


NOT_YET: Final = NotYet.NOT_YET
"""What a unit answers to a sample that it will answer later: it owes that, until its next answer of another kind."""


@dataclass(frozen=True, slots=True)
class Sample(Generic[Value_co]):
    """Hold one value of a stream with its two times.

    Attributes
    ----------
    available_us : when a node could first know the value; never decreases along one stream.
    valid_us : the time the value speaks of, on the timeline of the source.
    value : a whole frame's objects on pipeline streams, so that the cost of a hop is paid once a frame; `NO_VALUE`
        where the fluent is unknown.

    Examples
    --------
    >>> Sample(available_us=40_000, valid_us=0, value=3.5).delay_us
    40000
    >>> Sample(available_us=40_000, valid_us=0, value=NO_VALUE).value is NO_VALUE
    True
    """

    available_us: int
    valid_us: int
    value: Value_co

    @property
    def delay_us(self) -> int:
        """Return how long after its valid time the sample became available, in microseconds; a prediction has < 0."""
        return self.available_us - self.valid_us
