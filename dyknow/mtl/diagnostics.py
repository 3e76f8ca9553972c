"""What is wrong in a text of formulas, where, and how can it be mended?

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


class Span(NamedTuple):
    """A place in a text: lines and columns from 1, `end_column` one past the last character."""

    line: int
    column: int
    end_line: int
    end_column: int


@dataclass(frozen=True, slots=True)
class Diagnostic:
    """One error: `code` such as "F0201", place (lines and columns from 1), the source line, a hint or ""."""

    code: str
    message: str
    name: str
    line: int
    column: int
    end_column: int
    source_line: str
    hint: str = ""

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
        shown = self.source_line.replace("\t", " ")
        carets = " " * (self.column - 1) + "^" * max(1, self.end_column - self.column)
        lines = [
            f"error[{self.code}]: {self.message}",
            f"{margin}--> {self.name}:{self.line}:{self.column}",
            f"{margin} |",
            f"{self.line} | {shown}".rstrip(),
            f"{margin} | {carets}",
        ]
        if self.hint:
            lines.append(f"{margin} = help: {self.hint}")
        return "\n".join(lines)


class FormulaError(DyKnowError):
    """A text of formulas that cannot be used; `diagnostics` lists every error, the message shows them."""

    def __init__(self, diagnostics: tuple[Diagnostic, ...]) -> None:
        super().__init__("\n\n".join(found.render() for found in diagnostics))
        self.diagnostics = diagnostics


class Reporter:
    """Collects the errors of one text; invariant: each carries the source line it points at.

    Parameters
    ----------
    text : the whole text.
    name : its file name or label, for messages.
    """

    def __init__(self, text: str, name: str) -> None:
        self._lines = text.split("\n")
        self._name = name
        self._found: list[Diagnostic] = []

    @property
    def diagnostics(self) -> tuple[Diagnostic, ...]:
        """All errors so far, in the order of their places."""
        return tuple(sorted(self._found, key=lambda found: (found.line, found.column, found.code)))

    def error(self, code: str, message: str, span: Span, hint: str = "") -> None:
        """Add an error at a place."""
        source_line = self._lines[span.line - 1].removesuffix("\r")
        end_column = span.end_column if span.end_line == span.line else len(source_line) + 1
        self._found.append(Diagnostic(code, message, self._name, span.line, span.column, end_column, source_line, hint))

    def raise_if_any(self) -> None:
        """Raise what was found.

        Raises
        ------
        FormulaError
            If there is any error.
        """
        if self._found:
            raise FormulaError(self.diagnostics)


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
