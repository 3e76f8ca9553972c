"""Which residual follows before the next deadline? Then the time of a state does not matter, only what it shows.

Between two deadlines of a residual, a state that opens no new window leaves the same behind whenever it comes. So does
one whose new windows are all made superfluous at once, if that does not hang on when they were opened. Such steps are
remembered, so that states at irregular times cost little while nothing is at stake.
"""

from __future__ import annotations

from dyknow.mtl.progression.automaton import Values, verdict_of
from dyknow.mtl.progression.residual import STARTED_US, Guarded, Junction, Residual, Waiting, is_timeless
from dyknow.mtl.progression.templates import NEVER_US, Operator, Shape, Template, every


class Lull:
    """A residual until its next deadline.

    Attributes
    ----------
    until_us : the first time at which a window of the residual opens or ends; only before it the edges are valid.
    edges : what follows a state, by the values of the tests.
    """

    __slots__ = ("edges", "residual", "until_us", "verdict")

    def __init__(self, residual: Residual) -> None:
        self.residual = residual
        self.verdict = verdict_of(residual)
        self.until_us = _next_deadline(residual)
        self.edges: dict[Values, Lull] = {}


def leads_alike(before: Residual, after: Residual, *, opens_in_order: bool) -> bool:
    """Tell whether a step that opened windows leaves the same at any other time before the next deadline.

    From a residual without times, another time moves all that is left by the same amount; where nothing of it has a
    time, it is the same. With windows that open in order, which of two is superfluous does not hang on the time of the
    state: whatever was open before ends before what is opened now. So the same parts stay, whenever the state comes,
    and they are the same if none of them is new.

    Parameters
    ----------
    before, after : what was left before and after the state; of one progressor, and without sorts over time.
    opens_in_order : see `opens_in_order`, of the formula.
    """
    if is_timeless(before):
        return is_timeless(after)
    return opens_in_order and _ends(after) <= _ends(before)


def opens_in_order(template: Template) -> bool:
    """Tell whether of two windows of one shape the one that was opened later always ends later.

    It is so where every shape has one window, and that begins in the state where it is asked.

    Examples
    --------
    >>> from dyknow.mtl.parser import parse_formula
    >>> from dyknow.mtl.progression.templates import TemplateMaker
    >>> def of(text):
    ...     return opens_in_order(TemplateMaker().make(parse_formula(text), ()))
    >>> of("always (p implies eventually[0s, 2s] q)"), of("always (p implies eventually[1s, 2s] q)")
    (True, False)
    >>> of("always ((p implies eventually[0s, 2s] q) and (r implies eventually[0s, 9s] q))")
    False
    """
    ends_us: dict[Shape, int] = {}
    return all(
        one.start_us == 0 and ends_us.setdefault(one.shape, one.end_us) == one.end_us
        for one in every(template)
        if isinstance(one, Operator)
    )


def _ends(residual: Residual) -> set[tuple[Shape, int]]:
    """Give the windows of a residual that end; all began by now, and all are about the same objects."""
    match residual:
        case Waiting(shape, end_us=end_us) if end_us != NEVER_US:
            return {(shape, end_us)}
        case Guarded(inner=inner):
            return _ends(inner)
        case Junction(parts=parts):
            return set().union(*map(_ends, parts))
        case _:
            return set()


def _next_deadline(residual: Residual) -> int:
    match residual:
        case Waiting(start_us=start_us, end_us=end_us):
            return end_us if start_us == STARTED_US else start_us
        case Guarded(inner=inner):
            return _next_deadline(inner)
        case Junction(parts=parts):
            return min(map(_next_deadline, parts))
        case _:
            return NEVER_US
