"""Does an event fit a pattern, and which values does it give to the variables?"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from operator import itemgetter

from chronicles.compilation.plan import EventTest
from chronicles.compilation.symbols import UNKNOWN
from chronicles.events import Event

Values = tuple[str, ...]
EventMatcher = Callable[[Event], Values | None]


def event_matcher(test: EventTest, fields: Sequence[int]) -> EventMatcher:
    """Make the function that tests an event.

    Parameters
    ----------
    test : what the event must look like; its name is not tested.
    fields : which fields of a fitting event the function returns.

    Examples
    --------
    >>> matcher = event_matcher(EventTest("honk", 2, is_change=False, constants=((0, "car1"),)), [1])
    >>> matcher(Event("honk", ("car1", "car2"), 0)), matcher(Event("honk", ("car3", "car2"), 0))
    (('car2',), None)
    """
    pick = _picker(fields)
    if not (test.is_change or test.constants or test.filters or test.equal or test.different):
        return _message_matcher(test.arity, tuple(fields), pick)
    constants, arity, is_change = test.constants, test.arity, test.is_change
    is_limited = bool(test.filters or test.equal or test.different)

    def match(event: Event) -> Values | None:
        """Give the values of the variables, or None if the event does not fit."""
        values = event.args
        if len(values) != arity or (event.new is not None) != is_change:
            return None
        if is_change:
            old, new = event.old or UNKNOWN, event.new or UNKNOWN
            if old == new:  # a value stated again is no change
                return None
            values = (*values, old, new)
        for field, text in constants:
            if values[field] != text:
                return None
        if is_limited and not _is_allowed(test, values):
            return None
        return pick(values)

    return match


def _is_allowed(test: EventTest, values: Values) -> bool:
    return (
        all(values[field] in allowed for field, allowed in test.filters)
        and all(values[first] == values[second] for first, second in test.equal)
        and all(values[first] != values[second] for first, second in test.different)
    )


def _message_matcher(arity: int, fields: tuple[int, ...], pick: Callable[[Values], Values]) -> EventMatcher:
    takes_all = fields == tuple(range(arity))

    def match(event: Event) -> Values | None:
        """Give the values of the arguments, or None if the event does not fit."""
        args = event.args
        if len(args) != arity or event.new is not None:
            return None
        return args if takes_all else pick(args)

    return match


def _picker(fields: Sequence[int]) -> Callable[[Values], Values]:
    if len(fields) > 1:
        return itemgetter(*fields)
    if len(fields) == 1:
        only = fields[0]
        return lambda values: (values[only],)
    return lambda values: ()
