"""How much is a number with a unit? Durations in integer microseconds, everything else in metres, m/s and radians."""

from __future__ import annotations

import math
from decimal import Decimal
from types import MappingProxyType

from dyknow.mtl.formula import Number

US_PER_UNIT = MappingProxyType({"us": 1, "ms": 1_000, "s": 1_000_000, "min": 60_000_000, "h": 3_600_000_000})
LARGEST_US = 2**50  # 35 years: sums with time stamps stay far inside 64 bits
_SI_PER_UNIT = MappingProxyType(
    {"m": 1.0, "km": 1000.0, "m/s": 1.0, "km/h": 1 / 3.6, "m/s2": 1.0, "rad": 1.0, "deg": math.pi / 180, "": 1.0}
)
UNITS = tuple(unit for unit in (*US_PER_UNIT, *_SI_PER_UNIT) if unit)


def to_us(amount: Decimal, unit: str) -> int | None:
    """Convert a duration exactly; None where that is no whole number of microseconds.

    Examples
    --------
    >>> to_us(Decimal("1.5"), "ms"), to_us(Decimal("0.1"), "us")
    (1500, None)
    """
    us = amount * US_PER_UNIT[unit]
    return int(us) if us == us.to_integral_value() else None


def value_of(number: Number) -> float:
    """Give the value that a number is compared by: microseconds, metres, m/s, m/s2, radians, or itself.

    Examples
    --------
    >>> value_of(Number(Decimal(36), "km/h")), value_of(Number(Decimal(2), "s")), value_of(Number(Decimal("-1.5")))
    (10.0, 2000000, -1.5)
    """
    if number.unit in US_PER_UNIT:
        us = to_us(number.amount, number.unit)
        return us if us is not None else float(number.amount * US_PER_UNIT[number.unit])
    value = float(number.amount) * _SI_PER_UNIT[number.unit]
    return int(value) if not number.unit and number.amount == number.amount.to_integral_value() else value


def format_duration(us: int) -> str:
    """Write a duration with the largest unit that keeps it a whole number.

    Examples
    --------
    >>> format_duration(1_500_000), format_duration(120_000_000), format_duration(0)
    ('1500ms', '2min', '0s')
    """
    if us == 0:
        return "0s"
    unit = max((unit for unit in US_PER_UNIT if us % US_PER_UNIT[unit] == 0), key=lambda unit: US_PER_UNIT[unit])
    return f"{us // US_PER_UNIT[unit]}{unit}"
