"""How much is a number with a unit? Durations in integer microseconds, everything else in metres, m/s and radians."""

from __future__ import annotations

import math
from types import MappingProxyType

from dyknow.language.durations import US_PER_UNIT, to_us
from dyknow.mtl.formula import Number

_SI_PER_UNIT = MappingProxyType(
    {"m": 1.0, "km": 1000.0, "m/s": 1.0, "km/h": 1 / 3.6, "m/s2": 1.0, "rad": 1.0, "deg": math.pi / 180, "": 1.0}
)
UNITS = tuple(unit for unit in (*US_PER_UNIT, *_SI_PER_UNIT) if unit)


def value_of(number: Number) -> float:
    """Give the value that a number is compared by: microseconds, metres, m/s, m/s2, radians, or itself.

    Examples
    --------
    >>> from decimal import Decimal
    >>> value_of(Number(Decimal(36), "km/h")), value_of(Number(Decimal(2), "s")), value_of(Number(Decimal("-1.5")))
    (10.0, 2000000, -1.5)
    """
    if number.unit in US_PER_UNIT:
        us = to_us(number.amount, number.unit)
        return us if us is not None else float(number.amount * US_PER_UNIT[number.unit])
    value = float(number.amount) * _SI_PER_UNIT[number.unit]
    return int(value) if not number.unit and number.amount == number.amount.to_integral_value() else value
