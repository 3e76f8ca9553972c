"""Do monitors compare what can be compared? Every feature has a kind: a truth value, a word, a speed, a length.

The parser knows names and numbers of arguments; that ``speed[?c] < 36 m`` means nothing is found here.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from enum import Enum
from types import MappingProxyType

from dyknow.errors import DyKnowError
from dyknow.mtl.formula import (
    Comparison,
    Feature,
    Formula,
    Monitor,
    Number,
    Proposition,
    Scaled,
    Sum,
    Term,
    Text,
    Variable,
)
from dyknow.mtl.printer import print_formula, print_term
from dyknow.mtl.structure import parts_of


class Kind(Enum):
    """Name what the value of a feature is; `NUMBER` is one without a unit."""

    TRUTH = "truth value"
    WORD = "word"
    OBJECT = "object"
    NUMBER = "number"
    LENGTH = "length"
    SPEED = "speed"
    ACCELERATION = "acceleration"
    ANGLE = "angle"
    DURATION = "duration"


_NUMERIC = frozenset({Kind.NUMBER, Kind.LENGTH, Kind.SPEED, Kind.ACCELERATION, Kind.ANGLE, Kind.DURATION})
_OF_UNIT = MappingProxyType(
    {
        "": Kind.NUMBER,
        **dict.fromkeys(("m", "km"), Kind.LENGTH),
        **dict.fromkeys(("m/s", "km/h"), Kind.SPEED),
        "m/s2": Kind.ACCELERATION,
        **dict.fromkeys(("rad", "deg"), Kind.ANGLE),
        **dict.fromkeys(("us", "ms", "s", "min", "h"), Kind.DURATION),
    }
)


class KindError(DyKnowError):
    """Monitors that compare what cannot be compared; the message lists every place, one a line."""


def check_kinds(monitors: Iterable[Monitor], kinds: Mapping[str, Kind], *, name: str = "monitors") -> None:
    """Refuse monitors that compare values of different kinds, or take something else for a truth value.

    Parameters
    ----------
    kinds : of every feature that the monitors name.
    name : the text's file name or label, for messages.

    Raises
    ------
    KindError
        If there is such a place.

    Examples
    --------
    >>> from dyknow.mtl.parser import parse_monitors
    >>> careful = parse_monitors("monitor careful per Car: always speed[?c] < 50 m")
    >>> check_kinds(careful, {"speed": Kind.SPEED})
    Traceback (most recent call last):
    dyknow.monitors.kinds.KindError: monitors: monitor 'careful': expected values of one kind in 'speed[?c] < 50 m',
    got a speed and a length
    """
    found = [f"monitor {one.name!r}: {problem}" for one in monitors for problem in _problems(one.formula, kinds)]
    if found:
        raise KindError("\n".join(f"{name}: {problem}" for problem in found))


def _problems(formula: Formula, kinds: Mapping[str, Kind]) -> Iterator[str]:
    if isinstance(formula, Proposition):
        kind = kinds[formula.feature.name]
        if kind is not Kind.TRUTH:
            yield f"expected a truth value in {print_formula(formula)!r}, got {_article(kind)}; compare it"
    elif isinstance(formula, Comparison):
        yield from _problems_of_comparison(formula, kinds)
    for part in parts_of(formula):
        yield from _problems(part, kinds)


def _problems_of_comparison(comparison: Comparison, kinds: Mapping[str, Kind]) -> Iterator[str]:
    sides: list[Kind] = []
    for term in (comparison.left, comparison.right):
        kind = _kind_of(term, kinds)
        if isinstance(kind, str):
            yield kind
        else:
            sides.append(kind)
    if len(sides) < 2:
        return
    left, right = sides
    shown = print_formula(comparison)
    if not _fit(left, right):
        yield f"expected values of one kind in {shown!r}, got {_article(left)} and {_article(right)}"
    elif left not in _NUMERIC and comparison.comparator not in ("=", "!="):
        yield f"expected = or != between {left.value}s in {shown!r}, got {comparison.comparator!r}"


def _kind_of(term: Term, kinds: Mapping[str, Kind]) -> Kind | str:
    """Give the kind of a term, or what is wrong with it."""
    match term:
        case Variable():
            return Kind.OBJECT
        case Text():
            return Kind.WORD
        case Number(unit=unit):
            return _OF_UNIT[unit]
        case Feature(name=feature):
            return kinds[feature]
        case Scaled(feature=feature):
            kind = kinds[feature.name]
            return kind if kind in _NUMERIC else f"expected a number in {print_term(term)!r}, got {_article(kind)}"
        case Sum(left, _, right):
            return _kind_of_sum(term, _kind_of(left, kinds), _kind_of(right, kinds))


def _kind_of_sum(term: Sum, left: Kind | str, right: Kind | str) -> Kind | str:
    for side in (left, right):
        if isinstance(side, str):
            return side
        if side not in _NUMERIC:
            return f"expected numbers in {print_term(term)!r}, got {_article(side)}"
    assert isinstance(left, Kind)
    assert isinstance(right, Kind)
    if not _fit(left, right):
        return f"expected numbers of one kind in {print_term(term)!r}, got {_article(left)} and {_article(right)}"
    return right if left is Kind.NUMBER else left


def _fit(left: Kind, right: Kind) -> bool:
    """Tell whether two kinds can be compared: a number without a unit goes with every other, an object has a name."""
    if left is right or {left, right} == {Kind.WORD, Kind.OBJECT}:
        return True
    return {left, right} <= _NUMERIC and Kind.NUMBER in (left, right)


def _article(kind: Kind) -> str:
    return f"{'an' if kind.value[0] in 'aeiou' else 'a'} {kind.value}"
