"""What does one state leave of a formula? The rules of progression, one function for each question.

After F. Bacchus and F. Kabanza, "Planning for temporally extended goals" (1998), as used for execution monitoring in
F. Heintz, "DyKnow" (2009), chapter 7. Departures: windows become absolute when an operator is first asked, so that
nothing is rewritten while it waits; what is not known is a value of its own; a window is closed by the state at its
right end, which is in.
"""

import operator

from dyknow.mtl.progression.residual import (
    FALSE,
    STARTED_US,
    TRUE,
    UNKNOWN,
    Expected,
    Guarded,
    Junction,
    Known,
    Moment,
    Residual,
    Waiting,
)
from dyknow.mtl.progression.state_test import Bound
from dyknow.mtl.progression.table import FormulaTable
from dyknow.mtl.progression.templates import NEVER_US, Following, ForEach, Joined, Operator, Shape, Template, Test


def ask(template: Template, bound: Bound, moment: Moment, table: FormulaTable) -> Residual:
    """Ask a formula in a state: what must the following states satisfy, if anything?

    Parameters
    ----------
    template : the formula.
    bound : the objects of its free variables.
    moment : the state.
    table : makes the residuals.
    """
    key = (template, bound)
    found = moment.memo.get(key)
    if found is None:
        found = moment.memo[key] = _asked(template, bound, moment, table)
    return found


def progress(residual: Residual, moment: Moment, table: FormulaTable) -> Residual:
    """Take one more state: what is left of a residual after it?"""
    found = moment.memo.get(residual)
    if found is None:
        found = moment.memo[residual] = _progressed(residual, moment, table)
    return found


def advance(residual: Residual, t_us: int, table: FormulaTable) -> Residual:  # noqa: PLR0911 - one rule after another
    """Let time pass without a state: what is left if no state comes before a time?

    A window that ends before it is over: nothing can happen in it any more, and nothing can go wrong. One that is open
    by then is open already, as no state can tell the difference.

    Parameters
    ----------
    residual : made by `table`, in its present generation.
    t_us : the next state is at this time or later.
    table : makes the residuals.

    Returns
    -------
    The same object where nothing changes.
    """
    if isinstance(residual, Waiting):
        if residual.end_us < t_us:
            return TRUE if residual.shape.is_universal else FALSE
        if STARTED_US < residual.start_us <= t_us:
            return table.waiting(residual.shape, residual.bound, STARTED_US, residual.end_us)
        return residual
    if isinstance(residual, Guarded):
        inner = advance(residual.inner, t_us, table)
        return residual if inner is residual.inner else table.guarded(residual.sort, residual.member, inner)
    if isinstance(residual, Junction):
        parts = [advance(part, t_us, table) for part in residual.parts]
        if all(map(operator.is_, parts, residual.parts)):
            return residual
        return table.join(parts, is_conjunction=residual.is_conjunction)
    return residual


def finish(residual: Residual) -> Residual:
    """End the sequence: no state comes any more, so nothing can happen and nothing can go wrong."""
    match residual:
        case Waiting(shape):
            return TRUE if shape.is_universal else FALSE
        case Expected(following):
            return FALSE if following.is_strong else TRUE
        case Guarded(inner=inner):
            return finish(inner)
        case Junction(is_conjunction, parts):
            return _joined_known([finish(part) for part in parts], is_conjunction=is_conjunction)
        case _:
            return residual


def _asked(template: Template, bound: Bound, moment: Moment, table: FormulaTable) -> Residual:
    if isinstance(template, Test):
        value = template.holds(moment.state, bound)
        return TRUE if value is True else FALSE if value is False else UNKNOWN
    if isinstance(template, Operator):
        t_us, end_us = moment.t_us, template.end_us
        until_us = t_us + end_us if end_us != NEVER_US else NEVER_US
        return _unrolled(template.shape, bound, t_us + template.start_us, until_us, None, moment, table)
    if isinstance(template, Joined):
        decisive = FALSE if template.is_conjunction else TRUE
        parts: list[Residual] = []
        for part in template.parts:
            asked = ask(part, bound, moment, table)
            if asked is decisive:
                return decisive
            parts.append(asked)
        return table.join(parts, is_conjunction=template.is_conjunction)
    if isinstance(template, Following):
        return table.expected(template, bound)
    return _asked_for_each(template, bound, moment, table)


