"""What does a link wait for, and what does it need to live on? Conditions over time, answered in three values.

A condition looks at a stream of states; it is a formula of the linkage text. What a formula means is what a progressor
says of it; here the formulas of usual shapes are compiled into a few comparisons, which say the same (by test).
"""

import re
from collections.abc import Callable, Mapping, Sequence
from collections.abc import Set as AbstractSet
from enum import Enum
from functools import partial
from typing import Protocol


class Verdict(Enum):
    """Answer of a condition so far; FALSE of a maintain condition is final."""

    TRUE = "true"
    FALSE = "false"
    UNKNOWN = "unknown"


class Condition(Protocol):
    """Take one state after another and say what is known.

    States map the names of fluents to truth values; `anchoring.linking.fluents` lists them.

    An establish or reestablish condition that has failed starts anew with the next state. While it is true and its link
    waits for the one below, it is dropped when its formula, asked in the present state alone, would be false.
    """

    def progress(self, t_us: int, state: Mapping[str, bool]) -> Verdict:
        """Take the state of a time later than the last one and answer."""

    @property
    def is_idle(self) -> bool:
        """Tell whether more states equal to the last one would change nothing; False is always safe."""


Maker = Callable[[], Condition]  # of a fresh condition for one link


class HeldFor:
    """TRUE once fluents have held without a break for a while, and others with them at last; dropped when one fails.

    Parameters
    ----------
    fluents : names.
    duration_us : how long, from the first state in which they held.
    at_last : what must hold besides when the time is over, in the state in which it becomes TRUE.

    Examples
    --------
    >>> seen = HeldFor(("visible",), 400_000)
    >>> [seen.progress(t_us, {"visible": t_us != 200_000}).value for t_us in range(0, 700_000, 100_000)]
    ['unknown', 'unknown', 'unknown', 'unknown', 'unknown', 'unknown', 'unknown']
    >>> seen.progress(700_000, {"visible": True}).value
    'true'
    """

    __slots__ = ("_at_last", "_duration_us", "_fluents", "_is_true", "_since_us", "is_idle")

    def __init__(self, fluents: Sequence[str], duration_us: int, at_last: Sequence[str] = ()) -> None:
        self._fluents = tuple(fluents)
        self._at_last = tuple(at_last)
        self._duration_us = duration_us
        self._since_us: int | None = None
        self._is_true = False
        self.is_idle = False  # until the first state

    def progress(self, t_us: int, state: Mapping[str, bool]) -> Verdict:
        """Take the next state."""
        self.is_idle = not all(map(state.__getitem__, self._fluents))
        if self.is_idle:
            self._since_us, self._is_true = None, False
            return Verdict.UNKNOWN
        if self._since_us is None:
            self._since_us = t_us
        if t_us - self._since_us >= self._duration_us and all(map(state.__getitem__, self._at_last)):
            self._is_true = True
        self.is_idle = self._is_true  # until a fluent fails, however long the link waits for the one below
        return Verdict.TRUE if self._is_true else Verdict.UNKNOWN


class NotLostFor:
    """FALSE once a fluent has failed without a break for its while; UNKNOWN until then.

    Parameters
    ----------
    durations_us : of the fluents by name: how long each must have failed, from the first state in which it does; 0
        allows no failure at all.

    Examples
    --------
    >>> on_road = NotLostFor({"on_road": 100_000, "no_jump": 0})
    >>> [on_road.progress(t_us, {"on_road": False, "no_jump": True}).value for t_us in (0, 99_999, 100_000)]
    ['unknown', 'unknown', 'false']
    """

    __slots__ = ("_durations_us", "_since_us", "is_idle")

    def __init__(self, durations_us: Mapping[str, int]) -> None:
        self._durations_us = durations_us
        self._since_us: Mapping[str, int] = {}  # of those that fail
        self.is_idle = False  # until the first state

    def progress(self, t_us: int, state: Mapping[str, bool]) -> Verdict:
        """Take the next state."""
        failing = [fluent for fluent in self._durations_us if not state[fluent]]
        self.is_idle = not failing
        self._since_us = {fluent: self._since_us.get(fluent, t_us) for fluent in failing}
        is_lost = any(t_us - self._since_us[fluent] >= self._durations_us[fluent] for fluent in failing)
        return Verdict.FALSE if is_lost else Verdict.UNKNOWN


def compiled(formula: str, fluents: AbstractSet[str], *, is_lasting: bool) -> Maker | None:
    """Compile a formula of a usual shape; None for all others.

    Parameters
    ----------
    formula : its words with a blank between each two; times are 0 or in whole microseconds.
    fluents : all names that it may use.
    is_lasting : whether it is to be maintained: then conditions like ``always p`` are compiled, else ``p until p``.

    Examples
    --------
    >>> kept = compiled("always p and always not ( not q until [ 5us , oo ] not q )", {"p", "q"}, is_lasting=True)
    >>> [kept().progress(0, {"p": p, "q": False}).value for p in (True, False)]
    ['unknown', 'false']
    >>> compiled("eventually p", {"p"}, is_lasting=False), compiled("p", {"q"}, is_lasting=False)
    (None, None)
    """
    if is_lasting:
        parts = [_KEPT.fullmatch(part) for part in re.split(" and (?=always )", formula)]
        kept = [(part[1] or part[2], _us(part[3])) for part in parts if part]
        if len(kept) < len(parts) or not fluents >= {fluent for fluent, _ in kept}:
            return None
        # Of a fluent that comes twice the shorter time is over first.
        return partial(NotLostFor, dict(sorted(kept, key=lambda one: -one[1])))
    held = _HELD.fullmatch(formula) or _NOW.fullmatch(formula)
    if held is None:
        return None
    names, last = (held[group].strip("() ").split(" and ") for group in (1, held.lastindex or 1))
    if not fluents >= {*names, *last} or not {*last} >= {*names}:
        return None
    return partial(HeldFor, names, _us(held.groupdict().get("for")), [one for one in last if one not in names])


def _us(text: str | None) -> int:
    return int((text or "0").removesuffix("us"))


_NAMES = r"\w+(?: and \w+)*"
_US = r"0|\d+us"
_NOW = re.compile(rf"({_NAMES})")
_HELD = re.compile(rf"(\w+|\( {_NAMES} \)) until \[ (?P<for>{_US}) , oo \] (\w+|\( {_NAMES} \))")
_KEPT = re.compile(rf"always (?:(\w+)|not \( not (\w+) until \[ ({_US}) , oo \] not \2 \))")
