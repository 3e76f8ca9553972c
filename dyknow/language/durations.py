"""How long is a number with a unit of time? Durations are integer microseconds in every language."""

from __future__ import annotations

from decimal import Decimal
from types import MappingProxyType

US_PER_UNIT = MappingProxyType({"us": 1, "ms": 1_000, "s": 1_000_000, "min": 60_000_000, "h": 3_600_000_000})
LARGEST_US = 2**50  # 35 years: sums with time stamps stay far inside 64 bits


def to_us(amount: Decimal, unit: str) -> int | None:
    """Convert a duration exactly; None where that is no whole number of microseconds.

    Examples
    --------
    >>> to_us(Decimal("1.5"), "ms"), to_us(Decimal("0.1"), "us")
    (1500, None)
    """
    us = amount * US_PER_UNIT[unit]
    return int(us) if us == us.to_integral_value() else None


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
