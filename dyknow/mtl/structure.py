"""What is inside a formula? Its parts, whether it looks beyond one state, and the variables that it leaves free."""

from __future__ import annotations

from collections.abc import Iterator

from dyknow.mtl.formula import (
    Always,
    And,
    Comparison,
    Eventually,
    Feature,
    Formula,
    Iff,
    Implies,
    Next,
    Not,
    Or,
    Proposition,
    Quantified,
    Scaled,
    Sum,
    Term,
    Tolerate,
    Until,
    Variable,
)


def parts_of(formula: Formula) -> tuple[Formula, ...]:
    """Give the formulas directly inside a formula, in the order of the text.

    Examples
    --------
    >>> from dyknow.mtl.formula import Truth
    >>> parts_of(Not(Truth(True)))
    (Truth(value=True),)
    """
    match formula:
        case And(parts) | Or(parts):
            return parts
        case Implies(left, right) | Iff(left, right) | Until(left, right):
            return (left, right)
        case Not(body) | Quantified(body=body) | Always(body) | Eventually(body) | Next(body) | Tolerate(body):
            return (body,)
        case _:
            return ()


def has_tense(formula: Formula) -> bool:
    """Tell whether a formula looks beyond one state.

    Examples
    --------
    >>> from dyknow.mtl.formula import Truth
    >>> has_tense(Not(Truth(True))), has_tense(Not(Next(Truth(True))))
    (False, True)
    """
    return isinstance(formula, Always | Eventually | Until | Next | Tolerate) or any(map(has_tense, parts_of(formula)))


def free_variables(formula: Formula) -> tuple[str, ...]:
    """Give the names of the variables that no quantifier binds, each once, in the order of the text.

    Examples
    --------
    >>> from dyknow.mtl.formula import Object
    >>> free_variables(Proposition(Feature("behind", (Variable("a"), Object("car7")))))
    ('a',)
    """
    return tuple(dict.fromkeys(_free(formula)))


def _free(formula: Formula) -> Iterator[str]:
    if isinstance(formula, Proposition):
        yield from _variables(formula.feature)
    elif isinstance(formula, Comparison):
        yield from _variables(formula.left)
        yield from _variables(formula.right)
    elif isinstance(formula, Quantified):
        yield from (name for name in _free(formula.body) if name != formula.variable.name)
    else:
        for part in parts_of(formula):
            yield from _free(part)


def _variables(term: Term) -> Iterator[str]:
    if isinstance(term, Variable):
        yield term.name
    elif isinstance(term, Feature):
        yield from (argument.name for argument in term.arguments if isinstance(argument, Variable))
    elif isinstance(term, Scaled):
        yield from _variables(term.feature)
    elif isinstance(term, Sum):
        yield from _variables(term.left)
        yield from _variables(term.right)
