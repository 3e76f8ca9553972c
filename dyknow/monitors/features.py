"""Which features does a text of monitors look at? Whoever makes the states need give no others."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from dyknow.mtl.formula import Comparison, Feature, Formula, Monitor, Proposition, Scaled, Sum, Term
from dyknow.mtl.structure import parts_of


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
