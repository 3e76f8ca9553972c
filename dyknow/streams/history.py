"""What was said lately? The last samples of a stream, for subscribers that ask for what came before them."""

from collections import deque
from typing import Any

from dyknow.errors import StreamError
from dyknow.streams.sample import Sample


class History:
    """Keep the samples of the last ``duration_us``, at most ``capacity`` of them.

    Attributes
    ----------
    overflowed : samples young enough that were forgotten because there were too many.

    Examples
    --------
    >>> history = History(duration_us=10, capacity=100)
    >>> for t_us in (0, 8, 15):
    ...     history.append(Sample(t_us, t_us, "here"), now_us=t_us)
    >>> len(history), [sample.valid_us for sample in history.since(10)]
    (2, [15])
    """

    __slots__ = ("_samples", "capacity", "duration_us", "overflowed")

    def __init__(self, *, duration_us: int, capacity: int) -> None:
        if duration_us < 0 or capacity < 1:
            raise StreamError(
                f"history: expected a duration >= 0 us and a capacity >= 1, got {duration_us!r} and {capacity!r}"
            )
        self.duration_us = duration_us
        self.capacity = capacity
        self.overflowed = 0
        self._samples: deque[Sample[Any]] = deque()

    def __len__(self) -> int:
        """Return how many samples are kept."""
        return len(self._samples)

    def append(self, sample: Sample[Any], *, now_us: int) -> None:
        """Keep a sample; forget what has become too old or too much."""
        self._samples.append(sample)
        self.forget_before(now_us - self.duration_us)
        if len(self._samples) > self.capacity:
            self._samples.popleft()
            self.overflowed += 1

    def forget_before(self, valid_us: int) -> None:
        """Forget old samples; one that came out of order goes with those that came before it."""
        while self._samples and self._samples[0].valid_us < valid_us:
            self._samples.popleft()

    def since(self, valid_us: int) -> tuple[Sample[Any], ...]:
        """Give the samples of that valid time and later, in the order in which they came."""
        return tuple(sample for sample in self._samples if sample.valid_us >= valid_us)
