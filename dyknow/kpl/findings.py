"""How does a KPL text that is wrong come back to its author? As an error that lists everything found."""

from __future__ import annotations

from dyknow.diagnostics import TextError


class KplError(TextError):
    """A KPL text that cannot be used; `diagnostics` lists every error, the message shows them."""
