"""What is the value of a feature: a truth value, a word, a speed, a length? Only values of one kind can be compared.

Durations count in integer microseconds, everything else in metres, m/s and radians.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from enum import Enum
from types import MappingProxyType

from dyknow.language.durations import US_PER_UNIT
from dyknow.mtl.formula import Number


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
_UNITS = MappingProxyType(
    {
        Kind.NUMBER: ("",),
        Kind.LENGTH: ("m", "km"),
        Kind.SPEED: ("m/s", "km/h"),
        Kind.ACCELERATION: ("m/s2",),
        Kind.ANGLE: ("rad", "deg"),
        Kind.DURATION: tuple(US_PER_UNIT),
    }
)
_OF_UNIT = MappingProxyType({unit: kind for kind, units in _UNITS.items() for unit in units})

_SI_PER_UNIT = MappingProxyType(
    {"m": 1.0, "km": 1000.0, "m/s": 1.0, "km/h": 1 / 3.6, "m/s2": 1.0, "rad": 1.0, "deg": math.pi / 180, "": 1.0}
)
UNITS = tuple(unit for unit in (*US_PER_UNIT, *_SI_PER_UNIT) if unit)


def kind_of_unit(unit: str) -> Kind:
    """Give the kind of a number with this unit; "" is that of a bare one.

    Examples
    --------
    >>> kind_of_unit("km/h"), kind_of_unit("")
    (<Kind.SPEED: 'speed'>, <Kind.NUMBER: 'number'>)
    """
    return _OF_UNIT[unit]


def units_of(kind: Kind) -> tuple[str, ...]:
    """Give the units in which values of a kind are written; none where they have no unit.

    Examples
    --------
    >>> units_of(Kind.SPEED), units_of(Kind.NUMBER), units_of(Kind.WORD)
    (('m/s', 'km/h'), (), ())
    """
    return tuple(unit for unit in _UNITS.get(kind, ()) if unit)


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
    value = float(number.amount) * _SI_PER_UNIT[number.unit]
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
