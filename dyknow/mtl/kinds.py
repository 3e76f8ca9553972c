"""What is the value of a feature: a truth value, a word, a speed, a length? Only values of one kind can be compared.

Durations count in integer microseconds, everything else in metres, m/s and radians.
"""

import math
from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from enum import Enum

from dyknow.language.diagnostics import Reporter, suggest
from dyknow.language.durations import US_PER_UNIT
from dyknow.language.reading import Node
from dyknow.mtl.formula import Comparison, Feature, Number, Scaled, Sum, Term, Text, Variable
from dyknow.mtl.printer import print_term


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


NUMERIC = frozenset({Kind.NUMBER, Kind.LENGTH, Kind.SPEED, Kind.ACCELERATION, Kind.ANGLE, Kind.DURATION})
# Of each unit its kind, and how much it is in the unit that values of the kind are compared in.
_UNITS: Mapping[str, tuple[Kind, float]] = {
    **{unit: (Kind.DURATION, float(us)) for unit, us in US_PER_UNIT.items()},
    "m": (Kind.LENGTH, 1.0),
    "km": (Kind.LENGTH, 1000.0),
    "m/s": (Kind.SPEED, 1.0),
    "km/h": (Kind.SPEED, 1 / 3.6),
    "m/s2": (Kind.ACCELERATION, 1.0),
    "rad": (Kind.ANGLE, 1.0),
    "deg": (Kind.ANGLE, math.pi / 180),
    "": (Kind.NUMBER, 1.0),
}
UNITS = tuple(unit for unit in _UNITS if unit)


def kind_of_unit(unit: str) -> Kind:
    """Give the kind of a number with this unit; "" is that of a bare one.

    Examples
    --------
    >>> kind_of_unit("km/h"), kind_of_unit("")
    (<Kind.SPEED: 'speed'>, <Kind.NUMBER: 'number'>)
    """
    return _UNITS[unit][0]


def units_of(kind: Kind) -> tuple[str, ...]:
    """Give the units in which values of a kind are written; none where they have no unit.

    Examples
    --------
    >>> units_of(Kind.SPEED), units_of(Kind.NUMBER), units_of(Kind.WORD)
    (('m/s', 'km/h'), (), ())
    """
    return tuple(unit for unit in UNITS if _UNITS[unit][0] is kind)


def are_comparable(left: Kind, right: Kind) -> bool:
    """Tell whether two kinds can be compared: a number without a unit goes with every other, an object has a name.

    Examples
    --------
    >>> are_comparable(Kind.SPEED, Kind.NUMBER), are_comparable(Kind.SPEED, Kind.LENGTH)
    (True, False)
    """
    if left is right or {left, right} == {Kind.WORD, Kind.OBJECT}:
        return True
    return {left, right} <= NUMERIC and Kind.NUMBER in (left, right)


def with_article(kind: Kind) -> str:
    """Name a kind in a sentence.

    Examples
    --------
    >>> with_article(Kind.ANGLE), with_article(Kind.SPEED)
    ('an angle', 'a speed')
    """
    return f"{'an' if kind.value[0] in 'aeiou' else 'a'} {kind.value}"


def value_of(number: Number) -> float:
    """Give the value that a number is compared by: microseconds, metres, m/s, m/s2, radians, or itself.

    Examples
    --------
    >>> from decimal import Decimal
    >>> value_of(Number(Decimal(36), "km/h")), value_of(Number(Decimal(2), "s")), value_of(Number(Decimal("-1.5")))
    (10.0, 2000000, -1.5)
    """
    if number.unit in US_PER_UNIT:
        us = number.amount * US_PER_UNIT[number.unit]
        return int(us) if us == us.to_integral_value() else float(us)
    value = float(number.amount) * _UNITS[number.unit][1]
    return int(value) if not number.unit and number.amount == number.amount.to_integral_value() else value


@dataclass(frozen=True, slots=True)
class Signature:
    """What a text may speak of.

    Attributes
    ----------
    features : each with its number of arguments.
    sorts : of the objects that quantifiers and monitors go over.
    kinds : of the values of features; a feature that is left out can be compared with anything.
    values : all the words that a feature can be; a feature that is left out takes any.
    events : those features that are events, each as it is written. Of their arguments some may be whichever, ``?``.

    Examples
    --------
    >>> from dyknow.errors import FormulaError
    >>> from dyknow.mtl.parser import parse_formula
    >>> traffic = Signature({"speed": 1, "class": 1}, kinds={"speed": Kind.SPEED}, values={"class": ("car", "bus")})
    >>> try:
    ...     parse_formula('always (speed[x] < 50 m or class[x] = "cra")', signature=traffic)
    ... except FormulaError as error:
    ...     print((error.line, error.column), *[one.message for one in error.diagnostics], sep="\\n")
    (1, 20)
    expected a speed, as 'speed[x]' is, got a length
    expected a value that 'class' can have, got 'cra'
    """

    features: Mapping[str, int]
    sorts: Collection[str] = ()
    kinds: Mapping[str, Kind] = field(default_factory=dict)
    values: Mapping[str, Collection[str]] = field(default_factory=dict)
    events: Mapping[str, str] = field(default_factory=dict)