def _asked_for_each(template: ForEach, bound: Bound, moment: Moment, table: FormulaTable) -> Residual:
    decisive = FALSE if template.is_universal else TRUE
    parts: list[Residual] = []
    for member in moment.state.members(template.sort):
        asked = ask(template.body, (*bound, member), moment, table)
        if asked is decisive:
            return decisive
        parts.append(table.guarded(template.sort, member, asked))
    return table.join(parts, is_conjunction=template.is_universal)


def _progressed(residual: Residual, moment: Moment, table: FormulaTable) -> Residual:
    if isinstance(residual, Waiting):
        return _unrolled(residual.shape, residual.bound, residual.start_us, residual.end_us, residual, moment, table)
    if isinstance(residual, Junction):
        return _progressed_junction(residual, moment, table)
    if isinstance(residual, Guarded):
        sort, member = residual.sort, residual.member
        if not moment.has_member(sort, member):
            return _left(residual.inner, moment.t_us)
        return table.guarded(sort, member, progress(residual.inner, moment, table))
    if isinstance(residual, Expected):
        return ask(residual.following.body, residual.bound, moment, table)
    return residual


def _progressed_junction(junction: Junction, moment: Moment, table: FormulaTable) -> Residual:
    decisive = FALSE if junction.is_conjunction else TRUE
    has_changed = False
    parts: list[Residual] = []
    for part in junction.parts:
        progressed = progress(part, moment, table)
        if progressed is decisive:
            return decisive
        has_changed = has_changed or progressed is not part
        parts.append(progressed)
    return table.join(parts, is_conjunction=junction.is_conjunction) if has_changed else junction


def _unrolled(  # noqa: PLR0917 - the inner loop: keywords cost
    shape: Shape,
    bound: Bound,
    start_us: int,
    end_us: int,
    waiting: Waiting | None,
    moment: Moment,
    table: FormulaTable,
) -> Residual:
    """Take one state of a window: what the body says now, joined with the same operator from the next state on."""
    t_us = moment.t_us
    is_universal = shape.is_universal
    neutral, decisive = (TRUE, FALSE) if is_universal else (FALSE, TRUE)
    if t_us > end_us:
        return neutral
    now: Residual = neutral
    if t_us >= start_us:
        now = ask(shape.body, bound, moment, table)
        if now is decisive or t_us == end_us:
            return now
    if waiting is not None and (start_us == STARTED_US or t_us < start_us):
        later: Residual = waiting
    else:
        later = table.waiting(shape, bound, STARTED_US if t_us >= start_us else start_us, end_us)
    if shape.other is not None:
        other = ask(shape.other, bound, moment, table)
        later = table.join((other, later), is_conjunction=not is_universal)
    return later if now is neutral else table.join((later, now), is_conjunction=is_universal)


def _left(residual: Residual, t_us: int) -> Residual:
    """Close what is asked about an object that is not there any more: a window that is over has its answer."""
    match residual:
        case Waiting(shape, end_us=end_us) if end_us < t_us:
            return TRUE if shape.is_universal else FALSE
        case Guarded(inner=inner):
            return _left(inner, t_us)
        case Junction(is_conjunction, parts):
            return _joined_known([_left(part, t_us) for part in parts], is_conjunction=is_conjunction)
        case Known():
            return residual
        case _:
            return UNKNOWN


def _joined_known(parts: list[Residual], *, is_conjunction: bool) -> Residual:
    neutral, decisive = (TRUE, FALSE) if is_conjunction else (FALSE, TRUE)
    if decisive in parts:
        return decisive
    return UNKNOWN if UNKNOWN in parts else neutral
