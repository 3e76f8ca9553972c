"""Which frames of a video are looked at? Every n-th, by the clock, so that a rate that varies does not matter."""

from typing import ClassVar


class Pace:
    """Choose every n-th frame, n the largest with which a rate is kept.

    Parameters
    ----------
    rate_hz : this many frames are looked at in a second, or a few more; infinite for all.
    source_hz : frames in a second on average; 0 where nobody knows.

    Attributes
    ----------
    every : n; 1 also where nobody knows, and the clock alone decides.

    Examples
    --------
    >>> [Pace(12.5, source_hz).every for source_hz in (12.0, 24.0, 25.0, 29.97, 50.0, 60.0)]
    [1, 1, 2, 2, 4, 4]
    >>> pace = Pace(12.5, 25.0)
    >>> [t_us for t_us in (0, 40000, 80000, 120000, 700000, 740000, 780000) if pace.takes(t_us)]
    [0, 80000, 700000, 780000]
    """

    LENIENT: ClassVar[float] = 1.01  # what a container announces is a mean: 25 frames a second may be said to be 24.9

    def __init__(self, rate_hz: float, source_hz: float) -> None:
        self.every = max(1, int(self.LENIENT * source_hz / rate_hz))
        self._takes_all = source_hz > 0 and self.every == 1
        self._step_us = self.every * 1e6 / source_hz if source_hz else 1e6 / rate_hz
        self._early_us = 0.5 * self._step_us / self.every if source_hz else 0.0
        self._due_us = 0.0

    def takes(self, t_us: int) -> bool:
        """Tell whether the frame of this time is looked at; times increase."""
        if self._takes_all:
            return True
        if t_us < self._due_us - self._early_us:
            return False
        # Small errors of the clock must not add up, and a hole starts anew.
        is_late = t_us > self._due_us + self._early_us
        self._due_us = (t_us if is_late else self._due_us) + self._step_us
        return True
