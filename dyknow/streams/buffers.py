"""Where do samples stay? Those of late in a history, for who comes later; those not taken yet in a pulled stream.

A pulled stream is for a reader who gets samples when it wants them, not when they come. Such buffers belong to the
edges (a network, a user interface, another thread's loop); between the processes of a node samples are pushed, which
needs no queue.
"""

from collections import deque
from collections.abc import Callable
from enum import Enum
from typing import Any

from dyknow.errors import StreamError
from dyknow.sample import Sample


class WhenFull(Enum):
    """Name which sample a full buffer gives up: the one that waited longest, or the one that comes."""

    DROP_OLDEST = "drop oldest"
    REFUSE_NEWEST = "refuse newest"


class Stream:
    """Buffer what one subscriber has not taken yet.

    Attributes
    ----------
    dropped : samples given up because the buffer was full, under the words of `WhenFull`.

    Raises
    ------
    StreamError
        If ``capacity`` is no positive number, or ``when_full`` no `WhenFull`.

    Examples
    --------
    >>> stream = Stream("pos[car1]", capacity=2)
    >>> for t_us in (1, 2, 3):
    ...     stream.accept(Sample(t_us, t_us, "here"))
    >>> stream.is_full, stream.dropped
    (True, {'drop oldest': 1})
    >>> [sample.valid_us for sample in stream.take()], stream.take()
    ([2, 3], ())
    """

    __slots__ = ("_buffer", "_leave", "_when_full", "capacity", "dropped", "label")

    def __init__(self, label: str, capacity: int, when_full: WhenFull = WhenFull.DROP_OLDEST) -> None:
        if type(capacity) is not int or capacity < 1:
            raise StreamError(f"stream {label!r}: expected a capacity of at least 1 sample, got {capacity!r}")
        if not isinstance(when_full, WhenFull):
            raise StreamError(f"stream {label!r}: expected one of {[*map(str, WhenFull)]}, got {when_full!r}")
        self.label = label
        self.capacity = capacity
        self.dropped: dict[str, int] = {}
        self._when_full = when_full
        self._buffer: deque[Sample[Any]] = deque()
        self._leave: Callable[[], None] | None = None

    def __len__(self) -> int:
        """Return how many samples wait."""
        return len(self._buffer)

    @property
    def is_full(self) -> bool:
        """Tell whether the next sample costs one: a producer that can wait, waits."""
        return len(self._buffer) >= self.capacity

    def accept(self, sample: Sample[Any]) -> None:
        """Put a sample into the buffer, or count the one that finds no room."""
        if self.is_full:
            cause = self._when_full.value
            self.dropped[cause] = self.dropped.get(cause, 0) + 1
            if self._when_full is WhenFull.REFUSE_NEWEST:
                return
            self._buffer.popleft()
        self._buffer.append(sample)

    def take(self, limit: int | None = None) -> tuple[Sample[Any], ...]:
        """Take up to ``limit`` samples out, or all that wait; oldest first, empty if there are none.

        Raises
        ------
        StreamError
            If ``limit`` is negative.
        """
        if limit is not None and limit < 0:
            raise StreamError(f"stream {self.label!r}: expected to take 0 samples or more, got {limit!r}")
        count = len(self._buffer) if limit is None else min(limit, len(self._buffer))
        return tuple(self._buffer.popleft() for _ in range(count))

    def leave_by(self, leave: Callable[[], None]) -> None:
        """Say how to end the subscription that fills this buffer."""
        self._leave = leave

    def close(self) -> None:
        """End the subscription; what waits can still be taken. Closing again does nothing."""
        if self._leave is not None:
            self._leave()
            self._leave = None


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