class KindChecker:
    """Reports what has the wrong kind in one text.

    Parameters
    ----------
    reporter : takes what is found.
    signature : kinds of features and the words that they can be; what it does not say is not checked.
    """

    def __init__(self, reporter: Reporter, signature: Signature) -> None:
        self._reporter = reporter
        self._signature = signature

    def check_proposition(self, feature: Feature, tree: Node) -> None:
        """Check a feature that stands alone."""
        kind = self._signature.kinds.get(feature.name, Kind.TRUTH)
        if kind is not Kind.TRUTH:
            message = f"expected a truth value, got {print_term(feature)!r}, which is {with_article(kind)}"
            self._reporter.error("F0401", message, tree.span, f"compare it: {print_term(feature)} = ...")

    def check_comparison(self, comparison: Comparison, tree: Node) -> None:
        """Check both sides of a comparison, and that they go together."""
        left_tree, sign, right_tree = tree.parts
        left, right = comparison.left, comparison.right
        kinds = self._kind_of(left, left_tree), self._kind_of(right, right_tree)
        if kinds[0] is not None and kinds[1] is not None and not are_comparable(kinds[0], kinds[1]):
            if _has_feature(left) or not _has_feature(right):
                self._mismatch(left, kinds[0], kinds[1], right_tree)
            else:
                self._mismatch(right, kinds[1], kinds[0], left_tree)
            return
        unordered = next((kind for kind in kinds if kind is not None and kind not in NUMERIC), None)
        if unordered is not None and comparison.comparator not in ("=", "!="):
            message = f"expected '=' or '!=' between {unordered.value}s, got {comparison.comparator!r}"
            self._reporter.error("F0403", message, sign.span)
            return
        self._check_word(left, right, right_tree)
        self._check_word(right, left, left_tree)

    def _kind_of(self, term: Term, tree: Node) -> Kind | None:
        """Give the kind of a term; None where it is not known, or was wrong and has been reported."""
        match term:
            case Variable():
                return Kind.OBJECT
            case Text():
                return Kind.WORD
            case Number(unit=unit):
                return kind_of_unit(unit)
            case Feature(name):
                return self._signature.kinds.get(name)
            case Scaled(feature=feature):
                return self._number(feature, tree.parts[1])
            case Sum():
                return self._kind_of_sum(term, tree)

    def _kind_of_sum(self, term: Sum, tree: Node) -> Kind | None:
        left_tree, right_tree = tree.parts
        left, right = self._number(term.left, left_tree), self._number(term.right, right_tree)
        if left is None or right is None:
            return left or right
        if not are_comparable(left, right):
            self._mismatch(term.left, left, right, right_tree)
            return None
        return right if left is Kind.NUMBER else left

    def _number(self, term: Term, tree: Node) -> Kind | None:
        kind = self._kind_of(term, tree)
        if kind is None or kind in NUMERIC:
            return kind
        message = f"expected a number to reckon with, got {print_term(term)!r}, which is {with_article(kind)}"
        self._reporter.error("F0404", message, tree.span)
        return None

    def _mismatch(self, sound: Term, expected: Kind, came: Kind, tree: Node) -> None:
        message = f"expected {with_article(expected)}, as {print_term(sound)!r} is, got {with_article(came)}"
        hint = ""
        if units_of(expected) and came in NUMERIC:
            hint = f"units of {expected.value} are {', '.join(units_of(expected))}"
        elif expected is Kind.TRUTH and isinstance(sound, Feature):
            hint = f"truth values stand alone: {print_term(sound)}, or not {print_term(sound)}"
        elif expected is Kind.WORD:
            hint = 'words are written in "quotes"'
        self._reporter.error("F0402", message, tree.span, hint)

    def _check_word(self, feature: Term, word: Term, tree: Node) -> None:
        """Check a word against all that the feature can be: of others the comparison would always say the same."""
        if not isinstance(feature, Feature) or not isinstance(word, Text):
            return
        known = self._signature.values.get(feature.name)
        if known is not None and word.text not in known:
            message = f"expected a value that {feature.name!r} can have, got {word.text!r}"
            self._reporter.error("F0405", message, tree.span, suggest(word.text, known))


def _has_feature(term: Term) -> bool:
    if isinstance(term, Sum):
        return _has_feature(term.left) or _has_feature(term.right)
    return isinstance(term, Feature | Scaled)
