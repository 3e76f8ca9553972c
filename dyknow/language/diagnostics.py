"""What is wrong in a text of one of our languages, where, and how can it be mended?

A diagnostic is a value; its text form has a caret line under the place. All diagnostics of some texts are collected by
a `Reporter`, so that one check shows every error at once. `rendering.py` writes them for programs.
"""

import difflib
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Literal, NamedTuple

from dyknow.language.places import Place, Span, printable

Severity = Literal["error", "warning"]
Related = Iterable[tuple[Span, str]]
_FEW = 12
_MOST_SHOWN = 50


class Hint(NamedTuple):
    """How to mend a text: in words, and, where that is certain, what to write in place of the marked text.

    Without words it is false, so that hints can be tried with `or`.
    """

    text: str = ""
    edit: str | None = None

    def __bool__(self) -> bool:
        return bool(self.text)


@dataclass(frozen=True, slots=True)
class Diagnostic:
    """One finding: `code` such as "C0201", place (lines and columns from 1), the source line, a hint or "".

    `edit` is what to write in place of the marked text, None where no change is certain to be meant; `related` are
    other places, in the order of the text.
    """

    code: str
    severity: Severity
    message: str
    file: str
    line: int
    column: int
    end_column: int
    source_line: str
    hint: str = ""
    edit: str | None = None
    related: tuple[Place, ...] = ()

    def render(self) -> str:
        """Write the diagnostic with its source line and a caret line, and related places with dashes.

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
        here = Place(self.file, self.line, self.column, self.end_column, self.source_line)
        margin = " " * max(len(str(one.line)) for one in (here, *self.related))
        same = sorted([here, *(one for one in self.related if one.file == self.file)], key=lambda one: one.line)
        lines = [
            f"{self.severity}[{self.code}]: {self.message}",
            f"{margin}--> {printable(self.file)}:{self.line}:{self.column}",
            f"{margin} |",
            *_excerpt(same, here, margin),
        ]
        for one in self.related:
            if one.file != self.file:
                lines += [f"{margin}::: {printable(one.file)}:{one.line}:{one.column}", f"{margin} |"]
                lines += _excerpt([one], here, margin)
        if self.hint:
            lines.append(f"{margin} = help: {self.hint}")
        return "\n".join(lines)


def _excerpt(places: Iterable[Place], here: Place, margin: str) -> Iterator[str]:
    """Write source lines with marks under the places, which are sorted by line."""
    line, before = 0, ""
    for one in places:
        text, marks = one.shown("^" if one is here else "-")
        if line and one.line > line + 1:
            yield "..."
        if one.line != line or text != before:
            yield f"{one.line:>{len(margin)}} | {text}".rstrip()
        yield f"{margin} | {marks}"
        line, before = one.line, text


def render_all(diagnostics: Iterable[Diagnostic]) -> str:
    """Write diagnostics one after the other with a blank line between them."""
    return "\n\n".join(found.render() for found in diagnostics)


class TextError(Exception):
    """A text that cannot be used; `diagnostics` lists all that was found in it, the message shows the first fifty."""

    def __init__(self, diagnostics: tuple[Diagnostic, ...]) -> None:
        more = len(diagnostics) - _MOST_SHOWN
        super().__init__(render_all(diagnostics[:_MOST_SHOWN]) + (f"\n\nand {more} more errors" if more > 0 else ""))
        self.diagnostics = diagnostics


class Reporter:
    """Collects the diagnostics of some texts; invariant: each carries the source line it points at.

    Parameters
    ----------
    sources : the texts by name.

    Attributes
    ----------
    error_count : how many errors were added so far.
    """

    def __init__(self, sources: Mapping[str, str]) -> None:
        self._lines = {name: text.split("\n") for name, text in sources.items()}
        self._found: dict[Diagnostic, None] = {}
        self.error_count = 0

    @property
    def diagnostics(self) -> tuple[Diagnostic, ...]:
        """All diagnostics so far, without doubles, in the order of the texts and then of the places."""
        order = {name: rank for rank, name in enumerate(self._lines)}
        return tuple(sorted(self._found, key=lambda found: (order[found.file], found.line, found.column, found.code)))

    @property
    def errors(self) -> tuple[Diagnostic, ...]:
        """The diagnostics that forbid the text to be used."""
        return tuple(found for found in self.diagnostics if found.severity == "error") if self.error_count else ()

    @property
    def warnings(self) -> tuple[Diagnostic, ...]:
        """The diagnostics that leave the text usable."""
        return tuple(found for found in self.diagnostics if found.severity == "warning")

    def error(self, code: str, message: str, span: Span, hint: str | Hint = "", *, related: Related = ()) -> None:
        """Add an error at a place; `related` are other places with what they have to do with it."""
        self._add("error", code, message, span, hint=hint, related=related)
        self.error_count += 1

    def warning(self, code: str, message: str, span: Span, hint: str | Hint = "", *, related: Related = ()) -> None:
        """Add a warning at a place; the text stays usable."""
        self._add("warning", code, message, span, hint=hint, related=related)

    def raise_if_any(self, error: type[TextError] = TextError) -> None:
        """Raise the errors found so far.

        Raises
        ------
        TextError
            Or the class of it that was given, if there is any error.
        """
        if self.error_count:
            raise error(self.errors)

    def count_again(self) -> None:
        """Count an error that was reported already, where something rests on it and therefore cannot be judged."""
        self.error_count += 1

    def has_syntax_error_in(self, span: Span) -> bool:
        """Say whether a part of the text at a place could not be read (codes C01.. and their like)."""
        return any(found.code[1:3] == "01" for found in self._errors_in(span))

    def has_error_in(self, span: Span) -> bool:
        """Say whether there is an error at a place."""
        return any(self._errors_in(span))

    def _errors_in(self, span: Span) -> Iterator[Diagnostic]:
        if self.error_count:
            for found in self._found:
                is_inside = found.file == span.file and span.line <= found.line <= span.end_line
                if is_inside and found.severity == "error":
                    yield found

    def _add(
        self, severity: Severity, code: str, message: str, span: Span, *, hint: str | Hint, related: Related
    ) -> None:
        text, edit = (hint, None) if isinstance(hint, str) else hint
        # Only what lies on one line is marked as a whole, so only that can be replaced.
        edit = edit if span.line == span.end_line else None
        others = tuple(sorted(self._place(other, printable(label)) for other, label in related))
        place = self._place(span)[:-1]
        self._found[Diagnostic(code, severity, printable(message), *place, printable(text), edit, others)] = None

    def _place(self, span: Span, label: str = "") -> Place:
        lines = self._lines[span.file]
        source_line = lines[span.line - 1].removesuffix("\r") if 0 < span.line <= len(lines) else ""
        end_column = span.end_column if span.end_line == span.line else len(source_line) + 1
        return Place(span.file, span.line, span.column, end_column, source_line, label)


def suggest(name: str, known: Iterable[str]) -> Hint:
    """Suggest the nearest known name, whatever its case, or list the known names when they are few.

    Examples
    --------
    >>> suggest("behnd", ["behind", "beside"]), suggest("ROAD", ["broad", "road"]).edit
    (Hint(text="did you mean 'behind'?", edit='behind'), 'road')
    >>> suggest("x", ["behind", "beside"])
    Hint(text="known: 'behind', 'beside'", edit=None)
    >>> suggest("x", [])
    Hint(text='', edit=None)
    """
    names = list(known)
    alike = [one for one in names if one.lower() == name.lower()]
    near = alike or difflib.get_close_matches(name, names, n=1, cutoff=0.6)
    if near:
        return Hint(f"did you mean {near[0]!r}?", near[0])
    if 0 < len(names) <= _FEW:
        return Hint("known: " + ", ".join(map(repr, sorted(names))))
    return Hint()


def hinted(name: str, known: Iterable[str]) -> str:
    """Say which known name is nearest, or which there are when they are few, behind a message; "" if neither helps."""
    hint = suggest(name, sorted(known)).text
    return f"; {hint}" if hint else ""


def near(name: str, known: Iterable[str]) -> Hint:
    """Suggest the nearest known name; nothing where none is near."""
    found = suggest(name, known)
    return found if found.edit is not None else Hint()
