"""What holds at one time, out of several streams? A synchroniser makes states: one value of each fluent at one time.

Samples of different streams speak of different times and come with different delays. States are formed at regular valid
times, or at those of one of the fluents, in order, and are never revised. After the improved state generation of Heintz
(2009), section 7.8, which knows regular times only: a state leaves as soon as it is settled, that is, when no fluent
can change at its time any more: a sample of exactly that time came; or the stream is ordered and a later one came; or
its producer promised; at the latest when the delay is over.
"""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from dyknow.errors import ProcessError
from dyknow.policies.policy import Approximation, Order, Policy
from dyknow.policies.sampled_fluent import SampledFluent
from dyknow.policies.sampling import LedSampling, Sampling, Values
from dyknow.sample import Sample


@dataclass(frozen=True, slots=True)
class State:
    """Hold the values of some fluents at one time, `NO_VALUE` where one is unknown.

    Examples
    --------
    >>> state = State(("speed", "on_road"), (12.5, True))
    >>> state["on_road"], dict(state)
    (True, {'speed': 12.5, 'on_road': True})
    """

    names: tuple[str, ...]
    values: Values

    def __getitem__(self, name: str) -> Any:  # Any: fluents have values of any type
        """Give the value of a fluent."""
        if name not in self.names:
            raise KeyError(name)
        return self.values[self.names.index(name)]

    def keys(self) -> Iterator[str]:
        """Give the names of the fluents, so that `dict` takes a state."""
        return iter(self.names)


