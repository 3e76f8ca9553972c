"""When do the values at a time leave? As soon as nothing that comes later can change them, or at a deadline.

The times are regular, or those of one of the fluents (`LedSampling`). This is the core of `sample every` (one fluent)
and of the synchroniser (several): the state generation of Heintz (2009), section 7.8. Times leave in order, one value
for each fluent, and are never revised. What is reported is a function of the samples, their available times and the
deadlines alone: being told the time earlier or later releases values earlier or later, but with the same content and
the same available time.
"""

from collections import deque
from collections.abc import Sequence
from typing import Any

from dyknow.policies.sampled_fluent import SampledFluent
from dyknow.sample import Sample

_NEVER_US = 2**80

Values = tuple[Any, ...]  # Any: fluents have values of any type


class Sampling:
    """Release the values of some fluents at regular times.

    Parameters
    ----------
    fluents : all with the same sampled times.
    start_us, period_us, end_us : the sampled times are ``start_us + k * period_us``, up to ``end_us`` included.
    max_delay_us : a time is released this long after it at the latest; None waits until it is settled.

    Attributes
    ----------
    now_us : the latest available time that was told.
    """

    def __init__(
        self,
        fluents: Sequence[SampledFluent],
        *,
        start_us: int,
        period_us: int,
        max_delay_us: int | None,
        end_us: int | None = None,
    ) -> None:
        self._fluents = fluents
        self._period_us = period_us
        self._max_delay_us = max_delay_us
        self._end_us = end_us
        self._last_us = start_us - 1
        self.now_us = -_NEVER_US
        self._deadline_us = _NEVER_US
        self._unsettled: set[int] = set()  # fluents that hold up the head
        self._wait_for(start_us)

    def push(self, index: int, sample: Sample[Any]) -> list[Sample[Values]]:
        """Take in a sample of one fluent; return the times that leave by it, or left before it came."""
        released = self.advance(sample.available_us)
        self._note(index, sample.valid_us)
        self._fluents[index].insert(sample)
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
            self.now_us = max(self.now_us, self._deadline_us)
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

    def _note(self, index: int, valid_us: int) -> None:
        """Take note of what a sample speaks of, before it is taken in."""
        self._last_us = max(self._last_us, valid_us)

    def _settle(self, index: int, released: list[Sample[Values]]) -> list[Sample[Values]]:
        if index in self._unsettled and self._fluents[index].is_settled(self._head_us):
            self._unsettled.discard(index)
            self._release_settled(released)
        return released

    def _release_settled(self, released: list[Sample[Values]]) -> None:
        while not self._unsettled and not self._is_over():
            released.append(self._release())

    def _release(self) -> Sample[Values]:
        t_us = self._head_us
        values = tuple([fluent.take(t_us) for fluent in self._fluents])
        self._wait_for(self._time_after(t_us))
        return Sample(self.now_us, t_us, values)

    def _time_after(self, t_us: int) -> int:
        return t_us + self._period_us

    def _wait_for(self, t_us: int) -> None:
        self._head_us = t_us
        has_deadline = self._max_delay_us is not None and not self._is_over()
        self._deadline_us = t_us + (self._max_delay_us or 0) if has_deadline else _NEVER_US
        self._unsettled = {index for index, fluent in enumerate(self._fluents) if not fluent.is_settled(t_us)}

    def _is_over(self) -> bool:
        return self._end_us is not None and self._head_us > self._end_us


class LedSampling(Sampling):
    """Release the values of some fluents at the times of one of them, the leader.

    Where one stream tells when there is something to say, such as the frames of a camera, states at regular times would
    fall between its samples. A sample of the leader that comes after its own deadline is late. What later times can
    still ask for is all that is kept, also while the leader is silent.

    Parameters
    ----------
    fluents : with a period of 1 us, as any time may become one of the leader's.
    leader : index of the fluent that sets the times; its samples must be known to be in order.
    max_delay_us : as for `Sampling`.
    """

    def __init__(self, fluents: Sequence[SampledFluent], *, leader: int, max_delay_us: int) -> None:
        super().__init__(fluents, start_us=_NEVER_US, period_us=1, max_delay_us=max_delay_us, end_us=_NEVER_US - 1)
        self._leader = leader
        self._lag_us = max_delay_us
        self._taken_us = -_NEVER_US  # no time up to this one is released any more
        self._times_us: deque[int] = deque()  # of the leader, that wait

    def advance(self, available_us: int) -> list[Sample[Values]]:
        """Let time pass; see `Sampling.advance`."""
        released = super().advance(available_us)
        forgotten_us = available_us - self._lag_us - 1
        if forgotten_us > self._taken_us:
            self._taken_us = forgotten_us
            for fluent in self._fluents:
                fluent.forget(forgotten_us)
        return released

    def _note(self, index: int, valid_us: int) -> None:
        if index == self._leader and valid_us > max(self._fluents[index].settled_us, self._taken_us):
            self._times_us.append(valid_us)

    def _settle(self, index: int, released: list[Sample[Values]]) -> list[Sample[Values]]:
        if not self._is_over() or not self._times_us:
            return super()._settle(index, released)
        self._wait_for(self._times_us[0])
        self._release_settled(released)
        return released

    def _time_after(self, t_us: int) -> int:
        self._taken_us = self._times_us.popleft()
        return self._times_us[0] if self._times_us else _NEVER_US
