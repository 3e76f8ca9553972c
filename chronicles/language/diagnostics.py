"""What is wrong in a chronicle text, where, and how can it be mended?

A diagnostic is a value; its text form has a caret line under the place. All diagnostics of a text are collected by a
`Reporter`, so that one check shows every error at once.
"""

from __future__ import annotations

import difflib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

Severity = Literal["error", "warning"]


@dataclass(frozen=True, slots=True)
class Span:
    """A place in a text: lines and columns from 1, `end_column` one past the last character."""

    file: str
    line: int
    column: int
    end_line: int
    end_column: int

    def to(self, other: Span) -> Span:
        """Give the span from the start of this one to the end of another."""
        return Span(self.file, self.line, self.column, other.end_line, other.end_column)


@dataclass(frozen=True, slots=True)
class Diagnostic:
    """One finding: `code` such as "C0201", place (lines and columns from 1), the source line, a hint or ""."""

    code: str
    severity: Severity
    message: str
    file: str
    line: int
    column: int
    end_column: int
    source_line: str
    hint: str = ""

    def render(self) -> str:
        """Write the diagnostic with its source line and a caret line.

        Returns
        -------
        Several lines without a final newline.

        Examples
        --------
        >>> print(Diagnostic("C0201", "error", "unknown attribute 'behnd'", "a.chronicle", 3, 9, 14,
        ...                  "  event(behnd[?a,?b]:(true,false), t1)", "did you mean 'behind'?").render())
        error[C0201]: unknown attribute 'behnd'
         --> a.chronicle:3:9
          |
        3 |   event(behnd[?a,?b]:(true,false), t1)
          |         ^^^^^
          = help: did you mean 'behind'?
        """
        margin = " " * len(str(self.line))
        shown = self.source_line.replace("\t", " ")
        carets = " " * (self.column - 1) + "^" * max(1, self.end_column - self.column)
        lines = [
            f"{self.severity}[{self.code}]: {self.message}",
            f"{margin}--> {self.file}:{self.line}:{self.column}",
            f"{margin} |",
            f"{self.line} | {shown}".rstrip(),
            f"{margin} | {carets}",
        ]
        if self.hint:
            lines.append(f"{margin} = help: {self.hint}")
        return "\n".join(lines)


class Reporter:
    """Collects the diagnostics of some texts; invariant: each carries the source line it points at."""

    def __init__(self, sources: Mapping[str, str]) -> None:
        self._lines = {name: text.splitlines() for name, text in sources.items()}
        self._found: list[Diagnostic] = []

    @property
    def diagnostics(self) -> tuple[Diagnostic, ...]:
        """All diagnostics so far, without doubles, in the order of the texts and then of the places."""
        order = {name: rank for rank, name in enumerate(self._lines)}
        unique = dict.fromkeys(self._found)
        return tuple(sorted(unique, key=lambda found: (order[found.file], found.line, found.column, found.code)))

    @property
    def errors(self) -> tuple[Diagnostic, ...]:
        """The diagnostics that forbid the text to be used."""
        return tuple(found for found in self.diagnostics if found.severity == "error")

    def error(self, code: str, message: str, span: Span, hint: str = "") -> None:
        """Add an error at a place."""
        self._add(code, "error", message, span, hint)

    def warning(self, code: str, message: str, span: Span, hint: str = "") -> None:
        """Add a warning at a place; the text stays usable."""
        self._add(code, "warning", message, span, hint)

    def has_syntax_error_in(self, span: Span) -> bool:
        """Say whether a part of the text at a place could not be read (codes C01..)."""
        return any(
            found.code.startswith("C01") and found.file == span.file and span.line <= found.line <= span.end_line
            for found in self._found
        )

    def _add(self, code: str, severity: Severity, message: str, span: Span, hint: str) -> None:
        lines = self._lines[span.file]
        source_line = lines[span.line - 1] if 0 < span.line <= len(lines) else ""
        end_column = span.end_column if span.end_line == span.line else len(source_line) + 1
        found = Diagnostic(code, severity, message, span.file, span.line, span.column, end_column, source_line, hint)
        self._found.append(found)


def render_all(diagnostics: Iterable[Diagnostic]) -> str:
    """Write diagnostics one after the other with a blank line between them."""
    return "\n\n".join(found.render() for found in diagnostics)


def suggest(name: str, known: Sequence[str]) -> str:
    """Write "did you mean ...?" for the nearest known name, or list the known names when they are few.

    Examples
    --------
    >>> suggest("behnd", ["behind", "beside"])
    "did you mean 'behind'?"
    >>> suggest("x", ["behind", "beside"])
    "known: 'behind', 'beside'"
    >>> suggest("x", [])
    ''
    """
    near = difflib.get_close_matches(name, known, n=1, cutoff=0.6)
    if near:
        return f"did you mean {near[0]!r}?"
    if 0 < len(known) <= 12:
        return "known: " + ", ".join(repr(one) for one in sorted(known))
    return ""
