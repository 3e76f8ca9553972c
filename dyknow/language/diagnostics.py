"""What is wrong in a text of one of the languages, where, and how can it be mended?

A diagnostic is a value; its text form has a caret line under the place. All diagnostics of a text are collected by a
`Reporter`, so that one reading shows every error at once.
"""

from __future__ import annotations

import difflib
from collections.abc import Iterable
from dataclasses import dataclass
from typing import NamedTuple

from dyknow.errors import DyKnowError

_FEW = 6
_WIDEST = 120  # characters of a source line that are shown


class Span(NamedTuple):
    """A place in a text: lines and columns from 1, `end_column` one past the last character."""

    line: int
    column: int
    end_line: int
    end_column: int


@dataclass(frozen=True, slots=True)
class Diagnostic:
    """One finding: `code` such as "F0201", place (lines and columns from 1), the source line, a hint or ""."""

    code: str
    message: str
    name: str
    line: int
    column: int
    end_column: int
    source_line: str
    hint: str = ""
    severity: str = "error"

    def render(self) -> str:
        """Write the error with its source line and a caret line.

        Returns
        -------
        Several lines without a final newline.

        Examples
        --------
        >>> print(Diagnostic("F0201", "expected a known feature, got 'spead'", "a.mtl", 3, 8, 13,
        ...                  "always spead[?c] < 30", "did you mean 'speed'?").render())
        error[F0201]: expected a known feature, got 'spead'
         --> a.mtl:3:8
          |
        3 | always spead[?c] < 30
          |        ^^^^^
          = help: did you mean 'speed'?
        """
        margin = " " * len(str(self.line))
        shown, column = _window(self.source_line, self.column)
        carets = (" " * (column - 1) + "^" * max(1, self.end_column - self.column))[:_WIDEST]
        lines = [
            f"{self.severity}[{self.code}]: {self.message}",
            f"{margin}--> {self.name}:{self.line}:{self.column}",
            f"{margin} |",
            f"{self.line} | {shown}".rstrip(),
            f"{margin} | {carets}",
        ]
        if self.hint:
            lines.append(f"{margin} = help: {self.hint}")
        return "\n".join(lines)


def _window(line: str, column: int) -> tuple[str, int]:
    """Cut the part around a column out of a long line, for people to see; say which column of the part that is."""
    clean = "".join(one if one.isprintable() else " " for one in line)
    start = 0 if len(line) <= _WIDEST else max(0, column - 1 - _WIDEST // 2)
    return clean[start : start + _WIDEST], column - start


class TextError(DyKnowError):
    """A text that cannot be used; `diagnostics` lists every error, the message shows them."""

    def __init__(self, diagnostics: tuple[Diagnostic, ...]) -> None:
        super().__init__("\n\n".join(found.render() for found in diagnostics))
        self.diagnostics = diagnostics


class Reporter:
    """Collects what is found in one text; invariant: each finding carries the source line it points at.

    Parameters
    ----------
    text : the whole text.
    name : its file name or label, for messages.
    error : what `raise_if_any` raises.
    """

    def __init__(self, text: str, name: str, error: type[TextError] = TextError) -> None:
        self._error = error
        self._lines = text.split("\n")
        self._name = name
        self._found: list[Diagnostic] = []

    @property
    def diagnostics(self) -> tuple[Diagnostic, ...]:
        """All errors so far, in the order of their places."""
        return self._in_order("error")

    @property
    def warnings(self) -> tuple[Diagnostic, ...]:
        """All warnings so far, in the order of their places."""
        return self._in_order("warning")

    def error(self, code: str, message: str, span: Span, hint: str = "") -> None:
        """Add an error at a place."""
        self._add(code, message, span, hint, "error")

    def warning(self, code: str, message: str, span: Span, hint: str = "") -> None:
        """Add a finding that does not refuse the text."""
        self._add(code, message, span, hint, "warning")

    def raise_if_any(self) -> None:
        """Raise what was found.

        Raises
        ------
        TextError
            Or the class of it that was given, if there is any error.
        """
        if self.diagnostics:
            raise self._error(self.diagnostics)

    def _add(self, code: str, message: str, span: Span, hint: str, severity: str) -> None:
        source_line = self._lines[span.line - 1].removesuffix("\r")
        end_column = span.end_column if span.end_line == span.line else len(source_line) + 1
        place = (self._name, span.line, span.column, end_column, source_line)
        self._found.append(Diagnostic(code, message, *place, hint, severity))

    def _in_order(self, severity: str) -> tuple[Diagnostic, ...]:
        found = [one for one in self._found if one.severity == severity]
        return tuple(sorted(found, key=lambda one: (one.line, one.column, one.code)))


def suggest(name: str, known: Iterable[str]) -> str:
    """Suggest the nearest known name, or list the known names when they are few.

    Examples
    --------
    >>> suggest("spead", ["speed", "road"]), suggest("x", ["speed", "road"]), suggest("x", [])
    ("did you mean 'speed'?", "known: 'road', 'speed'", '')
    """
    names = sorted(known)
    near = difflib.get_close_matches(name, names, n=1)
    if near:
        return f"did you mean {near[0]!r}?"
    return "known: " + ", ".join(map(repr, names)) if 0 < len(names) <= _FEW else ""
