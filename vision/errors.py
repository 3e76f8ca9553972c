"""What can go wrong in `vision`, as one exception family."""


class VisionError(Exception):
    """Base of every error that `vision` raises: where, what was expected, what came."""
