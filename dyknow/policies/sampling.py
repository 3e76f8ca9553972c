"""When do the values at regular times leave? As soon as nothing that comes later can change them, or at a deadline.

This is the core of `sample every` (one fluent) and of the synchroniser (several): the state generation of Heintz
(2009), section 7.8. Times leave in order, one value for each fluent, and are never revised. What is reported is a
function of the samples, their available times and the deadlines alone: being told the time earlier or later releases
values earlier or later, but with the same content and the same available time.
"""

from collections.abc import Sequence
from typing import Any

from dyknow.policies.sampled_fluent import SampledFluent
from dyknow.streams.sample import Sample

_NEVER_US = 2**80

Values = tuple[Any, ...]  # Any: fluents have values of any type


class Sampling:
    """Release the values of some fluents at regular times.

    Parameters
    ----------
    fluents : all with the same sampled times.
    start_us, period_us, end_us : the sampled times are ``start_us + k * period_us``, up to ``end_us`` included.
    max_delay_us : a time is released this long after it at the latest; None waits until it is settled.
    is_eager : release a settled time at once; otherwise every time waits for its deadline.

    Attributes
    ----------
    now_us : the latest available time that was told.
    """

    __slots__ = (
        "_deadline_us", "_end_us", "_fluents", "_head_us", "_is_eager", "_last_us", "_max_delay_us", "_period_us",
        "_unsettled", "now_us",
    )  # fmt: skip

    def __init__(
        self,
        fluents: Sequence[SampledFluent],
        *,
        start_us: int,
        period_us: int,
        max_delay_us: int | None,
        end_us: int | None = None,
        is_eager: bool = True,
    ) -> None:
        self._fluents = fluents
        self._period_us = period_us
        self._max_delay_us = max_delay_us
        self._end_us = end_us
        self._is_eager = is_eager
        self._last_us = start_us - 1
        self.now_us = -_NEVER_US
        self._deadline_us = _NEVER_US
        self._unsettled: set[int] = set()  # fluents that hold up the head
        self._wait_for(start_us)

    def push(self, index: int, sample: Sample[Any]) -> list[Sample[Values]]:
        """Take in a sample of one fluent; return the times that leave by it, or left before it came."""
        released = self.advance(sample.available_us)
        fluent = self._fluents[index]
        fluent.insert(sample)
        self._last_us = max(self._last_us, sample.valid_us)
        return self._settle(index, released)

    def promise(self, index: int, valid_us: int, available_us: int) -> list[Sample[Values]]:
        """Take the word of one fluent's producer that it says nothing more about ``valid_us`` or earlier."""
        released = self.advance(available_us)
        self._fluents[index].promise(valid_us)
        return self._settle(index, released)

    def advance(self, available_us: int) -> list[Sample[Values]]:
        """Let time pass: nothing that became available before this time comes any more.

        What becomes available at that very time may still come, so a deadline passes only after its time.
        """
        released: list[Sample[Values]] = []
        while self._deadline_us < available_us:
            self.now_us = self._deadline_us
            released.append(self._release())
            self._release_settled(released)
        self.now_us = max(self.now_us, available_us)
        return released

    def finish(self) -> list[Sample[Values]]:
        """Release every time that a sample spoke of or that lies before one: nothing comes any more."""
        released: list[Sample[Values]] = []
        while self._head_us <= self._last_us and not self._is_over():
            released.append(self._release())
        for fluent in self._fluents:
            fluent.finish()
        return released

    def _settle(self, index: int, released: list[Sample[Values]]) -> list[Sample[Values]]:
        if self._is_eager and index in self._unsettled and self._fluents[index].is_settled(self._head_us):
            self._unsettled.discard(index)
            self._release_settled(released)
        return released

    def _release_settled(self, released: list[Sample[Values]]) -> None:
        while self._is_eager and not self._unsettled and not self._is_over():
            released.append(self._release())

    def _release(self) -> Sample[Values]:
        t_us = self._head_us
        values = tuple([fluent.take(t_us) for fluent in self._fluents])
        self._wait_for(t_us + self._period_us)
        return Sample(self.now_us, t_us, values)

    def _wait_for(self, t_us: int) -> None:
        self._head_us = t_us
        has_deadline = self._max_delay_us is not None and not self._is_over()
        self._deadline_us = t_us + (self._max_delay_us or 0) if has_deadline else _NEVER_US
        self._unsettled = {index for index, fluent in enumerate(self._fluents) if not fluent.is_settled(t_us)}

    def _is_over(self) -> bool:
        return self._end_us is not None and self._head_us > self._end_us