class Synchroniser:
    """Turn samples of several fluents into states at regular times; a unit for a process with several inputs.

    Parameters
    ----------
    fluents : by name, in the order of the inputs, what the samples of each keep: the order decides what settles a time,
        the approximation the value at it. The other constraints are not looked at: where a process reads the
        streams, they are met before the samples come here.
    max_delay_us : a state leaves this long after its time at the latest; samples that come later are too late.
    period_us, start_us : states are formed at ``start_us + k * period_us``, k = 0, 1, ...
    at : instead of a period, the fluent at whose times states are formed, one for each of its samples.

    Raises
    ------
    ProcessError
        If there is no fluent, the period is not positive or the delay is negative; if there is not one of a period
        and a fluent to follow, or that fluent is unknown or in no order.

    Examples
    --------
    >>> from dyknow.policies.policy import Approximation, Order
    >>> held = Policy(approximation=Approximation.MOST_RECENT, order=Order.STRICT)
    >>> states = Synchroniser({"speed": held, "road": held}, period_us=100, start_us=0, max_delay_us=500)
    >>> states.observe("speed", Sample(0, 0, 12.5)), states.observe("road", Sample(10, 0, "E6"))
    ([], [Sample(available_us=10, valid_us=0, value=State(names=('speed', 'road'), values=(12.5, 'E6')))])
    >>> states.observe("speed", Sample(130, 130, 13.0))
    []
    >>> [late] = states.advance(700)          # the road says nothing: the state waits as long as it may
    >>> late.available_us, dict(late.value)
    (600, {'speed': 12.5, 'road': 'E6'})

    With a fluent to follow:

    >>> states = Synchroniser({"frame": held, "road": held}, at="frame", max_delay_us=500)
    >>> states.observe("road", Sample(10, 0, "E6")), states.observe("frame", Sample(33, 33, "first"))
    ([], [])
    >>> states.observe("road", Sample(70, 50, "E4"))
    [Sample(available_us=70, valid_us=33, value=State(names=('frame', 'road'), values=('first', 'E6')))]
    """

    def __init__(
        self,
        fluents: Mapping[str, Policy],
        *,
        max_delay_us: int,
        period_us: int | None = None,
        start_us: int = 0,
        at: str | None = None,
    ) -> None:
        _check_times(fluents, period_us, max_delay_us, at)
        self.names = tuple(fluents)
        self._index = {name: index for index, name in enumerate(self.names)}
        # Any time may become one of those to follow, so nothing is thinned out between the microseconds.
        grid = {"start_us": start_us, "period_us": period_us or 1}
        self._fluents = [
            # What is followed is never asked for between its samples, so that one which comes too late is of no use.
            SampledFluent(Approximation.NONE if name == at else policy.approximation, policy.order, **grid)
            for name, policy in fluents.items()
        ]
        self._sampling: Sampling | LedSampling
        if at is not None:
            leader = self._index[at]
            self._sampling = LedSampling(self._fluents, leader=leader, max_delay_us=max_delay_us)
        else:
            self._sampling = Sampling(self._fluents, max_delay_us=max_delay_us, **grid)

    def update(self, index: int, sample: Sample[Any]) -> list[Sample[State]]:
        """Take a sample of the fluent with this index; return the states that leave, oldest first.

        Available times must not decrease from one call to the next, whatever the fluent.
        """
        return self._states(self._sampling.push(index, sample))

    def observe(self, name: str, sample: Sample[Any]) -> list[Sample[State]]:
        """Take a sample of the fluent with this name; see `update`."""
        return self.update(self._index_of(name), sample)

    def promise(self, name: str, valid_us: int, *, available_us: int) -> list[Sample[State]]:
        """Take the word of a fluent's producer that it says nothing more about ``valid_us`` or earlier.

        The word itself came at ``available_us``. Streams that only report changes need it: without, every state waits
        for its delay while nothing changes. Linear interpolation needs the next sample all the same.
        """
        return self._states(self._sampling.promise(self._index_of(name), valid_us, available_us))

    def advance(self, available_us: int) -> list[Sample[State]]:
        """Let time pass: nothing that became available before this time comes any more."""
        return self._states(self._sampling.advance(available_us))

    def finish(self) -> list[Sample[State]]:
        """Return the states up to the last time that a sample, or one of the fluent to follow, spoke of; it is over."""
        return self._states(self._sampling.finish())

    @property
    def held(self) -> dict[str, int]:
        """Return how many samples of each fluent are kept."""
        return {name: len(fluent) for name, fluent in zip(self.names, self._fluents, strict=True)}

    @property
    def dropped(self) -> dict[str, dict[str, int]]:
        """Return by fluent and cause the samples that no state needs.

        ``not sampled``: others are nearer to the times of the states; ``late``: the state they matter to has left;
        ``repeated``: there was one of the same time.
        """
        return {name: dict(fluent.dropped) for name, fluent in zip(self.names, self._fluents, strict=True)}

    @property
    def left_out(self) -> dict[str, int]:
        """Return the same for the report of a process, as ``speed late``."""
        return {f"{name} {cause}": count for name, causes in self.dropped.items() for cause, count in causes.items()}

    def _index_of(self, name: str) -> int:
        if name not in self._index:
            raise ProcessError(f"synchroniser: expected one of the fluents {self.names!r}, got {name!r}")
        return self._index[name]

    def _states(self, released: Iterable[Sample[Values]]) -> list[Sample[State]]:
        names = self.names
        return [Sample(one.available_us, one.valid_us, State(names, one.value)) for one in released]


def _check_times(fluents: Mapping[str, Policy], period_us: int | None, max_delay_us: int, at: str | None) -> None:
    if not fluents or max_delay_us < 0 or (period_us is not None and period_us <= 0):
        raise ProcessError(
            "synchroniser: expected one fluent or more, a period > 0 us and a delay >= 0 us, "
            f"got {tuple(fluents)!r}, {period_us!r} and {max_delay_us!r}"
        )
    if (period_us is None) is (at is None):
        raise ProcessError(f"synchroniser: expected a period or a fluent to follow, got {period_us!r} and {at!r}")
    if at is not None and (at not in fluents or fluents[at].order is Order.ANY):
        ordered = tuple(name for name, policy in fluents.items() if policy.order is not Order.ANY)
        raise ProcessError(f"synchroniser: expected to follow one of the ordered fluents {ordered!r}, got {at!r}")
