"""How is what is left of a formula written? As a formula again, that asks just as much of the states to come.

Deadlines are absolute while a formula runs, and windows are written relative to a state. So what is left is written for
somebody who asks it in the last state: a window that is open begins a microsecond later, with the next state at the
earliest. What is asked about a member of a sort as long as it stays one is a quantifier that means this member alone.
Only ``<unknown>``, for what will never be known, is no word of the language.
"""

from collections.abc import Callable
from itertools import count
from typing import TypeAlias

from dyknow.mtl import formula as model
from dyknow.mtl.formula import Formula, Quantifier
from dyknow.mtl.printer import print_formula
from dyknow.mtl.progression.residual import Expected, Guarded, Junction, Known, Residual, Waiting
from dyknow.mtl.progression.state_test import Bound
from dyknow.mtl.progression.templates import NEVER_US, Source, Template
from dyknow.mtl.structure import every_part, with_objects

SourceOf: TypeAlias = Callable[[Template], Source]
_UNKNOWN = model.Proposition(model.Feature("<unknown>"))


def print_residual(residual: Residual, t_us: int, source_of: SourceOf) -> str:
    """Write what is left of a formula, on one line.

    Parameters
    ----------
    residual : what is left.
    t_us : time of the last state; in this state the text means what is left.
    source_of : gives the formula of a template, as `TemplateMaker.source_of`.

    Returns
    -------
    A formula of the language, unless ``<unknown>`` is in it.

    Examples
    --------
    >>> from dyknow.mtl.parser import parse_formula
    >>> from dyknow.mtl.progression.residual import STARTED_US
    >>> from dyknow.mtl.progression.templates import Operator, TemplateMaker
    >>> maker = TemplateMaker()
    >>> operator = maker.make(parse_formula("eventually[0s, 1s] p"), ())
    >>> assert isinstance(operator, Operator)
    >>> print_residual(Waiting(operator.shape, (), STARTED_US, 5_000_000), 4_400_000, maker.source_of)
    'eventually[1us, 600ms] p'
    """
    return print_formula(_formula_of(residual, t_us, source_of))


def formula_with_objects(template: Template, bound: Bound, source_of: SourceOf) -> Formula:
    """Give the formula of a template, about the objects that its variables stand for."""
    source = source_of(template)
    formula = with_objects(source.formula, dict(zip(source.scope, bound, strict=True)))
    return _negation(formula) if source.is_negated else formula


def _formula_of(residual: Residual, t_us: int, source_of: SourceOf) -> Formula:
    match residual:
        case Known(value):
            return _UNKNOWN if value is None else model.Truth(value)
        case Waiting():
            return _waiting(residual, t_us, source_of)
        case Expected(following, bound):
            body = formula_with_objects(following.body, bound, source_of)
            return model.Next(body) if following.is_strong else _negation(model.Next(_negation(body)))
        case Guarded(sort, member, inner):
            return _about_member(sort, member, _formula_of(inner, t_us, source_of))
        case Junction(is_conjunction, parts):
            made = tuple(_formula_of(part, t_us, source_of) for part in parts)
            return model.And(made) if is_conjunction else model.Or(made)


def _waiting(waiting: Waiting, t_us: int, source_of: SourceOf) -> Formula:
    shape = waiting.shape
    start_us = max(waiting.start_us - t_us, 1)
    end_us = None if waiting.end_us == NEVER_US else waiting.end_us - t_us
    if end_us is not None and end_us < start_us:
        return model.Truth(shape.is_universal)
    window = model.Window(start_us, end_us)
    body = formula_with_objects(shape.body, waiting.bound, source_of)
    if shape.other is None:
        return model.Always(body, window) if shape.is_universal else model.Eventually(body, window)
    # An until asks its left side in the last state once more: what that left is beside it here already.
    other = formula_with_objects(shape.other, waiting.bound, source_of)
    if shape.is_universal:
        return _negation(model.Until(_negation(other), _negation(body), window))
    return model.Until(other, body, window)


def _about_member(sort: str, member: str, inner: Formula) -> Formula:
    taken = {one.variable.name for one in every_part(inner) if isinstance(one, model.Quantified)}
    names = ("it" if k == 1 else f"it{k}" for k in count(1))
    variable = model.Variable(next(name for name in names if name not in taken))
    is_member = model.Comparison(variable, "=", model.Text(member))
    return model.Quantified(Quantifier.FORALL, variable, sort, model.Implies(is_member, inner))


def _negation(formula: Formula) -> Formula:
    return formula.body if isinstance(formula, model.Not) else model.Not(formula)
