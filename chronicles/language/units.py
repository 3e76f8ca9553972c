"""Which unit of time was meant by one that the language does not have?"""

from __future__ import annotations

from types import MappingProxyType

from chronicles.language.diagnostics import Hint
from chronicles.language.printer import US_PER_UNIT

_SPELLINGS = MappingProxyType(
    {
        "h": ("h", "hr", "hrs", "hour", "hours"),
        "min": ("m", "min", "mins", "minute", "minutes"),
        "s": ("s", "sec", "secs", "second", "seconds"),
        "ms": ("ms", "msec", "msecs", "millis", "millisecond", "milliseconds"),
        "us": ("us", "usec", "usecs", "micros", "microsecond", "microseconds"),
    }
)
_HOURS = MappingProxyType({"d": 24, "day": 24, "days": 24, "week": 168, "weeks": 168})


def meant(digits: str, unit: str) -> Hint:
    """Say how a duration with an unknown unit is written; what cannot be known has no edit.

    Examples
    --------
    >>> meant("2.5", "S")
    Hint(text="did you mean '2.5s'?", edit='2.5s')
    >>> meant("2", "days")
    Hint(text='there is no unit above the hour: a day is 24h', edit='48h')
    >>> meant("3", "ticks").edit is None
    True
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
    return Hint("known: " + ", ".join(map(repr, sorted(US_PER_UNIT))))
