"""What can go wrong in `anchoring`, as one exception family."""

from dyknow.language.diagnostics import TextError


class AnchoringError(Exception):
    """Base of every error that `anchoring` raises: where, what was expected, what came."""


class LinkageError(TextError, AnchoringError):
    """A linkage text that cannot be used."""
