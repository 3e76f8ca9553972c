"""What is inside a formula? Its parts, the features it looks at, and the variables that it leaves free.

`with_objects` puts objects in the place of these.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace

from dyknow.mtl.formula import (
    Always,
    And,
    Comparison,
    Eventually,
    Feature,
    Formula,
    Iff,
    Implies,
    Monitor,
    Next,
    Not,
    Object,
    Operand,
    Or,
    Proposition,
    Quantified,
    Scaled,
    Sum,
    Term,
    Text,
    Tolerate,
    Truth,
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


def with_objects(formula: Formula, objects: Mapping[str, str]) -> Formula:  # noqa: PLR0911 - one case per kind
    """Put objects in the place of free variables.

    Parameters
    ----------
    objects : names of objects by names of variables; variables that are left out stay.

    Examples
    --------
    >>> from dyknow.mtl.parser import parse_formula
    >>> from dyknow.mtl.printer import print_formula
    >>> nobody_near = parse_formula("forall ?b in Car: ?a = ?b or not close[?a, ?b]", variables=["a"])
    >>> print_formula(with_objects(nobody_near, {"a": "car7"}))
    'forall ?b in Car: "car7" = ?b or not close[car7, ?b]'
    """

    def inside(part: Formula) -> Formula:
        return with_objects(part, objects)

    match formula:
        case Proposition(feature):
            return Proposition(_feature_with(feature, objects))
        case Comparison(left, comparator, right):
            return Comparison(_term_with(left, objects), comparator, _term_with(right, objects))
        case Quantified(variable=variable, body=body):
            rest = {name: one for name, one in objects.items() if name != variable.name}
            return replace(formula, body=with_objects(body, rest))
        case And(parts) | Or(parts):
            return replace(formula, parts=tuple(map(inside, parts)))
        case Implies(left, right) | Iff(left, right) | Until(left, right):
            return replace(formula, left=inside(left), right=inside(right))
        case Truth():
            return formula
        case _:
            return replace(formula, body=inside(formula.body))


def _feature_with(feature: Feature, objects: Mapping[str, str]) -> Feature:
    found = (
        Object(objects[one.name]) if isinstance(one, Variable) and one.name in objects else one
        for one in feature.arguments
    )
    return Feature(feature.name, tuple(found))


def _term_with(term: Term, objects: Mapping[str, str]) -> Term:
    if isinstance(term, Sum):
        right = _operand_with(term.right, objects)
        return Sum(_term_with(term.left, objects), term.sign, right)
    return _operand_with(term, objects)


def _operand_with(operand: Operand, objects: Mapping[str, str]) -> Operand:
    match operand:
        case Variable(name) if name in objects:
            return Text(objects[name])
        case Feature():
            return _feature_with(operand, objects)
        case Scaled(factor, feature):
            return Scaled(factor, _feature_with(feature, objects))
        case _:
            return operand


def features_of(monitors: Iterable[Monitor]) -> frozenset[str]:
    """Name the features that monitors look at.

    Examples
    --------
    >>> from dyknow.mtl.parser import parse_monitors
    >>> text = "monitor polite per Car: always (close[?c, car1] implies speed[?c] + 2 * gain[?c] < 50 km/h)"
    >>> sorted(features_of(parse_monitors(text)))
    ['close', 'gain', 'speed']
    """
    return frozenset(name for one in monitors for name in _of_formula(one.formula))


def _of_formula(formula: Formula) -> Iterator[str]:
    if isinstance(formula, Proposition):
        yield formula.feature.name
    elif isinstance(formula, Comparison):
        yield from _of_term(formula.left)
        yield from _of_term(formula.right)
    for part in parts_of(formula):
        yield from _of_formula(part)


def _of_term(term: Term) -> Iterator[str]:
    match term:
        case Feature(name=name) | Scaled(feature=Feature(name=name)):
            yield name
        case Sum(left=left, right=right):
            yield from _of_term(left)
            yield from _of_term(right)
