"""What is inside a formula? Its parts, the features it looks at, the variables that it leaves free, and its windows.

`with_objects` puts objects in the place of variables. `window_changes` and `horizon_us` say what windows cost and how
far they reach.
"""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import fields, is_dataclass, replace
from typing import Any, cast  # Any: the fields of formulas and terms are of many types

from dyknow.mtl import formula as model
from dyknow.mtl.formula import Formula, Term

MOST_CHANGES = 5
_TENSES = model.Always | model.Eventually | model.Until | model.Next | model.Tolerate


def parts_of(formula: Formula) -> tuple[Formula, ...]:
    """Give the formulas directly inside a formula, in the order of the text.

    Examples
    --------
    >>> from dyknow.mtl.formula import Not, Truth
    >>> parts_of(Not(Truth(True)))
    (Truth(value=True),)
    """
    match formula:
        case model.And(parts) | model.Or(parts):
            return parts
        case model.Implies(left, right) | model.Iff(left, right) | model.Until(left, right):
            return (left, right)
        case model.Truth() | model.Proposition() | model.Comparison():
            return ()
        case _:
            return (formula.body,)


def every_part(formula: Formula) -> Iterator[Formula]:
    """Give a formula and all formulas inside it, outer ones first, in the order of the text."""
    yield formula
    for part in parts_of(formula):
        yield from every_part(part)


def has_tense(formula: Formula) -> bool:
    """Tell whether a formula looks beyond one state.

    Examples
    --------
    >>> from dyknow.mtl.formula import Next, Not, Truth
    >>> has_tense(Not(Truth(True))), has_tense(Not(Next(Truth(True))))
    (False, True)
    """
    return any(isinstance(one, _TENSES) for one in every_part(formula))


def free_variables(formula: Formula) -> tuple[str, ...]:
    """Give the names of the variables that no quantifier binds, each once, in the order of the text.

    Examples
    --------
    >>> from dyknow.mtl.formula import Feature, Object, Proposition, Variable
    >>> free_variables(Proposition(Feature("behind", (Variable("a"), Object("car7")))))
    ('a',)
    """
    return tuple(dict.fromkeys(_free(formula)))


def _free(formula: Formula) -> Iterator[str]:
    bound = formula.variable.name if isinstance(formula, model.Quantified) else None
    for atom in _atoms(formula):
        arguments = atom.arguments if isinstance(atom, model.Feature) else (atom,)
        yield from (one.name for one in arguments if isinstance(one, model.Variable))
    for part in parts_of(formula):
        yield from (name for name in _free(part) if name != bound)


def _atoms(part: Formula | Term) -> Iterator[model.Feature | model.Variable]:
    """Give the features and variables of a term, or of a formula that is made of terms; in the order of the text."""
    match part:
        case model.Feature() | model.Variable():
            yield part
        case model.Proposition(feature) | model.Scaled(feature=feature):
            yield feature
        case model.Comparison(left=left, right=right) | model.Sum(left=left, right=right):
            yield from _atoms(left)
            yield from _atoms(right)


def with_objects(formula: Formula, objects: Mapping[str, str]) -> Formula:
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
    return cast(Formula, _with_objects(formula, objects))


def _with_objects(part: Any, objects: Mapping[str, str]) -> Any:
    match part:
        case model.Variable(name):
            return model.Text(objects[name]) if name in objects else part
        case model.Feature(name, arguments):
            found = (
                model.Object(objects[one.name]) if one.name in objects and isinstance(one, model.Variable) else one
                for one in arguments
            )
            return model.Feature(name, tuple(found))
        case model.Quantified(variable=variable):
            objects = {name: one for name, one in objects.items() if name != variable.name}
        case tuple():
            return tuple(_with_objects(one, objects) for one in part)
    if not is_dataclass(part) or isinstance(part, type):
        return part
    return replace(part, **{one.name: _with_objects(getattr(part, one.name), objects) for one in fields(part)})


def features_of(monitors: Iterable[model.Monitor]) -> frozenset[str]:
    """Name the features that monitors look at.

    Examples
    --------
    >>> from dyknow.mtl.parser import parse_monitors
    >>> text = "monitor polite per Car: always (close[?c, car1] implies speed[?c] + 2 * gain[?c] < 50 km/h)"
    >>> sorted(features_of(parse_monitors(text)))
    ['close', 'gain', 'speed']
    """
    every_atom = (atom for one in monitors for part in every_part(one.formula) for atom in _atoms(part))
    return frozenset(atom.name for atom in every_atom if isinstance(atom, model.Feature))


def window_changes(formula: Formula) -> int:
    """Count the longest chain of operators inside each other that are "everywhere" and "somewhere" in turn.

    What is left of ``always[0, 1s] eventually[0, 1s] always[0, 1s] ... p`` is a conjunction over the states of a window
    of disjunctions over the states of a window, and so on: with each change its size is multiplied by the states of a
    window, and no merging helps. Windows of one kind inside each other merge. Operators without a window count only
    around such a chain: around a single window they merge.

    Examples
    --------
    >>> from dyknow.mtl.parser import parse_formula
    >>> window_changes(parse_formula("always (not p implies eventually[0s, 1s] always[0s, 1s] p)"))
    3
    >>> window_changes(parse_formula("eventually[0s, 1s] not always[0s, 1s] p"))
    1
    >>> window_changes(parse_formula("always eventually always p"))
    0
    """
    return max(_chains(formula))


def _chains(formula: Formula) -> tuple[int, int]:  # noqa: PLR0911 - one case per kind of formula
    """Give the longest chains that begin with an operator that is universal, and with one that is existential."""
    inner = [_chains(part) for part in parts_of(formula)]
    universal = max((one[0] for one in inner), default=0)
    existential = max((one[1] for one in inner), default=0)
    match formula:
        case model.Not():
            return existential, universal
        case model.Implies():
            (left_universal, left_existential), (right_universal, right_existential) = inner
            return max(left_existential, right_universal), max(left_universal, right_existential)
        case model.Iff():
            return (max(universal, existential),) * 2
        case model.Always(window=window):
            return _around(universal, existential, window), existential
        case model.Eventually(window=window) | model.Until(window=window):
            return universal, _around(existential, universal, window)
        case model.Tolerate(return_us=return_us, stay_us=stay_us):
            stays = _around(universal, existential, model.Window(0, stay_us))
            return universal, max(existential, _around(existential, stays, model.Window(0, return_us)))
        case _:
            return universal, existential


def _around(same: int, other: int, window: model.Window) -> int:
    counts = window != model.ALWAYS_OPEN or max(same, other) > 1
    return max(same, other + 1) if counts else same


def horizon_us(formula: Formula) -> int:
    """Give the time after which all that one state asks is decided, as far as windows end.

    A window without an end counts up to its start. ``next`` counts a microsecond: any later state decides it.

    Examples
    --------
    >>> from dyknow.mtl.parser import parse_formula
    >>> horizon_us(parse_formula("always (stopped implies eventually[0s, 10s] always[0s, 2s] not stopped)"))
    12000000
    >>> horizon_us(parse_formula("always calm"))
    0
    """
    inner_us = max(map(horizon_us, parts_of(formula)), default=0)
    match formula:
        case model.Always(window=window) | model.Eventually(window=window) | model.Until(window=window):
            return _length_us(window) + inner_us
        case model.Tolerate(return_us=return_us, stay_us=stay_us):
            return return_us + stay_us + inner_us
        case model.Next():
            return 1 + inner_us
        case _:
            return inner_us


def _length_us(window: model.Window) -> int:
    return window.start_us if window.end_us is None else window.end_us
