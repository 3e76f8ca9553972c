"""What does a link wait for, and what does it need to live on? Conditions over time, answered in three values.

A condition looks at a stream of states. It may be a formula of a temporal logic or one of the small ones below: the
linker only asks for `progress`.
"""

from collections.abc import Mapping, Sequence
from enum import Enum
from typing import Protocol


class Verdict(Enum):
    """Answer of a condition so far; TRUE and FALSE of a maintain condition are final."""

    TRUE = "true"
    FALSE = "false"
    UNKNOWN = "unknown"


class Condition(Protocol):
    """Take one state after another and say what is known.

    States map the names of fluents to truth values; `anchoring.linking.fluents` lists them.
    """

    def progress(self, t_us: int, state: Mapping[str, bool]) -> Verdict:
        """Take the state of a time later than the last one and answer."""

    @property
    def is_idle(self) -> bool:
        """Tell whether more states equal to the last one would change nothing; False is always safe."""


class HeldFor:
    """TRUE while all fluents have held without a break for a while; UNKNOWN otherwise.

    Parameters
    ----------
    fluents : names.
    duration_us : how long, from the first state in which they held.

    Examples
    --------
    >>> seen = HeldFor(("visible",), 400_000)
    >>> [seen.progress(t_us, {"visible": t_us != 200_000}).value for t_us in range(0, 700_000, 100_000)]
    ['unknown', 'unknown', 'unknown', 'unknown', 'unknown', 'unknown', 'unknown']
    >>> seen.progress(700_000, {"visible": True}).value
    'true'
    """

    __slots__ = ("_duration_us", "_fluents", "_since_us", "is_idle")

    def __init__(self, fluents: Sequence[str], duration_us: int) -> None:
        self._fluents = tuple(fluents)
        self._duration_us = duration_us
        self._since_us: int | None = None
        self.is_idle = False  # until the first state

    def progress(self, t_us: int, state: Mapping[str, bool]) -> Verdict:
        """Take the next state."""
        self.is_idle = not all(state[fluent] for fluent in self._fluents)
        if self.is_idle:
            self._since_us = None
            return Verdict.UNKNOWN
        if self._since_us is None:
            self._since_us = t_us
        return Verdict.TRUE if t_us - self._since_us >= self._duration_us else Verdict.UNKNOWN


class NotLostLongerThan:
    """FALSE once a fluent has failed without a break for longer than a while; UNKNOWN until then.

    Parameters
    ----------
    fluent : name.
    duration_us : how long it may fail, from the first state in which it does; 0 allows no failure at all.

    Examples
    --------
    >>> on_road = NotLostLongerThan("on_road", 100_000)
    >>> [on_road.progress(t_us, {"on_road": False}).value for t_us in (0, 100_000, 100_001)]
    ['unknown', 'unknown', 'false']
    >>> NotLostLongerThan("no_jump", 0).progress(0, {"no_jump": False}).value
    'false'
    """

    __slots__ = ("_duration_us", "_fluent", "_lost_since_us", "is_idle")

    def __init__(self, fluent: str, duration_us: int) -> None:
        self._fluent = fluent
        self._duration_us = duration_us
        self._lost_since_us: int | None = None
        self.is_idle = False  # until the first state

    def progress(self, t_us: int, state: Mapping[str, bool]) -> Verdict:
        """Take the next state."""
        self.is_idle = state[self._fluent]
        if self.is_idle:
            self._lost_since_us = None
            return Verdict.UNKNOWN
        if self._lost_since_us is None:
            self._lost_since_us = t_us
        too_long = t_us - self._lost_since_us > self._duration_us or self._duration_us == 0
        return Verdict.FALSE if too_long else Verdict.UNKNOWN


class AllOf:
    """Join conditions: FALSE if one is, TRUE if all are, else UNKNOWN.

    Parameters
    ----------
    conditions : each takes every state.
    """

    __slots__ = ("_conditions",)

    def __init__(self, *conditions: Condition) -> None:
        self._conditions = conditions

    def progress(self, t_us: int, state: Mapping[str, bool]) -> Verdict:
        """Take the next state."""
        verdicts = {condition.progress(t_us, state) for condition in self._conditions}
        if Verdict.FALSE in verdicts:
            return Verdict.FALSE
        return Verdict.TRUE if verdicts == {Verdict.TRUE} else Verdict.UNKNOWN

    @property
    def is_idle(self) -> bool:
        """Tell whether every part is idle."""
        return all(condition.is_idle for condition in self._conditions)
