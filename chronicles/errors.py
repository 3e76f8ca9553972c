"""What can go wrong in `chronicles`, as one exception family."""

from __future__ import annotations

from dyknow.language.diagnostics import Diagnostic, render_all


class ChronicleError(Exception):
    """Base of every error that `chronicles` raises: where, what was expected, what came.

    `diagnostics` lists all findings of a refused text (warnings too); it is empty for other errors.
    """

    def __init__(self, message: str, diagnostics: tuple[Diagnostic, ...] = ()) -> None:
        super().__init__(message)
        self.diagnostics = diagnostics

    @classmethod
    def from_diagnostics(cls, diagnostics: tuple[Diagnostic, ...]) -> ChronicleError:
        """Make the error of a refused text; its message is the rendered list of findings."""
        return cls(render_all(diagnostics), diagnostics)
