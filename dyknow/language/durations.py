"""How long is a number with a unit of time? Durations are integer microseconds in every language."""

import re
from collections.abc import Mapping

from dyknow.language.diagnostics import Hint

US_PER_UNIT: Mapping[str, int] = {"us": 1, "ms": 1_000, "s": 1_000_000, "min": 60_000_000, "h": 3_600_000_000}
LARGEST_US = 2**50  # 35 years: sums with time stamps stay far inside 64 bits
LONGEST_NUMBER = 30  # in characters; Python converts no text of thousands of digits
_QUANTITY = re.compile(r"([0-9.]+)[ \t]*(.*)")
_SPELLINGS: Mapping[str, tuple[str, ...]] = {
    "h": ("h", "hr", "hrs", "hour", "hours"),
    "min": ("m", "min", "mins", "minute", "minutes"),
    "s": ("s", "sec", "secs", "second", "seconds"),
    "ms": ("ms", "msec", "msecs", "millis", "millisecond", "milliseconds"),
    "us": ("us", "usec", "usecs", "micros", "microsecond", "microseconds"),
}
_HOURS: Mapping[str, int] = {"d": 24, "day": 24, "days": 24, "week": 168, "weeks": 168}


def split_quantity(text: str) -> tuple[str, str]:
    """Part the digits of a number from its unit, "" without one.

    Examples
    --------
    >>> split_quantity("2.5 km/h"), split_quantity("7")
    (('2.5', 'km/h'), ('7', ''))
    """
    found = _QUANTITY.fullmatch(text)
    assert found is not None, text
    return found[1], found[2]


def to_us(digits: str, unit_us: int) -> int | None:
    """Convert a duration exactly; None where that is no whole number of microseconds.

    Numbers that are too long to be read count as more than `LARGEST_US`.

    Examples
    --------
    >>> to_us("1.5", 1_000), to_us("0.1", 1)
    (1500, None)
    """
    if len(digits) > LONGEST_NUMBER:
        return LARGEST_US + 1
    whole, _, decimals = digits.partition(".")
    us, rest = divmod(int(whole + decimals) * unit_us, 10 ** len(decimals))
    return None if rest else us


def format_duration(us: int) -> str:
    """Write a duration with the largest unit that keeps it a whole number.

    Examples
    --------
    >>> format_duration(1_500_000), format_duration(-60_000_000), format_duration(0)
    ('1500ms', '-1min', '0s')
    """
    if us == 0:
        return "0s"
    unit = next(unit for unit in reversed([*US_PER_UNIT]) if us % US_PER_UNIT[unit] == 0)
    return f"{us // US_PER_UNIT[unit]}{unit}"


def meant(digits: str, unit: str) -> Hint:
    """Say how a duration with an unknown unit is written; what cannot be known has no edit.

    Examples
    --------
    >>> meant("2.5", "S")
    Hint(text="did you mean '2.5s'?", edit='2.5s')
    >>> meant("2", "days")
    Hint(text='there is no unit above the hour: a day is 24h', edit='48h')
    >>> meant("3", "ticks")
    Hint(text='units are us, ms, s, min, h', edit=None)
    """
    spelled = unit.lower()
    for known, spellings in _SPELLINGS.items():
        if spelled in spellings:
            return Hint(f"did you mean '{digits}{known}'?", f"{digits}{known}")
    if spelled in _HOURS:
        is_short = digits.isdigit() and len(digits) < len("1000000")
        edit = f"{int(digits) * _HOURS[spelled]}h" if is_short else None
        name, hours = ("a day", 24) if _HOURS[spelled] == 24 else ("a week", 168)
        return Hint(f"there is no unit above the hour: {name} is {hours}h", edit)
    return Hint("units are " + ", ".join(US_PER_UNIT))
