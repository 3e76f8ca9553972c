"""What can go wrong in `qsr`, as one exception family."""


class QsrError(Exception):
    """Base of every error that `qsr` raises: where, what was expected, what came."""
