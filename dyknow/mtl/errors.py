"""How does a text of formulas that is wrong come back to its author? As an error that lists everything found."""

from __future__ import annotations

from dyknow.language.diagnostics import TextError


class FormulaError(TextError):
    """A text of formulas that cannot be used; `diagnostics` lists every error, the message shows them with carets.

    Examples
    --------
    >>> from dyknow.mtl.parser import parse_formula
    >>> try:
    ...     parse_formula("always 3 m < 5 s")
    ... except FormulaError as error:
    ...     print(error.line, error.column)
    ...     print(error)
    1 14
    error[F0402]: expected a length, as '3 m' is, got a duration
     --> formula:1:14
      |
    1 | always 3 m < 5 s
      |              ^^^
      = help: units of length are m, km
    """

    @property
    def line(self) -> int:
        """Line of the first error, from 1."""
        return self.diagnostics[0].line

    @property
    def column(self) -> int:
        """Column of the first error, from 1."""
        return self.diagnostics[0].column
