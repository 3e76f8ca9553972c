"""How does a text of formulas that is wrong come back to its author? As an error that lists everything found."""

from __future__ import annotations

from dyknow.diagnostics import TextError


class FormulaError(TextError):
    """A text of formulas that cannot be used; `diagnostics` lists every error, the message shows them."""
