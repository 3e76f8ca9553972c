"""Where in a text is something, and how is that place shown to people? One guard for all that goes to a terminal."""

from __future__ import annotations

import re
from typing import NamedTuple

_WIDEST = 120  # characters of a source line that are shown
_LONGEST_WORD = 60
_LONGEST_MESSAGE = 1_000
_LONG_WORD = re.compile(rf"\w{{{_LONGEST_WORD + 1},}}")


class Span(NamedTuple):
    """A place in a text: lines and columns from 1, `end_column` one past the last character.

    A tuple, because a text has thousands of places and a frozen dataclass takes three times as long to make.
    """

    file: str
    line: int
    column: int
    end_line: int
    end_column: int

    def to(self, other: Span) -> Span:
        """Give the span from the start of this one to the end of another."""
        return Span(self.file, self.line, self.column, other.end_line, other.end_column)


NOWHERE = Span("", 1, 1, 1, 2)  # of what was read from no text


class Place(NamedTuple):
    """A place with the source line it points at; `label` says what it has to do with a finding, "" for its own."""

    file: str
    line: int
    column: int
    end_column: int
    source_line: str
    label: str = ""

    def shown(self, mark: str) -> tuple[str, str]:
        """Give the source line, or the part of a long one around the place, and the line with marks under it."""
        start = 0 if len(self.source_line) <= _WIDEST else max(0, self.column - 1 - _WIDEST // 2)
        part = self.source_line[start : start + _WIDEST]
        marks = " " * (self.column - 1 - start) + mark * max(1, self.end_column - self.column)
        return "".join(one if one.isprintable() else " " for one in part), f"{marks[:_WIDEST]} {self.label}".rstrip()


def printable(text: str) -> str:
    r"""Write out what a terminal would obey, and shorten words and texts that nobody would want all of.

    Examples
    --------
    >>> printable("expected a name, got \x1b[31m"), len(printable("a" * 5000))
    ('expected a name, got \\x1b[31m', 60)
    """
    text = _LONG_WORD.sub(lambda found: found.group()[: _LONGEST_WORD - 3] + "...", text)
    text = text if len(text) <= _LONGEST_MESSAGE else text[: _LONGEST_MESSAGE - 3] + "..."
    return text if text.isprintable() else "".join(one if one.isprintable() else repr(one)[1:-1] for one in text)
