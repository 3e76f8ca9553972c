"""What can go wrong in `dyknow`, as one exception family."""

from dyknow.language.diagnostics import TextError


class DyKnowError(Exception):
    """Base of every error that `dyknow` raises: where, what was expected, what came."""


class PolicyError(DyKnowError):
    """A policy that contradicts itself or that no stream can satisfy."""


class StreamError(DyKnowError):
    """An unknown label, a label given twice, or a use after closing."""


class ProcessError(DyKnowError):
    """A process that cannot be created, removed, or fed what came."""


class RegistryError(DyKnowError):
    """A name that no source or unit has, or that two of them claim."""


class KplError(TextError, DyKnowError):
    """A KPL text that cannot be used."""


class FormulaError(TextError, DyKnowError):
    """A text of formulas that cannot be used.

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
