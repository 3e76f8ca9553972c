"""What does a stream carry? Samples: a value, when it holds and when it could be known.

After Heintz (2009), chapters 3 and 4: a fluent stream approximates a fluent by samples ``<available, valid, value>``.
"""

from dataclasses import dataclass
from typing import Generic, TypeVar

Value_co = TypeVar("Value_co", covariant=True)


@dataclass(frozen=True, slots=True)
class Sample(Generic[Value_co]):
    """Hold one value of a stream with its two times.

    Attributes
    ----------
    available_us : when a node could first know the value; never decreases along one stream.
    valid_us : the time the value speaks of, on the timeline of the source.
    value : a whole frame's objects on pipeline streams, so that the cost of a hop is paid once a frame.

    Examples
    --------
    >>> Sample(available_us=40_000, valid_us=0, value=3.5).delay_us
    40000
    """

    available_us: int
    valid_us: int
    value: Value_co

    @property
    def delay_us(self) -> int:
        """Return how long after its valid time the sample became available, in microseconds."""
        return self.available_us - self.valid_us
