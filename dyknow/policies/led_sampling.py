"""What are the values of several fluents at the times of one of them? As `dyknow.policies.sampling`, without a period.

Where one stream tells when there is something to say, such as the frames of a camera, states at regular times would
fall between its samples. So the *leader* sets the times: each of its samples is one, in order, and leaves as soon as
every other fluent is settled at it, or at a deadline. A sample of the leader that comes after its own deadline is late.
What later times can still ask for is all that is kept, also while the leader is silent.
"""

from collections import deque
from collections.abc import Sequence
from typing import Any

from dyknow.policies.sampled_fluent import SampledFluent
from dyknow.policies.sampling import Values
from dyknow.streams.sample import Sample

_BEFORE_EVERYTHING_US = -(2**80)


class LedSampling:
    """Release the values of some fluents at the times of the leader.

    Parameters
    ----------
    fluents : with a period of 1 us, as any time may become one of the leader's.
    leader : index of the fluent that sets the times; its samples must be known to be in order.
    max_delay_us : a time is released this long after it at the latest.
    is_eager : release a settled time at once; otherwise every time waits for its deadline.
    """

    __slots__ = ("_fluents", "_is_eager", "_leader", "_max_delay_us", "_now_us", "_taken_us", "_times_us")

    def __init__(
        self, fluents: Sequence[SampledFluent], *, leader: int, max_delay_us: int, is_eager: bool = True
    ) -> None:
        self._fluents = fluents
        self._leader = leader
        self._max_delay_us = max_delay_us
        self._is_eager = is_eager
        self._now_us = _BEFORE_EVERYTHING_US
        self._taken_us = _BEFORE_EVERYTHING_US  # no time up to this one is released any more
        self._times_us: deque[int] = deque()  # of the leader, that wait

    def push(self, index: int, sample: Sample[Any]) -> list[Sample[Values]]:
        """Take in a sample of one fluent; return the times that leave by it, or left before it came."""
        released = self.advance(sample.available_us)
        fluent = self._fluents[index]
        if index == self._leader and sample.valid_us > max(fluent.settled_us, self._taken_us):
            self._times_us.append(sample.valid_us)
        fluent.insert(sample)
        return self._release_settled(released)

    def promise(self, index: int, valid_us: int, available_us: int) -> list[Sample[Values]]:
        """Take the word of one fluent's producer that it says nothing more about ``valid_us`` or earlier."""
        released = self.advance(available_us)
        self._fluents[index].promise(valid_us)
        return self._release_settled(released)

    def advance(self, available_us: int) -> list[Sample[Values]]:
        """Let time pass: nothing that became available before this time comes any more.

        What becomes available at that very time may still come, so a deadline passes only after its time.
        """
        released: list[Sample[Values]] = []
        while self._times_us and self._times_us[0] + self._max_delay_us < available_us:
            self._now_us = max(self._now_us, self._times_us[0] + self._max_delay_us)
            released.append(self._release())
            self._release_settled(released)
        if available_us > self._now_us:
            self._now_us = available_us
            self._forget(available_us - self._max_delay_us - 1)
        return released

    def finish(self) -> list[Sample[Values]]:
        """Release every time of the leader: nothing comes any more."""
        released = [self._release() for _ in range(len(self._times_us))]
        for fluent in self._fluents:
            fluent.finish()
        return released

    def _release_settled(self, released: list[Sample[Values]]) -> list[Sample[Values]]:
        while self._is_eager and self._times_us and self._is_settled(self._times_us[0]):
            released.append(self._release())
        return released

    def _is_settled(self, t_us: int) -> bool:
        return all(fluent.is_settled(t_us) for fluent in self._fluents)

    def _release(self) -> Sample[Values]:
        t_us = self._times_us.popleft()
        self._taken_us = t_us
        return Sample(self._now_us, t_us, tuple([fluent.take(t_us) for fluent in self._fluents]))

    def _forget(self, t_us: int) -> None:
        """Forget what no later time needs: none up to this one is released any more."""
        if t_us > self._taken_us:
            self._taken_us = t_us
            for fluent in self._fluents:
                fluent.forget(t_us)
