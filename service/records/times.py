"""How are times read and written at the edge of the service?

Inside, a time is an integer number of microseconds. At the edge a time point may be given in media time (`12500000`,
`12.5s`, `01:23.5`, `1:02:03`) or on the UTC calendar (RFC 3339), and is shown as RFC 3339 with six decimals.
"""

import re
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from fractions import Fraction
from typing import Literal

from service.errors import QueryError

EPOCH = datetime(1970, 1, 1, tzinfo=UTC)
MICROSECOND = timedelta(microseconds=1)
MAX_MEDIA_US = 10**15  # about 31 years, far below what an SQL bigint holds

# A source may start between these: the calendar has room for any media time after it, in any zone.
FIRST_UTC, LAST_UTC = datetime(1900, 1, 1, tzinfo=UTC), datetime(9900, 1, 1, tzinfo=UTC)

_MEDIA = "microseconds of media time (12500000), seconds (12.5s) or mm:ss (01:23.5)"
_SECONDS = re.compile(r"(\d{1,12}(?:\.\d{1,9})?)s", re.ASCII)
_CLOCK = re.compile(r"(?:(\d{1,6}):)?(\d{1,2}):(\d{2}(?:\.\d{1,9})?)", re.ASCII)
_INTEGER = re.compile(r"\d{1,18}", re.ASCII)
_RFC3339 = re.compile(r"\d{4}-\d{2}-\d{2}[Tt ]\d{2}:\d{2}:\d{2}(?:\.\d{1,9})?(?:[Zz]|[+-]\d{2}:\d{2})", re.ASCII)


# No struct, since the command line reads times before it loads anything.
@dataclass(frozen=True, slots=True)
class TimePoint:
    """A time point on one of two clocks.

    Attributes
    ----------
    us : microseconds since the start of the source (media), or since 1970-01-01 (utc).
    """

    us: int
    clock: Literal["media", "utc"]


def parse_time(text: str, *, parameter: str) -> TimePoint:
    """Read a time point as users write it.

    Parameters
    ----------
    text : `12500000`, `12.5s`, `01:23.5`, `1:02:03` (media time) or RFC 3339 with an offset (UTC).
    parameter : what the value was given for, named in the error.

    Raises
    ------
    QueryError
        If the text is none of these.

    Examples
    --------
    >>> parse_time("12.5s", parameter="from")
    TimePoint(us=12500000, clock='media')
    >>> parse_time("01:02.25", parameter="from").us
    62250000
    >>> parse_time("2026-05-01T10:00:00+02:00", parameter="to") == parse_time("2026-05-01T08:00:00Z", parameter="to")
    True
    """
    media_us = _parse_media_us(text)
    if media_us is not None:
        return TimePoint(media_us, "media")
    if _RFC3339.fullmatch(text):
        try:
            return TimePoint(utc_us(datetime.fromisoformat(text.upper())), "utc")
        except (ValueError, OverflowError):
            pass  # a 30th of February, or a year no calendar holds: the message below says what is wanted
    raise QueryError(
        f"{parameter}: expected {_MEDIA}, or RFC 3339 with an offset (2026-05-01T08:00:00Z), got {text!r}",
        parameter=parameter,
    )


def parse_media_us(text: str, *, parameter: str) -> int:
    """Read a time point in media time, or how long something lasts, in microseconds.

    Raises
    ------
    QueryError
        If it is not a time, or one on the UTC calendar, which a video's own timeline does not carry.

    Examples
    --------
    >>> parse_media_us("1:02.5", parameter="--from")
    62500000
    """
    media_us = _parse_media_us(text)
    if media_us is None:
        raise QueryError(f"{parameter}: expected {_MEDIA}, got {text!r}", parameter=parameter)
    return media_us


def parse_utc_us(text: str, *, parameter: str) -> int:
    """Read a moment, such as when a source started, in microseconds since 1970-01-01 UTC.

    Raises
    ------
    QueryError
        If it is no time on the UTC calendar, or too near to the ends of it.

    Examples
    --------
    >>> parse_utc_us("1970-01-01T00:00:01Z", parameter="--start-utc")
    1000000
    """
    point = parse_time(text, parameter=parameter)
    if point.clock != "utc" or not utc_us(FIRST_UTC) <= point.us <= utc_us(LAST_UTC):
        expected = f"expected a time with its zone from {FIRST_UTC:%Y-%m-%d} to {LAST_UTC:%Y-%m-%d}"
        raise QueryError(f"{parameter}: {expected}, such as 2026-05-01T08:00:00Z, got {text!r}", parameter=parameter)
    return point.us


def utc_us(moment: datetime) -> int:
    """Convert an aware date and time to microseconds since 1970-01-01 UTC.

    Examples
    --------
    >>> utc_us(datetime(1970, 1, 1, 0, 0, 1, tzinfo=UTC))
    1000000
    """
    return (moment - EPOCH) // MICROSECOND


def format_utc(us: int) -> str:
    """Write microseconds since 1970-01-01 as RFC 3339 UTC with six decimals.

    Examples
    --------
    >>> format_utc(1_500_000)
    '1970-01-01T00:00:01.500000Z'
    """
    return (EPOCH + timedelta(microseconds=us)).strftime("%Y-%m-%dT%H:%M:%S.%fZ")


def format_media(us: int) -> str:
    """Write media time for people, minutes and seconds to the millisecond.

    Examples
    --------
    >>> format_media(83_500_000)
    '01:23.500'
    >>> format_media(3_600_000_000)
    '1:00:00.000'
    """
    seconds, millis = divmod((us + 500) // 1000, 1000)
    minutes, seconds = divmod(seconds, 60)
    hours, minutes = divmod(minutes, 60)
    clock = f"{minutes:02d}:{seconds:02d}.{millis:03d}"
    return f"{hours}:{clock}" if hours else clock


def _parse_media_us(text: str) -> int | None:
    media_us = None
    if _INTEGER.fullmatch(text):
        media_us = int(text)
    elif match := _SECONDS.fullmatch(text):
        media_us = _to_us(match[1])
    elif match := _CLOCK.fullmatch(text):
        hours, minutes, seconds = match.groups()
        if Fraction(seconds) < 60 and (hours is None or int(minutes) < 60):
            media_us = (int(hours or 0) * 3600 + int(minutes) * 60) * 1_000_000 + _to_us(seconds)
    return None if media_us is None or media_us > MAX_MEDIA_US else media_us


def _to_us(seconds: str) -> int:
    # Exact: float would turn 0.0000005 differences into other microseconds.
    return round(Fraction(seconds) * 1_000_000)
